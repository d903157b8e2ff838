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
use sdf_core::grid::owned::Blocks;
use sdf_core::grid::sparse::BRICK;
use sdf_core::grid::{Grid, Lattice, Storage};
use sdf_core::{Aabb, Sdf};

use crate::hdf5::Tile;

/// A file has bounds of all blocks, or a table of as many.
const FITS: &str = "the file's own tables have as many blocks";

/// Error of a query point in f32, relative to the largest coordinate: a minimizer's point and its steps from the origin
/// are off by three half roundings.
const POINT_ERROR: f64 = 32.0 * f32::EPSILON as f64;

/// Nodes beyond a point's cell that the normal of a contact depends on: `Sdf::evaluate_smooth` of a grid takes six along each axis.
const NORMAL_REACH: u32 = 2;

/// Error of a bound on an element's values, relative to the largest number and a slope of one: twice what
/// [`sdf_core::contact`] allows for in f32.
const CULL_ERROR: f64 = 64.0 * f32::EPSILON as f64;

/// Blocks of which there are more are counted in groups of 8 × 8 × 8: of a box larger than [`is_small`] whole groups are needed.
const MAX_COUNTED: usize = 1 << 22;

/// The blocks of [`BRICK`] nodes along each axis that regions need.
pub(super) struct BlockMask {
    /// Blocks of small boxes.
    is_marked: Blocks<bool>,
    /// Counters along x, y and z: one more than there are groups of blocks.
    counts: [usize; 3],
    /// For each group of blocks: how many of the larger boxes need it. Empty until there is one.
    region_counts: Vec<u32>,
    /// A group has 2ⁿ blocks along each axis.
    group_bits: u32,
}

