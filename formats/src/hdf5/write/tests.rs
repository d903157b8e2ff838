use hdf5_reader::Hdf5File;

use super::*;
use crate::hdf5::{Hdf5Reader, Value};

/// Members fill two nodes of a symbol table, chunks three levels of a tree: 64 a node.
const SHAPES: [[&[usize]; 2]; 9] = [
    [&[40, 33, 65], &[32, 32, 32]],
    [&[5, 3, 70], &[3, 2, 32]],
    [&[5000, 3], &[4096, 3]],
    [&[70, 512], &[32, 512]],
    [&[9000], &[2]],
    [&[64], &[1]],
    [&[65], &[1]],
    [&[1], &[1]],
    [&[7, 1], &[7, 1]],
];

fn numbers(shape: &[usize]) -> Vec<f32> {
    (0..shape.iter().product()).map(|index: usize| (index as f32 * 0.01).sin()).collect()
}

fn fill(root: &Group, compression: Compression) -> io::Result<()> {
    let group = root.group("group");
    group.set_text("text", "a Text with ü");
    group.set_text("again", "a Text with ü");
    group.set_text("empty", "");
    group.set_text("long", &"x".repeat(5000));
    group.set_ascii("ascii", "Scalars");
    group.set_number("one", 1.5);
    group.set_numbers("several", &[-3_i64, 4]);
    let late = group.contiguous::<u16>("late", &[3, 2]);
    for (index, shapes) in SHAPES.into_iter().enumerate() {
        let numbers = numbers(shapes[0]);
        let dataset = group.chunked(&format!("d{index}"), shapes, compression, &numbers, |_| (), &mut vec![])?;
        dataset.set_ascii("Attribute", "Scalars");
    }
    late.write(4, &[3, 0, 4, 0, 5, 0, 6, 0])?;
    late.write(0, &[1, 0, 2, 0])?;
    assert!(late.write(10, &[0; 3]).is_err(), "a row sticks out");
    group.contiguous::<f64>("nothing", &[0]);
    root.group("alone").chunked("bytes", [&[3], &[3]], compression, &[1_u8, 2, 3], |_| (), &mut vec![])?;
    Ok(())
}

fn file(compression: Compression) -> Vec<u8> {
    to_bytes(|root| fill(root, compression)).unwrap()
}

#[test]
fn memory_and_disk_have_the_same_bytes() {
    for compression in Compression::ALL {
        let path = tempfile::tempdir().unwrap().keep().join("a.h5");
        create(&path, |root| fill(root, compression)).unwrap();
        assert!(std::fs::read(&path).unwrap() == file(compression), "{compression:?}");
        std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
    }
}

#[test]
fn our_reader_finds_what_was_written() {
    for compression in Compression::ALL {
        let bytes = file(compression);
        let reader = Hdf5Reader::open_bytes(bytes.as_slice().into()).unwrap();
        let group = reader.member(None, "group").unwrap();
        for name in ["text", "again"] {
            assert_eq!(reader.attribute(&group, name).unwrap(), Value::Text("a Text with ü".into()));
        }
        assert_eq!(reader.attribute(&group, "long").unwrap(), Value::Text("x".repeat(5000)));
        assert_eq!(reader.attribute(&group, "empty").unwrap(), Value::Text(String::new()));
        assert_eq!(reader.attribute(&group, "ascii").unwrap(), Value::Text("Scalars".into()));
        assert_eq!(reader.attribute(&group, "one").unwrap(), Value::Numbers(vec![1.5]));
        assert_eq!(reader.attribute(&group, "several").unwrap(), Value::Integers(vec![-3, 4]));
        for (index, [shape, _]) in SHAPES.into_iter().enumerate() {
            let object = reader.member(Some(&group), &format!("d{index}")).unwrap();
            let dataset = reader.dataset::<f32>(&object, "numbers", shape).unwrap();
            let mut whole = [1; 3];
            whole[3 - shape.len()..].copy_from_slice(shape);
            let found = reader.elements(&dataset, whole, |_| true, |_, _| Ok(())).unwrap();
            assert_eq!(found, numbers(shape), "{shape:?} {compression:?}");
        }
    }
}

#[test]
fn other_libraries_find_what_was_written() {
    for compression in Compression::ALL {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.h5");
        std::fs::write(&path, file(compression)).unwrap();
        let other = Hdf5File::open(&path).unwrap();
        let group = other.group("/group").unwrap();
        assert_eq!(group.attribute("text").unwrap().read_string().unwrap(), "a Text with ü");
        assert_eq!(group.attribute("one").unwrap().read_scalar::<f64>().unwrap(), 1.5);
        for (index, [shape, _]) in SHAPES.into_iter().enumerate() {
            let found = other.dataset(&format!("/group/d{index}")).unwrap().read_array::<f32>().unwrap();
            assert_eq!(found.as_slice().unwrap(), numbers(shape), "{shape:?} {compression:?}");
        }
        let late = other.dataset("/group/late").unwrap().read_array::<u16>().unwrap();
        assert_eq!(late.as_slice().unwrap(), [1, 2, 3, 4, 5, 6]);
        let third = rust_hdf5::H5File::open(&path).unwrap();
        assert_eq!(third.dataset("alone/bytes").unwrap().read_raw::<u8>().unwrap(), [1, 2, 3]);
        assert_eq!(third.dataset("group/late").unwrap().read_raw::<u16>().unwrap(), [1, 2, 3, 4, 5, 6]);
    }
}
