//! Bounds of the stored samples of one brick: value, slope, and magnitude at jumps of the sign.
//!
//! In a cell of side h, ∂φ/∂x is a bilinear mean of the differences Δx along the cell's four edges in x, over h. So
//!
//! ```text
//! |∇φ|² ≤ (max Δx² + max Δy² + max Δz²) / h²
//! ```

use rayon::prelude::*;
use sdf_core::Interval;
use sdf_core::grid::sparse::BRICK;
use sdf_core::grid::{BlockBounds, Lattice};

use crate::simd::{max, min};

/// Nodes of a brick along each axis, with a halo of one: cells have corners in several bricks.
const SIDE: usize = BRICK as usize + 2;
const CELLS: usize = SIDE - 1;

/// A brick's 8³ samples with a halo of one node, x fastest; NaN outside the lattice.
pub(crate) struct HaloBlock {
    values: [[[f32; SIDE]; SIDE]; SIDE],
    spacing: f64,
    /// Number of cells along each axis whose first corner is in the brick.
    own_cells: [usize; 3],
}

impl HaloBlock {
    /// Reads the samples of the brick at `brick`, counted in bricks. `read_row` fills a row of nodes along x from the
    /// given one on, all in one brick.
    #[inline(always)]
    pub fn new(lattice: &Lattice, brick: [u32; 3], read_row: impl Fn([u32; 3], &mut [f32])) -> Self {
        let mut values = [[[f32::NAN; SIDE]; SIDE]; SIDE];
        let own = brick.map(|n| n * BRICK);
        // The array's first node is one before the brick's, and may be outside the lattice, as may be its last.
        let starts = own.map(|n| usize::from(n == 0));
        let ends: [usize; 3] = std::array::from_fn(|axis| SIDE.min((lattice.nodes()[axis] - own[axis]) as usize + 1));
        for z in starts[2]..ends[2] {
            for y in starts[1]..ends[1] {
                let row = &mut values[z][y];
                for [start, end] in [[0, 1], [1, SIDE - 1], [SIDE - 1, SIDE]] {
                    let (start, end) = (start.max(starts[0]), end.min(ends[0]));
                    if start < end {
                        let node = [own[0] + start as u32 - 1, own[1] + y as u32 - 1, own[2] + z as u32 - 1];
                        read_row(node, &mut row[start..end]);
                    }
                }
            }
        }
        let own_cells =
            std::array::from_fn(|axis| (lattice.cells()[axis].saturating_sub(own[axis])).min(BRICK) as usize);
        Self { values, spacing: lattice.spacing(), own_cells }
    }

    /// Range of the brick's samples, and slope bound of all cells with a corner in it.
    pub fn bounds(&self) -> BlockBounds {
        let (mut lowers, mut uppers) = ([f32::INFINITY; BRICK as usize], [f32::NEG_INFINITY; BRICK as usize]);
        for row in self.values[1..SIDE - 1].iter().flat_map(|layer| &layer[1..SIDE - 1]) {
            for x in 0..BRICK as usize {
                lowers[x] = min(row[x + 1], lowers[x]);
                uppers[x] = max(row[x + 1], uppers[x]);
            }
        }
        let lower = lowers.into_iter().fold(f32::INFINITY, f32::min);
        let upper = uppers.into_iter().fold(f32::NEG_INFINITY, f32::max);
        let slope_bound = pulp::Arch::new().dispatch(MaxSlopeSq(self)).sqrt() / self.spacing;
        BlockBounds { range: Interval { lower, upper }, slope_bound: round_up(slope_bound) }
    }

    /// Largest magnitude at the corners of cells that may have both signs and have none beyond `max_magnitude`.
    ///
    /// Only cells whose first corner is in the brick count. Each value is off by `rounding` at most.
    pub fn largest_at_sign_change(&self, rounding: f32, max_magnitude: f32) -> f32 {
        let mut largest = 0.0_f32;
        for z in 1..=self.own_cells[2] {
            for y in 1..=self.own_cells[1] {
                let rows = [[y, z], [y + 1, z], [y, z + 1], [y + 1, z + 1]].map(|[y, z]| &self.values[z][y]);
                for x in 1..=self.own_cells[0] {
                    let (mut lower, mut upper) = (f32::INFINITY, f32::NEG_INFINITY);
                    for row in rows {
                        lower = lower.min(row[x]).min(row[x + 1]);
                        upper = upper.max(row[x]).max(row[x + 1]);
                    }
                    let magnitude = upper.max(-lower);
                    let changes_sign = lower <= rounding && upper >= -rounding && magnitude <= max_magnitude;
                    largest = if changes_sign { largest.max(magnitude) } else { largest };
                }
            }
        }
        largest
    }
}

/// Σ over the axes of a cell's largest squared difference along it, in the steepest cell.
///
/// The square of [`cell_slope`](sdf_core::grid::cell_slope) times the spacing. A cell partly outside the lattice has
/// NaN differences, which count as zero; the cell beside it with the same corners is at least as steep.
struct MaxSlopeSq<'a>(&'a HaloBlock);

impl pulp::WithSimd for MaxSlopeSq<'_> {
    type Output = f64;
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> f64 {
        let values = &self.0.values;
        let mut steepest = [0.0_f64; CELLS];
        for z in 0..CELLS {
            for y in 0..CELLS {
                let [a, b, c, d] = [&values[z][y], &values[z][y + 1], &values[z + 1][y], &values[z + 1][y + 1]];
                for x in 0..CELLS {
                    let along_x = [a, b, c, d].map(|row| difference(row[x], row[x + 1]));
                    let along_y = [[a, b], [c, d]]
                        .map(|[from, to]| max(difference(from[x], to[x]), difference(from[x + 1], to[x + 1])));
                    let along_z = [[a, c], [b, d]]
                        .map(|[from, to]| max(difference(from[x], to[x]), difference(from[x + 1], to[x + 1])));
                    let max_x = max(max(along_x[0], along_x[1]), max(along_x[2], along_x[3]));
                    let (max_y, max_z) = (max(along_y[0], along_y[1]), max(along_z[0], along_z[1]));
                    let slope_sq = max_x * max_x + max_y * max_y + max_z * max_z;
                    steepest[x] = max(slope_sq, steepest[x]);
                }
            }
        }
        steepest.into_iter().fold(0.0, f64::max)
    }
}

/// |b − a|; zero if one of them is NaN.
#[inline(always)]
fn difference(a: f32, b: f32) -> f64 {
    max((f64::from(b) - f64::from(a)).abs(), 0.0)
}

/// Smallest f32 that is at least `x`.
pub(crate) fn round_up(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) < x { rounded.next_up() } else { rounded }
}

/// Whether a node on a face of the lattice's box is negative.
pub(crate) fn inside_reaches_box(lattice: &Lattice, value: impl Fn([u32; 3]) -> f32 + Sync) -> bool {
    let nodes = lattice.nodes();
    let is_face_inside = |axis: usize, layer: u32| {
        let [second, third] = [(axis + 1) % 3, (axis + 2) % 3];
        let is_negative = |i: u32, j: u32| {
            let mut node = [layer; 3];
            (node[second], node[third]) = (i, j);
            value(node) < 0.0
        };
        (0..nodes[third]).into_par_iter().any(|j| (0..nodes[second]).any(|i| is_negative(i, j)))
    };
    (0..3).any(|axis| is_face_inside(axis, 0) || is_face_inside(axis, nodes[axis] - 1))
}

#[cfg(test)]
mod tests;
