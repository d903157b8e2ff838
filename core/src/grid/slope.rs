//! Lipschitz constants of a grid: how much φ changes per unit of distance.
//!
//! In one cell |∂φ/∂x| is at most the largest difference along its four edges in x over the spacing h, because the
//! derivative is a mean of these four; likewise y and z. So |∇φ| ≤ |(Δx, Δy, Δz)| / h.

use super::{Lattice, Storage};

/// Slope bound of a grid, inside its box and outside, for [`Grid::new`](super::Grid::new): the largest [`cell_slope`],
/// extended by [`slope_bound_with_outside`]. One pass over all samples.
pub fn measure_slope_bound<S: Storage>(lattice: &Lattice, storage: &S) -> f64 {
    let [cells_x, cells_y, cells_z] = lattice.cells();
    let mut inside = 0.0_f64;
    for z in 0..cells_z {
        for y in 0..cells_y {
            for x in 0..cells_x {
                inside = inside.max(cell_slope(storage.corners([x, y, z]), lattice.spacing()));
            }
        }
    }
    slope_bound_with_outside(inside, lowest_boundary_sample(lattice, storage) < 0.0)
}

/// Slope bound of a grid from `inside`, that of its cells.
///
/// With d the distance to the box and P the nearest point of it, φ outside is hypot(d, φ(P)), whose slope is at most
/// max(1, `inside`). `has_negative_boundary` says that a sample on the box is negative; there φ is φ(P) + d, whose two
/// slopes are orthogonal: √(1 + `inside`²).
pub fn slope_bound_with_outside(inside: f64, has_negative_boundary: bool) -> f64 {
    if has_negative_boundary { libm::sqrt(1.0 + inside * inside) } else { inside.max(1.0) }
}

/// Slope bound of one cell from its corners, in the order of [`Storage::corners`]: |(Δx, Δy, Δz)| / `spacing`, each Δ
/// the largest difference along an edge of that axis.
pub fn cell_slope(corners: [f32; 8], spacing: f64) -> f64 {
    // By name: an index could panic where the compiler does not unroll a loop.
    let [a, b, c, d, e, f, g, h] = corners.map(f64::from);
    let max_difference =
        |edges: [(f64, f64); 4]| edges.into_iter().fold(0.0_f64, |max, (from, to)| max.max((to - from).abs()));
    let along_x = max_difference([(a, b), (c, d), (e, f), (g, h)]);
    let along_y = max_difference([(a, c), (b, d), (e, g), (f, h)]);
    let along_z = max_difference([(a, e), (b, f), (c, g), (d, h)]);
    libm::sqrt(along_x * along_x + along_y * along_y + along_z * along_z) / spacing
}

/// Lowest sample on the six faces of the box.
pub(super) fn lowest_boundary_sample<S: Storage>(lattice: &Lattice, storage: &S) -> f64 {
    let cells = lattice.cells();
    let mut lowest = f64::INFINITY;
    for (axis, second, third) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
        // Always below three; the remainder removes a bounds check that could panic.
        let count = |axis: usize| cells[axis % 3];
        for (face, layer) in [(0, 0), (1, count(axis).wrapping_sub(1))] {
            for i in 0..count(second) {
                for j in 0..count(third) {
                    let mut cell = [layer; 3];
                    (cell[second % 3], cell[third % 3]) = (i, j);
                    let corners = storage.corners(cell);
                    let on_face = corners.iter().enumerate().filter(|(corner, _)| corner >> (axis % 3) & 1 == face);
                    lowest = on_face.fold(lowest, |lowest, (_, sample)| lowest.min(f64::from(*sample)));
                }
            }
        }
    }
    lowest
}
