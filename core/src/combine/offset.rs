use nalgebra::Vector3;

use crate::grid::{SegmentMinimum, TriangleMinimum};
use crate::number::{Float, Real};
use crate::{Aabb, BoxEnclosure, Enclosure, Sample, Sdf};

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
        Sample { value: sample.value - R::from_f64(self.distance), ..sample }
    }

    #[inline]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        self.field.value(point) - R::from_f64(self.distance)
    }

    fn bounds(&self, level: f64) -> Aabb {
        self.field.bounds(level + self.distance)
    }

    fn slope_bound(&self) -> f64 {
        self.field.slope_bound()
    }

    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        self.field.enclose_box(region).raise(-self.distance)
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.field.enclosure(about, corners).raise(R::from_f64(-self.distance))
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        self.field.is_convex_on(corners)
    }

    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        self.field.max_rise_to_corners(corners)
    }

    fn linearization_error(&self, region: &Aabb) -> f64 {
        self.field.linearization_error(region)
    }

    fn minimum_on_segment<R: Float>(&self, ends: [Vector3<R>; 2]) -> Option<SegmentMinimum<R>> {
        let of_field = self.field.minimum_on_segment(ends)?;
        Some(SegmentMinimum { value: of_field.value - R::from_f64(self.distance), ..of_field })
    }

    fn minimum_on_triangle<R: Float>(&self, corners: [Vector3<R>; 3], enough: [R; 2]) -> Option<TriangleMinimum<R>> {
        let distance = R::from_f64(self.distance);
        let [level, gap] = enough;
        let of_field = self.field.minimum_on_triangle(corners, [level + distance, gap])?;
        Some(TriangleMinimum { value: of_field.value - distance, least: of_field.least - distance, ..of_field })
    }
}
