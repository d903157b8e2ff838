use nalgebra::Vector3;

use crate::real::{Float, Real};
use crate::vector::norm;
use crate::{Aabb, Sdf, Simplex};

/// What is certain of a field on the convex hull of one to four points, after one look at their mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Survey<R> {
    /// φ at the mean of the points.
    pub value: R,
    /// No value on the hull is below this.
    pub least: R,
    /// No value on the hull is above this.
    pub greatest: R,
}

impl<R: Float> Survey<R> {
    /// By how steep the field is in the box around the points, and what else is certain there.
    pub fn by_slope<F: Sdf>(field: &F, corners: &[Vector3<R>]) -> Self {
        let center = mean(corners);
        let value = field.value(center);
        let reach = reach(center, corners);
        let local = field.local_bounds(&bounds(corners));
        let spread = reach * R::lift(local.slope_bound);
        let unrounded = Self {
            value,
            least: Real::max(value - spread, R::lift(local.least)),
            greatest: Real::min(value + spread, R::lift(local.greatest)),
        };
        unrounded.widen(rounding(field.slope_bound(), center, reach, value))
    }

    /// Of a field that is a convex function, which lies above its tangent planes. A gradient that is a choice must be a
    /// limit of gradients nearby.
    pub fn of_convex<F: Sdf>(field: &F, corners: &[Vector3<R>]) -> Self {
        let center = mean(corners);
        let sample = field.evaluate(center);
        let reach = reach(center, corners);
        let falls = corners.iter().map(|corner| sample.gradient.dot(&(corner - center)));
        let unrounded = Self {
            value: sample.value,
            least: sample.value + falls.fold(R::zero(), Real::min),
            greatest: sample.value + reach * R::lift(field.slope_bound()),
        };
        unrounded.widen(rounding(field.slope_bound(), center, reach, sample.value))
    }

    /// That of −φ.
    pub fn negate(self) -> Self {
        Self { value: -self.value, least: -self.greatest, greatest: -self.least }
    }

    /// That of the lower of two fields.
    pub fn lower(self, other: Self) -> Self {
        Self {
            value: Real::min(self.value, other.value),
            least: Real::min(self.least, other.least),
            greatest: Real::min(self.greatest, other.greatest),
        }
    }

    /// With bounds that allow for values that are off by so much.
    pub fn widen(self, rounding: R) -> Self {
        Self { least: self.least - rounding, greatest: self.greatest + rounding, ..self }
    }

    /// With a function that never falls done to each number.
    pub fn map(self, rising: impl Fn(R) -> R) -> Self {
        Self { value: rising(self.value), least: rising(self.least), greatest: rising(self.greatest) }
    }
}

/// How many roundings of the largest number in it a bound may be off. An evaluation takes some thirty operations, few of
/// which round at the size of the coordinates.
const ROUNDINGS: f64 = 32.0;

/// More than `value` or another value of the field within `reach` of `point`, no larger in size, may be off by rounding.
#[inline]
pub(crate) fn rounding<R: Real>(slope_bound: f64, point: Vector3<R>, reach: R, value: R) -> R {
    let largest = point.iter().fold(reach.max(value.abs()), |largest, x| largest.max(x.abs()));
    largest * R::lift(slope_bound.max(1.0) * ROUNDINGS * R::EPSILON)
}

/// Summed over edges from the first, so that digits are not lost far from the origin.
#[inline]
pub(crate) fn mean<R: Real>(points: &[Vector3<R>]) -> Vector3<R> {
    let Some(first) = points.first() else { return Vector3::zeros() };
    let share = R::lift(1.0 / points.len() as f64);
    points.iter().skip(1).fold(*first, |mean, point| mean + (point - first) * share)
}

#[inline]
pub(crate) fn reach<R: Real>(from: Vector3<R>, points: &[Vector3<R>]) -> R {
    points.iter().fold(R::zero(), |reach, point| reach.max(norm(point - from)))
}

/// The smallest box around the points.
#[inline]
pub(crate) fn bounds<R: Float>(points: &[Vector3<R>]) -> Aabb {
    let nothing = Aabb { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };
    points.iter().fold(nothing, |bounds, point| {
        let point = point.map(R::to_f64).into();
        bounds.union(&Aabb { min: point, max: point })
    })
}

impl<R: Float, const N: usize> Simplex<R, N> {
    /// The smallest box around it.
    #[inline]
    pub fn bounds(&self) -> Aabb {
        bounds(&self.corners)
    }
}
