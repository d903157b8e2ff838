//! Mesh files that are damaged, cut short, of another kind, or made to exhaust time or memory.

use sdf_formats::mesh::{Mesh, MeshError, read, read_bytes};
use std::path::Path;
use std::time::{Duration, Instant};

use crate::memory::peak_of;
use crate::mesh_models::Model;
use crate::random::Random;

/// Reads a mesh, and checks what holds for any bytes: valid indices, finite points, little memory, one clean line of
/// error.
fn survive(bytes: &[u8], name: &str) -> Result<Mesh, MeshError> {
    let (parsed, memory) = peak_of(|| read_bytes(bytes, name));
    assert!(memory < 64 * bytes.len() + 10_000, "{memory} bytes for a file of {}", bytes.len());
    match &parsed {
        Ok(mesh) => {
            let points = mesh.points.len();
            assert!(mesh.triangles.as_flattened().iter().all(|&i| (i as usize) < points));
            assert!(mesh.segments.as_flattened().iter().all(|&i| (i as usize) < points));
            assert!(mesh.points.as_flattened().iter().all(|x| x.is_finite()));
            assert_eq!(mesh.triangles.len(), mesh.polygons.len());
        }
        Err(error) => {
            let message = error.to_string();
            assert!(message.chars().count() < 200 && !message.contains(char::is_control), "{message:?}");
        }
    }
    parsed
}

fn samples() -> Vec<(Vec<u8>, &'static str)> {
    let mut random = Random::new(1);
    let polygons = Model::random(&mut random, 8, 6, 7);
    let triangles = Model::random(&mut random, 5, 4, 3);
    let strips = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element tristrips 1\nproperty list int int vertex_indices\nelement edge 1\nproperty int vertex1\n\
        property int vertex2\nend_header\n0 0 0\n1 0 0\n0 1 0\n5 0 1 2 -1 0\n0 2\n";
    let obj = format!("# c\r\n{}l 1 -2 \\\n 3\ng a\nf 1/1/1 2//2 -1/3", polygons.obj());
    vec![
        (obj.into_bytes(), "a.obj"),
        (polygons.ply("ascii"), "a.ply"),
        (polygons.ply("binary_little_endian"), "a.ply"),
        (polygons.ply("binary_big_endian"), "a.ply"),
        (strips.into(), "a.ply"),
        (polygons.off().into_bytes(), "a.off"),
        (polygons.off().replacen("OFF", "STCNOFF # c", 1).into_bytes(), "a.off"),
        (triangles.stl_text().into_bytes(), "a.stl"),
        (triangles.stl_binary("solid"), "a.stl"),
    ]
}

#[test]
fn files_cut_short_anywhere_are_survived() {
    for (bytes, name) in samples() {
        survive(&bytes, name).unwrap();
        for end in 0..bytes.len() {
            let _ = survive(&bytes[..end], name);
        }
    }
}

#[test]
fn binary_files_and_closed_texts_notice_every_missing_byte_of_data() {
    for (bytes, name) in samples().into_iter().filter(|(bytes, _)| bytes[0] != b'#') {
        let text = bytes.iter().all(|&b| b != 0);
        // A text may lose the end of its last line, word or number unnoticed.
        let end = bytes.len() - if text { 25 } else { 0 };
        for end in bytes.len() / 2..end {
            assert!(survive(&bytes[..end], name).is_err(), "{name} cut at {end} of {}", bytes.len());
        }
    }
}

#[test]
fn damaged_files_are_survived() {
    let mut random = Random::new(2);
    let tokens = [
        "-1",
        "0",
        "4294967295",
        "4294967296",
        "18446744073709551616",
        "1e999",
        "nan",
        "\n",
        "\r",
        "\\\n",
        "#",
        " ",
        "list",
        "OFF",
        "4nOFF BINARY",
        "element face 4294967295\n",
        "f 1 1 1 1 1\n",
        "\0",
        "solid\n",
        "property list double double vertex_indices\n",
        "//",
    ];
    for (sample, name) in samples() {
        for _ in 0..4000 {
            let mut bytes = sample.clone();
            for _ in 0..1 + random.below(4) {
                let at = random.below(bytes.len());
                match random.below(4) {
                    0 => bytes[at] ^= 1 << random.below(8),
                    1 => bytes[at] = random.bits() as u8,
                    2 => drop(bytes.splice(at..at, random.pick(&tokens).bytes())),
                    _ => {
                        let to = (at + random.below(20)).min(bytes.len() - 1);
                        bytes.drain(at..to);
                    }
                }
            }
            let _ = survive(&bytes, name);
        }
    }
}

#[test]
fn other_files_get_one_clear_line() {
    let not = "not an OBJ, PLY, STL or OFF mesh";
    for (bytes, message) in [
        (&b""[..], format!("{not}: an empty file")),
        (b"<!DOCTYPE html>\n<p>\nv 1 2 3\n", format!("{not}: an HTML or XML page")),
        (b"\n <?xml version='1.0'?>", format!("{not}: an HTML or XML page")),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", format!("{not}: a PNG image")),
        (
            b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12\n",
            format!("{not}: a git-lfs pointer, fetch the file itself with `git lfs pull`"),
        ),
        (b"\xff\xfev\0 \0", format!("{not}: UTF-16 text, save it as UTF-8")),
        (b"dear diary\nvery little today\n", not.to_string()),
        (b"# only words\n", not.to_string()),
        (b"plywood\n", not.to_string()),
        (b"solid ground\nfor walking\n", not.to_string()),
        (b"\0\0\0\0", not.to_string()),
    ] {
        assert_eq!(survive(bytes, "x.obj").unwrap_err().to_string(), format!("x.obj: {message}"));
    }
    let error = read(Path::new("no/such/file.obj")).unwrap_err();
    assert!(error.to_string().starts_with("no/such/file.obj: "), "{error}");
    assert_eq!(
        survive(b"", "a\x1b[2J.obj").unwrap_err().to_string(),
        format!("a\u{fffd}[2J.obj: {not}: an empty file")
    );
}

