//! Smooth union: the quadratic polynomial smooth minimum (Quilez, "Smooth minimum", iquilezles.org).
//!
//! ```text
//! φ = min(a, b) − h² k/4,    h = max(1 − |a − b|/k, 0)
//! ∇φ = (1 − h/2) ∇(lower) + (h/2) ∇(higher)
//! ```
//!
//! φ increases in a and in b, so intervals of both give an interval of φ. ∇φ is a mean of the parts' gradients.

use core::array::from_fn;

use nalgebra::Vector3;

use super::enclosures;
use crate::enclosure::sum;
use crate::number::interval::Interval;
use crate::number::{Float, Real};
use crate::{Aabb, BoxEnclosure, EnclosedSdf, Enclosure, ErrorBound, Relaxation, Sample, Sdf};

/// A union with filled creases: min(a, b) − h² k/4 with k = `blend` and h = max(1 − |a − b|/k, 0).
///
/// The gradient is continuous where those of a and b are, and never steeper. Where |a − b| ≥ k this is the plain
/// union; at a = b the surface moves out by k/4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothUnion<A, B> {
    a: A,
    b: B,
    blend: f64,
}

impl<A, B> SmoothUnion<A, B> {
    /// `blend` is a length. `None` unless it is finite and positive.
    pub fn new(a: A, b: B, blend: f64) -> Option<Self> {
        (blend.is_finite() && blend > 0.0).then_some(Self { a, b, blend })
    }

    /// Both fields.
    pub fn parts(&self) -> (&A, &B) {
        (&self.a, &self.b)
    }

    /// k.
    pub fn blend(&self) -> f64 {
        self.blend
    }

    /// h.
    #[inline]
    fn blend_factor<R: Real>(&self, a: R, b: R) -> R {
        (R::one() - (a - b).abs() / R::from_f64(self.blend)).max(R::zero())
    }

    /// φ from a, b and h.
    #[inline]
    fn blended<R: Real>(&self, a: R, b: R, h: R) -> R {
        a.min(b) - h * h * R::from_f64(0.25 * self.blend)
    }

    /// ∂φ/∂a = 1 − ∂φ/∂b.
    #[inline]
    fn a_weight<R: Real>(&self, a: R, b: R) -> R {
        let higher_weight = self.blend_factor(a, b) * R::from_f64(0.5);
        R::select(a.lt(b), R::one() - higher_weight, higher_weight)
    }

    /// φ and ∇φ from those of both parts.
    #[inline]
    fn blend_samples<R: Real>(&self, a: Sample<R>, b: Sample<R>) -> Sample<R> {
        let h = self.blend_factor(a.value, b.value);
        let gradient = b.gradient + (a.gradient - b.gradient) * self.a_weight(a.value, b.value);
        let blended = Sample { value: self.blended(a.value, b.value, h), gradient, status: a.status.merge(b.status) };
        let is_unblended = h.is_zero();
        let lower = Sample::select(b.value.lt(a.value), b, a);
        Sample::select(is_unblended, Sample { value: blended.value, ..lower }, blended)
    }
}

impl<A: Sdf, B: Sdf> Sdf for SmoothUnion<A, B> {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        self.blend_samples(self.a.evaluate(point), self.b.evaluate(point))
    }

    #[inline]
    fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
        self.blend_samples(self.a.evaluate_smooth(point), self.b.evaluate_smooth(point))
    }

    #[inline]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        let (a, b) = (self.a.value(point), self.b.value(point));
        self.blended(a, b, self.blend_factor(a, b))
    }

    fn bounds(&self, level: f64) -> Aabb {
        let level = level + 0.25 * self.blend;
        self.a.bounds(level).union(&self.b.bounds(level))
    }

    fn slope_bound(&self) -> f64 {
        self.a.slope_bound().max(self.b.slope_bound())
    }

    #[inline]
    fn magnitude<R: Real>(&self) -> R {
        self.a.magnitude::<R>().max(self.b.magnitude()) + R::from_f64(self.blend)
    }

    fn extent<R: Real>(&self) -> R {
        self.a.extent::<R>().max(self.b.extent())
    }
}

impl<A: EnclosedSdf, B: EnclosedSdf> EnclosedSdf for SmoothUnion<A, B> {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        let sharp = self.a.enclose_box(region).min(self.b.enclose_box(region));
        let range = Interval { lower: sharp.range.lower - 0.25 * self.blend, ..sharp.range };
        BoxEnclosure { range, ..sharp }
    }

    fn error_bound(&self, region: &Aabb) -> ErrorBound {
        let both = self.a.error_bound(region).max(self.b.error_bound(region));
        // A part counts where it is less than k above the other, and lowers the union by up to k/4 more.
        let Interval { lower, upper } = both.levels;
        ErrorBound { levels: Interval { lower, upper: upper - 1.25 * self.blend }, ..both }
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.relaxation(about, corners).enclosure
    }

    /// Bounds of φ = S(a, b), which is concave and increases in both: S of the parts' lower bounds at the corners, and the
    /// tangent plane of S for their upper bounds.
    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        let (a, b) = (self.a.relaxation(about, corners), self.b.relaxation(about, corners));
        let blended = |a: R, b: R| self.blended(a, b, self.blend_factor(a, b));
        let [a_value, b_value] = [a.enclosure.value, b.enclosure.value];
        let (value, b_weight) = (blended(a_value, b_value), R::one() - self.a_weight(a_value, b_value));
        let rises = |k: usize| {
            let [a_rise, b_rise] = [a.upper[k] - a_value, b.upper[k] - b_value];
            a_rise + (b_rise - a_rise) * b_weight
        };
        let [a_range, b_range] = [a.enclosure.range, b.enclosure.range];
        let range =
            Interval { lower: blended(a_range.lower, b_range.lower), upper: blended(a_range.upper, b_range.upper) };
        let gradients = a.enclosure.gradients.hull(b.enclosure.gradients);
        Relaxation {
            enclosure: Enclosure { value, range, gradients },
            lower: from_fn(|k| blended(a.lower[k], b.lower[k])),
            upper: from_fn(|k| value + rises(k)),
        }
        .widen_by_rounding(self, about, corners)
        .tighten()
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

    /// The rises of both parts together: the gradient is a mean of theirs, with weights that change along the path.
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
