//! Boolean combinations (Ricci 1973, "A Constructive Geometry for Computer Graphics"): minimum and maximum of two fields.

use nalgebra::Vector3;

use super::enclosures;
use crate::enclosure::PartVisitor;
use crate::number::{Float, Real};
use crate::{Aabb, BoxEnclosure, EnclosedSdf, Enclosure, ErrorBound, ExactMinimum, Goal, Relaxation, Sample, Sdf};

/// The union: min(a, b).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Union<A, B>(pub A, pub B);

/// The intersection: max(a, b) = −min(−a, −b).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intersection<A, B>(pub A, pub B);

/// The first without the second: max(a, −b) = −min(−a, b).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference<A, B>(pub A, pub B);

impl<A: Sdf, B: Sdf> Sdf for Union<A, B> {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        lower(self.0.evaluate(point), self.1.evaluate(point))
    }

    #[inline]
    fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
        lower(self.0.evaluate_smooth(point), self.1.evaluate_smooth(point))
    }

    #[inline]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        lower_value(self.0.value(point), self.1.value(point))
    }

    fn bounds(&self, level: f64) -> Aabb {
        self.0.bounds(level).union(&self.1.bounds(level))
    }

    fn slope_bound(&self) -> f64 {
        self.0.slope_bound().max(self.1.slope_bound())
    }

    #[inline]
    fn magnitude<R: Real>(&self) -> R {
        self.0.magnitude::<R>().max(self.1.magnitude())
    }

    fn extent<R: Real>(&self) -> R {
        self.0.extent::<R>().max(self.1.extent())
    }
}

impl<A: EnclosedSdf, B: EnclosedSdf> EnclosedSdf for Union<A, B> {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        self.0.enclose_box(region).min(self.1.enclose_box(region))
    }

    fn error_bound(&self, region: &Aabb) -> ErrorBound {
        self.0.error_bound(region).max(self.1.error_bound(region))
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.0.enclosure(about, corners).min(self.1.enclosure(about, corners))
    }

    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        self.0.relaxation(about, corners).min(self.1.relaxation(about, corners))
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        let [a, b] = enclosures(&self.0, &self.1, corners);
        match () {
            () if a.range.upper < b.range.lower => self.0.is_convex_on(corners),
            () if b.range.upper < a.range.lower => self.1.is_convex_on(corners),
            () => false,
        }
    }

    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let [a, b] = enclosures(&self.0, &self.1, corners);
        a.min_max_rise(b, || self.0.max_rise_to_corners(corners), || self.1.max_rise_to_corners(corners))
    }

    /// The goal's level is not handed on: a part that lies above it could stop with fewer evaluations than the union.
    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        let goal = Goal { level: R::from_f64(f64::INFINITY), ..goal };
        let (a, b) = (self.0.exact_minimum(corners, goal)?, self.1.exact_minimum(corners, goal)?);
        let evaluations = a.evaluations.saturating_add(b.evaluations);
        let lower_bound = Real::min(a.lower_bound, b.lower_bound);
        Some(ExactMinimum { evaluations, lower_bound, ..if b.value < a.value { b } else { a } })
    }

    #[inline]
    fn visit_parts<V: PartVisitor>(&self, visitor: &mut V) {
        self.0.visit_parts(visitor);
        self.1.visit_parts(visitor);
    }
}

impl<A: Sdf, B: Sdf> Sdf for Intersection<A, B> {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        higher(self.0.evaluate(point), self.1.evaluate(point))
    }

    #[inline]
    fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
        higher(self.0.evaluate_smooth(point), self.1.evaluate_smooth(point))
    }

    #[inline]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        -lower_value(-self.0.value(point), -self.1.value(point))
    }

    fn bounds(&self, level: f64) -> Aabb {
        let (a, b) = (self.0.bounds(level), self.1.bounds(level));
        a.intersection(&b).unwrap_or(a)
    }

    fn slope_bound(&self) -> f64 {
        self.0.slope_bound().max(self.1.slope_bound())
    }

    #[inline]
    fn magnitude<R: Real>(&self) -> R {
        self.0.magnitude::<R>().max(self.1.magnitude())
    }

    /// Longest side of what both boxes have in common, if that is shorter.
    fn extent<R: Real>(&self) -> R {
        let extent = self.0.extent::<R>().min(self.1.extent());
        let both = self.0.bounds(0.0).intersection(&self.1.bounds(0.0)).map_or(0.0, |bounds| bounds.longest_side());
        if both > 0.0 { extent.min(R::from_f64(both)) } else { extent }
    }
}

