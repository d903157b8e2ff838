//! STL files: text and binary, welding, refusals, and the triangles that stl_io reads.

use sdf_formats::mesh::{Mesh, MeshFormat, read_bytes};

use crate::mesh_models::Model;
use crate::random::Random;

fn stl(bytes: impl AsRef<[u8]>) -> Mesh {
    read_bytes(bytes.as_ref(), "test.stl").unwrap()
}

fn refusal(bytes: impl AsRef<[u8]>) -> String {
    read_bytes(bytes.as_ref(), "bunny.stl").unwrap_err().to_string()
}

fn corners(mesh: &Mesh) -> Vec<[[f64; 3]; 3]> {
    mesh.triangles.iter().map(|t| t.map(|i| mesh.points[i as usize])).collect()
}

const FACET: &str = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";

#[test]
fn text_and_binary_hold_the_triangles_of_the_obj() {
    let mut random = Random::new(1);
    let model = Model::random(&mut random, 60, 200, 3);
    let obj = read_bytes(model.obj().as_bytes(), "").unwrap();
    let (text, binary) = (stl(model.stl_text()), stl(model.stl_binary("")));
    assert_eq!(text, binary);
    assert_eq!(text.format, MeshFormat::Stl);
    assert_eq!(corners(&text), corners(&obj));
    let reference = stl_io::read_stl(&mut std::io::Cursor::new(model.stl_binary(""))).unwrap();
    assert_eq!(text.points.len(), reference.vertices.len());
    let faces: Vec<_> = reference.faces.iter().map(|f| f.vertices.map(|i| i as u32)).collect();
    assert_eq!(text.triangles, faces);
}

#[test]
fn equal_corners_are_one_point_in_order_of_appearance() {
    let mesh = stl(format!("solid\n{FACET}{}endsolid", FACET.replace("vertex 0 0 0", "vertex -0 0 -0.0e0")));
    assert_eq!(mesh.points, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 1, 2]]);
    let mesh = stl(format!("solid\n{}endsolid", FACET.replace("vertex 1 0 0", "vertex 1e-300 0 0")));
    assert_eq!(mesh.points.len(), 3);
}

#[test]
fn binary_files_may_begin_as_text_does() {
    let model = Model { points: vec![[0.0; 3], [1.0; 3]], polygons: vec![vec![0, 1, 1]; 3] };
    for header in ["solid facet", "ply\n", "v 1 2 3\n", "<html>"] {
        let bytes = model.stl_binary(header);
        if header != "ply\n" {
            assert_eq!(read_bytes(&bytes, "part").unwrap().triangles.len(), 3, "{header}");
        }
    }
}

#[test]
fn text_may_be_spelled_in_many_ways() {
    let one = stl(format!("solid\n{FACET}endsolid\n"));
    for text in [
        format!("SOLID A B\r\n{}ENDSOLID A B", FACET.to_uppercase().replace('\n', "\r\n")),
        format!("  solid facet\n\n\n{}  endsolid facet\n\n", FACET.replace('\n', "\n\t ")),
        format!("\u{feff}Solid x\r{}EndSolid x", FACET.replace('\n', "\r")),
        format!("solid\ncolor 1 0 0\n{}endsolid", FACET.replace("0 1 0", "0.0E+000 +1.e0 -0")),
        format!("solid\n{}endsolid", FACET.replace("normal 0 0 1", "normal nan nan nan")),
    ] {
        let mesh = stl(&text);
        assert_eq!((&mesh.triangles, &mesh.points), (&one.triangles, &one.points), "{text}");
    }
    let mut latin = b"solid caf\xe9\n".to_vec();
    latin.extend(format!("{FACET}endsolid").bytes());
    assert_eq!(stl(latin), one);
}

#[test]
fn all_solids_of_a_file_are_read() {
    let mesh = stl(format!("solid a\n{FACET}endsolid a\nsolid empty\nendsolid\nsolid b\n{FACET}{FACET}endsolid b\n"));
    assert_eq!((mesh.triangles.len(), mesh.objects), (3, 2));
}

#[test]
fn binary_files_must_have_the_length_that_they_declare() {
    let model = Model { points: vec![[0.0; 3], [1.0; 3]], polygons: vec![vec![0, 1, 1]; 3] };
    let mut bytes = model.stl_binary("solid");
    let expected = "bunny.stl: expected 84 + 50 * 3 = 234 bytes of binary STL, found";
    assert_eq!(refusal(&bytes[..233]), format!("{expected} 233"));
    assert_eq!(refusal(&bytes[..20]), "bunny.stl: expected at least 84 bytes of binary STL, found 20");
    bytes.push(0);
    assert_eq!(refusal(&bytes), format!("{expected} 235"));
    bytes[83] = 0xff;
    assert_eq!(
        refusal(&bytes),
        "bunny.stl: expected 84 + 50 * 4278190083 = 213909504234 bytes of binary STL, found 235"
    );
    assert_eq!(read_bytes(&bytes, "bunny").unwrap_err().to_string(), "bunny: not an OBJ, PLY, STL or OFF mesh");
    assert_eq!(refusal(Model::default().stl_binary("")), "no triangles in bunny.stl");
}

#[test]
fn refusals_name_the_line_or_the_triangle() {
    let model = Model { points: vec![[0.0; 3], [0.0, f64::NAN, 0.0]], polygons: vec![vec![0, 0, 0], vec![0, 1, 0]] };
    assert_eq!(refusal(model.stl_binary("")), "bunny.stl, triangle 1: expected a finite number, found NaN");
    for (text, message) in [
        (format!("solid\n{}", FACET.replace("1 0 0", "1 0")), "line 5: expected 3 coordinates, found 2"),
        (format!("solid\n{}", FACET.replace("1 0 0", "1 0 inf")), "line 5: expected a finite number, found `inf`"),
        (format!("solid\n{}", FACET.replace("1 0 0", "1 0 0,")), "line 5: expected a number, found `0,`"),
        (format!("solid\n{}", FACET.replace("vertex 1 0 0\n", "")), "line 7: expected 3 corners, found 2"),
        (
            format!("solid\n{}", FACET.replace("endloop", "vertex 1 1 1")),
            "line 7: expected `endfacet` after 3 corners, found `vertex`",
        ),
        (format!("solid\n{}", FACET.replace("endfacet", "")), "line 9: expected `endfacet`, found the end of the file"),
        (format!("solid\n{FACET}"), "line 9: expected `endsolid`, found the end of the file"),
        (format!("solid\nendsolid\n{FACET}"), "line 3: expected `solid`, found `facet`"),
        (format!("solid\n{}", FACET.replace("outer", "inner")), "line 3: expected a keyword of STL, found `inner`"),
        ("solid\nfacet\nfacet".into(), "line 3: expected `endfacet`, found `facet`"),
        ("solid\nfacet\nendsolid".into(), "line 3: expected `endfacet`, found `endsolid`"),
    ] {
        assert_eq!(refusal(text), format!("bunny.stl, {message}"));
    }
    assert_eq!(refusal("solid\nendsolid\n"), "no triangles in bunny.stl");
}
