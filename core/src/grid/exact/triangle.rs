//! Exact minimum of a trilinear grid on a triangle, without iteration over the triangle.
//!
//! ```text
//!        c                 The cell faces x = i, y = j, z = k cut the triangle into convex polygons.
//!       /|\                On each polygon φ is one cubic polynomial without pure second derivatives.
//!      /-+--\              A minimum is therefore
//!     / |    \               (a) a corner of the triangle,
//!    /--+-----\              (b) on an edge or on a cut, where φ is a univariate cubic per cell, or
//!   a---+------b             (c) a stationary point inside a polygon.
//! ```
//!
//! | step | question | file |
//! |---|---|---|
//! | 1 | Which cells does the triangle meet? | `grid_triangle`, `cell_range`, `separating_planes` (Akenine-Möller 2001), `cells` |
//! | 2 | In which interval is ∇φ·d, for four directions d in the plane? Mean value form (Moore 1966) | `directions`, `cell`, `cells` |
//! | 3 | (a), and which edges can hold a minimum? Those without a descent direction (Clarke 1983, prop. 2.3.2) | `corners_and_edges` |
//! | 4 | (b): on which parts of these edges and of the cuts do the cells around share no descent direction? | `descent_table` |
//! | 5 | The minimum on these parts | `line_parts` |
//! | 6 | (c): saddle → minimum on the boundary; else at most four Newton steps | `interior_minimum` |
//! | 7 | What step 6 leaves undecided is bisected and bounded by ½‖H‖r² (Taylor) | `stationary` |
//! | – | A triangle that meets many cells: the same in blocks of its box, and only in cells with low samples | `blocks` |
//!
//! If φ is monotonic along some d in all cells, cuts and interiors have no minimum, and only edges are left. Most triangles end
//! after one corner or edge, the others after a few parts of cuts.
//!
//! Steps 1 and 2 only exclude. They are in single precision, which samples have anyway, and widened by its rounding. What is
//! evaluated is evaluated in the caller's numbers.

mod blocks;
mod cell;
mod cell_range;
mod cells;
mod corners_and_edges;
mod descent_table;
mod directions;
mod grid_triangle;
mod interior_minimum;
mod line_parts;
mod separating_planes;
mod stationary;
mod team_list;

use cells::{CELL_ROOM, Cells, DirectionalBoundsLanes};
use corners_and_edges::MinimumPlaces;
use descent_table::{DescentTable, TABLE_ROOM};
use directions::{DirectionalBounds, Directions};
use grid_triangle::GridTriangle;
use line_parts::LineParts;
use nalgebra::Vector3;
use separating_planes::SeparatingPlanes;

use super::polynomial::Polynomial;
use super::{LANES, corners_of_thread, of_all_lanes};
use crate::grid::node_box::NodeBox;
use crate::grid::{Grid, Storage};
use crate::number::{Float, Real};
use crate::rounding::{FieldScale, rounding};
use crate::simplex::{max_distance, mean};
use crate::{Aabb, ExactMinimum, Goal};

/// Most cells along an axis of a triangle's box that are all searched. Of more, those with low samples.
const FEW_CELLS: u32 = 10;

/// Largest change of φ over a cell: its square, times a few hundred, is a number of single precision.
const STEEPEST: f64 = 1e18;

impl<S: Storage> Grid<S> {
    /// `None` if the triangle leaves the box or meets too many cells, a sample is not finite, or φ changes by so much over a cell that
    /// single precision does not hold its square.
    // On small processors not inlined: its 8 KB of stack are free again when a search by branch and bound begins.
    #[cfg_attr(feature = "std", inline(always))]
    #[cfg_attr(not(feature = "std"), inline(never))]
    pub(in crate::grid) fn minimum_on_triangle<R: Float>(
        &self,
        corners: [Vector3<R>; 3],
        goal: Goal<R>,
    ) -> Option<ExactMinimum<R, 3>> {
        let is_steep = R::from_f64(STEEPEST) < self.slope_bound_in_cells::<R>();
        if is_steep || !self.lattice.bounds().encloses(&Aabb::from_corners(&corners)) {
            return None;
        }
        let triangle = GridTriangle::new(&self.lattice, corners.map(|corner| self.cell_coordinates(corner)))?;
        // Small processors have no memory for blocks, and answers in single precision are the same everywhere.
        let has_blocks = cfg!(feature = "std") && R::EPSILON < 1e-10;
        let is_small = triangle.is_small();
        if has_blocks && (FEW_CELLS < triangle.extent || !is_small) {
            return self.minimum_by_blocks(&triangle, corners, goal);
        }
        if !is_small {
            return None;
        }
        if !S::IS_COPIED {
            return self.search_triangle(&self.storage, &triangle, corners, goal);
        }
        let nodes = NodeBox::new(&self.storage, triangle.first_cell, triangle.cell_counts().map(|n| n.wrapping_add(1)));
        self.search_triangle(&nodes, &triangle, corners, goal)
    }

