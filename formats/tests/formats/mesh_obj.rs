//! OBJ files: spellings, numbers, refusals, and the triangles that tobj reads.

use std::fmt::Write;

use sdf_formats::mesh::{Mesh, read, read_bytes};

use crate::mesh_models::shared_meshes;
use crate::random::Random;

pub fn obj(text: impl AsRef<[u8]>) -> Mesh {
    read_bytes(text.as_ref(), "test.obj").unwrap()
}

fn refusal(text: impl AsRef<[u8]>) -> String {
    read_bytes(text.as_ref(), "bunny.obj").unwrap_err().to_string()
}

pub const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn all_spellings_of_a_face_are_the_same_face() {
    for face in [
        "f 1 2 3 4",
        "f 1/1 2/2 3/3 4/4",
        "f 1//9 2//9 3//9 4//9",
        "f 1/1/1 2/2/2 3/3/3 4/4/4",
        "f -4 -3 -2 -1",
        "f -4/-1/-1 -3/-1/-1 -2 4",
        "\tf  1\t2 3 4 \t",
        "f 1 2 \\\n 3 4",
        "f 1 2 \\\r\n 3 4\r",
        "f 1 2 3 4#comment",
        "f 1 2 3 4 # 5 6",
        "f +1 02 3 4",
        "f 1//6148914691236517206 2//1 3 4",
    ] {
        let mesh = obj(format!("{SQUARE}{face}"));
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]], "{face:?}");
        assert_eq!(mesh.polygons, [0, 0]);
    }
}

#[test]
fn line_ends_marks_and_foreign_words_change_nothing() {
    let text = "# \\\nmtllib a.mtl\no thing\n# C:\\\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 0.5\nvn 0 0 1\nvt 0 0\nusemtl m\ns off\np 1\nf 1 2 3\n";
    let plain = obj(text);
    assert_eq!((plain.points.len(), plain.triangles.len()), (3, 1));
    for other in [
        text.replace('\n', "\r\n"),
        text.replace('\n', "\r"),
        text.replace('\n', "\n\n"),
        text.replace('\n', " \t\n"),
        text.replace(' ', "\t"),
        format!("\u{feff}{text}"),
        text.trim_end().to_string(),
    ] {
        assert_eq!(obj(&other), plain, "{other:?}");
    }
    let mut latin = b"# caf\xe9\no \xff\xfe\n".to_vec();
    latin.extend(text.bytes());
    assert_eq!(obj(&latin), plain);
}

#[test]
fn numbers_are_those_of_the_standard_library() {
    let mut random = Random::new(1);
    for _ in 0..20_000 {
        let digits = |random: &mut Random, end: usize| -> String {
            (0..random.below(end)).map(|_| random.pick(&["0", "1", "2", "3", "5", "7", "9"])).collect()
        };
        let number = format!(
            "{}{}{}{}{}",
            random.pick(&["", "-", "+"]),
            digits(&mut random, 22),
            random.pick(&["", "."]),
            digits(&mut random, 25),
            random.pick(&["", "", "", "e5", "E-7", "e+022", "e-320"]),
        );
        let text = format!("v {number} 0 0");
        match number.parse::<f64>() {
            Ok(value) if value.is_finite() => assert_eq!(obj(text).points[0][0].to_bits(), value.to_bits(), "{number}"),
            _ => assert!(read_bytes(text.as_bytes(), "").is_err(), "{number}"),
        }
    }
    // 2^64 + 1, which wraps to 1 in 64 bits.
    assert_eq!(obj("v 18446744073709551617 0 0").points[0][0], 18446744073709551616.0);
    let mesh = obj("v 1.e5 +1.0 -.5\nv -0 1e-400 9007199254740993");
    assert_eq!(mesh.points, [[1e5, 1.0, -0.5], [0.0, 0.0, 9007199254740992.0]]);
}

