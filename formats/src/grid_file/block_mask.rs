//! Blocks of 8 × 8 × 8 nodes whose samples queries in given regions need.
//!
//! A region needs the nodes of all cells that it meets, and two more on each side for normals, widened by the rounding of points in f32. Each
//! region adds 1 to a box of counters through a difference array: ±1 at the eight corners of the box, and prefix sums
//! along the axes at the end. So a region costs the same whatever its size.
//!
//! A region is skipped if the block bounds prove that no value in it is low enough. Rounding is allowed for as
//! [`sdf_core::contact`] does when it culls. The lower bound of each block is computed once: a sparse grid's empty slots have none that is
//! stored.

use sdf_core::EnclosedSdf;
use sdf_core::grid::sparse::BRICK;
use sdf_core::grid::{Grid, Lattice, Storage};
use sdf_core::{Aabb, Sdf};

use crate::hdf5::Tile;

/// Error of a query point in f32, relative to the largest coordinate: a minimizer's point and its steps from the origin
/// are off by three half roundings.
const POINT_ERROR: f64 = 32.0 * f32::EPSILON as f64;

/// Nodes beyond a point's cell that the normal of a contact depends on: `Sdf::evaluate_smooth` of a grid takes six along each axis.
const NORMAL_REACH: u32 = 2;

/// Error of a bound on an element's values, relative to the largest number and a slope of one: twice what
/// [`sdf_core::contact`] allows for in f32.
const CULL_ERROR: f64 = 64.0 * f32::EPSILON as f64;

/// For each block of [`BRICK`] nodes along each axis: how many regions need it.
pub(super) struct BlockMask {
    /// Counters along x, y and z: one more than there are blocks.
    counts: [usize; 3],
    region_counts: Vec<u32>,
    /// Blocks already known to be needed, before the sums are taken.
    is_marked: Vec<bool>,
}

impl BlockMask {
    /// Blocks that queries in `regions` need, except regions in which no value is at most `level`. See
    /// [`super::GridReader::read_needed`]. Evaluates only the block bounds of `grid`, never its samples.
    pub(super) fn needed(grid: &Grid<impl Storage>, regions: impl IntoIterator<Item = Aabb>, level: f64) -> Self {
        let lattice = grid.lattice();
        let nodes = lattice.nodes();
        let counts: [usize; 3] = std::array::from_fn(|axis| nodes[axis].div_ceil(BRICK) as usize + 1);
        let blocks = counts.iter().product();
        let mut mask = Self { counts, region_counts: vec![0; blocks], is_marked: vec![false; blocks] };
        let bounds = lattice.bounds();
        let max_of_lattice = max_magnitude(&bounds);
        let slope_bound = grid.slope_bound().max(1.0);
        // Zeros, of which the system provides only what is written to.
        let mut lower_bounds = vec![0; blocks];
        // Of the last region of which nothing is left to do: its blocks, and the level that they are above.
        let mut done = None;
        for region in regions {
            let is_inside = bounds.encloses(&region);
            let magnitude = if is_inside { max_of_lattice } else { max_magnitude(&region).max(max_of_lattice) };
            let near = nodes_near(lattice, &region, magnitude);
            let [first, last] = near.unwrap_or([[0; 3], lattice.cells()]);
            let block = |node: [u32; 3]| node.map(|index| (index / BRICK) as usize);
            let (first, last) = (block(first), block(last));
            let rounding = CULL_ERROR * slope_bound * magnitude.max(level.abs());
            let is_done = |(blocks, above)| near.is_some() && blocks == (first, last) && level + rounding <= above;
            if done.is_some_and(is_done) {
                continue;
            }
            // Most elements of a mesh need only what one before them needed.
            if mask.is_box_marked(first, last) {
                done = Some(((first, last), f64::INFINITY));
                continue;
            }
            // Outside the box values are no lower than at its border.
            if near.is_some() && mask.is_box_above(first, last, level + rounding, grid.storage(), &mut lower_bounds) {
                done = Some(((first, last), level + rounding));
                continue;
            }
            if near.is_none() || grid.enclose_box(&region).range.lower <= level + rounding {
                mask.add_box(first, last);
            }
        }
        mask.sum();
        mask
    }

