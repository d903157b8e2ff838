use nalgebra::Vector3;

use super::enclosures;
use crate::enclosure::sum;
use crate::number::interval::Interval;
use crate::number::{Float, Real};
use crate::{Aabb, BoxEnclosure, EnclosedSdf, Enclosure, Sample, Sdf};

/// A union with its creases filled: min(a, b) − h²·blend/4 with h = max(1 − |a − b|/blend, 0).
///
/// The gradient is a mean of the parts' own, so it is continuous where theirs are and never steeper. Where |a − b| is
/// `blend` or more nothing changes; at a = b the surface moves out by blend/4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothUnion<A, B> {
    a: A,
    b: B,
    blend: f64,
}

impl<A, B> SmoothUnion<A, B> {
    /// `blend` > 0 is a length.
    pub fn new(a: A, b: B, blend: f64) -> Option<Self> {
        (blend.is_finite() && blend > 0.0).then_some(Self { a, b, blend })
    }

    /// h of the type's formula.
    #[inline]
    fn nearness<R: Real>(&self, a: R, b: R) -> R {
        (R::one() - (a - b).abs() / R::from_f64(self.blend)).max(R::zero())
    }

    #[inline]
    fn blended<R: Real>(&self, a: R, b: R, nearness: R) -> R {
        a.min(b) - nearness * nearness * R::from_f64(0.25 * self.blend)
    }
}

impl<A: Sdf, B: Sdf> Sdf for SmoothUnion<A, B> {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let (a, b) = (self.a.evaluate(point), self.b.evaluate(point));
        let nearness = self.nearness(a.value, b.value);
        let weight_of_higher = nearness * R::from_f64(0.5);
        let weight_of_a = R::select(a.value.lt(b.value), R::one() - weight_of_higher, weight_of_higher);
        let gradient = b.gradient + (a.gradient - b.gradient) * weight_of_a;
        let blended =
            Sample { value: self.blended(a.value, b.value, nearness), gradient, status: a.status.merge(b.status) };
        let alone = nearness.is_zero();
        let lower = Sample::select(b.value.lt(a.value), b, a);
        Sample::select(alone, Sample { value: blended.value, ..lower }, blended)
    }

    #[inline]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        let (a, b) = (self.a.value(point), self.b.value(point));
        self.blended(a, b, self.nearness(a, b))
    }

    fn bounds(&self, level: f64) -> Aabb {
        let level = level + 0.25 * self.blend;
        self.a.bounds(level).union(&self.b.bounds(level))
    }

    fn slope_bound(&self) -> f64 {
        self.a.slope_bound().max(self.b.slope_bound())
    }
}

impl<A: EnclosedSdf, B: EnclosedSdf> EnclosedSdf for SmoothUnion<A, B> {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        let sharp = self.a.enclose_box(region).min(self.b.enclose_box(region));
        let range = Interval { lower: sharp.range.lower - 0.25 * self.blend, ..sharp.range };
        BoxEnclosure { range, ..sharp }
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        let (a, b) = (self.a.enclosure(about, corners), self.b.enclosure(about, corners));
        // The blend is monotonic in both values.
        let blended = |a: R, b: R| self.blended(a, b, self.nearness(a, b));
        Enclosure {
            value: blended(a.value, b.value),
            range: Interval {
                lower: blended(a.range.lower, b.range.lower),
                upper: blended(a.range.upper, b.range.upper),
            },
            gradients: a.gradients.hull(b.gradients),
        }
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        let [a, b] = enclosures(&self.a, &self.b, corners);
        let blend = R::from_f64(self.blend);
        match () {
            () if a.range.upper + blend < b.range.lower => self.a.is_convex_on(corners),
            () if b.range.upper + blend < a.range.lower => self.b.is_convex_on(corners),
            () => false,
        }
    }

    /// Its gradient is a mean of the parts' own.
    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let [a, b] = enclosures(&self.a, &self.b, corners);
        let blend = R::from_f64(self.blend);
        match () {
            () if a.range.upper + blend < b.range.lower => self.a.max_rise_to_corners(corners),
            () if b.range.upper + blend < a.range.lower => self.b.max_rise_to_corners(corners),
            () => sum(self.a.max_rise_to_corners(corners), self.b.max_rise_to_corners(corners)),
        }
    }
}
