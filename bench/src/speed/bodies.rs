//! Bodies that are baked, and the cloth that is laid over them.

use sdf_procedural::{Bowl, Mesh, Pot, Sheet, SpikedBall};

/// Two closed shells that intersect: signs come from winding numbers.
pub const POT: &str = "pot";
/// One closed shell: signs come from pseudo-normals.
pub const BOWL: &str = "bowl";

/// [`POT`] or [`BOWL`] with about this number of triangles.
pub fn body(name: &str, triangles: usize) -> Mesh {
    let steps = |shells: f64| (triangles as f64 / (2.0 * shells)).sqrt().round().max(3.0) as u32;
    match name {
        BOWL => Bowl { slices: steps(1.0), stacks: steps(1.0) + 1, thickness: 0.2 }.mesh(),
        _ => Pot { slices: steps(2.0), stacks: steps(2.0) + 1 }.mesh(),
    }
}

/// The body of bench/scenes/dragon.toml: thin spikes all over.
pub fn spiked_ball() -> Mesh {
    SpikedBall { levels: 4, radius: 0.8 }.mesh()
}

/// The cloth of bench/scenes/dragon.toml: as many faces as in the paper's dragon scene.
pub fn cloth() -> Mesh {
    cloth_of([199, 99])
}

/// The same cloth with about this number of faces.
pub fn cloth_with_faces(faces: usize) -> Mesh {
    let side = (faces as f64).sqrt() * 0.5;
    cloth_of([2.0 * side, side].map(|cells| cells.round().max(1.0) as u32))
}

fn cloth_of(cells: [u32; 2]) -> Mesh {
    Sheet { cells, size: [2.4, 2.4], height: 0.9, bend: 0.45, floor: -0.6, holes: None, faces: None }.mesh()
}