impl<A: EnclosedSdf, B: EnclosedSdf> EnclosedSdf for Intersection<A, B> {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        self.0.enclose_box(region).negate().min(self.1.enclose_box(region).negate()).negate()
    }

    fn error_bound(&self, region: &Aabb) -> ErrorBound {
        self.0.error_bound(region).max(self.1.error_bound(region))
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.relaxation(about, corners).enclosure
    }

    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        self.0.relaxation(about, corners).max(self.1.relaxation(about, corners))
    }

    /// A maximum of convex functions is convex.
    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        self.0.is_convex_on(corners) && self.1.is_convex_on(corners)
    }

    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let [a, b] = enclosures(&self.0, &self.1, corners);
        a.negate().min_max_rise(
            b.negate(),
            || self.0.max_rise_to_corners(corners),
            || self.1.max_rise_to_corners(corners),
        )
    }

    /// No value is below that of the part which is the higher at the centre.
    fn linearization_error(&self, region: &Aabb) -> f64 {
        self.0.linearization_error(region).max(self.1.linearization_error(region))
    }
}

impl<A: Sdf, B: Sdf> Sdf for Difference<A, B> {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        without(self.0.evaluate(point), self.1.evaluate(point))
    }

    #[inline]
    fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
        without(self.0.evaluate_smooth(point), self.1.evaluate_smooth(point))
    }

    #[inline]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        -lower_value(-self.0.value(point), self.1.value(point))
    }

    fn bounds(&self, level: f64) -> Aabb {
        self.0.bounds(level)
    }

    fn slope_bound(&self) -> f64 {
        self.0.slope_bound().max(self.1.slope_bound())
    }

    #[inline]
    fn magnitude<R: Real>(&self) -> R {
        self.0.magnitude::<R>().max(self.1.magnitude())
    }

    fn extent<R: Real>(&self) -> R {
        self.0.extent()
    }
}

impl<A: EnclosedSdf, B: EnclosedSdf> EnclosedSdf for Difference<A, B> {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        self.0.enclose_box(region).negate().min(self.1.enclose_box(region)).negate()
    }

    fn error_bound(&self, region: &Aabb) -> ErrorBound {
        self.0.error_bound(region).max(self.1.error_bound(region).negate())
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.relaxation(about, corners).enclosure
    }

    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        self.0.relaxation(about, corners).max(self.1.relaxation(about, corners).negate())
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        let [a, b] = enclosures(&self.0, &self.1, corners);
        -b.range.lower < a.range.lower && self.0.is_convex_on(corners)
    }

    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let [a, b] = enclosures(&self.0, &self.1, corners);
        a.negate().min_max_rise(
            b,
            || self.0.max_rise_to_corners(corners),
            || b.gradients.negate().max_rise_to_corners(corners),
        )
    }
}

/// The sample with the lower value. Of two equal ones the first, with a degenerate gradient. NaN if one value is NaN.
#[inline]
pub fn lower<R: Real>(a: Sample<R>, b: Sample<R>) -> Sample<R> {
    let (is_a, is_b) = (a.value.le(b.value), b.value.le(a.value));
    let mut sample = Sample::select(is_a, a, b);
    // Neither, if one is NaN.
    sample.value = R::select(is_a | is_b, sample.value, a.value + b.value);
    sample.status.degenerate_gradient = sample.status.degenerate_gradient | (is_a & is_b);
    sample
}

/// The sample with the higher value. Outside of a grid its φ may be far below the distance, which may then be the higher one.
#[inline]
fn higher<R: Real>(a: Sample<R>, b: Sample<R>) -> Sample<R> {
    let mut sample = lower(a.negate(), b.negate()).negate();
    sample.status.outside_grid = a.status.outside_grid | b.status.outside_grid;
    sample
}

/// The sample of a without b. Outside of a grid the negative of its φ is not below that of the distance.
#[inline]
fn without<R: Real>(a: Sample<R>, b: Sample<R>) -> Sample<R> {
    let mut sample = lower(a.negate(), b).negate();
    sample.status.outside_grid = sample.status.outside_grid | a.status.outside_grid;
    sample
}

/// The lower value; NaN if one is NaN.
#[inline]
pub fn lower_value<R: Real>(a: R, b: R) -> R {
    R::select(b.le(b), a.min(b), b)
}
