//! PLY files: encodings, types, foreign elements, refusals, and the triangles that ply-rs-bw reads.

use sdf_formats::mesh::{Mesh, MeshFormat, read, read_bytes};

use crate::mesh_models::{Model, shared_meshes};
use crate::random::Random;

fn ply(bytes: impl AsRef<[u8]>) -> Mesh {
    read_bytes(bytes.as_ref(), "test.ply").unwrap()
}

fn refusal(bytes: impl AsRef<[u8]>) -> String {
    read_bytes(bytes.as_ref(), "bunny.ply").unwrap_err().to_string()
}

fn is_same(a: &Mesh, b: &Mesh) -> bool {
    a.points == b.points && a.triangles == b.triangles && a.polygons == b.polygons
}

const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

#[test]
fn a_mesh_is_the_same_in_every_encoding_and_in_obj() {
    let mut random = Random::new(1);
    for max_corners in [3, 4, 9] {
        let model = Model::random(&mut random, 100, 300, max_corners);
        let obj = read_bytes(model.obj().as_bytes(), "").unwrap();
        for encoding in ENCODINGS {
            let mesh = ply(model.ply(encoding));
            assert_eq!(mesh.format, MeshFormat::Ply);
            assert!(is_same(&mesh, &obj), "{encoding}");
        }
    }
}

/// A header with all types and things to skip, and its elements in order as (type, value).
fn rich() -> (String, Vec<Vec<(&'static str, f64)>>) {
    let header = "element tag 2\nproperty double weight\nproperty list uint short words\nelement vertex 3\n\
        property uchar red\nproperty double z\nproperty list uint8 float64 extra\nproperty int16 x\nproperty float32 y\n\
        property uchar red\nelement void 1000000000\nelement face 2\nproperty int8 flag\n\
        property list ushort uint32 vertex_index\nproperty list char float uv\nelement edge 1\nproperty ushort vertex1\n\
        property char vertex2\nelement after 1\nproperty uint x\n"
        .to_string();
    let vertex = |x: f64, y: f64, z: f64| {
        vec![("u8", 7.0), ("f64", z), ("u8", 2.0), ("f64", 1.5), ("f64", 2.5), ("i16", x), ("f32", y), ("u8", 9.0)]
    };
    let face = |corners: [f64; 3]| {
        let mut face = vec![("i8", -1.0), ("u16", 3.0)];
        face.extend(corners.map(|i| ("u32", i)));
        face.extend([("i8", 1.0), ("f32", 0.5)]);
        face
    };
    let elements = vec![
        vec![("f64", 1e-3), ("u32", 0.0)],
        vec![("f64", 2.0), ("u32", 2.0), ("i16", -3.0), ("i16", 4.0)],
        vertex(-2.0, 0.25, 1e300),
        vertex(3.0, -0.5, 0.1),
        vertex(5.0, 4.0, -0.0),
        face([0.0, 1.0, 2.0]),
        face([2.0, 1.0, 0.0]),
        vec![("u16", 2.0), ("i8", 0.0)],
        vec![("u32", 4294967295.0)],
    ];
    (header, elements)
}

fn rich_file(encoding: &str, line_end: &str) -> Vec<u8> {
    let (header, elements) = rich();
    let mut bytes =
        format!("ply\nformat {encoding} 1.0\nobj_info any\n{header}end_header\n").replace('\n', line_end).into_bytes();
    for element in elements {
        for (kind, value) in element {
            let mut little = match kind {
                "u8" => vec![value as u8],
                "i8" => (value as i8).to_le_bytes().to_vec(),
                "u16" => (value as u16).to_le_bytes().to_vec(),
                "i16" => (value as i16).to_le_bytes().to_vec(),
                "u32" => (value as u32).to_le_bytes().to_vec(),
                "f32" => (value as f32).to_le_bytes().to_vec(),
                _ => value.to_le_bytes().to_vec(),
            };
            match encoding {
                "ascii" => bytes.extend(format!(" {value:?}").bytes()),
                "binary_little_endian" => bytes.append(&mut little),
                _ => bytes.extend(little.iter().rev()),
            }
        }
        if encoding == "ascii" {
            bytes.extend(line_end.bytes());
        }
    }
    bytes
}

#[test]
fn any_types_and_foreign_elements_are_skipped() {
    for encoding in ENCODINGS {
        for line_end in ["\n", "\r\n", "\r"] {
            let mesh = ply(rich_file(encoding, line_end));
            assert_eq!(
                mesh.points,
                [[-2.0, 0.25, 1e300], [3.0, -0.5, 0.1], [5.0, 4.0, 0.0]],
                "{encoding} {line_end:?}"
            );
            assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 0]]);
            assert_eq!(mesh.segments, [[2, 0]]);
        }
    }
}

