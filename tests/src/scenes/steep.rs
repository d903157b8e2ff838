use nalgebra::{Matrix3, Vector3};
use sdf_core::{Aabb, BoxEnclosure, EnclosedSdf, Enclosure, Float, Real, Sample, Sdf};

/// A field multiplied by `steepness`: with a slope above one, which no cull may ignore.
#[derive(Clone, Copy)]
pub struct Steep<F> {
    pub field: F,
    pub steepness: f64,
}

impl<F> Steep<F> {
    fn steepen<R: Real>(&self, sample: Sample<R>) -> Sample<R> {
        let steepness = R::from_f64(self.steepness);
        Sample { value: sample.value * steepness, gradient: sample.gradient * steepness, ..sample }
    }
}

impl<F: Sdf> Sdf for Steep<F> {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        self.steepen(self.field.evaluate(point))
    }
    fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
        self.steepen(self.field.evaluate_smooth(point))
    }
    fn bounds(&self, level: f64) -> Aabb {
        self.field.bounds(level / self.steepness)
    }
    fn slope_bound(&self) -> f64 {
        self.field.slope_bound() * self.steepness
    }
    fn magnitude<R: Real>(&self) -> R {
        self.field.magnitude()
    }
}

impl<F: EnclosedSdf> EnclosedSdf for Steep<F> {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        let BoxEnclosure { range, slope_bound } = self.field.enclose_box(region);
        BoxEnclosure { range: range.scale(self.steepness), slope_bound: slope_bound * self.steepness }
    }
    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.field.enclosure(about, corners).pull_back(&Matrix3::identity(), R::from_f64(self.steepness))
    }
    fn linearization_error(&self, region: &Aabb) -> f64 {
        self.field.linearization_error(region) * self.steepness
    }
}