/// Lines with all kinds of ends and lengths, wherever the reader's blocks may cut them.
#[test]
fn a_large_file_reads_as_its_bytes_do() {
    let mut random = Random::new(17);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let mut refused = 0;
    for round in 0..20 {
        let mut text = String::from(random.pick(&["", "\u{feff}"]));
        let ends: &[&str] =
            if round % 5 == 0 { &["\r"] } else { &["\n", "\r\n", "\r", " \\\n 2\n", "\\\r\n\r\n", " # \\\n"] };
        let mut points = 0;
        let wanted = 300_000 + random.below(900_000);
        while text.len() < wanted {
            match random.below(9) {
                0 if points > 2 => write!(text, "f 1 {} {points}/3", 1 + random.below(points)).unwrap(),
                1 if points > 2 => text.push_str("f -1 -2 -3 2"),
                2 => text.push_str(random.pick(&["", "vn 1 2 3", "o a", "g b", "usemtl \\x"])),
                5 | 6 => {
                    points += 1;
                    text.push_str(random.pick(&["v 1 \\\n 2 3", "v \\\r\n1 2 3", "v 1 2 \\\r 3"]));
                }
                3 if random.below(5_000) == 0 => text.push_str(&"# long ".repeat(90_000)),
                4 if random.below(6_000) == 0 => text.push_str("v 1 x 2"),
                _ => {
                    points += 1;
                    write!(text, "v {:.6} {} {}", random.unit(), random.unit(), random.below(100)).unwrap();
                }
            }
            text.push_str(random.pick(ends));
        }
        std::fs::write(&path, &text).unwrap();
        let name = path.display().to_string();
        let (whole, streamed) = (read_bytes(text.as_bytes(), &name), sdf_formats::mesh::read(&path));
        refused += usize::from(whole.is_err());
        match (whole, streamed) {
            (Ok(whole), Ok(streamed)) => assert!(whole == streamed, "round {round}"),
            (whole, streamed) => {
                let [whole, streamed] = [whole, streamed].map(|read| read.map(|_| ()).unwrap_err().to_string());
                assert_eq!(whole, streamed, "round {round}");
            }
        }
    }
    assert!((3..18).contains(&refused), "{refused} refused");
}

#[test]
fn a_first_line_does_not_hide_that_the_rest_is_not_text() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let zeros = [b"v 0 0 0\n".to_vec(), vec![0; 300_000]].concat();
    let count = 6_000_u32;
    let mut header = b"v 1 2 3\n".to_vec();
    header.resize(80, b' ');
    let stl = [header, count.to_le_bytes().to_vec(), vec![0; 50 * count as usize]].concat();
    for bytes in [zeros, stl] {
        std::fs::write(&path, &bytes).unwrap();
        let name = path.display().to_string();
        assert_eq!(sdf_formats::mesh::read(&path).is_ok(), read_bytes(&bytes, &name).is_ok());
    }
}

/// Blanks that are neither spaces nor tabs, joined lines and comments bypass the reader's fast paths.
#[test]
fn fast_and_slow_paths_read_the_same() {
    let mut random = Random::new(11);
    for _ in 0..300 {
        let plain = random_text(&mut random);
        let mut spaced = String::new();
        for c in plain.chars() {
            match c {
                ' ' => spaced.push_str(random.pick(&[" ", "\t", "\x0b", "\x0c ", " \\\n", "  ", " \\\r\n\t"])),
                '\n' => spaced.push_str(random.pick(&["\n", "\r", "\r\n", " \n", "#\n", " # a\\b \\\n"])),
                c => spaced.push(c),
            }
        }
        let [fast, slow] = [&plain, &spaced].map(|text| read_bytes(text.as_bytes(), "a.obj"));
        match (fast, slow) {
            (Ok(fast), Ok(slow)) => assert_eq!(fast, slow, "{spaced:?}"),
            (Err(fast), Err(slow)) => {
                let [fast, slow] = [fast, slow].map(|error| error.to_string());
                let expected = |error: &str| error.split_once(": expected").map(|(_, expected)| expected.to_owned());
                assert_eq!(expected(&fast), expected(&slow), "{spaced:?}");
            }
            (fast, slow) => panic!("{fast:?} of {plain:?}, and {slow:?} of {spaced:?}"),
        }
    }
}

