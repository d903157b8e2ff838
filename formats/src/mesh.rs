//! Triangle meshes from OBJ, PLY, STL and OFF files.
//!
//! Files are untrusted: none makes a reader panic, hang, or take memory out of proportion to the file's size.
//!
//! | question | file |
//! |---|---|
//! | Which format is it? | `sniff` |
//! | What do its elements say? | `obj`, `ply_header` and `ply`, `stl`, `off` |
//! | Which tokens and numbers does a text have? | `text`, `number` |
//! | How does an OBJ file avoid being held whole? | `streamed` |
//! | How do polygons become triangles? | `polygons`, `triangulate`, `reflex_grid` |
//!
//! ```
//! let text = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
//! let mesh = sdf_formats::mesh::read_bytes(text, "square.obj")?;
//! assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
//! # Ok::<(), sdf_formats::mesh::MeshError>(())
//! ```

mod edges;
mod error;
mod number;
mod obj;
mod off;
mod ply;
mod ply_header;
mod polygons;
mod reflex_grid;
mod sniff;
mod stl;
mod streamed;
mod text;
mod triangulate;
mod write;

pub use error::{Location, MeshError, MeshFault};
pub use sniff::format_of;
pub use write::{flattened, to_bytes, write};

use std::fmt::{self, Display, Formatter};
use std::path::Path;

/// Contents of a mesh file.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// The format that the content has.
    pub format: MeshFormat,
    /// In file order, finite, at least one; f32 coordinates are converted exactly. From STL: in order of first
    /// appearance, equal corners welded.
    pub points: Vec<[f64; 3]>,
    /// Indices of points, in file order, with the polygon's orientation. A polygon with n corners gives n - 2
    /// triangles, even if some have no area.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle, the index of its polygon in the file, counted from 0.
    pub polygons: Vec<u32>,
    /// Line elements in file order: OBJ's `l`, split into segments, PLY's `edge`, and OFF's faces of two corners.
    pub segments: Vec<[u32; 2]>,
    /// Number of groups (`o` or `g`) or solids with at least one polygon; at least 1.
    pub objects: usize,
    /// Polygons by the way in which they were triangulated.
    pub polygon_counts: PolygonCounts,
}

/// Number of polygons in a file, by the way in which they became triangles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PolygonCounts {
    /// Number of all polygons.
    pub total: usize,
    /// Polygons with more than three corners.
    pub larger: usize,
    /// Larger polygons cut ear by ear, because a fan from the first corner does not fill them. Ears of one that lies over itself overlap.
    pub ear_clipped: usize,
    /// Larger polygons cut into a fan that may overlap: without area, with edges that cross so that no ear is left, or one of those that hide so much
    /// from each other that cutting them takes more than half a second.
    pub unverified: usize,
}

/// A format of mesh files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshFormat {
    /// Wavefront OBJ, text.
    Obj,
    /// PLY, text or binary.
    Ply,
    /// STL, text or binary.
    Stl,
    /// OFF, text.
    Off,
}

/// Reads a mesh file. An OBJ file with LF line ends is read in blocks, so that only a little of its text is in memory.
/// To do more with the bytes, such as hashing them, use [`read_bytes`].
pub fn read(path: &Path) -> Result<Mesh, MeshError> {
    let name = path.display().to_string();
    match streamed::read(path, &name) {
        Ok(mesh) => mesh,
        Err(source) => Err(MeshError::Unreadable { file: name, source }),
    }
}

/// Reads a mesh from the bytes of a file. Errors show `name`. The content decides the format; the name does so only if
/// the content does not suffice, as for a binary STL file cut short.
///
/// A mesh may have points and no triangles: see [`Mesh::require_triangles`].
pub fn read_bytes(bytes: &[u8], name: &str) -> Result<Mesh, MeshError> {
    let parsed = match sniff::kind(bytes, name) {
        Ok(sniff::FileKind::Obj) => obj::parse(bytes),
        Ok(sniff::FileKind::Ply) => ply::parse(bytes),
        Ok(sniff::FileKind::StlText) => stl::parse_text(bytes),
        Ok(sniff::FileKind::StlBinary) => stl::parse_binary(bytes),
        Ok(sniff::FileKind::Off) => off::parse(bytes),
        Err(hint) => return Err(MeshError::NotAMesh { file: name.into(), hint }),
    };
    checked(parsed, name)
}

fn checked(parsed: Result<Mesh, MeshFault>, name: &str) -> Result<Mesh, MeshError> {
    let mesh = parsed.map_err(|fault| MeshError::Malformed { file: name.into(), fault })?;
    if mesh.points.is_empty() {
        let what = if mesh.format == MeshFormat::Stl { "triangles" } else { "points" };
        return Err(MeshError::Empty { file: name.into(), what });
    }
    Ok(mesh)
}

impl Mesh {
    /// An error if the mesh has no triangles, only points or segments.
    pub fn require_triangles(&self, name: &str) -> Result<(), MeshError> {
        if self.triangles.is_empty() {
            return Err(MeshError::Empty { file: name.into(), what: "triangles" });
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
            Self::Off => "OFF",
        })
    }
}

/// The index of the next point after `points` points; an error if there are too many.
#[inline]
fn point_index(points: usize) -> Result<u32, MeshFault> {
    match u32::try_from(points) {
        Ok(index) if index < u32::MAX => Ok(index),
        _ => Err(MeshFault::whole_file(format!("at most {} points", u32::MAX), "more")),
    }
}
