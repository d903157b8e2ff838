use nalgebra::Vector3;

use crate::enclosure::{mean, sum};
use crate::number::{Float, Real};
use crate::{Aabb, BoxEnclosure, Enclosure, Sample, Sdf};

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
        Sample { value: wall.value - R::from_f64(0.5 * self.thickness), ..wall }
    }

    #[inline]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        self.field.value(point).abs() - R::from_f64(0.5 * self.thickness)
    }

    fn bounds(&self, level: f64) -> Aabb {
        self.field.bounds(level + 0.5 * self.thickness)
    }

    fn slope_bound(&self) -> f64 {
        self.field.slope_bound()
    }

    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        let of_field = self.field.enclose_box(region);
        let least = of_field.least.max(-of_field.greatest).max(0.0);
        let greatest = of_field.greatest.max(-of_field.least);
        BoxEnclosure { least, greatest, ..of_field }.raise(-0.5 * self.thickness)
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        let of_field = self.field.enclosure(about, corners);
        let other_side = of_field.negate();
        let wall = match () {
            () if R::zero() < of_field.least => of_field,
            () if R::zero() < other_side.least => other_side,
            () => Enclosure {
                value: of_field.value.abs(),
                least: R::zero(),
                greatest: Real::max(of_field.greatest, other_side.greatest),
                gradients: of_field.gradients.union(other_side.gradients),
            },
        };
        wall.raise(R::from_f64(-0.5 * self.thickness))
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        R::zero() < self.field.enclosure(mean(corners), corners).least && self.field.is_convex_on(corners)
    }

    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let outside = self.field.enclosure(mean(corners), corners);
        let inside = outside.negate();
        match () {
            () if R::zero() < outside.least => self.field.max_rise_to_corners(corners),
            () if R::zero() < inside.least => inside.gradients.max_rise_to_corners(corners),
            () => sum(self.field.max_rise_to_corners(corners), inside.gradients.max_rise_to_corners(corners)),
        }
    }
}
