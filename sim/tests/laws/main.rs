//! Laws of the simulator: free motion, sliding and rolling friction, walls, sheets at rest, stiff, entangled or split ones, soft
//! bodies, also those that carry a sheet, two bodies exchanged, bodies that pass by or are struck, rigid surfaces that are
//! remembered, overlaps undone, boxes that stand on each other, messages of scenes and refusals, figures, recordings.

mod caged;
mod contacts;
mod entangled;
mod figures;
mod messages;
mod motion;
mod parting;
mod passing;
mod recordings;
mod recovery;
mod reduce;
mod refusals;
mod remembered;
mod rigid_memory;
mod rolling;
mod seams;
mod sheets;
mod soft;
mod standing;
mod struck;
mod toward;

use sdf_core::nalgebra::Vector3;

type V3 = Vector3<f64>;

const GRAVITY: f64 = 9.81;

fn falling() -> sdf_sim::World {
    sdf_sim::World::new([0.0, 0.0, -GRAVITY])
}

/// A box of twelve faces.
fn cuboid(half: [f64; 3]) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let corner = |index: u32| std::array::from_fn(|axis| if index >> axis & 1 == 1 { half[axis] } else { -half[axis] });
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
    ((0..8).map(corner).collect(), faces.collect())
}
