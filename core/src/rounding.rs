//! How far a computed value may be from the exact one: the one place for the constants of rounding.
//!
//! A computation of n operations whose intermediate results do not exceed L in magnitude is off by at most about n·ε·L
//! (Higham 2002, "Accuracy and Stability of Numerical Algorithms", §3.1), with ε the distance from 1 to the next larger
//! number. Every bound of this crate is widened by such a multiple before it is compared.

use nalgebra::Vector3;

use crate::number::Real;

/// An evaluation takes some thirty operations, few of which round at the size of the coordinates.
pub(crate) const EVALUATION: f64 = 32.0;

/// Bound of |computed φ − exact φ| in multiples of [`EVALUATION`] · ε: for a field of this slope bound, for `value` and for
/// every value no larger than it within `distance` of `point`.
#[inline(always)]
pub(crate) fn rounding<R: Real>(slope_bound: f64, point: Vector3<R>, distance: R, value: R) -> R {
    let length = distance.max(point.x.abs()).max(point.y.abs()).max(point.z.abs());
    (length * R::from_f64(slope_bound)).max(value.abs()) * R::from_f64(EVALUATION * R::EPSILON)
}
