//! Shell of a field: |φ| − thickness/2.
//!
//! Bounds follow from |φ| = max(φ, −φ, 0). A path may cross the surface once or more, so its rise is at most that of φ
//! plus that of −φ.

use nalgebra::Vector3;

use super::offset::extent_at;
use crate::enclosure::sum;
use crate::number::interval::Interval;
use crate::number::{Float, Real};
use crate::simplex::mean;
use crate::{Aabb, BoxEnclosure, EnclosedSdf, Enclosure, ErrorBound, Relaxation, Sample, Sdf};

/// A wall with half of `thickness` on either side of the surface: |φ| − thickness/2.
///
/// Degenerate: the old surface, which is the middle of the wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shell<F> {
    field: F,
    thickness: f64,
    extent: f64,
}

impl<F: Sdf> Shell<F> {
    /// `None` unless `thickness` is finite and positive.
    pub fn new(field: F, thickness: f64) -> Option<Self> {
        let extent = extent_at(&field, 0.5 * thickness);
        (thickness.is_finite() && thickness > 0.0).then_some(Self { field, thickness, extent })
    }
}

impl<F> Shell<F> {
    /// The wall's φ and ∇φ from those of the field.
    #[inline]
    fn wall<R: Real>(&self, sample: Sample<R>) -> Sample<R> {
        let mut wall = Sample::select(sample.value.lt(R::zero()), sample.negate(), sample);
        wall.status.degenerate_gradient = wall.status.degenerate_gradient | sample.value.is_zero();
        Sample { value: wall.value - R::from_f64(0.5 * self.thickness), ..wall }
    }

    /// The field whose surface is the middle of the wall.
    pub fn field(&self) -> &F {
        &self.field
    }

    /// Thickness of the wall.
    pub fn thickness(&self) -> f64 {
        self.thickness
    }
}

impl<F: Sdf> Sdf for Shell<F> {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        self.wall(self.field.evaluate(point))
    }

    #[inline]
    fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
        self.wall(self.field.evaluate_smooth(point))
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

    #[inline]
    fn magnitude<R: Real>(&self) -> R {
        self.field.magnitude::<R>() + R::from_f64(0.5 * self.thickness)
    }

    fn extent<R: Real>(&self) -> R {
        R::from_f64(self.extent)
    }
}

impl<F: EnclosedSdf> EnclosedSdf for Shell<F> {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        let inner = self.field.enclose_box(region);
        let lower = inner.range.lower.max(-inner.range.upper).max(0.0);
        let upper = inner.range.upper.max(-inner.range.lower);
        BoxEnclosure { range: Interval { lower, upper }, ..inner }.shift(-0.5 * self.thickness)
    }

    fn error_bound(&self, region: &Aabb) -> ErrorBound {
        let error = self.field.error_bound(region);
        let both = error.max(error.negate());
        // Deep inside and far outside the field alike, |φ| and |d| are above both levels.
        ErrorBound { levels: Interval { lower: f64::NEG_INFINITY, ..both.levels }, ..both }.shift(-0.5 * self.thickness)
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.relaxation(about, corners).enclosure
    }

    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        let outside = self.field.relaxation(about, corners);
        let shell = outside.max(outside.negate()).raise(R::zero()).shift(R::from_f64(-0.5 * self.thickness));
        shell.widen_by_rounding(self, about, corners)
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        R::zero() < self.field.enclosure(mean(corners), corners).range.lower && self.field.is_convex_on(corners)
    }

    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let outside = self.field.enclosure(mean(corners), corners);
        let inside = outside.negate();
        match () {
            () if R::zero() < outside.range.lower => self.field.max_rise_to_corners(corners),
            () if R::zero() < inside.range.lower => inside.gradients.max_rise_to_corners(corners),
            () => sum(self.field.max_rise_to_corners(corners), inside.gradients.max_rise_to_corners(corners)),
        }
    }
}
