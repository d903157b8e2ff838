//! Bounds of the stored samples of one brick: value, slope, and magnitude at jumps of the sign.
//!
//! In a cell of side h, ∂φ/∂x is a bilinear mean of the differences Δx along the cell's four edges in x, over h. So
//!
//! ```text
//! |∇φ|² ≤ (max Δx² + max Δy² + max Δz²) / h²
//! ```

use sdf_core::Interval;
use sdf_core::grid::sparse::BRICK;
use sdf_core::grid::{BlockBounds, Lattice};

use crate::rounding::SLOPE_ROUNDING;
use crate::simd::{greater_magnitude, max, min};

/// Nodes of a brick along each axis, with a halo of one: cells have corners in several bricks.
const SIDE: usize = BRICK as usize + 2;
const CELLS: usize = SIDE - 1;

/// Length of a row in memory: a multiple of all registers, so that rows are bounded in whole ones.
const STRIDE: usize = 16;

/// Cells with corners in bricks, all within the distance up to which samples are exact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct BandCells {
    /// Their number.
    pub count: u64,
    /// Largest magnitude at their corners.
    pub max_magnitude: f32,
}

impl BandCells {
    /// Counts both.
    pub fn joined(self, other: Self) -> Self {
        Self { count: self.count + other.count, max_magnitude: self.max_magnitude.max(other.max_magnitude) }
    }
}

/// Rows of samples with a halo of one node, x fastest.
pub(crate) type Halo = [[[f32; STRIDE]; SIDE]; SIDE];

/// A brick's 8³ samples with a halo of one node, x fastest; NaN outside the lattice.
pub(crate) struct HaloBlock {
    pub values: Halo,
    spacing: f64,
    /// Number of cells along each axis whose first corner is in the brick.
    own_cells: [usize; 3],
}

impl HaloBlock {
    /// Reads the samples of the brick at `brick`, counted in bricks. `read_row` fills a row of nodes along x from the
    /// given one on, all in one brick.
    #[inline(always)]
    pub fn new(lattice: &Lattice, brick: [u32; 3], read_row: impl Fn([u32; 3], &mut [f32])) -> Self {
        let own = brick.map(|n| n * BRICK);
        let (mut block, [starts, ends]) = Self::empty(lattice, brick);
        for z in starts[2]..ends[2] {
            for y in starts[1]..ends[1] {
                let row = &mut block.values[z][y];
                for [start, end] in [[0, 1], [1, SIDE - 1], [SIDE - 1, SIDE]] {
                    let (start, end) = (start.max(starts[0]), end.min(ends[0]));
                    if start < end {
                        let node = [own[0] + start as u32 - 1, own[1] + y as u32 - 1, own[2] + z as u32 - 1];
                        read_row(node, &mut row[start..end]);
                    }
                }
            }
        }
        block
    }

    /// A block without samples yet. The nodes in the lattice are from the first to before the second of the returned ones.
    #[inline(always)]
    pub fn empty(lattice: &Lattice, brick: [u32; 3]) -> (Self, [[usize; 3]; 2]) {
        let own = brick.map(|n| n * BRICK);
        // The array's first node is one before the brick's, and may be outside the lattice, as may be its last.
        let starts = own.map(|n| usize::from(n == 0));
        let ends = std::array::from_fn(|axis| SIDE.min((lattice.nodes()[axis] - own[axis]) as usize + 1));
        let own_cells =
            std::array::from_fn(|axis| (lattice.cells()[axis].saturating_sub(own[axis])).min(BRICK) as usize);
        let values = [[[f32::NAN; STRIDE]; SIDE]; SIDE];
        (Self { values, spacing: lattice.spacing(), own_cells }, [starts, ends])
    }

    /// Range of the brick's samples, and slope bound of all cells with a corner in it.
    #[inline(always)]
    pub fn bounds(&self) -> BlockBounds {
        let (mut lowers, mut uppers) = ([f32::INFINITY; BRICK as usize], [f32::NEG_INFINITY; BRICK as usize]);
        for layer in &self.values[1..SIDE - 1] {
            for row in &layer[1..SIDE - 1] {
                for x in 0..BRICK as usize {
                    lowers[x] = min(row[x + 1], lowers[x]);
                    uppers[x] = max(row[x + 1], uppers[x]);
                }
            }
        }
        let lower = lowers.into_iter().fold(f32::INFINITY, f32::min);
        let upper = uppers.into_iter().fold(f32::NEG_INFINITY, f32::max);
        let slope_sq = f64::from(pulp::Arch::new().dispatch(MaxSlopeSq(self)));
        let slope_bound = (slope_sq * (1.0 + SLOPE_ROUNDING)).sqrt();
        BlockBounds { range: Interval { lower, upper }, slope_bound: round_up(slope_bound) }
    }

    /// Largest magnitude at the corners of cells that may have both signs and have none beyond `max_magnitude`, and the cells that have
    /// none beyond `exact_within`.
    ///
    /// Only cells whose first corner is in the brick count. Each value is off by `rounding` at most; zero if none has lost its sign.
    pub fn largest_at_sign_change(&self, rounding: f32, max_magnitude: f32, exact_within: f32) -> (f32, BandCells) {
        pulp::Arch::new().dispatch(LargestAtSignChange { halo: self, rounding, max_magnitude, exact_within })
    }
}

