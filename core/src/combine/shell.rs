use nalgebra::Vector3;

use crate::real::{Float, Real};
use crate::survey::{mean, sum};
use crate::{Aabb, LocalBounds, Sample, Sdf, Survey};

/// A wall of `thickness`, half to either side of the surface: |φ| − thickness/2. On the old surface, now the middle of
/// the wall, the gradient is a choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shell<F> {
    field: F,
    thickness: f64,
}

impl<F> Shell<F> {
    pub fn new(field: F, thickness: f64) -> Option<Self> {
        (thickness.is_finite() && thickness > 0.0).then_some(Self { field, thickness })
    }
}

impl<F: Sdf> Sdf for Shell<F> {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let sample = self.field.evaluate(point);
        let mut wall = Sample::select(sample.value.lt(R::zero()), sample.negate(), sample);
        wall.status.degenerate_gradient = wall.status.degenerate_gradient | sample.value.is_zero();
        Sample { value: wall.value - R::lift(0.5 * self.thickness), ..wall }
    }

    #[inline]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        self.field.value(point).abs() - R::lift(0.5 * self.thickness)
    }

    fn bounds(&self, level: f64) -> Aabb {
        self.field.bounds(level + 0.5 * self.thickness)
    }

    fn slope_bound(&self) -> f64 {
        self.field.slope_bound()
    }

    fn local_bounds(&self, region: &Aabb) -> LocalBounds {
        let of_field = self.field.local_bounds(region);
        let least = of_field.least.max(-of_field.greatest).max(0.0);
        let greatest = of_field.greatest.max(-of_field.least);
        LocalBounds { least, greatest, ..of_field }.raise(-0.5 * self.thickness)
    }

    fn survey<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Survey<R> {
        let of_field = self.field.survey(about, corners);
        let other_side = of_field.negate();
        let wall = match () {
            () if R::zero() < of_field.least => of_field,
            () if R::zero() < other_side.least => other_side,
            () => Survey {
                value: of_field.value.abs(),
                least: R::zero(),
                greatest: Real::max(of_field.greatest, other_side.greatest),
                gradients: of_field.gradients.union(other_side.gradients),
            },
        };
        wall.raise(R::lift(-0.5 * self.thickness))
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        R::zero() < self.field.survey(mean(corners), corners).least && self.field.is_convex_on(corners)
    }

    fn rises<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let outside = self.field.survey(mean(corners), corners);
        let inside = outside.negate();
        match () {
            () if R::zero() < outside.least => self.field.rises(corners),
            () if R::zero() < inside.least => inside.gradients.rises(corners),
            () => sum(self.field.rises(corners), inside.gradients.rises(corners)),
        }
    }
}
