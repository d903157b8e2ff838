//! OFF files: headers, counts, comments, polygons, and what is refused.

use sdf_formats::mesh::{Mesh, MeshFormat, PolygonCounts, read, read_bytes};

use crate::mesh_models::Model;
use crate::random::Random;

fn off(text: impl AsRef<[u8]>) -> Mesh {
    read_bytes(text.as_ref(), "test.off").unwrap()
}

fn refusal(text: impl AsRef<[u8]>) -> String {
    read_bytes(text.as_ref(), "cow.off").unwrap_err().to_string()
}

const POINTS: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

#[test]
fn it_holds_the_triangles_of_the_obj() {
    let mut random = Random::new(1);
    for max_corners in [3, 4, 9] {
        let model = Model::random(&mut random, 60, 200, max_corners);
        let (off, obj) = (off(model.off()), read_bytes(model.obj().as_bytes(), "").unwrap());
        assert_eq!(off, Mesh { format: MeshFormat::Off, ..obj });
    }
}

#[test]
fn a_file_is_read_as_its_bytes_are_however_long() {
    let folder = tempfile::TempDir::new().unwrap();
    let path = folder.path().join("long.off");
    for points in [60, 20_000] {
        let text = Model::random(&mut Random::new(2), points, 2 * points, 5).off();
        std::fs::write(&path, &text).unwrap();
        assert_eq!(read(&path).unwrap(), off(text));
    }
}

#[test]
fn one_square_may_be_spelled_in_many_ways() {
    let square = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
    let colored = "0 0 0 255 0 0\n1 0 0 0.5 0.5 0.5 1\n1 1 0 7\n0 1 0\n4 0 1 2 3 0.1 0.2 0.3\n";
    let homogeneous = "0 0 0 1\n2 0 0 2\n0.5 0.5 0 0.5\n0 -1 0 -1\n4 0 1 2 3\n";
    for text in [
        format!("OFF\n4 1 4\n{square}"),
        format!("OFF\r\n4 1 4\r\n{}", square.replace('\n', "\r\n")),
        format!("\u{feff}OFF 4 1 4\n{square}"),
        format!("OFF4 1 0\n{square}"),
        format!("# made by hand\n\nOFF # a square\n# counts\n4 1 0 # edges may be wrong\n\n{square}# end\n"),
        format!("OFF\n4 1 0\n  # the points\n{}", square.replace("1 1 0\n", "1 1 0\n\t# the last\n")),
        format!("OFF\n4\n1\n{square}"),
        format!("OFF\n4\n1\n4\n{square}"),
        format!("OFF 4\n1 # faces\n# edges\n\n 0 # none\n{square}"),
        format!("OFF\n4 1 4\n{}", square.replace("4 0 1 2 3", "4\n0 1 # two lines\n2 3 255 0 0")),
        format!("COFF\n4 1 4\n{colored}"),
        format!("NOFF\n4 1 4\n{colored}"),
        format!("STCNOFF\n4 1 4\n{colored}"),
        format!("4OFF\n4 1 4\n{homogeneous}"),
        format!("C4OFF\n4 1 4\n{}", homogeneous.replace("0 0 0 1", "0 0 0 1 255 0 0 255")),
    ] {
        for name in ["square.off", "square.obj", "square"] {
            let mesh = read_bytes(text.as_bytes(), name).unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!((&mesh.points[..], &mesh.triangles[..]), (&POINTS[..], &[[0, 1, 2], [0, 2, 3]][..]), "{text}");
            assert_eq!((mesh.format, &mesh.polygons[..], mesh.objects), (MeshFormat::Off, &[0, 0][..], 1));
            assert_eq!(mesh.polygon_counts, PolygonCounts { total: 1, larger: 1, ..PolygonCounts::default() });
        }
    }
}

#[test]
fn faces_of_two_corners_are_segments() {
    let mesh = off("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n2 0 2\n3 0 1 2\n");
    assert_eq!((mesh.segments, mesh.triangles, mesh.polygons), (vec![[0, 2]], vec![[0, 1, 2]], vec![0]));
    // Points alone are a mesh, too.
    assert!(off("OFF\n1 0 0\n1 2 3\n").require_triangles("").is_err());
}

#[test]
fn refusals_name_the_line_and_what_was_expected() {
    let points = "0 0 0\n1 0 0\n0 1 0\n";
    for (text, message) in [
        ("8 6 12\n0 0 0\n".into(), "cow.off, line 1: expected `OFF` first, found `8`"),
        ("OFF BINARY\n\0\0\0".into(), "cow.off, line 1: expected text, saved as ASCII OFF, found `BINARY`"),
        ("COFF BINARY\n8 6".into(), "cow.off, line 1: expected text, saved as ASCII OFF, found `BINARY`"),
        ("4nOFF\n5\n".into(), "cow.off, line 1: expected 3 dimensions, `OFF`, found `4nOFF`"),
        ("OFF\n-3 1 0\n".into(), "cow.off, line 2: expected the number of points, found `-3`"),
        ("OFF\n3".into(), "cow.off, line 2: expected the number of faces, found the end of the file"),
        ("OFF\n3 1 0\n0 0 0\n1 0\n".into(), "cow.off, line 4: expected 3 coordinates, found 2"),
        ("OFF\n1 0 0\n0 x 0\n".into(), "cow.off, line 3: expected a number, found `x`"),
        ("OFF\n1 0 0\n0 nan 0\n".into(), "cow.off, line 3: expected a finite number, found `nan`"),
        (
            "OFF\n1 0 0\n0 0 0 255 0 0\n".into(),
            "cow.off, line 3: expected 3 coordinates on a line, or `C` before `OFF` for colours, found `255`",
        ),
        ("4OFF\n1 0 0\n0 0 0 0\n".into(), "cow.off, line 3: expected a fourth coordinate that is not 0, found `0`"),
        ("4OFF\n1 0 0\n1e300 0 0 1e-300\n".into(), "cow.off, line 3: expected a finite number, found inf"),
        ("OFF\n2 0 0\n0 0 0\n".into(), "cow.off, line 4: expected a point, found the end of the file"),
        (
            format!("OFF\n3 1 0\n{points}3 0 1 3\n"),
            "cow.off, line 6: expected an index below 3, the number of points, found 3",
        ),
        (format!("OFF\n3 1 0\n{points}3 0 1 -1\n"), "cow.off, line 6: expected an index, found `-1`"),
        (format!("OFF\n3 1 0\n{points}1 0\n"), "cow.off, line 6: expected at least 2 corners, found 1"),
        (format!("OFF\n3 1 0\n{points}4 0 1 2\n"), "cow.off, line 7: expected an index, found the end of the file"),
        (
            format!("OFF\n3 2 0\n{points}3 0 1 2\n"),
            "cow.off, line 7: expected a face's number of corners, found the end of the file",
        ),
        (
            format!("OFF\n3 1 0\n{points}3 0 1 2\n3 2 1 0\n"),
            "cow.off, line 7: expected the end of the file after 1 faces, found `3`",
        ),
        ("OFF\n0 0 0\n".into(), "no points in cow.off"),
    ] {
        assert_eq!(refusal(&text), message, "{text}");
    }
    // Words that only begin like a header.
    for text in ["OFFSET\n1 0 0\n0 0 0\n", "OFFER\nv 0 0 0\n", "off\nv 0 0 0\n"] {
        let mesh = read_bytes(text.as_bytes(), "a.obj");
        assert!(mesh.is_err() || mesh.unwrap().format == MeshFormat::Obj, "{text}");
    }
}
