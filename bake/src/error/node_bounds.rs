use rayon::prelude::*;
use sdf_core::Interval;
use sdf_core::grid::sparse::BRICK;
use sdf_core::grid::{BlockBounds, Lattice};

/// Nodes of a place along each axis, with one more on each side for the cells that have a corner in the place.
const SIDE: usize = BRICK as usize + 2;
const CELLS: usize = SIDE - 1;

/// The nodes of a place of 8 × 8 × 8 and those around it, x fastest; not a number beyond the lattice.
pub(crate) struct HaloBlock {
    values: [[[f32; SIDE]; SIDE]; SIDE],
    spacing: f64,
    /// Cells whose first corner is in the place, along each axis.
    own_cells: [usize; 3],
}

impl HaloBlock {
    /// `values` is to fill in a row of nodes from the given one on, which are all in one place.
    pub fn new(lattice: &Lattice, place: [u32; 3], values: impl Fn([u32; 3], &mut [f32])) -> Self {
        let mut all = [[[f32::NAN; SIDE]; SIDE]; SIDE];
        let own = place.map(|n| n * BRICK);
        // The first node of the array stands one before the place's own: that may be before the lattice, the last beyond.
        let starts = own.map(|n| usize::from(n == 0));
        let ends: [usize; 3] = std::array::from_fn(|axis| SIDE.min((lattice.nodes()[axis] - own[axis]) as usize + 1));
        for z in starts[2]..ends[2] {
            for y in starts[1]..ends[1] {
                let row = &mut all[z][y];
                for [start, end] in [[0, 1], [1, SIDE - 1], [SIDE - 1, SIDE]] {
                    let (start, end) = (start.max(starts[0]), end.min(ends[0]));
                    if start < end {
                        let node = [own[0] + start as u32 - 1, own[1] + y as u32 - 1, own[2] + z as u32 - 1];
                        values(node, &mut row[start..end]);
                    }
                }
            }
        }
        let own_cells =
            std::array::from_fn(|axis| (lattice.cells()[axis].saturating_sub(own[axis])).min(BRICK) as usize);
        Self { values: all, spacing: lattice.spacing(), own_cells }
    }

    /// What is certain of the place's nodes, those beyond the lattice not counted.
    pub fn bounds(&self) -> BlockBounds {
        let own = || (1..SIDE - 1).flat_map(|z| (1..SIDE - 1).flat_map(move |y| &self.values[z][y][1..SIDE - 1]));
        let least = own().copied().fold(f32::INFINITY, f32::min);
        let greatest = own().copied().fold(f32::NEG_INFINITY, f32::max);
        let slope = pulp::Arch::new().dispatch(SteepestOf(self)).sqrt() / self.spacing;
        BlockBounds { range: Interval { lower: least, upper: greatest }, slope_bound: round_up(slope) }
    }

    /// The largest magnitude at a corner of a cell that may have corners of both signs and none farther than `within`, of the
    /// cells whose first corner is in the place. Each value is off by `rounding` at most.
    pub fn largest_at_sign_change(&self, rounding: f32, within: f32) -> f32 {
        let mut largest = 0.0_f32;
        for z in 1..=self.own_cells[2] {
            for y in 1..=self.own_cells[1] {
                let rows = [[y, z], [y + 1, z], [y, z + 1], [y + 1, z + 1]].map(|[y, z]| &self.values[z][y]);
                for x in 1..=self.own_cells[0] {
                    let (mut least, mut greatest) = (f32::INFINITY, f32::NEG_INFINITY);
                    for row in rows {
                        least = least.min(row[x]).min(row[x + 1]);
                        greatest = greatest.max(row[x]).max(row[x + 1]);
                    }
                    let of_cell = greatest.max(-least);
                    let is_torn = least <= rounding && greatest >= -rounding && of_cell <= within;
                    largest = if is_torn { largest.max(of_cell) } else { largest };
                }
            }
        }
        largest
    }
}

/// The square of the steepest cell's largest differences. As in `cell_slope`, whose root and quotient never change which is
/// the steepest. A cell partly beyond the lattice is no steeper than the one beside it with the same corners.
struct SteepestOf<'a>(&'a HaloBlock);