#[test]
fn counts_without_data_cost_nothing() {
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for element in
            ["element vertex", "element face", "element void", "element vertex 1\nproperty char x\nelement face"]
        {
            for property in ["", "property list uchar int vertex_indices\n", "property float x\n"] {
                for count in ["1000000000", "4294967296", "18446744073709551615"] {
                    let text = format!("ply\nformat {encoding} 1.0\n{element} {count}\n{property}end_header\n0 0 0\n");
                    assert!(survive(text.as_bytes(), "a.ply").is_err(), "{text}");
                }
            }
        }
    }
    for count in ["1000000000", "4294967296", "18446744073709551615", "99999999999999999999"] {
        for counts in [format!("{count} 0 0"), format!("0 {count} 0"), format!("1 1 {count}\n0 0 0\n{count}")] {
            let text = format!("OFF\n{counts}\n0 0 0\n");
            assert!(survive(text.as_bytes(), "a.off").is_err(), "{text}");
        }
    }
    let list =
        b"ply\nformat binary_little_endian 1.0\nelement a 1\nproperty list uint double b\nend_header\n\xff\xff\xff\xff";
    let wanted = "a.ply, a 0: expected 34359738360 more bytes, found 0 at the end of the file";
    assert_eq!(survive(list, "a.ply").unwrap_err().to_string(), wanted);
}

/// A polygon whose corners nearly all point inwards: two combs, tooth in gap.
fn comb(teeth: usize) -> String {
    let mut text = String::new();
    for i in 0..teeth {
        let x = i as f64;
        text += &format!("v {x} 0 0\nv {} 1 0\n", x + 0.4);
    }
    for i in (0..teeth).rev() {
        let x = i as f64;
        text += &format!("v {} 1.5 0\nv {} 0.5 0\n", x + 0.5, x + 0.1);
    }
    text + "f" + &(1..=4 * teeth).map(|i| format!(" {i}")).collect::<String>()
}

#[test]
fn polygons_of_many_corners_end_in_time() {
    for (teeth, repeated) in [(2_000, 1), (2_400, 10), (250_000, 1)] {
        let text = comb(teeth);
        let face = text.find('f').unwrap();
        let text = format!("{}{}", &text[..face], format!("{}\n", &text[face..]).repeat(repeated));
        let start = Instant::now();
        let mesh = survive(text.as_bytes(), "a.obj").unwrap();
        println!("{teeth} {repeated} {:?} {:?}", start.elapsed(), mesh.polygon_counts);
        assert!(start.elapsed() < Duration::from_secs(60));
        assert_eq!(mesh.triangles.len(), repeated * (4 * teeth - 2));
    }
}

#[test]
fn polygons_that_touch_themselves_end_in_time() {
    let mut random = Random::new(3);
    for lattice in [2, 3, 10, 40] {
        let points: String = (0..lattice * lattice).map(|i| format!("v {} {} 0\n", i % lattice, i / lattice)).collect();
        let corners: String = (0..9_000).map(|_| format!(" {}", 1 + random.below(lattice * lattice))).collect();
        let twice: String =
            (1..=lattice * lattice).map(|i| format!(" {i}").repeat(4_000 / (lattice * lattice))).collect();
        let start = Instant::now();
        let mesh = survive(format!("{points}f{corners}\nf{twice}").as_bytes(), "a.obj").unwrap();
        println!("{lattice} {:?} {:?}", start.elapsed(), mesh.polygon_counts);
        assert!(start.elapsed() < Duration::from_secs(60));
    }
}

/// The product of its extents underflows when it is divided by the number of corners: yet the grid of its corners has about one cell for
/// each, and not its square.
#[test]
fn a_tiny_polygon_of_many_corners_takes_no_more_than_a_large_one() {
    let text = comb(5_000);
    let scaled = |scale: f64| {
        let line = |line: &str| match line.strip_prefix("v ") {
            Some(point) => {
                let scaled: Vec<String> =
                    point.split(' ').map(|x| format!("{:e}", x.parse::<f64>().unwrap() * scale)).collect();
                format!("v {}\n", scaled.join(" "))
            }
            None => format!("{line}\n"),
        };
        let text: String = text.lines().map(line).collect();
        let (mesh, peak) = peak_of(|| survive(text.as_bytes(), "a.obj").unwrap());
        assert_eq!(mesh.triangles.len(), 4 * 5_000 - 2, "{scale}");
        peak
    };
    let large = scaled(1.0);
    for scale in [1e-150, 1e-158, 1e-161, 1e-162, 1e-165] {
        let tiny = scaled(scale);
        assert!(tiny < 2 * large, "{scale}: {tiny} bytes, {large} at full size");
    }
}

#[test]
fn huge_and_tiny_coordinates_are_survived() {
    for scale in ["e300", "e-300", "e308", "e-320", "e160", "e-160"] {
        let text: String = [(0, 0), (4, 0), (4, 4), (2, 1), (1, 0), (0, 4), (1, 1)]
            .iter()
            .map(|(x, y)| format!("v 0.{x}{scale} 0.{y}{scale} -0.{x}{scale}\n"))
            .collect();
        let mesh = survive(format!("{text}f 1 2 3 4 5 6 7\nf 7 6 5 4 3 2 1").as_bytes(), "a.obj").unwrap();
        assert_eq!(mesh.triangles.len(), 10);
    }
}
