//! Meshes written as OBJ, PLY, STL or OFF; shortest decimal numbers in text, so that all but STL keep every bit.

use std::fmt::{self, Write as _};
use std::io;
use std::path::Path;

use sdf_core::nalgebra::Vector3;

use super::MeshFormat;
use crate::atomic_write::atomic_write;

impl MeshFormat {
    /// The format of a name that ends in obj, ply, stl or off.
    pub fn from_extension(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            "stl" => Some(Self::Stl),
            "off" => Some(Self::Off),
            _ => None,
        }
    }
}

/// Writes a mesh whole or not at all: OBJ and OFF as text, PLY and STL in binary, little-endian. STL rounds to f32.
///
/// # Errors
/// `InvalidInput` if a triangle names a point that is not there, or a coordinate is NaN, infinite, or in STL beyond f32.
pub fn write(path: &Path, format: MeshFormat, points: &[[f64; 3]], triangles: &[[u32; 3]]) -> io::Result<()> {
    let bytes = to_bytes(format, points, triangles)?;
    atomic_write(path, |temporary| std::fs::write(temporary, bytes))
}

/// The bytes that [`write()`] would write.
pub fn to_bytes(format: MeshFormat, points: &[[f64; 3]], triangles: &[[u32; 3]]) -> io::Result<Vec<u8>> {
    check(format, points, triangles)?;
    Ok(match format {
        MeshFormat::Obj => obj(points, triangles).into_bytes(),
        MeshFormat::Ply => ply(points, triangles),
        MeshFormat::Stl => stl(points, triangles),
        MeshFormat::Off => off(points, triangles).into_bytes(),
    })
}

/// Refuses what the readers would refuse.
fn check(format: MeshFormat, points: &[[f64; 3]], triangles: &[[u32; 3]]) -> io::Result<()> {
    let invalid = |message| Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    let is_written = |x: &f64| if format == MeshFormat::Stl { (*x as f32).is_finite() } else { x.is_finite() };
    if let Some(point) = points.iter().position(|point| !point.iter().all(is_written)) {
        return invalid(format!("point {point} has a coordinate that is not finite or too large for the format"));
    }
    let is_missing = |index: &u32| *index as usize >= points.len();
    if let Some(triangle) = triangles.iter().position(|corners| corners.iter().any(is_missing)) {
        return invalid(format!("triangle {triangle} names a point that is not among the {}", points.len()));
    }
    match u32::try_from(triangles.len()) {
        Err(_) if format == MeshFormat::Stl => invalid("STL has at most 2^32 - 1 triangles".to_owned()),
        _ => Ok(()),
    }
}

/// How many triangles with an area have none in a file of this format: STL rounds their corners to f32.
pub fn flattened(format: MeshFormat, points: &[[f64; 3]], triangles: &[[u32; 3]]) -> usize {
    if format != MeshFormat::Stl {
        return 0;
    }
    let area = |corners: [[f64; 3]; 3]| {
        let [a, b, c] = corners.map(Vector3::from);
        (b - a).cross(&(c - a))
    };
    let is_flattened = |corners: &&[u32; 3]| {
        let corners = corners.map(|index| points[index as usize]);
        let rounded = corners.map(|corner| corner.map(|x| f64::from(x as f32)));
        area(corners) != Vector3::zeros() && area(rounded) == Vector3::zeros()
    };
    triangles.iter().filter(is_flattened).count()
}