    /// `true` if any block of a tile of the grid's nodes is needed.
    pub(super) fn intersects(&self, tile: Tile) -> bool {
        let blocks = |axis: usize| {
            let (first, end) = (tile.first[axis], tile.first[axis] + tile.size[axis]);
            first / BRICK as usize..end.div_ceil(BRICK as usize)
        };
        blocks(0).any(|z| blocks(1).any(|y| blocks(2).any(|x| self.contains([x, y, z]))))
    }

    /// `true` if a block, given by x, y and z, is needed.
    pub(super) fn contains(&self, block: [usize; 3]) -> bool {
        self.region_counts[self.index(block)] != 0
    }

    /// `true` if the box is small and all of its blocks are marked, so that adding it changes nothing.
    fn is_box_marked(&self, first: [usize; 3], last: [usize; 3]) -> bool {
        let is_row_marked = |y, z| {
            let [first, last] = [first[0], last[0]].map(|x| self.index([x, y, z]));
            self.is_marked[first..=last].iter().all(|is_marked| *is_marked)
        };
        is_small(first, last) && (first[2]..=last[2]).all(|z| (first[1]..=last[1]).all(|y| is_row_marked(y, z)))
    }

    /// `true` if the box is small, and no sample of its blocks is at most `level`.
    fn is_box_above(
        &self,
        first: [usize; 3],
        last: [usize; 3],
        level: f64,
        storage: &impl Storage,
        lower_bounds: &mut [u32],
    ) -> bool {
        let mut is_above = |block: [usize; 3]| {
            let bits = &mut lower_bounds[self.index(block)];
            if *bits == 0 {
                let node = block.map(|index| index as u32 * BRICK);
                let lower = storage.block_bounds(node, node).map_or(f32::NEG_INFINITY, |bounds| bounds.range.lower);
                *bits = lower.to_bits();
            }
            f64::from(f32::from_bits(*bits)) > level
        };
        let blocks = |axis: usize| first[axis]..=last[axis];
        is_small(first, last) && blocks(2).all(|z| blocks(1).all(|y| blocks(0).all(|x| is_above([x, y, z]))))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    /// Adds ±1 at the corners of a box of the difference array.
    fn add_box(&mut self, first: [usize; 3], last: [usize; 3]) {
        for corner in 0..8_u32 {
            let is_upper = [0, 1, 2].map(|axis| corner >> axis & 1 == 1);
            let block = std::array::from_fn(|axis| if is_upper[axis] { last[axis] + 1 } else { first[axis] });
            let index = self.index(block);
            let count = &mut self.region_counts[index];
            *count = if corner.count_ones() % 2 == 1 { count.wrapping_sub(1) } else { count.wrapping_add(1) };
        }
        if is_small(first, last) {
            for (z, y) in (first[2]..=last[2]).flat_map(|z| (first[1]..=last[1]).map(move |y| (z, y))) {
                let [first, last] = [first[0], last[0]].map(|x| self.index([x, y, z]));
                self.is_marked[first..=last].fill(true);
            }
        }
    }

    /// Turns the difference array into counts.
    fn sum(&mut self) {
        let mut stride = 1;
        for count in self.counts {
            for line in self.region_counts.chunks_exact_mut(stride * count) {
                for index in stride..line.len() {
                    line[index] = line[index].wrapping_add(line[index - stride]);
                }
            }
            stride *= count;
        }
    }
}

/// At most three blocks along each axis, as an element of a mesh needs. In larger boxes, testing each block costs more
/// than it saves.
fn is_small(first: [usize; 3], last: [usize; 3]) -> bool {
    (0..3).all(|axis| last[axis] - first[axis] < 3)
}

/// First and last node that a region needs; `None` if the region is empty or not finite. `magnitude` is the largest
/// coordinate of the region and the grid.
fn nodes_near(lattice: &Lattice, region: &Aabb, magnitude: f64) -> Option<[[u32; 3]; 2]> {
    let [first, last] = lattice.nodes_around(region)?;
    // The cast saturates.
    let margin = ((POINT_ERROR * magnitude * lattice.inv_spacing()) as u32).saturating_add(1 + NORMAL_REACH);
    let cells = lattice.cells();
    let last = std::array::from_fn(|axis| last[axis].saturating_add(margin).min(cells[axis]));
    Some([first.map(|node| node.saturating_sub(margin)), last])
}

fn max_magnitude(bounds: &Aabb) -> f64 {
    (0..3).fold(0.0, |max: f64, axis| max.max(bounds.min[axis].abs()).max(bounds.max[axis].abs()))
}
