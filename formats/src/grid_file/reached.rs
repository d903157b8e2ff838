//! Which parts of a grid will be asked for.

use sdf_core::grid::{Grid, Lattice, Storage};
use sdf_core::{Aabb, Sdf};

/// How far, of the largest coordinate, a point may be from where it should be when it is asked for in f32: a minimizer's
/// point and its steps from the origin are off by three roundings of a half.
const OFF: f64 = 8.0 * f32::EPSILON as f64;

/// How far off, of the largest number and a slope of one, a cull may be that goes by an element's bounds: twice what
/// [`sdf_core::contact`] allows for in f32.
const CULL_OFF: f64 = 64.0 * f32::EPSILON as f64;

/// Blocks of nodes, and how many regions reach each.
pub(super) struct Reached {
    /// Along x, y and z, with one more than there are.
    counts: [usize; 3],
    by: Vec<u32>,
}

impl Reached {
    /// `sides` are the nodes of a block along each axis. `grid` need know the bounds of nodes alone.
    ///
    /// A region in which no value is as low as `level` reaches nothing: see `GridReader::read_reached`. Any other
    /// reaches the nodes of all cells that it meets, and as many more to all sides as rounding may need.
    pub(super) fn by_regions(
        grid: &Grid<impl Storage>,
        sides: [usize; 3],
        regions: impl IntoIterator<Item = Aabb>,
        level: f64,
    ) -> Self {
        let lattice = grid.lattice();
        let nodes = lattice.nodes();
        let counts: [usize; 3] = std::array::from_fn(|axis| (nodes[axis] as usize).div_ceil(sides[axis]) + 1);
        let mut reached = Self { counts, by: vec![0; counts.iter().product()] };
        for region in regions {
            let near = nodes_near(lattice, &region);
            let rounding = CULL_OFF * grid.slope_bound().max(1.0) * largest_number(lattice, &region).max(level.abs());
            if near.is_some() && grid.local_bounds(&region).least > level + rounding {
                continue;
            }
            let [first, last] = near.unwrap_or([[0; 3], lattice.cells()]);
            let block = |node: [u32; 3]| std::array::from_fn(|axis| node[axis] as usize / sides[axis]);
            reached.begin(block(first), block(last));
        }
        reached.sum();
        reached
    }

    /// Whether any region reaches a block.
    pub(super) fn holds(&self, block: [usize; 3]) -> bool {
        self.by[self.index(block)] != 0
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

/// `None` where the region is no box.
fn nodes_near(lattice: &Lattice, region: &Aabb) -> Option<[[u32; 3]; 2]> {
    let [first, last] = lattice.nodes_around(region)?;
    // As u32 it is at most the largest of them.
    let more = ((OFF * largest_number(lattice, region) * lattice.per_spacing()) as u32).saturating_add(1);
    let cells = lattice.cells();
    let last = std::array::from_fn(|axis| last[axis].saturating_add(more).min(cells[axis]));
    Some([first.map(|node| node.saturating_sub(more)), last])
}

fn largest_number(lattice: &Lattice, region: &Aabb) -> f64 {
    let bounds = lattice.bounds();
    let numbers = [region.min, region.max, bounds.min, bounds.max];
    numbers.iter().flatten().fold(0.0, |largest, x| x.abs().max(largest))
}
