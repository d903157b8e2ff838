use nalgebra::Vector3;

use crate::number::{Float, Real};
use crate::vector::norm;
use crate::{Sample, Status};

/// What both fields answer at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OverlapPoint<R: Real> {
    pub point: Vector3<R>,
    /// max(φ_A, φ_B).
    pub value: R,
    pub a: Sample<R>,
    pub b: Sample<R>,
    /// Out of B and into A; zero where the gradients are the same.
    pub normal: Vector3<R>,
}

impl<R: Float> OverlapPoint<R> {
    pub(super) fn new(point: Vector3<R>, a: Sample<R>, b: Sample<R>) -> Self {
        let apart = b.gradient - a.gradient;
        let length = norm(apart);
        let normal = if length.is_negligible() { Vector3::zeros() } else { apart / length };
        Self { point, value: Real::max(a.value, b.value), a, b, normal }
    }

    /// φ_A + φ_B: of convex bodies the gap, or minus the depth.
    pub fn separation(&self) -> R {
        self.a.value + self.b.value
    }

    /// The doubts of either sample.
    pub fn status(&self) -> Status<bool> {
        self.a.status.merge(self.b.status)
    }

    /// Whether both fields are numbers here.
    pub(super) fn is_known(&self) -> bool {
        let samples = [self.a, self.b];
        samples.iter().all(|sample| sample.value.is_finite() && sample.gradient.iter().all(|slope| slope.is_finite()))
    }

    /// Where φ_A = φ_B, by the linear parts of both here; `None` where those say nothing.
    pub(super) fn on_middle(&self) -> Option<Vector3<R>> {
        let apart = self.b.gradient - self.a.gradient;
        let length_sq = apart.dot(&apart);
        if length_sq.sqrt().is_negligible() {
            return None;
        }
        Some(self.point + apart * ((self.a.value - self.b.value) / length_sq))
    }
}
