//! Triangles that meet many cells: block by block, and only in cells with low samples.
//!
//! φ is nowhere in a cell below its lowest sample. So a cell without a sample below a value that φ takes, the *ceiling*, holds no lower
//! minimum, and neither do its borders; nor does a block of such cells. A local search ends at a low value, so few cells are left.
//!
//! A minimum below the ceiling lies in cells that are left, all that meet there: what they say of it (`triangle`) holds as if all cells
//! of the triangle were searched. Blocks share a layer of cells, so all cells around a point are together in one of them.

use nalgebra::Vector3;

use super::cells::{CELL_ROOM, Cells};
use super::corners_and_edges::MinimumPlaces;
use super::descent_table::TABLE_ROOM;
use super::directions::{DirectionalBounds, Directions};
use super::grid_triangle::GridTriangle;
use super::separating_planes::SeparatingPlanes;
use super::{LowestPoint, directional_bounds, minimize_in_cells};
use crate::grid::node_box::NodeBox;
use crate::grid::{Grid, Storage};
use crate::minimize::{Minimizer, Newton};
use crate::number::{Float, Real};
use crate::rounding::NESTED_FIELDS;
use crate::simplex::{corner_weights, mean};
use crate::{ExactMinimum, Goal, Sdf, Simplex};

/// The local search.
const LOCAL: Newton = Newton { iterations: 4, tolerance: 1e-3 };

/// A search in blocks.
struct BlockSearch<R: Float> {
    planes: SeparatingPlanes<R>,
    /// The first cell of the triangle's box, from which the planes count.
    first_cell: [u32; 3],
    directions: Directions<R>,
    single: Directions<f32>,
    goal: Goal<R>,
    rounding: R,
    lowest: LowestPoint<R>,
    deficit: R,
    /// Lower bound of φ in the cells that were left out.
    above: R,
}

impl<S: Storage> Grid<S> {
    /// The minimum on a triangle in this box. `None` if there are too many blocks, or a sample is not finite.
    #[inline(always)]
    pub(super) fn minimum_by_blocks<R: Float>(
        &self,
        triangle: &GridTriangle<R>,
        corners: [Vector3<R>; 3],
        goal: Goal<R>,
    ) -> Option<ExactMinimum<R, 3>> {
        let blocks = triangle.blocks()?;
        let (lowest, gradient) = self.low_point(corners, goal.level);
        let rounding = self.triangle_rounding(&corners, lowest.value);
        let slope_bound = self.slope_bound_in_cells();
        let directions = Directions::new(triangle, gradient * R::from_f64(self.lattice.spacing()), slope_bound);
        let single = directions.to_single(slope_bound);
        let above = R::from_f64(f64::INFINITY);
        let (planes, first_cell) = (SeparatingPlanes::new(triangle), triangle.first_cell);
        let mut search =
            BlockSearch { planes, first_cell, directions, single, goal, rounding, lowest, deficit: R::zero(), above };
        for block in blocks {
            search.search(&self.storage, &block)?;
        }
        let BlockSearch { lowest: LowestPoint { weights, value, evaluations }, deficit, above, .. } = search;
        let lower_bound = Real::min(value - deficit, above) - rounding;
        Some(ExactMinimum { weights, value, lower_bound, evaluations })
    }

    /// The lowest of corners and centroid, or the end of a local search, if that is at most the level. With the gradient there.
    fn low_point<R: Float>(&self, corners: [Vector3<R>; 3], level: R) -> (LowestPoint<R>, Vector3<R>) {
        let mut lowest = LowestPoint { weights: [R::from_f64(1.0 / 3.0); 3], value: R::zero(), evaluations: 4 };
        let mut sample = self.evaluate(mean(&corners));
        for (k, corner) in corners.into_iter().enumerate() {
            let at_corner = self.evaluate(corner);
            if at_corner.value < sample.value {
                (lowest.weights, sample) = (corner_weights(k), at_corner);
            }
        }
        if sample.value <= level {
            let found = LOCAL.minimize(self, &Simplex { corners });
            lowest = LowestPoint { weights: found.weights, evaluations: found.evaluations.to_f64() as u32, ..lowest };
            sample = found.sample;
        }
        (LowestPoint { value: sample.value, ..lowest }, sample.gradient)
    }
}

impl<R: Float> BlockSearch<R> {
    /// The value from which on cells are left out.
    fn ceiling(&self) -> f32 {
        let above_level = self.goal.level + self.rounding * R::from_f64(NESTED_FIELDS);
        Real::min(self.lowest.value, above_level).to_single().next_up()
    }

    /// Includes a block. `None` if a sample is not finite.
    #[inline(always)]
    fn search<S: Storage>(&mut self, storage: &S, block: &GridTriangle<R>) -> Option<()> {
        let ceiling = self.ceiling();
        let Some(block) = &self.shrunk(block) else { return Some(()) };
        let last_node = block.last_cell.map(|cell| cell.wrapping_add(1));
        if S::HAS_LOWEST
            && let Some(lowest) = storage.lowest(block.first_cell, last_node)
            && ceiling <= lowest
        {
            self.above = Real::min(self.above, R::from_stored(lowest));
            return Some(());
        }
        let nodes = NodeBox::new(storage, block.first_cell, block.cell_counts().map(|cells| cells.wrapping_add(1)));
        if !nodes.is_finite() {
            return None;
        }
        let mut cells = Cells::<CELL_ROOM>::new(block);
        let above = cells.collect_low(block, &nodes, ceiling);
        self.above = Real::min(self.above, R::from_stored(above));
        if cells.count == 0 {
            return Some(());
        }
        let bounds = DirectionalBounds::from_single(directional_bounds(&nodes, &mut cells, &self.single)?);
        let places = MinimumPlaces::in_cells::<R>(&bounds);
        let Self { directions, goal, lowest, .. } = self;
        let deficit =
            minimize_in_cells::<_, _, _, TABLE_ROOM>(&nodes, block, &cells, directions, &places, goal.gap, lowest)?;
        self.deficit = Real::max(self.deficit, deficit);
        Some(())
    }

    /// The block without cells that the triangle misses along each axis. `None` if it misses all.
    #[inline(always)]
    fn shrunk(&self, block: &GridTriangle<R>) -> Option<GridTriangle<R>> {
        let before = |axis: usize| block.first_cell[axis % 3].wrapping_sub(self.first_cell[axis % 3]);
        let first = [before(0), before(1), before(2)];
        let counts = block.cell_counts();
        let float = |count: u32| R::from_f64(f64::from(count));
        let lower = first.map(float);
        let upper = [0, 1, 2].map(|axis: usize| float(first[axis % 3].wrapping_add(counts[axis % 3])));
        let [from, to] = self.planes.met_part(lower, upper);
        let mut shrunk = *block;
        for axis in 0..3 {
            let (from, to) = (from[axis], to[axis]);
            if to < from {
                return None;
            }
            let cell = |x: R| {
                let cell = self.first_cell[axis].wrapping_add(x.trunc().to_index());
                cell.clamp(block.first_cell[axis], block.last_cell[axis])
            };
            (shrunk.first_cell[axis], shrunk.last_cell[axis]) = (cell(from), cell(to));
        }
        Some(shrunk)
    }
}