impl BlockMask {
    /// Blocks that queries in `regions` need, except regions in which no value is at most `level`. See
    /// [`super::GridReader::read_needed`]. Evaluates only the block bounds of `grid`, never its samples.
    pub(super) fn needed(grid: &Grid<impl Storage>, regions: impl IntoIterator<Item = Aabb>, level: f64) -> Self {
        let lattice = grid.lattice();
        let nodes = lattice.nodes();
        let block_counts = nodes.map(|n| n.div_ceil(BRICK));
        let mut mask = Self::new(block_counts, MAX_COUNTED);
        let bounds = lattice.bounds();
        let max_of_lattice = max_magnitude(&bounds);
        let slope_bound = grid.slope_bound().max(1.0);
        // Bits of numbers; 0 where none is known.
        let mut lower_bounds = Blocks::new(block_counts, 0).expect(FITS);
        // Of the last region of which nothing is left to do: its blocks, and the level that they are above.
        let mut done = None;
        for region in regions {
            let is_inside = bounds.encloses(&region);
            let magnitude = if is_inside { max_of_lattice } else { max_magnitude(&region).max(max_of_lattice) };
            let own = lattice.nodes_around(&region);
            let near = own.map(|nodes| widened(lattice, nodes, magnitude));
            let box_of = |nodes: [[u32; 3]; 2]| nodes.map(|node| node.map(|index| (index / BRICK) as usize));
            let [first, last] = box_of(near.unwrap_or([[0; 3], lattice.cells()]));
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
            let mut is_above = |[first, last]: [[usize; 3]; 2]| {
                Self::is_box_above(first, last, level + rounding, grid.storage(), &mut lower_bounds)
            };
            // Outside the box values are no lower than at its border.
            if near.is_some() && is_above([first, last]) {
                done = Some(((first, last), level + rounding));
                continue;
            }
            let is_far = match own.map(box_of).filter(|[first, last]| is_inside && is_small(*first, *last)) {
                Some(own) => is_above(own),
                None => near.is_some() && grid.enclose_box(&region).range.lower > level + rounding,
            };
            if !is_far {
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

    /// Empty mask of so many blocks along each axis. `max_counted`: [`MAX_COUNTED`].
    fn new(block_counts: [u32; 3], max_counted: usize) -> Self {
        let blocks = block_counts.iter().fold(1_usize, |count, along| count.saturating_mul(*along as usize));
        let group_bits = if blocks > max_counted { 3 } else { 0 };
        let counts = block_counts.map(|count| (count as usize).div_ceil(1 << group_bits) + 1);
        let is_marked = Blocks::new(block_counts, false).expect(FITS);
        Self { is_marked, counts, region_counts: vec![], group_bits }
    }

    /// `true` if a block, given by x, y and z, is needed.
    pub(super) fn contains(&self, block: [usize; 3]) -> bool {
        let is_counted = || self.region_counts.get(self.index(block)).is_some_and(|count| *count != 0);
        self.is_marked.get(block.map(|index| index as u32)) == Some(true) || is_counted()
    }

    /// `true` if the box is small and all of its blocks are marked, so that adding it changes nothing.
    fn is_box_marked(&self, first: [usize; 3], last: [usize; 3]) -> bool {
        is_small(first, last) && blocks(first, last).all(|block| self.is_marked.get(block) == Some(true))
    }

    /// `true` if the box is small, and no sample of its blocks is at most `level`.
    fn is_box_above(
        first: [usize; 3],
        last: [usize; 3],
        level: f64,
        storage: &impl Storage,
        lower_bounds: &mut Blocks<u32>,
    ) -> bool {
        let mut is_above = |block: [u32; 3]| {
            let mut bits = lower_bounds.get(block).unwrap_or(0);
            if bits == 0 {
                let node = block.map(|index| index * BRICK);
                bits = storage.lowest(node, node).unwrap_or(f32::NEG_INFINITY).to_bits();
                lower_bounds.set(block, bits);
            }
            f64::from(f32::from_bits(bits)) > level
        };
        is_small(first, last) && blocks(first, last).all(&mut is_above)
    }

    /// Index of the counter of a block.
    fn index(&self, block: [usize; 3]) -> usize {
        let [x, y, z] = block.map(|index| index >> self.group_bits);
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    /// Marks the blocks of a small box; adds ±1 at the corners of another in the difference array.
    fn add_box(&mut self, first: [usize; 3], last: [usize; 3]) {
        if is_small(first, last) {
            return blocks(first, last).for_each(|block| self.is_marked.set(block, true));
        }
        self.region_counts.resize(self.counts.iter().product(), 0);
        let group = 1 << self.group_bits;
        for corner in 0..8_u32 {
            let is_upper = [0, 1, 2].map(|axis| corner >> axis & 1 == 1);
            let block = std::array::from_fn(|axis| if is_upper[axis] { last[axis] + group } else { first[axis] });
            let index = self.index(block);
            let count = &mut self.region_counts[index];
            *count = if corner.count_ones() % 2 == 1 { count.wrapping_sub(1) } else { count.wrapping_add(1) };
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

/// The blocks of a box, from its first to its last.
fn blocks(first: [usize; 3], last: [usize; 3]) -> impl Iterator<Item = [u32; 3]> {
    let along = move |axis: usize| first[axis] as u32..=last[axis] as u32;
    along(2).flat_map(move |z| along(1).flat_map(move |y| along(0).map(move |x| [x, y, z])))
}

/// At most three blocks along each axis, as an element of a mesh needs. In larger boxes, testing each block costs more
/// than it saves.
fn is_small(first: [usize; 3], last: [usize; 3]) -> bool {
    (0..3).all(|axis| last[axis] - first[axis] < 3)
}

/// First and last node that queries in a region need; `None` if the region is empty or not finite.
pub(super) fn nodes_needed(lattice: &Lattice, region: &Aabb) -> Option<[[u32; 3]; 2]> {
    let magnitude = max_magnitude(region).max(max_magnitude(&lattice.bounds()));
    Some(widened(lattice, lattice.nodes_around(region)?, magnitude))
}

/// First and last node that a region needs, of the nodes around it. `magnitude` is the largest coordinate of the region and the grid.
fn widened(lattice: &Lattice, [first, last]: [[u32; 3]; 2], magnitude: f64) -> [[u32; 3]; 2] {
    // The cast saturates.
    let margin = ((POINT_ERROR * magnitude * lattice.inv_spacing()) as u32).saturating_add(1 + NORMAL_REACH);
    let cells = lattice.cells();
    let last = std::array::from_fn(|axis| last[axis].saturating_add(margin).min(cells[axis]));
    [first.map(|node| node.saturating_sub(margin)), last]
}

fn max_magnitude(bounds: &Aabb) -> f64 {
    (0..3).fold(0.0, |max: f64, axis| max.max(bounds.min[axis].abs()).max(bounds.max[axis].abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Among few blocks exactly those of the boxes are needed; among many also the rest of their groups, and none farther.
    #[test]
    fn blocks_of_boxes_are_needed_and_of_many_blocks_few_others() {
        let counts = [21_u32, 40, 17];
        let mut state = 5_u32;
        let mut random = |below: usize| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as usize % below
        };
        for boxes in [1, 2, 7] {
            let (mut exact, mut grouped) = (BlockMask::new(counts, MAX_COUNTED), BlockMask::new(counts, 0));
            let mut wanted = vec![];
            for _ in 0..boxes {
                let first = counts.map(|count| random(count as usize));
                let last = [0, 1, 2].map(|axis| (first[axis] + random(9)).min(counts[axis] as usize - 1));
                exact.add_box(first, last);
                grouped.add_box(first, last);
                wanted.push((first, last));
            }
            exact.sum();
            grouped.sum();
            for block in blocks([0; 3], counts.map(|count| count as usize - 1)) {
                let block = block.map(|index| index as usize);
                let is_within = |more: usize| {
                    wanted.iter().any(|(first, last)| {
                        (0..3).all(|axis| block[axis] + more >= first[axis] && block[axis] <= last[axis] + more)
                    })
                };
                assert_eq!(exact.contains(block), is_within(0), "{block:?} of {wanted:?}");
                assert!(
                    is_within(0) <= grouped.contains(block) && grouped.contains(block) <= is_within(7),
                    "{block:?}"
                );
            }
        }
    }
}
