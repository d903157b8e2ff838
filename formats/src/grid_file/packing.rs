//! Chunks packed side by side, as rust-hdf5 would pack them one after another.

use rayon::prelude::*;
use rust_hdf5::Hdf5Error;
use rust_hdf5::format::FormatError;
use rust_hdf5::format::messages::filter::{FilterPipeline, apply_filters};
use sha2::{Digest, Sha256};

use super::element::Element;
use super::layout;
use super::tiling::Tiling;

/// Chunks that each thread packs before they are written. Fewer make threads wait for each other, more take more memory:
/// these take half a megabyte for each thread.
const CHUNKS_OF_A_THREAD: usize = 4;

/// A chunk as it stands in the file.
pub(super) struct PackedChunk {
    pub packed: Vec<u8>,
    /// SHA-256 of the elements, cut to the dataset, before they were packed.
    pub digest: [u8; layout::DIGEST_BYTES],
}

/// Gives each chunk of a dataset to `write`, in order, its elements changed by `change`. Only a few are held at a time. The
/// bytes are the same on any number of threads.
pub(super) fn packed_chunks<T: Element>(
    elements: &[T],
    tiling: &Tiling,
    change: impl Fn(&mut [T]) + Sync,
    mut write: impl FnMut(usize, PackedChunk) -> Result<(), Hdf5Error>,
) -> Result<(), Hdf5Error> {
    let count = tiling.count().unwrap_or(0);
    let at_a_time = CHUNKS_OF_A_THREAD * rayon::current_num_threads();
    for first in (0..count).step_by(at_a_time) {
        let chunks = first..count.min(first + at_a_time);
        let pack = |chunk: &mut Vec<T>, at| pack(elements, tiling, at, &change, chunk);
        let packed: Vec<_> = chunks.clone().into_par_iter().map_init(Vec::new, pack).collect();
        for (at, chunk) in chunks.zip(packed) {
            write(at, chunk?)?;
        }
    }
    Ok(())
}

fn pack<T: Element>(
    elements: &[T],
    tiling: &Tiling,
    at: usize,
    change: impl Fn(&mut [T]),
    chunk: &mut Vec<T>,
) -> Result<PackedChunk, FormatError> {
    let tile = tiling.tile(at);
    chunk.clear();
    tiling.rows(tile).for_each(|row| chunk.extend_from_slice(&elements[row..][..tile.size[2]]));
    change(chunk);
    let [sz, sy, sx] = tiling.sides();
    let mut bytes = Vec::with_capacity(sz * sy * sx * T::BYTES);
    chunk.iter().for_each(|element| element.put_le(&mut bytes));
    let digest = Sha256::digest(&bytes).into();
    if tile.size != tiling.sides() {
        bytes = padded(&bytes, tile.size, tiling.sides(), T::BYTES);
    }
    let filters = match T::BYTES {
        1 => FilterPipeline::deflate(layout::DEFLATE_LEVEL),
        element_bytes => FilterPipeline::shuffle_deflate(element_bytes as u32, layout::DEFLATE_LEVEL),
    };
    Ok(PackedChunk { packed: apply_filters(&filters, &bytes)?, digest })
}

/// A chunk that reaches past the dataset is whole in the file, zeros standing for what is not there.
fn padded(bytes: &[u8], size: [usize; 3], sides: [usize; 3], element_bytes: usize) -> Vec<u8> {
    let mut whole = vec![0; sides.iter().product::<usize>() * element_bytes];
    let rows = (0..size[0]).flat_map(|z| (0..size[1]).map(move |y| (z * sides[1] + y) * sides[2] * element_bytes));
    for (at, row) in rows.zip(bytes.chunks_exact(size[2] * element_bytes)) {
        whole[at..][..row.len()].copy_from_slice(row);
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hdf5;

    /// As [`packed_chunks`] gives them, or as rust-hdf5 makes them.
    fn file<T: Element>(shape: &[usize], elements: &[T], by_us: bool) -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.h5");
        let sides = layout::chunk_shape(shape);
        hdf5::create(&path, |file| {
            let dataset = file.new_dataset::<T>().shape(shape).chunk(&sides);
            let dataset = match T::BYTES {
                1 => dataset.deflate(layout::DEFLATE_LEVEL),
                _ => dataset.shuffle_deflate(layout::DEFLATE_LEVEL),
            };
            let dataset = dataset.create("numbers")?;
            if !by_us {
                return dataset.write_raw(elements);
            }
            let tiling = Tiling::new(shape, &sides);
            packed_chunks(elements, &tiling, |_| (), |at, chunk| dataset.write_chunk_raw(at, &chunk.packed, 0))
        })
        .unwrap();
        std::fs::read(&path).unwrap()
    }

    #[test]
    fn rust_hdf5_packs_to_the_same_file() {
        for shape in [&[40, 33, 65][..], &[3, 2, 70], &[5000, 3], &[70, 512], &[9000], &[1]] {
            let count: usize = shape.iter().product();
            let numbers: Vec<f32> = (0..count).map(|at| (at as f32 * 0.01).sin()).collect();
            let words: Vec<u16> = numbers.iter().map(|number| (number * 1000.0) as i16 as u16).collect();
            let bytes: Vec<u8> = words.iter().map(|word| *word as u8).collect();
            assert!(file(shape, &numbers, true) == file(shape, &numbers, false), "f32 of {shape:?}");
            assert!(file(shape, &words, true) == file(shape, &words, false), "u16 of {shape:?}");
            assert!(file(shape, &bytes, true) == file(shape, &bytes, false), "u8 of {shape:?}");
        }
    }
}
