//! Meshes of a scene file: by formula, or from a file.

use std::path::{Path, PathBuf};

use sdf_procedural::{Bowl, Cuboid, Mesh, Pot, Rope, Serpent, Sheet, SpikedBall};
use serde::Deserialize;

/// A mesh by formula, or a file.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum MeshSpec {
    /// A cloth or net over the origin.
    Sheet(Sheet),
    /// A ball with spikes.
    SpikedBall(SpikedBall),
    /// A long winding body with spines.
    Serpent(Serpent),
    /// Half of a hollow ball.
    Bowl(Bowl),
    /// A pot with a spout.
    Pot(Pot),
    /// A box.
    Cuboid(Cuboid),
    /// Strings.
    Rope(Rope),
    /// An OBJ, PLY, STL or OFF file, beside the scene's own.
    File(PathBuf),
}

/// Most points of a mesh by formula.
const MAX_POINTS: f64 = 1e7;

impl MeshSpec {
    /// The mesh; files are looked for in `folder`.
    pub(super) fn mesh(&self, folder: &Path) -> Result<Mesh, String> {
        let points = match self {
            Self::Sheet(sheet) => f64::from(sheet.cells[0]) * f64::from(sheet.cells[1]),
            Self::SpikedBall(ball) => 4_f64.powf(f64::from(ball.levels)),
            Self::Serpent(serpent) => f64::from(serpent.rings) * f64::from(serpent.slices),
            Self::Bowl(bowl) => f64::from(bowl.slices) * f64::from(bowl.stacks),
            Self::Pot(pot) => f64::from(pot.slices) * f64::from(pot.stacks),
            Self::Rope(rope) => f64::from(rope.strands) * f64::from(rope.edges),
            Self::Cuboid(_) | Self::File(_) => 0.0,
        };
        if points > MAX_POINTS {
            return Err(format!("a mesh of about {points:.0} points: take less than {MAX_POINTS:.0}"));
        }
        Ok(match self {
            Self::Sheet(sheet) => sheet.mesh(),
            Self::SpikedBall(ball) => ball.mesh(),
            Self::Serpent(serpent) => serpent.mesh(),
            Self::Bowl(bowl) => bowl.mesh(),
            Self::Pot(pot) => pot.mesh(),
            Self::Cuboid(cuboid) => cuboid.mesh(),
            Self::Rope(rope) => rope.mesh(),
            Self::File(path) => {
                let mesh = sdf_formats::mesh::read(&folder.join(path)).map_err(|error| error.to_string())?;
                Mesh { points: mesh.points, triangles: mesh.triangles, segments: mesh.segments }
            }
        })
    }
}
