use nalgebra::Vector3;

use super::surveys;
use crate::grid::{SegmentMinimum, TriangleMinimum};
use crate::real::{Float, Real};
use crate::{Aabb, LocalBounds, Sample, Sdf, Survey};

/// What lies in either: min(a, b).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Union<A, B>(pub A, pub B);

/// What lies in both: max(a, b).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intersection<A, B>(pub A, pub B);

/// What lies in the first and not in the second: max(a, −b).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference<A, B>(pub A, pub B);

impl<A: Sdf, B: Sdf> Sdf for Union<A, B> {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        lower(self.0.evaluate(point), self.1.evaluate(point))
    }

    #[inline]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        self.0.value(point).min(self.1.value(point))
    }

    fn bounds(&self, level: f64) -> Aabb {
        self.0.bounds(level).union(&self.1.bounds(level))
    }

    fn slope_bound(&self) -> f64 {
        self.0.slope_bound().max(self.1.slope_bound())
    }

    fn local_bounds(&self, region: &Aabb) -> LocalBounds {
        self.0.local_bounds(region).lower(self.1.local_bounds(region))
    }

    fn survey<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Survey<R> {
        self.0.survey(about, corners).lower(self.1.survey(about, corners))
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        let [a, b] = surveys(&self.0, &self.1, corners);
        match () {
            () if a.greatest < b.least => self.0.is_convex_on(corners),
            () if b.greatest < a.least => self.1.is_convex_on(corners),
            () => false,
        }
    }

    fn rises<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let [a, b] = surveys(&self.0, &self.1, corners);
        a.rises_of_lower(b, || self.0.rises(corners), || self.1.rises(corners))
    }

    fn least_on_segment<R: Float>(&self, ends: [Vector3<R>; 2]) -> Option<SegmentMinimum<R>> {
        let (a, b) = (self.0.least_on_segment(ends)?, self.1.least_on_segment(ends)?);
        let looks = a.looks.saturating_add(b.looks);
        Some(SegmentMinimum { looks, ..if b.value < a.value { b } else { a } })
    }

    /// The level is not handed on: what is above it in one field takes more or fewer looks, and changes how many there were.
    fn least_on_triangle<R: Float>(&self, corners: [Vector3<R>; 3], enough: [R; 2]) -> Option<TriangleMinimum<R>> {
        let enough = [R::lift(f64::INFINITY), enough[1]];
        let (a, b) = (self.0.least_on_triangle(corners, enough)?, self.1.least_on_triangle(corners, enough)?);
        let looks = a.looks.saturating_add(b.looks);
        let least = Real::min(a.least, b.least);
        Some(TriangleMinimum { looks, least, ..if b.value < a.value { b } else { a } })
    }
}

impl<A: Sdf, B: Sdf> Sdf for Intersection<A, B> {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        lower(self.0.evaluate(point).negate(), self.1.evaluate(point).negate()).negate()
    }

    #[inline]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        -(-self.0.value(point)).min(-self.1.value(point))
    }

    fn bounds(&self, level: f64) -> Aabb {
        let (a, b) = (self.0.bounds(level), self.1.bounds(level));
        a.intersection(&b).unwrap_or(a)
    }

    fn slope_bound(&self) -> f64 {
        self.0.slope_bound().max(self.1.slope_bound())
    }

    fn local_bounds(&self, region: &Aabb) -> LocalBounds {
        let (a, b) = (self.0.local_bounds(region).negate(), self.1.local_bounds(region).negate());
        a.lower(b).negate()
    }

    fn survey<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Survey<R> {
        self.0.survey(about, corners).negate().lower(self.1.survey(about, corners).negate()).negate()
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        self.0.is_convex_on(corners) && self.1.is_convex_on(corners)
    }

    fn rises<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let [a, b] = surveys(&self.0, &self.1, corners);
        a.negate().rises_of_lower(b.negate(), || self.0.rises(corners), || self.1.rises(corners))
    }

    /// No value is below that of the part which is the higher at the middle.
    fn linearization_error(&self, region: &Aabb) -> f64 {
        self.0.linearization_error(region).max(self.1.linearization_error(region))
    }
}

impl<A: Sdf, B: Sdf> Sdf for Difference<A, B> {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        lower(self.0.evaluate(point).negate(), self.1.evaluate(point)).negate()
    }

    #[inline]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        -(-self.0.value(point)).min(self.1.value(point))
    }

    fn bounds(&self, level: f64) -> Aabb {
        self.0.bounds(level)
    }

    fn slope_bound(&self) -> f64 {
        self.0.slope_bound().max(self.1.slope_bound())
    }

    fn local_bounds(&self, region: &Aabb) -> LocalBounds {
        self.0.local_bounds(region).negate().lower(self.1.local_bounds(region)).negate()
    }

    fn survey<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Survey<R> {
        self.0.survey(about, corners).negate().lower(self.1.survey(about, corners)).negate()
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        let [a, b] = surveys(&self.0, &self.1, corners);
        -b.least < a.least && self.0.is_convex_on(corners)
    }

    fn rises<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let [a, b] = surveys(&self.0, &self.1, corners);
        a.negate().rises_of_lower(b, || self.0.rises(corners), || b.gradients.negate().rises(corners))
    }
}

/// The sample with the lower value. Of two equal ones the first, and its gradient a choice.
#[inline]
pub fn lower<R: Real>(a: Sample<R>, b: Sample<R>) -> Sample<R> {
    let mut sample = Sample::select(b.value.lt(a.value), b, a);
    let tie = a.value.le(b.value) & b.value.le(a.value);
    sample.status.degenerate_gradient = sample.status.degenerate_gradient | tie;
    sample
}
