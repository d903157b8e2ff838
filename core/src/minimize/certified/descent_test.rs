//! The descent test: does one in-plane direction descend on all of a part of a triangle? Then the part holds no
//! minimum, unless on the triangle's boundary. In the interior 0 lies in the generalized gradient of a minimum (Clarke
//! 1983, "Optimization and Nonsmooth Analysis", prop. 2.3.2).
//!
//! With gradients in the interval vector \[g\] the candidate is u, the projection of mid \[g\] to the plane: u = Σ_k
//! e_k (mid \[g\] · e_k) / (e_k · e_k) for an orthogonal basis e of the plane. −u descends if lower(\[g\] · u) > 0.

use nalgebra::Vector3;

use crate::number::{Float, Real};
use crate::rounding::DIRECTIONAL_DERIVATIVE;
use crate::vector::norm;
use crate::{GradientBox, Simplex};

/// An orthogonal basis of a triangle's plane.
#[derive(Clone, Copy)]
pub(super) struct DescentTest<R: Real> {
    basis: [Vector3<R>; 2],
}

impl<R: Float> DescentTest<R> {
    pub fn new<const N: usize>(simplex: &Simplex<R, N>) -> Self {
        let &[a, b, c] = simplex.corners.as_slice() else { return Self { basis: [Vector3::zeros(); 2] } };
        let (first, other) = (b - a, c - a);
        let second = other - project(first, other);
        // The plane of a sliver is known by rounding alone: then only the direction of one edge is used.
        let is_well_conditioned = norm(other) * R::from_f64(4e-3) < norm(second);
        Self { basis: [first, if is_well_conditioned { second } else { Vector3::zeros() }] }
    }

    /// True only if a direction in the plane descends for all these gradients.
    pub fn excludes(&self, gradients: &GradientBox<R>, slope_bound: f64) -> bool {
        let middle = (gradients.lower + gradients.upper) * R::from_f64(0.5);
        let uphill = self.basis.iter().fold(Vector3::zeros(), |sum, axis| sum + project(*axis, middle));
        let rounding = norm(uphill) * R::from_f64(slope_bound * DIRECTIONAL_DERIVATIVE * R::EPSILON);
        rounding < gradients.change_along(uphill).lower
    }
}

/// The projection of a vector to an axis: axis (vector · axis) / (axis · axis), zero if the axis is.
fn project<R: Float>(axis: Vector3<R>, vector: Vector3<R>) -> Vector3<R> {
    let length_sq = axis.dot(&axis);
    if R::zero() < length_sq { axis * (vector.dot(&axis) / length_sq) } else { Vector3::zeros() }
}
