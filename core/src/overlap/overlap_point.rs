use nalgebra::Vector3;

use crate::number::{Float, Real};
use crate::vector::norm;
use crate::{Sample, Status};

/// Both fields' samples at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OverlapPoint<R: Real> {
    /// The point, in the frame of the pair.
    pub point: Vector3<R>,
    /// max(φ_A, φ_B).
    pub value: R,
    /// φ_A and its gradient.
    pub a: Sample<R>,
    /// φ_B and its gradient.
    pub b: Sample<R>,
    /// (∇φ_B − ∇φ_A) / |∇φ_B − ∇φ_A|, out of B and into A; zero where the gradients are equal.
    pub normal: Vector3<R>,
}

impl<R: Float> OverlapPoint<R> {
    pub(super) fn new(point: Vector3<R>, a: Sample<R>, b: Sample<R>) -> Self {
        let difference = b.gradient - a.gradient;
        let length = norm(difference);
        let normal = if length.is_negligible() { Vector3::zeros() } else { difference / length };
        Self { point, value: Real::max(a.value, b.value), a, b, normal }
    }

    /// φ_A + φ_B: for convex bodies the gap, or minus the penetration depth.
    pub fn separation(&self) -> R {
        self.a.value + self.b.value
    }

    /// Every flag of either sample.
    pub fn status(&self) -> Status<bool> {
        self.a.status.merge(self.b.status)
    }

    /// Are both values and gradients finite?
    pub(super) fn is_finite(&self) -> bool {
        let samples = [self.a, self.b];
        samples.iter().all(|sample| sample.value.is_finite() && sample.gradient.iter().all(|slope| slope.is_finite()))
    }

    /// The nearest point with φ_A = φ_B by the tangents of both fields; `None` if their gradients are equal.
    pub(super) fn middle_point(&self) -> Option<Vector3<R>> {
        let difference = self.b.gradient - self.a.gradient;
        let length_sq = difference.dot(&difference);
        if length_sq.sqrt().is_negligible() {
            return None;
        }
        Some(self.point + difference * ((self.a.value - self.b.value) / length_sq))
    }
}
