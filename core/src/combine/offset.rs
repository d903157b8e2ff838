use nalgebra::Vector3;

use crate::grid::{SegmentMinimum, TriangleMinimum};
use crate::real::{Float, Real};
use crate::{Aabb, LocalBounds, Sample, Sdf, Survey};

/// The shape grown by `distance`, or shrunk where it is negative: φ − distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offset<F> {
    field: F,
    distance: f64,
}

impl<F> Offset<F> {
    pub fn new(field: F, distance: f64) -> Option<Self> {
        distance.is_finite().then_some(Self { field, distance })
    }
}

impl<F: Sdf> Sdf for Offset<F> {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let sample = self.field.evaluate(point);
        Sample { value: sample.value - R::lift(self.distance), ..sample }
    }

    #[inline]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        self.field.value(point) - R::lift(self.distance)
    }

    fn bounds(&self, level: f64) -> Aabb {
        self.field.bounds(level + self.distance)
    }

    fn slope_bound(&self) -> f64 {
        self.field.slope_bound()
    }

    fn local_bounds(&self, region: &Aabb) -> LocalBounds {
        self.field.local_bounds(region).raise(-self.distance)
    }

    fn survey<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Survey<R> {
        self.field.survey(about, corners).raise(R::lift(-self.distance))
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        self.field.is_convex_on(corners)
    }

    fn rises<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        self.field.rises(corners)
    }

    fn linearization_error(&self, region: &Aabb) -> f64 {
        self.field.linearization_error(region)
    }

    fn least_on_segment<R: Float>(&self, ends: [Vector3<R>; 2]) -> Option<SegmentMinimum<R>> {
        let of_field = self.field.least_on_segment(ends)?;
        Some(SegmentMinimum { value: of_field.value - R::lift(self.distance), ..of_field })
    }

    fn least_on_triangle<R: Float>(&self, corners: [Vector3<R>; 3], enough: [R; 2]) -> Option<TriangleMinimum<R>> {
        let distance = R::lift(self.distance);
        let [level, gap] = enough;
        let of_field = self.field.least_on_triangle(corners, [level + distance, gap])?;
        Some(TriangleMinimum { value: of_field.value - distance, least: of_field.least - distance, ..of_field })
    }
}