/// Lines of points, faces and skipped keywords, with single spaces.
fn random_text(random: &mut Random) -> String {
    let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    for _ in 0..random.below(30) {
        let number = |random: &mut Random| {
            let value = 100.0 * random.unit() - 50.0;
            match random.below(5) {
                0 => format!("{value:e}"),
                1 => format!("{value:.3}"),
                2 => format!("{}", value as i64),
                3 => format!("{:.1$}", value, 18),
                _ => format!("{value}"),
            }
        };
        let corner = |random: &mut Random| {
            let [v, t, n] = [4, 9, 1_000_000].map(|end| random.below(end) + usize::from(random.below(50) > 0));
            match random.below(60) {
                0 => format!("{v}/{t}/{n}/1"),
                1..=10 => format!("{v}/{t}/{n}"),
                11..=20 => format!("{v}//{n}"),
                21..=30 => format!("{v}/{t}"),
                31..=40 => format!("-{v}"),
                41..=50 => format!("{v}/-{t}/-{n}"),
                _ => format!("{v}"),
            }
        };
        let words = |random: &mut Random, word: &dyn Fn(&mut Random) -> String, count: usize| {
            (0..count).map(|_| word(random)).collect::<Vec<_>>().join(" ")
        };
        let more = random.below(4);
        let line = match random.below(8) {
            0..=2 => format!("v {}", words(random, &number, 3 + more)),
            3 | 4 => format!("f {}", words(random, &corner, 3 + more)),
            5 => format!("l {}", words(random, &corner, 2 + more)),
            6 => format!("vn {}", words(random, &number, 3)),
            _ => random.pick(&["g a b", "", "o", "usemtl x", "s 1"]).to_owned(),
        };
        text.push_str(&line);
        text.push('\n');
    }
    text
}

#[test]
fn polylines_become_segments_and_groups_with_faces_are_counted() {
    let mesh = obj(format!("{SQUARE}g empty\nl 1 2 3\nl -1/1 -4/2\no a\ng b\nf 1 2 3\nf 1 3 4\ng c\nf 1 2 4"));
    assert_eq!(mesh.segments, [[0, 1], [1, 2], [3, 0]]);
    assert_eq!(mesh.objects, 2);
    assert_eq!(obj("v 0 0 0").objects, 1);
    let error = obj("v 0 0 0\nv 1 1 1\nl 1 2").require_triangles("rope.obj").unwrap_err();
    assert_eq!(error.to_string(), "no triangles in rope.obj");
}

#[test]
fn points_may_follow_the_faces_that_use_them() {
    assert_eq!(obj(format!("f 1 2 3\nf 1 3 4\nl 4 1\n{SQUARE}")).triangles, [[0, 1, 2], [0, 2, 3]]);
    let text = format!("f 1 2 3\nf 1 2 5\nf 1 2 7\n{SQUARE}");
    assert_eq!(refusal(text), "bunny.obj, line 2: expected an index up to 4, the number of points, found 5");
    // Negative indices count back from the line that has them.
    assert!(refusal(format!("f -1 -2 -3\n{SQUARE}")).starts_with("bunny.obj, line 1: expected an index back to"));
}