    /// The search, with the nodes of the triangle's box in `storage`.
    #[inline(always)]
    fn search_triangle<R: Float, T: Storage>(
        &self,
        storage: &T,
        triangle: &GridTriangle<R>,
        corners: [Vector3<R>; 3],
        goal: Goal<R>,
    ) -> Option<ExactMinimum<R, 3>> {
        const {
            assert!(T::LANES_OF_THREAD == LANES || T::LANES_OF_THREAD == 1);
        }
        if T::LANES_OF_THREAD == LANES {
            self.search_in_room::<R, T, CELL_ROOM, TABLE_ROOM>(storage, triangle, corners, goal)
        } else {
            self.search_in_room::<R, T, { CELL_ROOM / LANES }, { TABLE_ROOM / LANES }>(storage, triangle, corners, goal)
        }
    }

    /// The search, in a thread's share of the lists of its team.
    #[inline(always)]
    fn search_in_room<R: Float, T: Storage, const CELLS: usize, const TABLE: usize>(
        &self,
        storage: &T,
        triangle: &GridTriangle<R>,
        corners: [Vector3<R>; 3],
        Goal { level, gap }: Goal<R>,
    ) -> Option<ExactMinimum<R, 3>> {
        let points = self.centroid_and_corners(storage, &triangle.corners);
        // Collected here, while the samples come from memory, and long before they are loaded as vectors: numbers
        // just stored one by one stall a vector load.
        let mut cells = Cells::<CELLS>::new(triangle);
        cells.collect(storage, triangle);
        let (values, gradient) = points.values();
        let (value, corner_values) = (values[0], [values[1], values[2], values[3]]);
        let rounding = self.triangle_rounding(&corners, value);
        let slope_bound = self.slope_bound_in_cells();
        let directions = Directions::new(triangle, gradient, slope_bound);
        let single = directions.to_single(slope_bound);
        let bounds = DirectionalBounds::from_single(directional_bounds(storage, &mut cells, &single)?);
        let lower_bound = value + bounds.min_rise_from_centroid() - rounding;
        let mut lowest = LowestPoint { weights: [R::from_f64(1.0 / 3.0); 3], value, evaluations: 1 };
        let mut deficit = R::zero();
        if lower_bound <= level {
            corners_and_edges::minimize_on_corners(&bounds, corner_values, &mut lowest);
            let places = MinimumPlaces::on_triangle(&bounds, corner_values, lowest.value);
            deficit = minimize_in_cells::<R, T, CELLS, TABLE>(
                storage,
                triangle,
                &cells,
                &directions,
                &places,
                gap,
                &mut lowest,
            )?;
        }
        let LowestPoint { weights, value, evaluations } = lowest;
        let lower_bound =
            if lower_bound <= level { Real::max(lower_bound, value - deficit - rounding) } else { lower_bound };
        Some(ExactMinimum { weights, value, lower_bound, evaluations })
    }

    /// Rounding of φ on the triangle.
    #[inline(always)]
    fn triangle_rounding<R: Float>(&self, corners: &[Vector3<R>; 3], value: R) -> R {
        let distance = max_distance(corners[0], corners);
        rounding(FieldScale::new(self), corners[0], distance, value)
    }

    /// The cells of the centroid and of the corners, with their samples.
    #[inline(always)]
    fn centroid_and_corners<R: Float, T: Storage>(&self, storage: &T, corners: &[Vector3<R>; 3]) -> CellPoints<R> {
        let last = self.lattice.cells().map(|cells| R::from_f64(f64::from(cells)) - R::one());
        let [a, b, c] = *corners;
        let points = [mean(corners), a, b, c];
        let mut cells = [[R::zero(); 4]; 3];
        for k in 0..4 {
            let cell = |x: R, last: R| Real::min(Real::max(x, R::zero()).trunc(), last);
            (cells[0][k], cells[1][k]) = (cell(points[k].x, last[0]), cell(points[k].y, last[1]));
            cells[2][k] = cell(points[k].z, last[2]);
        }
        let samples = storage.corners_in_lanes(cells);
        let fractions = [0, 1, 2, 3].map(|k: usize| {
            let k = k % 4;
            points[k] - Vector3::new(cells[0][k], cells[1][k], cells[2][k])
        });
        CellPoints { fractions, samples }
    }
}