impl pulp::WithSimd for SteepestOf<'_> {
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
                        .map(|[from, to]| larger(difference(from[x], to[x]), difference(from[x + 1], to[x + 1])));
                    let along_z = [[a, c], [b, d]]
                        .map(|[from, to]| larger(difference(from[x], to[x]), difference(from[x + 1], to[x + 1])));
                    let x_most = larger(larger(along_x[0], along_x[1]), larger(along_x[2], along_x[3]));
                    let (y_most, z_most) = (larger(along_y[0], along_y[1]), larger(along_z[0], along_z[1]));
                    let square = x_most * x_most + y_most * y_most + z_most * z_most;
                    steepest[x] = larger(square, steepest[x]);
                }
            }
        }
        steepest.into_iter().fold(0.0, f64::max)
    }
}

/// Zero where one of them is not a number.
#[inline(always)]
fn difference(a: f32, b: f32) -> f64 {
    larger((f64::from(b) - f64::from(a)).abs(), 0.0)
}

/// One instruction: the second where one of them is not a number.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
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

#[cfg(test)]
mod tests {
    use sdf_core::grid::cell_slope;

    use super::*;
    use crate::error::normal_cones::tests::random;

    fn nodes(first: [u32; 3], last: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
        let [xs, ys, zs] = [0, 1, 2].map(|axis| first[axis]..last[axis]);
        zs.flat_map(move |z| {
            let xs = xs.clone();
            ys.clone().flat_map(move |y| xs.clone().map(move |x| [x, y, z]))
        })
    }

    #[test]
    fn bounds_in_lanes_are_those_of_all_nodes_and_cells_one_by_one() {
        let mut state = 5;
        for counts in [[2, 2, 2], [8, 9, 10], [17, 3, 16], [25, 18, 8], [9, 9, 9]] {
            let lattice = Lattice::new([0.0; 3], 0.3, counts).unwrap();
            let samples: Vec<f32> = (0..lattice.node_count()).map(|_| random(&mut state) as f32).collect();
            let value = |node: [u32; 3]| samples[lattice.index(node)];
            let corner =
                |cell: [u32; 3], corner: u32| value(std::array::from_fn(|axis| cell[axis] + (corner >> axis & 1)));
            for place in nodes([0; 3], counts.map(|n| n.div_ceil(BRICK))) {
                let around = HaloBlock::new(&lattice, place, |[x, y, z], row| {
                    (x..).zip(row).for_each(|(x, sample)| *sample = value([x, y, z]));
                });
                let first = place.map(|n| n * BRICK);
                let last: [u32; 3] = std::array::from_fn(|axis| counts[axis].min(first[axis] + BRICK));
                let own = || nodes(first, last).map(value);
                let cells_from = first.map(|n| n.saturating_sub(1));
                let cells_to: [u32; 3] = std::array::from_fn(|axis| last[axis].min(counts[axis] - 1));
                let slope_of = |cell| cell_slope(std::array::from_fn(|index| corner(cell, index as u32)), 0.3);
                let steepest = nodes(cells_from, cells_to).map(slope_of).fold(0.0, f64::max);
                let wanted = BlockBounds {
                    range: Interval {
                        lower: own().fold(f32::INFINITY, f32::min),
                        upper: own().fold(f32::NEG_INFINITY, f32::max),
                    },
                    slope_bound: round_up(steepest),
                };
                assert_eq!(around.bounds(), wanted, "{place:?} of {counts:?}");

                let (rounding, within) = (0.1, 0.9);
                let torn_at = |cell: [u32; 3]| {
                    let corners: [f32; 8] = std::array::from_fn(|index| corner(cell, index as u32));
                    let largest = corners.iter().fold(0.0_f32, |largest, corner| largest.max(corner.abs()));
                    let has_both = corners.iter().any(|c| *c <= rounding) && corners.iter().any(|c| *c >= -rounding);
                    if has_both && largest <= within { largest } else { 0.0 }
                };
                let unpaired_at_boundary = nodes(first, cells_to).map(torn_at).fold(0.0, f32::max);
                assert_eq!(
                    around.largest_at_sign_change(rounding, within),
                    unpaired_at_boundary,
                    "{place:?} of {counts:?}"
                );
            }
        }
    }
}
