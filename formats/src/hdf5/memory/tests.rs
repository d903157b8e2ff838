use hdf5_reader::Hdf5File;

use super::*;
use crate::hdf5::{Hdf5Reader, Value, write_dataset};

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

fn file() -> Vec<u8> {
    let fill = |root: &Object| {
        let group = root.add_group("group")?;
        group.set_text("text", "a Text with ü")?;
        group.set_text("empty", "")?;
        group.set_ascii("ascii", "Scalars")?;
        group.set_number("one", 1.5)?;
        group.set_numbers("several", &[-3_i64, 4])?;
        for (index, [shape, chunk_shape]) in SHAPES.into_iter().enumerate() {
            let dataset = write_dataset(
                &group,
                &format!("d{index}"),
                [shape, chunk_shape],
                &numbers(shape),
                |_| (),
                &mut vec![],
            )?;
            dataset.label("Attribute", "Scalars")?;
        }
        write_dataset(&root.add_group("alone")?, "bytes", [&[3], &[3]], &[1_u8, 2, 3], |_| (), &mut vec![])?;
        Ok::<(), Hdf5Error>(())
    };
    to_bytes(fill).unwrap()
}

#[test]
fn our_reader_finds_what_was_written() {
    let bytes = file();
    let reader = Hdf5Reader::open_bytes(bytes.as_slice().into()).unwrap();
    let group = reader.member(None, "group").unwrap();
    assert_eq!(reader.attribute(&group, "text").unwrap(), Value::Text("a Text with ü".into()));
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
        assert_eq!(found, numbers(shape), "{shape:?}");
    }
}

#[test]
fn another_library_finds_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.h5");
    std::fs::write(&path, file()).unwrap();
    let other = Hdf5File::open(&path).unwrap();
    let group = other.group("/group").unwrap();
    assert_eq!(group.attribute("text").unwrap().read_string().unwrap(), "a Text with ü");
    assert_eq!(group.attribute("one").unwrap().read_scalar::<f64>().unwrap(), 1.5);
    for (index, [shape, _]) in SHAPES.into_iter().enumerate() {
        let found = other.dataset(&format!("/group/d{index}")).unwrap().read_array::<f32>().unwrap();
        assert_eq!(found.as_slice().unwrap(), numbers(shape), "{shape:?}");
    }
    let third = rust_hdf5::H5File::open(&path).unwrap();
    let found = third.dataset("alone/bytes").unwrap().read_raw::<u8>().unwrap();
    assert_eq!(found, [1, 2, 3]);
}
