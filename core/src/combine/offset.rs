//! Offset of a field: φ − d. Gradients, curvature and minimum points stay, values shift.

use nalgebra::Vector3;

use crate::number::{Float, Real};
use crate::{Aabb, BoxEnclosure, EnclosedSdf, Enclosure, ErrorBound, ExactMinimum, Goal, Relaxation, Sample, Sdf};

/// The shape grown by `distance`, or shrunk if that is negative: φ − `distance`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offset<F> {
    field: F,
    distance: f64,
    extent: f64,
}

impl<F: Sdf> Offset<F> {
    /// `None` unless `distance` is finite.
    pub fn new(field: F, distance: f64) -> Option<Self> {
        let extent = extent_at(&field, distance);
        distance.is_finite().then_some(Self { field, distance, extent })
    }
}

/// The longest side of the box around the points of a field with φ ≤ `level`. Where there are none it is that of the field's own box.
pub(super) fn extent_at<F: Sdf>(field: &F, level: f64) -> f64 {
    let side = field.bounds(level).longest_side();
    if side > 0.0 { side } else { field.extent::<f64>() }
}

impl<F> Offset<F> {
    /// The field that is offset.
    pub fn field(&self) -> &F {
        &self.field
    }

    /// How far the shape is grown.
    pub fn distance(&self) -> f64 {
        self.distance
    }
}

impl<F: Sdf> Sdf for Offset<F> {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let sample = self.field.evaluate(point);
        Sample { value: sample.value - R::from_f64(self.distance), ..sample }
    }

    #[inline]
    fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
        let sample = self.field.evaluate_smooth(point);
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

    #[inline]
    fn magnitude<R: Real>(&self) -> R {
        self.field.magnitude::<R>() + R::from_f64(self.distance).abs()
    }

    fn extent<R: Real>(&self) -> R {
        R::from_f64(self.extent)
    }
}

impl<F: EnclosedSdf> EnclosedSdf for Offset<F> {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        self.field.enclose_box(region).shift(-self.distance)
    }

    fn error_bound(&self, region: &Aabb) -> ErrorBound {
        self.field.error_bound(region).shift(-self.distance)
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.field.enclosure(about, corners).shift(R::from_f64(-self.distance))
    }

    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        let relaxation = self.field.relaxation(about, corners).shift(R::from_f64(-self.distance));
        relaxation.widen_by_rounding(self, about, corners)
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

    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        let distance = R::from_f64(self.distance);
        let goal = Goal { level: goal.level + distance, ..goal };
        let minimum = self.field.exact_minimum(corners, goal)?;
        Some(ExactMinimum { value: minimum.value - distance, lower_bound: minimum.lower_bound - distance, ..minimum })
    }
}
