//! What is baked and what is laid over it, made by formula.

use sdf_formats::mesh::{Mesh, MeshFormat, PolygonCounts};

use crate::mesh_input::MeshInput;
use crate::models::{Bowl, Model, Pot, Sheet, SpikedBall};

/// Two closed shells that pass through each other: its signs are told by winding numbers.
pub const POT: &str = "pot";
/// One closed shell: its signs are told by pseudo-normals.
pub const BOWL: &str = "bowl";

/// A body of about so many triangles.
pub fn body(name: &str, triangles: usize) -> MeshInput {
    let along = |shells: f64| (triangles as f64 / (2.0 * shells)).sqrt().round().max(3.0) as u32;
    let model = match name {
        BOWL => Bowl { around: along(1.0), along: along(1.0) + 1, thickness: 0.2 }.model(),
        _ => Pot { around: along(2.0), along: along(2.0) + 1 }.model(),
    };
    input(name, model)
}

/// Thin spikes all over, as in scenes/dragon.toml.
pub fn spiked_ball() -> MeshInput {
    input("spiked ball", SpikedBall { levels: 4, radius: 0.8 }.model())
}

/// As many faces as the paper's dragon scene has, draped over the ball with spikes.
pub fn cloth() -> Mesh {
    mesh(
        Sheet { cells: [199, 99], size: [2.4, 2.4], height: 0.9, bend: 0.45, floor: -0.6, holes: None, faces: None }
            .model(),
    )
}

fn input(name: &str, model: Model) -> MeshInput {
    MeshInput::new(name.to_owned(), mesh(model), [0; 32])
}

fn mesh(model: Model) -> Mesh {
    let Model { points, triangles, segments } = model;
    Mesh {
        format: MeshFormat::Obj,
        polygons: (0..triangles.len() as u32).collect(),
        polygon_counts: PolygonCounts { total: triangles.len(), ..PolygonCounts::default() },
        objects: 1,
        points,
        triangles,
        segments,
    }
}