struct LargestAtSignChange<'a> {
    halo: &'a HaloBlock,
    rounding: f32,
    max_magnitude: f32,
    exact_within: f32,
}

impl pulp::NullaryFnOnce for LargestAtSignChange<'_> {
    type Output = (f32, BandCells);

    #[inline(always)]
    fn call(self) -> (f32, BandCells) {
        const LANES: usize = BRICK as usize;
        let Self { halo: HaloBlock { values, own_cells, .. }, rounding, max_magnitude, exact_within } = self;
        let (mut largest, mut largest_in_band, mut count) = ([0.0_f32; LANES], [0.0_f32; LANES], [0_u32; LANES]);
        for z in 1..=own_cells[2] {
            for y in 1..=own_cells[1] {
                let rows = [[y, z], [y + 1, z], [y, z + 1], [y + 1, z + 1]].map(|[y, z]| &values[z][y]);
                for x in 0..LANES {
                    let (mut lower, mut upper) = (rows[0][x + 1], rows[0][x + 1]);
                    for row in rows {
                        lower = min(min(row[x + 1], row[x + 2]), lower);
                        upper = max(max(row[x + 1], row[x + 2]), upper);
                    }
                    // Not −0.
                    let magnitude = max(upper, -lower).abs();
                    let is_own = x < own_cells[0];
                    let counts = is_own & (lower < rounding) & (upper >= -rounding) & (magnitude <= max_magnitude);
                    largest[x] = greater_magnitude(if counts { magnitude } else { 0.0 }, largest[x]);
                    let is_in_band = is_own & (magnitude <= exact_within);
                    count[x] += u32::from(is_in_band);
                    largest_in_band[x] =
                        greater_magnitude(if is_in_band { magnitude } else { 0.0 }, largest_in_band[x]);
                }
            }
        }
        let greatest = |lanes: [f32; LANES]| lanes.into_iter().fold(0.0, f32::max);
        let count = count.into_iter().map(u64::from).sum();
        (greatest(largest), BandCells { count, max_magnitude: greatest(largest_in_band) })
    }
}

/// Σ over the axes of the square of a cell's largest difference along it over the spacing, in the steepest cell.
///
/// The square of [`cell_slope`](sdf_core::grid::cell_slope), but for rounding. A cell partly outside the lattice has
/// NaN differences, which count as zero; the cell beside it with the same corners is at least as steep.
struct MaxSlopeSq<'a>(&'a HaloBlock);

impl pulp::NullaryFnOnce for MaxSlopeSq<'_> {
    type Output = f32;
    #[inline(always)]
    fn call(self) -> f32 {
        let values = &self.0.values;
        let inv_spacing = (1.0 / self.0.spacing) as f32;
        // In whole registers: what is beyond the last node of a row is not a number.
        let mut next = [[[f32::NAN; STRIDE]; SIDE]; 2];
        let mut steepest = [0.0_f32; STRIDE];
        for z in 0..SIDE {
            next[0] = next[1];
            for (next, row) in next[1].iter_mut().zip(&values[z]) {
                next[..STRIDE - 1].copy_from_slice(&row[1..]);
            }
            if z == 0 {
                continue;
            }
            let z = z - 1;
            for y in 0..CELLS {
                let near = [&values[z][y], &values[z][y + 1], &values[z + 1][y], &values[z + 1][y + 1]];
                let far = [&next[0][y], &next[0][y + 1], &next[1][y], &next[1][y + 1]];
                let before = steepest;
                for x in 0..STRIDE {
                    let (mut along_x, mut along_y, mut along_z) = (0.0, 0.0, 0.0);
                    for row in 0..4 {
                        along_x = max(difference(near[row][x], far[row][x]), along_x);
                    }
                    for row in 0..2 {
                        for side in [near, far] {
                            along_y = max(difference(side[2 * row][x], side[2 * row + 1][x]), along_y);
                            along_z = max(difference(side[row][x], side[row + 2][x]), along_z);
                        }
                    }
                    along_x *= inv_spacing;
                    along_y *= inv_spacing;
                    along_z *= inv_spacing;
                    let slope_sq = along_x.mul_add(along_x, along_y.mul_add(along_y, along_z * along_z));
                    steepest[x] = max(slope_sq, before[x]);
                }
            }
        }
        steepest.into_iter().fold(0.0, f32::max)
    }
}

/// |b − a|; zero if one of them is NaN.
#[inline(always)]
fn difference(a: f32, b: f32) -> f32 {
    max((b - a).abs(), 0.0)
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
        let is_row_inside = |j: usize| (0..nodes[second]).any(|i| is_negative(i, j as u32));
        sdf_parallel::map(nodes[third] as usize, is_row_inside).contains(&true)
    };
    (0..3).any(|axis| is_face_inside(axis, 0) || is_face_inside(axis, nodes[axis] - 1))
}

#[cfg(test)]
mod tests;