/// Intervals of ∇φ·d over all cells. `None` if a sample is not finite.
#[inline(always)]
fn directional_bounds<S: Storage, const CELLS: usize>(
    storage: &S,
    cells: &mut Cells<CELLS>,
    directions: &Directions<f32>,
) -> Option<DirectionalBounds<f32>> {
    let mut bounds = DirectionalBoundsLanes::empty();
    let mut from = 0;
    while from < cells.count {
        cells.bound_directions(storage, directions, from, &mut bounds);
        from = from.saturating_add(LANES);
    }
    bounds.merge(storage)
}

/// Lowers `lowest` to the minima in these cells. Returns the deficit; `None` if a value is not finite.
#[inline(always)]
fn minimize_in_cells<R: Float, S: Storage, const CELLS: usize, const TABLE: usize>(
    storage: &S,
    triangle: &GridTriangle<R>,
    cells: &Cells<CELLS>,
    directions: &Directions<R>,
    &MinimumPlaces { feasible, has_interior }: &MinimumPlaces,
    gap: R,
    lowest: &mut LowestPoint<R>,
) -> Option<R> {
    if has_interior || feasible != [0; 3] {
        let mut table = DescentTable::<TABLE>::new(triangle);
        table.fill(storage, triangle, cells, feasible, has_interior);
        minimize_on_parts(storage, triangle, &table, lowest)?;
    }
    Some(if has_interior { minimize_interiors(storage, triangle, cells, directions, gap, lowest) } else { R::zero() })
}

/// Lowers `lowest` to the minima on those parts of edges and creases that may hold one. `None` if a value is not finite.
#[inline(always)]
fn minimize_on_parts<R: Float, S: Storage, const TABLE: usize>(
    storage: &S,
    triangle: &GridTriangle<R>,
    table: &DescentTable<TABLE>,
    lowest: &mut LowestPoint<R>,
) -> Option<()> {
    let (mut parts, mut to_search) = (LineParts::new(), table.parts(storage));
    while parts.fill(storage, triangle, &mut to_search) {
        parts.minimize(triangle, storage, lowest)?;
    }
    Some(())
}

/// Lowers `lowest` to the minima inside the polygons. Returns the deficit.
#[inline(never)]
fn minimize_interiors<R: Float, S: Storage, const CELLS: usize>(
    storage: &S,
    triangle: &GridTriangle<R>,
    cells: &Cells<CELLS>,
    directions: &Directions<R>,
    gap: R,
    lowest: &mut LowestPoint<R>,
) -> R {
    let mut deficit = R::zero();
    let planes = SeparatingPlanes::new(triangle);
    for cell in cells.stationary_cells(triangle, storage) {
        lowest.evaluations = lowest.evaluations.saturating_add(1);
        let interior = cell.interior_deficit(triangle, lowest);
        let is_settled = interior <= gap;
        deficit = Real::max(
            deficit,
            if is_settled { interior } else { cell.stationary_deficit(triangle, &planes, directions, gap, lowest) },
        );
    }
    deficit
}

/// Samples at the corners of one lane's cell.
#[inline(always)]
fn in_lane<T: Copy>(samples: &[[T; LANES]; 8], lane: usize) -> [T; 8] {
    let [a, b, c, d, e, f, g, h] = samples;
    [a[lane], b[lane], c[lane], d[lane], e[lane], f[lane], g[lane], h[lane]]
}

/// The lowest point of a triangle so far.
#[derive(Clone, Copy)]
struct LowestPoint<R> {
    weights: [R; 3],
    value: R,
    /// Points evaluated and parts or cells searched so far.
    evaluations: u32,
}

/// Centroid and corners, each in its cell.
struct CellPoints<R: Real> {
    /// Position in the cell.
    fractions: [Vector3<R>; 4],
    /// Samples by corner of the cell, then by point.
    samples: [[R; 4]; 8],
}

impl<R: Float> CellPoints<R> {
    /// φ at each point, and ∇φ at the first, in cell coordinates.
    #[inline(always)]
    fn values(&self) -> ([R; 4], Vector3<R>) {
        let mut values = [R::zero(); 4];
        for k in 0..4 {
            values[k] = self.polynomial(k).value(self.fractions[k]);
        }
        let (polynomial, fraction) = (self.polynomial(0), self.fractions[0]);
        (values, polynomial.gradient(fraction, &polynomial.mixed_derivatives(fraction)))
    }

    #[inline(always)]
    fn polynomial(&self, k: usize) -> Polynomial<R> {
        let sample = |corner: usize| self.samples[corner % 8][k % 4];
        Polynomial::new([sample(0), sample(1), sample(2), sample(3), sample(4), sample(5), sample(6), sample(7)])
    }
}
