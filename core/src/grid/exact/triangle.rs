//! The least value of a trilinear interpolant on a triangle, without a search.
//!
//! The faces of the cells cut the triangle into polygons, on each of which the field is one polynomial. The least value is at
//! a corner of the triangle, on one of its edges, where a face of a cell crosses it (along all these lines the field is a
//! cubic in each cell: see `segment`), or inside of a polygon where the polynomial is level along the triangle.
//!
//! How fast φ can change along a way in the triangle is bounded in each cell by the derivative at the middle of the part of
//! the cell that the triangle's box meets, and by how that varies over it. Where some way is downhill in all cells, no least
//! value is inside, nor on an edge from which that way leads inwards (0 is in the generalized gradient of a minimum: Clarke
//! 1983, "Optimization and Nonsmooth Analysis", prop. 2.3.2). That settles most triangles but for a corner or an edge.
//!
//! Within one cell the polynomial has no second derivative along any axis. So along most planes it is a saddle somewhere:
//! where it curves downwards along some way in the triangle, the least of a polygon is on its boundary. Where it curves by
//! c at most along a way whose longest chord is l, none is lower than on the boundary by more than c l² / 8.

mod cell;
mod cell_face_cuts;
mod cell_range;
mod cells;
mod directions;
mod face;
mod interior_minimum;
mod lines;
mod separating_planes;
mod stationary;

use cell_face_cuts::CellFaceCuts;
use cells::{Cells, DirectionalBoundsLanes, LANES};
use directions::{DirectionalBounds, Directions};
use face::Face;
use nalgebra::Vector3;

use super::polynomial::Polynomial;
use super::segment::Lowest;
use crate::grid::{Grid, Storage};
use crate::number::{Float, Real};
use crate::rounding::rounding;
use crate::simplex::{max_distance, mean};
use crate::{Aabb, ExactMinimum, Goal};

impl<S: Storage> Grid<S> {
    /// `None` where the triangle leaves the box or meets many cells, or a sample is no number.
    #[inline(always)]
    pub(in crate::grid) fn minimum_on_triangle<R: Float>(
        &self,
        corners: [Vector3<R>; 3],
        Goal { level, gap }: Goal<R>,
    ) -> Option<ExactMinimum<R, 3>> {
        if !self.lattice.bounds().encloses(&Aabb::around_corners(&corners)) {
            return None;
        }
        let face = Face::new(&self.lattice, corners.map(|corner| self.in_cells(corner)))?;
        let points = self.middle_and_corners(&face.corners);
        // While the samples come from memory, and well before the cells are looked at: what was just stored one by one is slow to
        // load side by side.
        let mut cells = Cells::new(&face);
        cells.find(&face);
        let (values, gradient) = points.values();
        let value = values[0];
        // Of the corners where they stand in the world, and of the first node, from which they are counted.
        let Aabb { min, max } = self.lattice.bounds();
        let farthest = min.iter().chain(&max).fold(0.0, |farthest: f64, x| farthest.max(x.abs()));
        let reach = Real::max(max_distance(corners[0], &corners), R::from_f64(farthest));
        let rounding = rounding(self.slope_bound, corners[0], reach, value);
        let directions = Directions::new(&face, gradient, R::from_f64(self.slope_bound * self.lattice.spacing()));
        let rises = self.directional_bounds(&mut cells, &directions)?;
        let least = value + rises.fall() - rounding;
        let mut lowest = Lowest { weights: [R::from_f64(1.0 / 3.0); 3], value, looks: 1 };
        let mut deficit = R::zero();
        if least <= level {
            lines::lower_to_corners(&rises, [values[1], values[2], values[3]], &mut lowest);
            let edges = lines::edges(&face, &rises, [values[1], values[2], values[3]], lowest.value);
            let is_steep = rises.is_steep();
            self.follow(edges, &mut CellFaceCuts::new(&face, !is_steep), &mut lowest)?;
            if !is_steep {
                deficit = self.inside(&face, &cells, &directions, gap, &mut lowest);
            }
        }
        let Lowest { weights, value, looks } = lowest;
        let least = if least <= level { Real::max(least, value - deficit - rounding) } else { least };
        Some(ExactMinimum { weights, value, lower_bound: least, evaluations: looks })
    }

    /// All counted in cells.
    #[inline(always)]
    fn middle_and_corners<R: Float>(&self, corners: &[Vector3<R>; 3]) -> Points<R> {
        let last = self.lattice.cells().map(|cells| R::from_f64(f64::from(cells)) - R::one());
        let [a, b, c] = *corners;
        let points = [mean(corners), a, b, c];
        let mut cells = [[R::zero(); 4]; 3];
        for k in 0..4 {
            let cell = |x: R, last: R| Real::min(Real::max(x, R::zero()).trunc(), last);
            (cells[0][k], cells[1][k]) = (cell(points[k].x, last[0]), cell(points[k].y, last[1]));
            cells[2][k] = cell(points[k].z, last[2]);
        }
        let samples = self.storage.corners_in_lanes(cells);
        let shares = [0, 1, 2, 3].map(|k: usize| {
            let k = k % 4;
            points[k] - Vector3::new(cells[0][k], cells[1][k], cells[2][k])
        });
        Points { shares, samples }
    }

    /// Over all cells. `None` where a sample is no number.
    #[inline(always)]
    fn directional_bounds<R: Float>(
        &self,
        cells: &mut Cells<R>,
        directions: &Directions<R>,
    ) -> Option<DirectionalBounds<R>> {
        let mut rises = DirectionalBoundsLanes::none();
        let mut from = 0;
        while from < cells.count {
            cells.look(&self.storage, directions, from, &mut rises);
            from = from.saturating_add(LANES);
        }
        rises.all()
    }

    /// Where the polynomial of a cell may be level. Answers by how much a value there may be less than what was found.
    #[inline(never)]
    fn inside<R: Float>(
        &self,
        face: &Face<R>,
        cells: &Cells<R>,
        directions: &Directions<R>,
        gap: R,
        lowest: &mut Lowest<R>,
    ) -> R {
        let mut deficit = R::zero();
        for cell in cells.level(&self.storage) {
            lowest.looks = lowest.looks.saturating_add(1);
            let of_cell = cell.least_inside(face, lowest);
            let is_near = of_cell <= gap;
            deficit = Real::max(
                deficit,
                if is_near { of_cell } else { cell.minimum_near_stationary(face, directions, gap, lowest) },
            );
        }
        deficit
    }
}

/// Some points, each in its cell.
struct Points<R: Real> {
    /// From the cell's first corner.
    shares: [Vector3<R>; 4],
    /// By corner of the cell.
    samples: [[R; 4]; 8],
}

impl<R: Float> Points<R> {
    /// The value at each, but for rounding, and the derivative at the first.
    #[inline(always)]
    fn values(&self) -> ([R; 4], Vector3<R>) {
        let mut values = [R::zero(); 4];
        for k in 0..4 {
            values[k] = self.field(k).value(self.shares[k]);
        }
        let (field, share) = (self.field(0), self.shares[0]);
        (values, field.gradient(share, &field.bends(share)))
    }

    #[inline(always)]
    fn field(&self, k: usize) -> Polynomial<R> {
        let of = |corner: usize| self.samples[corner % 8][k % 4];
        Polynomial::new([of(0), of(1), of(2), of(3), of(4), of(5), of(6), of(7)])
    }
}
