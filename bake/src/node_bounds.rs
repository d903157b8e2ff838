use rayon::prelude::*;
use sdf_core::grid::sparse::BRICK;
use sdf_core::grid::{Lattice, NodeBounds, cell_slope};

/// What is certain of the nodes of a place of 8 × 8 × 8, nodes beyond the lattice not counted.
pub(crate) fn node_bounds(lattice: &Lattice, place: [u32; 3], value: impl Fn([u32; 3]) -> f32) -> NodeBounds {
    /// With one more on each side, for the cells that have a corner in the place.
    const SIDE: usize = BRICK as usize + 2;
    let own = place.map(|n| n * BRICK);
    let first = own.map(|n| n.saturating_sub(1));
    let counts: [usize; 3] =
        std::array::from_fn(|axis| ((own[axis] + BRICK + 1).min(lattice.nodes()[axis]) - first[axis]) as usize);
    let index = |[x, y, z]: [usize; 3]| (z * SIDE + y) * SIDE + x;
    let mut bounds = NodeBounds { least: f32::INFINITY, greatest: f32::NEG_INFINITY, slope: 0.0 };
    let mut values = [0.0_f32; SIDE * SIDE * SIDE];
    for step in steps(counts) {
        let node: [u32; 3] = std::array::from_fn(|axis| first[axis] + step[axis] as u32);
        let value = value(node);
        values[index(step)] = value;
        if (0..3).all(|axis| node[axis] / BRICK == place[axis]) {
            bounds = NodeBounds { least: bounds.least.min(value), greatest: bounds.greatest.max(value), ..bounds };
        }
    }
    let slope_of = |[x, y, z]: [usize; 3]| {
        let corner = |corner: usize| values[index([x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)])];
        cell_slope(std::array::from_fn(corner), lattice.spacing())
    };
    let steepest = steps(counts.map(|count| count - 1)).map(slope_of).fold(0.0, f64::max);
    NodeBounds { slope: round_up(steepest), ..bounds }
}

fn steps([x, y, z]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..z).flat_map(move |k| (0..y).flat_map(move |j| (0..x).map(move |i| [i, j, k])))
}

pub(crate) fn round_up(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) < x { rounded.next_up() } else { rounded }
}

/// A node on a face of the box is negative.
pub(crate) fn inside_reaches_box(lattice: &Lattice, value: impl Fn([u32; 3]) -> f32 + Sync) -> bool {
    let nodes = lattice.nodes();
    let on_face = |axis: usize, layer: u32| {
        let [beside, above] = [(axis + 1) % 3, (axis + 2) % 3];
        let is_negative = |i: u32, j: u32| {
            let mut node = [layer; 3];
            (node[beside], node[above]) = (i, j);
            value(node) < 0.0
        };
        (0..nodes[above]).into_par_iter().any(|j| (0..nodes[beside]).any(|i| is_negative(i, j)))
    };
    (0..3).any(|axis| on_face(axis, 0) || on_face(axis, nodes[axis] - 1))
}
