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

mod block;
mod bowl;
mod cell;
mod cells;
mod creases;
mod face;
mod level;
mod lines;
mod outline;
mod ways;

use cells::{Cells, LANES, LaneRises};
use creases::Creases;
use face::Face;
use nalgebra::Vector3;
use ways::{Rises, Ways};

use super::polynomial::Polynomial;
use super::segment::Lowest;
use super::{Grid, Storage};
use crate::Aabb;
use crate::real::{Float, Real};
use crate::survey::{bounds, mean, reach, rounding};
use crate::vector::lift;

/// Where on a triangle a field is least.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleMinimum<R> {
    /// Barycentric.
    pub weights: [R; 3],
    /// φ there, but for rounding.
    pub value: R,
    /// No value on the triangle is below this, but for rounding.
    pub least: R,
    /// How many points were asked and cells searched. Cells of which no more than bounds were taken do not count.
    pub looks: u32,
}

impl<S: Storage> Grid<S> {
    /// `None` where the triangle leaves the box or meets many cells, or a sample is no number.
    #[inline(always)]
    pub(super) fn least_in<R: Float>(
        &self,
        corners: [Vector3<R>; 3],
        [level, gap]: [R; 2],
    ) -> Option<TriangleMinimum<R>> {
        if !self.lattice.bounds().encloses(&bounds(&corners)) {
            return None;
        }
        let face = Face::new(&self.lattice, corners.map(|corner| self.in_cells(corner)))?;
        let (values, gradient) = self.at_middle_and_corners(&face.corners);
        let value = values[0];
        // Of the corners where they stand in the world, and of the first node, from which they are counted.
        let Aabb { min, max } = self.lattice.bounds();
        let farthest = min.iter().chain(&max).fold(0.0, |farthest: f64, x| farthest.max(x.abs()));
        let reach = Real::max(reach(corners[0], &corners), R::lift(farthest));
        let rounding = rounding(self.slope_bound, corners[0], reach, value);
        let ways = Ways::new(&face, gradient, R::lift(self.slope_bound * self.lattice.spacing()));
        let mut cells = Cells::of(&face);
        let rises = self.rises(&mut cells, &ways)?;
        let least = value + rises.fall() - rounding;
        let mut lowest = Lowest { weights: [R::lift(1.0 / 3.0); 3], value, looks: 1 };
        let mut deficit = R::zero();
        if least <= level {
            lines::lower_to_corners(&rises, [values[1], values[2], values[3]], &mut lowest);
            let edges = lines::edges(&face, &rises, [values[1], values[2], values[3]], lowest.value);
            let creases = if rises.is_steep() { None } else { Some(Creases::new(&face)) };
            self.follow(edges, creases, &mut lowest)?;
            if !rises.is_steep() {
                deficit = self.inside(&face, &cells, &ways, gap, &mut lowest);
            }
        }
        let Lowest { weights, value, looks } = lowest;
        let least = if least <= level { Real::max(least, value - deficit - rounding) } else { least };
        Some(TriangleMinimum { weights, value, least, looks })
    }

    /// The value at the mean of the corners and at each, all counted in cells, but for rounding; and the derivative at the mean.
    #[inline(always)]
    fn at_middle_and_corners<R: Float>(&self, corners: &[Vector3<R>; 3]) -> ([R; 4], Vector3<R>) {
        let last = lift::<R>(self.lattice.cells().map(f64::from));
        let points = [mean(corners), corners[0], corners[1], corners[2]];
        let cells = points
            .map(|point| point.zip_map(&last, |x, last| Real::min(Real::max(x, R::zero()).trunc(), last - R::one())));
        let samples = self.storage.corners_of([0, 1, 2].map(|axis| cells.map(|cell| cell.as_slice()[axis % 3])));
        let mut values = [R::zero(); 4];
        for k in 0..4 {
            let field = Polynomial::new(samples.map(|lanes| lanes[k % 4]));
            values[k] = field.value(points[k] - cells[k]);
        }
        let field = Polynomial::new(samples.map(|lanes| lanes[0]));
        let share = points[0] - cells[0];
        let gradient = field.gradient(share, &field.bends(share));
        (values, gradient)
    }

    /// Over all cells. `None` where a sample is no number.
    #[inline(always)]
    fn rises<R: Float>(&self, cells: &mut Cells<R>, ways: &Ways<R>) -> Option<Rises<R>> {
        let mut rises = LaneRises::none();
        let mut from = 0;
        while from < cells.count {
            let look = cells.look(&self.storage, ways, from);
            if !look.is_finite {
                return None;
            }
            rises.include(&look);
            from = from.saturating_add(LANES);
        }
        Some(rises.all())
    }

    /// Where the polynomial of a cell may be level. Answers by how much a value there may be less than what was found.
    #[inline(never)]
    fn inside<R: Float>(&self, face: &Face<R>, cells: &Cells<R>, ways: &Ways<R>, gap: R, lowest: &mut Lowest<R>) -> R {
        let mut deficit = R::zero();
        for cell in cells.level(&self.storage) {
            lowest.looks = lowest.looks.saturating_add(1);
            let of_cell = cell.least_inside(face, lowest);
            let is_near = of_cell <= gap;
            deficit = Real::max(deficit, if is_near { of_cell } else { cell.least_level(face, ways, gap, lowest) });
        }
        deficit
    }
}
