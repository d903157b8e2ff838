//! Which parts of a grid will be asked for.

use sdf_core::grid::sparse::BRICK;
use sdf_core::grid::{Grid, Lattice, Storage};
use sdf_core::{Aabb, EnclosedSdf, Sdf};

use super::tiling::Tile;

/// How far, of the largest coordinate, a point may be from where it should be when it is asked for in f32: a minimizer's
/// point and its steps from the origin are off by three roundings of a half.
const OFF: f64 = 32.0 * f32::EPSILON as f64;

/// How far off, of the largest number and a slope of one, a cull may be that goes by an element's bounds: twice what
/// [`sdf_core::contact`] allows for in f32.
const CULL_OFF: f64 = 64.0 * f32::EPSILON as f64;

/// Blocks of [`BRICK`] nodes along each axis, and how many regions reach each.
pub(super) struct Reached {
    /// Along x, y and z, with one more than there are.
    counts: [usize; 3],
    by: Vec<u32>,
    /// Blocks that surely are, before they are counted.
    surely: Vec<bool>,
}

impl Reached {
    /// `grid` need know the bounds of nodes alone.
    ///
    /// A region in which no value is as low as `level` reaches nothing: see `GridReader::read_reached`. Any other
    /// reaches the nodes of all cells that it meets, and as many more to all sides as rounding may need.
    pub(super) fn by_regions(grid: &Grid<impl Storage>, regions: impl IntoIterator<Item = Aabb>, level: f64) -> Self {
        let lattice = grid.lattice();
        let nodes = lattice.nodes();
        let counts: [usize; 3] = std::array::from_fn(|axis| nodes[axis].div_ceil(BRICK) as usize + 1);
        let blocks = counts.iter().product();
        let mut reached = Self { counts, by: vec![0; blocks], surely: vec![false; blocks] };
        let of_lattice = largest_number(&lattice.bounds());
        for region in regions {
            let largest = largest_number(&region).max(of_lattice);
            let near = nodes_near(lattice, &region, largest);
            let [first, last] = near.unwrap_or([[0; 3], lattice.cells()]);
            let block = |node: [u32; 3]| node.map(|along| (along / BRICK) as usize);
            let (first, last) = (block(first), block(last));
            // Of a mesh most elements reach what one before them has reached.
            if reached.is_surely(first, last) {
                continue;
            }
            let rounding = CULL_OFF * grid.slope_bound().max(1.0) * largest.max(level.abs());
            if near.is_none() || grid.enclose_box(&region).range.lower <= level + rounding {
                reached.begin(first, last);
            }
        }
        reached.sum();
        reached
    }

    /// Whether any region reaches a block of a tile of the grid's nodes.
    pub(super) fn meets(&self, tile: Tile) -> bool {
        let along = |axis: usize| {
            let (first, past) = (tile.first[axis], tile.first[axis] + tile.size[axis]);
            first / BRICK as usize..past.div_ceil(BRICK as usize)
        };
        along(0).any(|z| along(1).any(|y| along(2).any(|x| self.holds([x, y, z]))))
    }

    /// Whether any region reaches a block.
    pub(super) fn holds(&self, block: [usize; 3]) -> bool {
        self.by[self.index(block)] != 0
    }

    /// Whether all of a few blocks are known to be reached, so that one region more changes nothing.
    fn is_surely(&self, first: [usize; 3], last: [usize; 3]) -> bool {
        let row = |y, z| {
            let [first, last] = [first[0], last[0]].map(|x| self.index([x, y, z]));
            self.surely[first..=last].iter().all(|surely| *surely)
        };
        is_few(first, last) && (first[2]..=last[2]).all(|z| (first[1]..=last[1]).all(|y| row(y, z)))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    /// Notes where the count rises by one and where it falls again, so that a region costs the same whatever its size:
    /// [`Self::sum`] makes counts of it.
    fn begin(&mut self, first: [usize; 3], last: [usize; 3]) {
        for corner in 0..8_u32 {
            let past = [0, 1, 2].map(|axis| corner >> axis & 1 == 1);
            let block = std::array::from_fn(|axis| if past[axis] { last[axis] + 1 } else { first[axis] });
            let at = self.index(block);
            let falls = corner.count_ones() % 2 == 1;
            self.by[at] = if falls { self.by[at].wrapping_sub(1) } else { self.by[at].wrapping_add(1) };
        }
        if is_few(first, last) {
            for (z, y) in (first[2]..=last[2]).flat_map(|z| (first[1]..=last[1]).map(move |y| (z, y))) {
                let [first, last] = [first[0], last[0]].map(|x| self.index([x, y, z]));
                self.surely[first..=last].fill(true);
            }
        }
    }

    fn sum(&mut self) {
        let mut step = 1;
        for count in self.counts {
            for line in self.by.chunks_exact_mut(step * count) {
                for at in step..line.len() {
                    line[at] = line[at].wrapping_add(line[at - step]);
                }
            }
            step *= count;
        }
    }
}

/// As many blocks as an element of a mesh reaches, at most two along each axis: of more it costs more to ask each.
fn is_few(first: [usize; 3], last: [usize; 3]) -> bool {
    (0..3).all(|axis| last[axis] - first[axis] < 2)
}

/// `None` where the region is no box. `largest` is the largest of its numbers and the grid's.
fn nodes_near(lattice: &Lattice, region: &Aabb, largest: f64) -> Option<[[u32; 3]; 2]> {
    let [first, last] = lattice.nodes_around(region)?;
    // As u32 it is at most the largest of them.
    let more = ((OFF * largest * lattice.inv_spacing()) as u32).saturating_add(1);
    let cells = lattice.cells();
    let last = std::array::from_fn(|axis| last[axis].saturating_add(more).min(cells[axis]));
    Some([first.map(|node| node.saturating_sub(more)), last])
}

fn largest_number(bounds: &Aabb) -> f64 {
    (0..3).fold(0.0, |largest: f64, axis| largest.max(bounds.min[axis].abs()).max(bounds.max[axis].abs()))
}
