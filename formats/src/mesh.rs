//! Triangle meshes from OBJ, PLY and STL files.
//!
//! A file is untrusted: none makes a reader panic, hang, or take memory out of proportion to the file's size.
//!
//! ```
//! let text = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
//! let mesh = sdf_formats::mesh::parse(text, "square.obj")?;
//! assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
//! # Ok::<(), sdf_formats::mesh::MeshError>(())
//! ```

mod edges;
mod error;
mod number;
mod obj;
mod ply;
mod ply_header;
mod polygons;
mod sniff;
mod stl;
mod streamed;
mod text;
mod triangulate;
mod write;

pub use error::{Fault, MeshError, Place};
pub use write::write;

use std::fmt::{self, Display, Formatter};
use std::path::Path;

/// What a mesh file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    pub format: MeshFormat,
    /// In file order, finite; at least one. What a file holds as f32 is exact. Of an STL file, in order of first
    /// appearance, with equal corners welded.
    pub points: Vec<[f64; 3]>,
    /// Indices of points, in file order, in the winding of the polygon. One with n corners gives n - 2 triangles, also
    /// where some have no area.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle the polygon of the file that it comes from, counted from 0.
    pub polygons: Vec<u32>,
    /// OBJ's `l`, a polyline as one segment after another, and PLY's `edge`, in file order.
    pub segments: Vec<[u32; 2]>,
    /// The groups (`o` or `g`, whichever came last) or solids with at least one polygon; 1 where the file has none.
    pub objects: usize,
    pub polygon_counts: PolygonCounts,
}

/// How the polygons of a file became triangles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PolygonCounts {
    pub all: usize,
    /// With more than three corners.
    pub larger: usize,
    /// Of the larger, those that no fan from the first corner fills: cut ear by ear.
    pub clipped: usize,
    /// Of the larger, those cut into a fan though nothing shows it right: without area, with crossing edges, or concave
    /// with more than 10,000 corners. Their triangles may overlap.
    pub blind: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshFormat {
    Obj,
    Ply,
    Stl,
}

/// Reads a file once, and parses it: of an OBJ file whose lines end in LF without holding more than a little of its text. To do
/// more with its bytes, such as hashing them, read it and call [`parse`].
pub fn read(path: &Path) -> Result<Mesh, MeshError> {
    let name = path.display().to_string();
    match streamed::read(path, &name) {
        Ok(mesh) => mesh,
        Err(source) => Err(MeshError::Unreadable { file: name, source }),
    }
}

/// The mesh that the bytes of a file hold. The content decides on the format; the name, which messages show too, does
/// so only where the content is not enough, as for an STL file cut short.
///
/// A mesh without triangles is returned where it has points: see [`Mesh::require_triangles`].
pub fn parse(bytes: &[u8], name: &str) -> Result<Mesh, MeshError> {
    let parsed = match sniff::kind(bytes, name) {
        Ok(sniff::Kind::Obj) => obj::parse(bytes),
        Ok(sniff::Kind::Ply) => ply::parse(bytes),
        Ok(sniff::Kind::StlText) => stl::parse_text(bytes),
        Ok(sniff::Kind::StlBinary) => stl::parse_binary(bytes),
        Err(likely) => return Err(MeshError::NotAMesh { file: name.into(), likely }),
    };
    checked(parsed, name)
}

fn checked(parsed: Result<Mesh, Fault>, name: &str) -> Result<Mesh, MeshError> {
    let mesh = parsed.map_err(|fault| MeshError::Malformed { file: name.into(), fault })?;
    if mesh.points.is_empty() {
        let what = if mesh.format == MeshFormat::Stl { "triangles" } else { "points" };
        return Err(MeshError::Nothing { file: name.into(), what });
    }
    Ok(mesh)
}

impl Mesh {
    /// An error that says so where the mesh has no triangles, only points or segments.
    pub fn require_triangles(&self, name: &str) -> Result<(), MeshError> {
        if self.triangles.is_empty() {
            return Err(MeshError::Nothing { file: name.into(), what: "triangles" });
        }
        Ok(())
    }
}

impl Display for MeshFormat {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Stl => "STL",
        })
    }
}

/// The index of a point that comes after so many.
#[inline]
fn point_index(points: usize) -> Result<u32, Fault> {
    match u32::try_from(points) {
        Ok(index) if index < u32::MAX => Ok(index),
        _ => Err(Fault::of_file(format!("at most {} points", u32::MAX), "more")),
    }
}