#[test]
fn a_carriage_return_alone_leaves_the_data_its_line_feed() {
    let mut bytes = b"ply\rformat binary_little_endian 1.0\relement vertex 1\rproperty char x\rproperty char y\rproperty char z\rend_header\r".to_vec();
    bytes.extend([10, 11, 12]);
    assert_eq!(ply(bytes).points, [[10.0, 11.0, 12.0]]);
}

fn ascii(elements: &str) -> String {
    let header = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices";
    format!("ply\nformat ascii 1.0\ncomment caf\u{e9}\n{header}\nend_header\n{elements}")
}

#[test]
fn text_may_be_spelled_loosely() {
    let plain = ply(ascii("0 0 0\n1 0 0\n0 1 .5\n3 0 1 2\n"));
    for text in ["0. 0 0\n+1.e0 0 -0\n\n0 1 0.5  \n\t3 0 1 2", "0 0 0\r\n1 0 0\r\n0 1 5e-1\r\n3 0 1 2\r\n\r\n"] {
        assert!(is_same(&ply(ascii(text)), &plain), "{text:?}");
    }
    let mut latin = ascii("0 0 0\n1 0 0\n0 1 .5\n3 0 1 2\n").into_bytes();
    let accent = latin.iter().position(|b| !b.is_ascii()).unwrap();
    latin.remove(accent);
    assert!(is_same(&ply(latin), &plain));
}

#[test]
fn float_text_is_the_float_that_binary_holds() {
    let mesh = ply(ascii("0.1 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"));
    assert_eq!(mesh.points[0][0], f64::from(0.1f32));
}

#[test]
fn strips_reverse_every_other_triangle() {
    let text = "ply\nformat ascii 1.0\nelement tristrips 1\nproperty list int int vertex_indices\nelement vertex 5\n\
        property float x\nproperty float y\nproperty float z\nend_header\n10 0 1 2 3 -1 2 3 4 -1 0\n\
        0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n";
    assert_eq!(ply(text).triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4]]);
}

