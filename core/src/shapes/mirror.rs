//! Shapes with mirror symmetry, evaluated at non-negative coordinates only.
//!
//! If φ(x) = f(|x|), then φ'(x) = f'(|x|) sign(x). At x = 0 both one-sided derivatives differ unless f'(0) = 0.

use nalgebra::Vector3;

use crate::Sample;
use crate::number::Real;

/// The sample at `point` of a field with mirror symmetry in all three coordinate planes, from `folded`, its sample at
/// |`point`|.
#[inline]
pub(super) fn reflect_sample<R: Real>(folded: Sample<R>, point: Vector3<R>) -> Sample<R> {
    let mut sample = folded;
    for axis in 0..3 {
        let (derivative, is_degenerate) = reflect_derivative(folded.gradient[axis], point[axis]);
        sample.gradient[axis] = derivative;
        sample.status.degenerate_gradient = sample.status.degenerate_gradient | is_degenerate;
    }
    sample
}

/// φ' at `coordinate` from `derivative` = f', and whether it is one of two one-sided limits.
#[inline]
pub(super) fn reflect_derivative<R: Real>(derivative: R, coordinate: R) -> (R, R::Mask) {
    (derivative * coordinate.sign(), coordinate.is_zero() & !derivative.is_zero())
}
