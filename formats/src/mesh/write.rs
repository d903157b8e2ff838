//! Meshes written as OBJ, PLY or STL; shortest decimal numbers in text, so that OBJ and PLY keep every bit.

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use sdf_core::nalgebra::Vector3;

use super::MeshFormat;
use crate::atomic_write::atomic_write;

impl MeshFormat {
    /// The format of a name that ends in obj, ply or stl.
    pub fn from_extension(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            "stl" => Some(Self::Stl),
            _ => None,
        }
    }
}

/// Writes a mesh whole or not at all: OBJ as text, PLY and STL in binary, little-endian. STL rounds to f32.
pub fn write(path: &Path, format: MeshFormat, points: &[[f64; 3]], triangles: &[[u32; 3]]) -> io::Result<()> {
    let bytes = to_bytes(format, points, triangles)?;
    atomic_write(path, |temporary| std::fs::write(temporary, bytes))
}

/// The bytes that [`write()`] would write.
pub fn to_bytes(format: MeshFormat, points: &[[f64; 3]], triangles: &[[u32; 3]]) -> io::Result<Vec<u8>> {
    Ok(match format {
        MeshFormat::Obj => obj(points, triangles).into_bytes(),
        MeshFormat::Ply => ply(points, triangles),
        MeshFormat::Stl => stl(points, triangles)?,
    })
}

fn obj(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    for [x, y, z] in points {
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for [a, b, c] in triangles.iter().map(|corners| corners.map(|index| u64::from(index) + 1)) {
        let _ = writeln!(text, "f {a} {b} {c}");
    }
    text
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

fn stl(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> io::Result<Vec<u8>> {
    let count = u32::try_from(triangles.len())
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidInput, "STL has at most 2^32 - 1 triangles"))?;
    let mut bytes = vec![b' '; 80];
    bytes.extend(count.to_le_bytes());
    for corners in triangles {
        let [a, b, c] = corners.map(|index| Vector3::from(points[index as usize]));
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
        let numbers = [normal, a, b, c];
        bytes.extend(numbers.iter().flat_map(|vector| vector.iter()).flat_map(|x| (*x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::read_bytes;

    #[test]
    fn a_written_mesh_reads_back_the_same() {
        let points = [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 2.25, -0.125], [0.5, 0.5, 3.0]];
        let triangles = [[0, 1, 2], [0, 2, 3], [1, 3, 2]];
        for format in [MeshFormat::Obj, MeshFormat::Ply, MeshFormat::Stl] {
            let bytes = to_bytes(format, &points, &triangles).unwrap();
            let mesh = read_bytes(&bytes, "written").unwrap();
            assert_eq!((mesh.points.as_slice(), mesh.triangles.as_slice()), (&points[..], &triangles[..]));
        }
    }
}