#[test]
fn refusals_name_the_location_and_what_was_expected() {
    for (elements, message) in [
        ("0 0 0\n1 0 0\n0 1 0\n", "line 8: expected 20 bytes or more after the header, for 1 face, found 18"),
        ("0 0 0\n1 0 0\n0 1\n3 0 1 2\n", "line 13: expected another value, found the end of the line"),
        ("0 0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "line 11: expected the end of the line, found `0`"),
        ("0 0 0\n1 0 inf\n0 1 0\n3 0 1 2\n", "line 12: expected a finite number, found inf"),
        ("0 0 0\n1 0 1e39\n0 1 0\n3 0 1 2\n", "line 12: expected a finite number, found inf"),
        ("0 0 0\n1 x 0\n0 1 0\n3 0 1 2\n", "line 12: expected a number, found `x`"),
        ("0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "line 14: expected an index from 0 up to 3 - 1, found 3"),
        ("0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", "line 14: expected an index from 0 up to 3 - 1, found -1"),
        ("0 0 0\n1 0 0\n0 1 0\n3 0 1 0.5\n", "line 14: expected an index from 0 up to 3 - 1, found 0.5"),
        ("0 0 0\n1 0 0\n0 1 0\n2 0 1\n", "line 14: expected at least 3 corners, found 2"),
        ("0 0 0\n1 0 0\n0 1 0\n-3 0 1 2\n", "line 14: expected the length of a list, found -3"),
        ("0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n", "line 14: expected another value"),
        ("0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n\n3 2 1 0", "line 16: expected no more than the header declares, found `3`"),
    ] {
        let found = refusal(ascii(elements));
        assert!(found.starts_with(&format!("bunny.ply, {message}")), "{found}");
    }
    let model = Model { points: vec![[0.0; 3]; 3], polygons: vec![vec![0, 1, 2], vec![0, 1, 3]] };
    for encoding in &ENCODINGS[1..] {
        let expected = "bunny.ply, face 1: expected an index from 0 up to 3 - 1, found 3";
        assert_eq!(refusal(model.ply(encoding)), expected);
    }
}

#[test]
fn refusals_of_headers_name_the_line() {
    for (header, message) in [
        ("format ascii 1.0\nelement vertex 1", "line 3: expected `end_header`, found the end of the file"),
        (
            "format ascii 2 words\nelement vertex -1\nend_header\n",
            "line 3: expected an element's name and number, found `-1`",
        ),
        (
            "format utf8 1.0\nend_header\n",
            "line 2: expected `ascii`, `binary_little_endian` or `binary_big_endian`, found `utf8`",
        ),
        ("element vertex 0\nend_header\n", "line 3: expected `format` before `end_header`, found none"),
        ("format ascii 1.0\nproperty float x\nend_header\n", "line 3: expected `element` first, found `property`"),
        (
            "format ascii 1.0\nelement a 1\nproperty half x\nend_header\n",
            "line 4: expected a type such as `float` or `int32`, found `half`",
        ),
        ("format ascii 1.0\nelement a 0\nelement a 0\nend_header\n", "line 4: expected each element once, found `a`"),
        ("format ascii 1.0\nnonsense\nend_header\n", "line 3: expected a keyword of PLY, found `nonsense`"),
        (
            "format ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n",
            "line 3: expected a property `z`, found none in element vertex",
        ),
        (
            "format ascii 1.0\nelement face 1\nproperty int vertex_indices\nend_header\n1\n",
            "line 3: expected a list property `vertex_indices`, found none in element face",
        ),
        (
            "format binary_little_endian 1.0\nelement vertex 18446744073709551615\nproperty float x\nend_header\n",
            "line 3: expected 73786976294838206460 bytes or more after the header, for 18446744073709551615 vertex, found 0",
        ),
    ] {
        assert_eq!(refusal(format!("ply\n{header}")), format!("bunny.ply, {message}"));
    }
    assert_eq!(refusal("ply\nformat ascii 1.0\nend_header\n"), "no points in bunny.ply");
}

/// An independent reader.
mod reference {
    use ply_rs_bw::parser::Parser;
    use ply_rs_bw::ply::{DefaultElement, Property};

    pub fn triangles(bytes: &[u8]) -> Vec<[[f64; 3]; 3]> {
        let ply = Parser::<DefaultElement>::new().read_ply(&mut &bytes[..]).unwrap();
        let float = |property: &Property| match property {
            Property::Float(x) => f64::from(*x),
            other => panic!("{other:?}"),
        };
        let points: Vec<_> =
            ply.payload["vertex"].iter().map(|v| ["x", "y", "z"].map(|axis| float(&v[axis]))).collect();
        let corners = |face: &DefaultElement| match &face["vertex_indices"] {
            Property::ListInt(list) => [list[0], list[1], list[2]].map(|i| points[i as usize]),
            other => panic!("{other:?}"),
        };
        ply.payload["face"].iter().map(corners).collect()
    }
}

#[test]
fn ply_rs_reads_the_same_triangles() {
    let mut random = Random::new(2);
    let model = Model::random(&mut random, 50, 100, 3);
    let mut files: Vec<Vec<u8>> = ENCODINGS.iter().map(|encoding| model.ply(encoding)).collect();
    files.extend(shared_meshes("ply").iter().map(|path| std::fs::read(path).unwrap()));
    for file in files {
        let mesh = ply(&file);
        let corners: Vec<_> = mesh.triangles.iter().map(|t| t.map(|i| mesh.points[i as usize])).collect();
        assert!(corners == reference::triangles(&file));
    }
    for path in shared_meshes("ply") {
        assert!(!read(&path).unwrap().triangles.is_empty());
    }
}
