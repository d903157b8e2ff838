use nalgebra::Vector3;

use super::surveys;
use crate::grid::{SegmentMinimum, TriangleMinimum};
use crate::number::{Float, Real};
use crate::{Aabb, BoxEnclosure, Enclosure, Sample, Sdf};

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

    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        self.0.enclose_box(region).lower(self.1.enclose_box(region))
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.0.enclosure(about, corners).lower(self.1.enclosure(about, corners))
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        let [a, b] = surveys(&self.0, &self.1, corners);
        match () {
            () if a.greatest < b.least => self.0.is_convex_on(corners),
            () if b.greatest < a.least => self.1.is_convex_on(corners),
            () => false,
        }
    }

    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let [a, b] = surveys(&self.0, &self.1, corners);
        a.min_combine(b, || self.0.max_rise_to_corners(corners), || self.1.max_rise_to_corners(corners))
    }

    fn minimum_on_segment<R: Float>(&self, ends: [Vector3<R>; 2]) -> Option<SegmentMinimum<R>> {
        let (a, b) = (self.0.minimum_on_segment(ends)?, self.1.minimum_on_segment(ends)?);
        let looks = a.looks.saturating_add(b.looks);
        Some(SegmentMinimum { looks, ..if b.value < a.value { b } else { a } })
    }

    /// The level is not handed on: what is above it in one field takes more or fewer looks, and changes how many there were.
    fn minimum_on_triangle<R: Float>(&self, corners: [Vector3<R>; 3], enough: [R; 2]) -> Option<TriangleMinimum<R>> {
        let enough = [R::from_f64(f64::INFINITY), enough[1]];
        let (a, b) = (self.0.minimum_on_triangle(corners, enough)?, self.1.minimum_on_triangle(corners, enough)?);
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

    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        let (a, b) = (self.0.enclose_box(region).negate(), self.1.enclose_box(region).negate());
        a.lower(b).negate()
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.0.enclosure(about, corners).negate().lower(self.1.enclosure(about, corners).negate()).negate()
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        self.0.is_convex_on(corners) && self.1.is_convex_on(corners)
    }

    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let [a, b] = surveys(&self.0, &self.1, corners);
        a.negate().min_combine(
            b.negate(),
            || self.0.max_rise_to_corners(corners),
            || self.1.max_rise_to_corners(corners),
        )
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

    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        self.0.enclose_box(region).negate().lower(self.1.enclose_box(region)).negate()
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.0.enclosure(about, corners).negate().lower(self.1.enclosure(about, corners)).negate()
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        let [a, b] = surveys(&self.0, &self.1, corners);
        -b.least < a.least && self.0.is_convex_on(corners)
    }

    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let [a, b] = surveys(&self.0, &self.1, corners);
        a.negate().min_combine(
            b,
            || self.0.max_rise_to_corners(corners),
            || b.gradients.negate().max_rise_to_corners(corners),
        )
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
