//! Fields from files, bytes and texts.

use std::fs;

use sdf_core::AnyField;
use sdf_core::Sdf;
use sdf_core::nalgebra::Vector3;
use sdf_formats::field_file::{self, Field};
use tempfile::TempDir;

use crate::grid_samples::{DENSE, Made};

const SHAPES: &str = "[field]\nshape = 'union'\nof = [\n  { shape = 'sphere', radius = 1 },\n  \
    { shape = 'box', half_extents = [1, 2, 3], pose = { translation = [0, 0, 2] } },\n]\n";

const WITH_GRID: &str = "[field]\nshape = 'shell'\nthickness = 0.25\nof = { shape = 'grid', file = 'ball.sdf.h5' }\n";

fn analytic(field: Field) -> AnyField {
    match field {
        Field::Analytic(node) => node,
        Field::Grid(_) => panic!("a grid"),
    }
}

#[test]
fn shapes_are_the_same_from_a_file_its_bytes_and_its_text() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("shapes.sdf.toml");
    fs::write(&path, SHAPES).unwrap();
    let file = analytic(field_file::read(&path).unwrap());
    let bytes = analytic(field_file::read_bytes(SHAPES.as_bytes(), "").unwrap());
    let text = field_file::read_text(SHAPES, "").unwrap();
    for point in [[0.0; 3], [1.5, 0.25, -3.0], [0.5, 2.5, 4.0]].map(Vector3::<f64>::from) {
        let sample = file.evaluate(point);
        assert_eq!((sample, sample), (bytes.evaluate(point), text.evaluate(point)));
    }
}

#[test]
fn grids_are_the_same_from_a_file_and_its_bytes() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("ball.sdf.h5");
    Made::new([9, 9, 9], DENSE).write(&path);
    let Field::Grid(file) = field_file::read(&path).unwrap() else { panic!("shapes") };
    let Field::Grid(bytes) = field_file::read_bytes(&fs::read(&path).unwrap(), "").unwrap() else { panic!("shapes") };
    assert!(file == bytes);
}

#[test]
fn only_a_file_can_name_a_grid() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("shell.sdf.toml");
    fs::write(&path, WITH_GRID).unwrap();
    Made::new([9, 9, 9], DENSE).write(&folder.path().join("ball.sdf.h5"));
    let file = analytic(field_file::read(&path).unwrap());
    assert!(file.value(Vector3::<f64>::from([0.0; 3])).is_finite());
    let refusal = "shell: field.of: file \"ball.sdf.h5\": only a field that is read from a file can name a grid";
    assert_eq!(field_file::read_text(WITH_GRID, "shell").unwrap_err().to_string(), refusal);
    assert_eq!(field_file::read_bytes(WITH_GRID.as_bytes(), "shell").unwrap_err().to_string(), refusal);
}

#[test]
fn bytes_that_are_not_a_field_are_refused_as_files_are() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.sdf.toml");
    for bytes in [&b""[..], b"\xff\xfe", b"[field", b"v 0 0 0\n", b"\x89HDF\r\n\x1a\n", b"[field]\nshape = 'spere'\n"] {
        fs::write(&path, bytes).unwrap();
        let file = field_file::read(&path).unwrap_err().to_string();
        assert_eq!(field_file::read_bytes(bytes, path.to_str().unwrap()).unwrap_err().to_string(), file);
    }
}