fn obj(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    for [x, y, z] in points.iter().map(|point| point.map(Short)) {
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for [a, b, c] in triangles.iter().map(|corners| corners.map(|index| u64::from(index) + 1)) {
        let _ = writeln!(text, "f {a} {b} {c}");
    }
    text
}

fn off(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> String {
    let mut text = format!("OFF\n{} {} 0\n", points.len(), triangles.len());
    for [x, y, z] in points.iter().map(|point| point.map(Short)) {
        let _ = writeln!(text, "{x} {y} {z}");
    }
    for [a, b, c] in triangles {
        let _ = writeln!(text, "3 {a} {b} {c}");
    }
    text
}

/// The shortest digits that read back the same; with an exponent where the plain digits would be many zeros.
struct Short(f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(x) = self;
        let is_plain = *x == 0.0 || (1e-5..1e16).contains(&x.abs());
        if is_plain { write!(f, "{x}") } else { write!(f, "{x:e}") }
    }
}

fn ply(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<u8> {
    let axes = ["x", "y", "z"].map(|axis| format!("property double {axis}\n")).concat();
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{axes}element face {}\n\
         property list uchar uint vertex_indices\nend_header\n",
        points.len(),
        triangles.len()
    );
    let mut bytes = header.into_bytes();
    bytes.extend(points.iter().flatten().flat_map(|x| x.to_le_bytes()));
    for corners in triangles {
        bytes.push(3);
        bytes.extend(corners.iter().flat_map(|index| index.to_le_bytes()));
    }
    bytes
}

fn stl(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for corners in triangles {
        let [a, b, c] = corners.map(|index| Vector3::from(points[index as usize]));
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
        let numbers = [normal, a, b, c];
        bytes.extend(numbers.iter().flat_map(|vector| vector.iter()).flat_map(|x| (*x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::read_bytes;

    #[test]
    fn a_written_mesh_reads_back_the_same() {
        let points = [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 2.25, -0.125], [0.5, 0.5, 3.0]];
        let triangles = [[0, 1, 2], [0, 2, 3], [1, 3, 2]];
        for format in [MeshFormat::Obj, MeshFormat::Ply, MeshFormat::Stl, MeshFormat::Off] {
            let bytes = to_bytes(format, &points, &triangles).unwrap();
            let mesh = read_bytes(&bytes, "written").unwrap();
            assert_eq!((mesh.points.as_slice(), mesh.triangles.as_slice()), (&points[..], &triangles[..]));
        }
    }

    #[test]
    fn a_mesh_that_the_readers_would_refuse_is_not_written() {
        let points = [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 2.25, -0.125]];
        for format in [MeshFormat::Obj, MeshFormat::Ply, MeshFormat::Stl, MeshFormat::Off] {
            let refused = |points: &[[f64; 3]], triangles: &[[u32; 3]]| {
                let error = to_bytes(format, points, triangles).unwrap_err();
                assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{format:?}");
                error.to_string()
            };
            let missing = refused(&points, &[[0, 1, 2], [0, 1, 3]]);
            assert_eq!(missing, "triangle 1 names a point that is not among the 3");
            for x in [f64::NAN, f64::INFINITY] {
                let not_finite = [points[0], [0.0, x, 0.0], points[2]];
                assert!(refused(&not_finite, &[[0, 1, 2]]).starts_with("point 1 has a coordinate"), "{format:?}");
            }
        }
        assert!(to_bytes(MeshFormat::Stl, &[[1e39, 0.0, 0.0]], &[]).is_err());
    }

    #[test]
    fn triangles_that_stl_flattens_are_counted() {
        let triangle =
            |offset: f64| [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]].map(|p| p.map(|x| x + offset));
        let count = |format, offset| flattened(format, &triangle(offset), &[[0, 1, 2], [0, 0, 1]]);
        assert_eq!([0.0, 1.0, 1e6].map(|offset| count(MeshFormat::Stl, offset)), [0, 0, 1]);
        assert_eq!([MeshFormat::Obj, MeshFormat::Ply, MeshFormat::Off].map(|format| count(format, 1e6)), [0; 3]);
    }

    #[test]
    fn tiny_and_huge_numbers_are_short_and_read_back_the_same() {
        let points = [[1e-30, -2.5e-300, 1e300], [1e-5, 123456.75, 5e-324], [-0.0, 1e15, 0.1]];
        for format in [MeshFormat::Obj, MeshFormat::Off] {
            let text = String::from_utf8(to_bytes(format, &points, &[[0, 1, 2]]).unwrap()).unwrap();
            assert!(text.contains("1e-30 -2.5e-300 1e300\n") && text.contains("0.00001 123456.75 5e-324\n"), "{text}");
            assert_eq!(read_bytes(text.as_bytes(), "written").unwrap().points, points);
        }
    }
}
