use super::*;
use crate::hdf5;

const CHUNK_SHAPES: [&[usize]; 6] = [&[32, 32, 32], &[3, 2, 32], &[4096, 3], &[32, 512], &[4096], &[1]];

/// The file's bytes with chunks from [`packed_chunks`], or as rust-hdf5 packs them.
fn file<T: Element>(shape: &[usize], chunk_shape: &[usize], elements: &[T], is_ours: bool) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.h5");
    hdf5::create(&path, |file| {
        let dataset = file.new_dataset::<T>().shape(shape).chunk(chunk_shape);
        let dataset = match T::BYTES {
            1 => dataset.deflate(DEFLATE_LEVEL),
            _ => dataset.shuffle_deflate(DEFLATE_LEVEL),
        };
        let dataset = dataset.create("numbers")?;
        if !is_ours {
            return dataset.write_raw(elements);
        }
        let tiling = Tiling::new(shape, chunk_shape);
        packed_chunks(elements, &tiling, |_| (), |chunk, packed| dataset.write_chunk_raw(chunk, &packed.packed, 0))
    })
    .unwrap();
    std::fs::read(&path).unwrap()
}

#[test]
fn rust_hdf5_packs_to_the_same_file() {
    let shapes: [&[usize]; 6] = [&[40, 33, 65], &[3, 2, 70], &[5000, 3], &[70, 512], &[9000], &[1]];
    for (shape, chunk_shape) in shapes.into_iter().zip(CHUNK_SHAPES) {
        let count: usize = shape.iter().product();
        let numbers: Vec<f32> = (0..count).map(|index| (index as f32 * 0.01).sin()).collect();
        let words: Vec<u16> = numbers.iter().map(|number| (number * 1000.0) as i16 as u16).collect();
        let bytes: Vec<u8> = words.iter().map(|word| *word as u8).collect();
        let is_same = |ours: Vec<u8>, theirs: Vec<u8>| ours == theirs;
        assert!(
            is_same(file(shape, chunk_shape, &numbers, true), file(shape, chunk_shape, &numbers, false)),
            "{shape:?}"
        );
        assert!(is_same(file(shape, chunk_shape, &words, true), file(shape, chunk_shape, &words, false)), "{shape:?}");
        assert!(is_same(file(shape, chunk_shape, &bytes, true), file(shape, chunk_shape, &bytes, false)), "{shape:?}");
    }
}