#[test]
fn refusals_name_the_line_and_what_was_expected() {
    for (text, message) in [
        ("v 1 2", "line 1: expected 3 coordinates, found 2"),
        ("v 1 2 3\n\nv 1 2 nan", "line 3: expected a finite number, found `nan`"),
        ("v 1 -inf 3", "line 1: expected a finite number, found `-inf`"),
        ("v 1 2 1e999", "line 1: expected a finite number, found `1e999`"),
        ("v 1,5 2 3", "line 1: expected a number, found `1,5`"),
        ("v 1 2 3\rf 0 1 1", "line 2: expected an index that is not 0 (they count from 1), found `0`"),
        ("v 1 2 3\r\nf 1 1 2", "line 2: expected an index up to 1, the number of points, found 2"),
        ("v 1 2 3\nf 1 1 -2", "line 2: expected an index back to one of 1 points so far, found `-2`"),
        ("v 1 2 3\n# a \\\n\nf 1 \\\n 1", "line 5: expected at least 3 corners, found 2"),
        ("v 1 2 3\nl 1", "line 2: expected at least 2 points, found 1"),
        ("v 1 2 3\nf 1 1 1.5", "line 2: expected a whole number, found `1.5`"),
        ("v 1 2 3\nf 1 1 1/x", "line 2: expected an index such as `7`, `7/1`, `7//1` or `7/1/1`, found `1/x`"),
        (
            "v 1 2 3\nf 1 1 99999999999999999999",
            "line 2: expected an index up to 4294967295, found `99999999999999999999`",
        ),
        ("v 1 2 \x1b[31m", "line 1: expected a number, found `\\x1b[31m`"),
    ] {
        assert_eq!(refusal(text), format!("bunny.obj, {message}"));
    }
    let long = refusal(format!("v {} 2 3", "x\u{7}".repeat(1000)));
    assert!(long.chars().count() < 100 && !long.contains('\u{7}'), "{long}");
    assert_eq!(refusal("l 1 2"), "bunny.obj, line 1: expected an index up to 0, the number of points, found 1");
}

fn triangle_corners(mesh: &Mesh) -> Vec<[[f64; 3]; 3]> {
    mesh.triangles.iter().map(|t| t.map(|i| mesh.points[i as usize])).collect()
}

fn tobj_corners(bytes: &[u8]) -> Vec<[[f64; 3]; 3]> {
    let options = tobj::LoadOptions { triangulate: true, ..tobj::LoadOptions::default() };
    let (models, _) = tobj::load_obj_buf(&mut &bytes[..], &options, |_| Ok(Default::default())).unwrap();
    let mut triangles = Vec::new();
    for tobj::Model { mesh, .. } in models {
        let point = |&i: &u32| *mesh.positions[3 * i as usize..].first_chunk().unwrap();
        triangles.extend(mesh.indices.chunks_exact(3).map(|t| [point(&t[0]), point(&t[1]), point(&t[2])]));
    }
    triangles
}

#[test]
fn tobj_reads_the_same_triangles_from_the_shared_meshes() {
    for path in shared_meshes("obj") {
        let mesh = read(&path).unwrap();
        assert!(triangle_corners(&mesh) == tobj_corners(&std::fs::read(&path).unwrap()), "{}", path.display());
    }
}

#[test]
fn tobj_reads_the_same_triangles_from_random_text() {
    let mut random = Random::new(4);
    for _ in 0..200 {
        let (mut text, mut points) = (String::new(), 0i64);
        for line in 0..60 {
            match random.below(if points < 3 { 1 } else { 4 }) {
                0 => {
                    let spelled: Vec<_> = (0..3).map(|_| format!("{:e}", random.unit() - 0.5)).collect();
                    text += &format!("v {}", spelled.join(random.pick(&[" ", "  ", "\t"])));
                    points += 1;
                }
                1 => text += random.pick(&["# words", "s 1", "g part", "o whole", ""]),
                _ => {
                    text += "f";
                    for _ in 0..3 {
                        let index = 1 + random.below(points as usize) as i64;
                        let index = if random.below(2) == 0 { index } else { index - points - 1 };
                        text += &format!(" {index}");
                    }
                }
            }
            text += if line == 59 { "" } else { random.pick(&["\n", "\r\n", "\n\n", " \n"]) };
        }
        assert_eq!(triangle_corners(&obj(&text)), tobj_corners(text.as_bytes()), "{text}");
    }
}
