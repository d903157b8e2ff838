//! Shapes that mirror in the coordinate planes are asked in the octant where all coordinates are positive.

use nalgebra::Vector3;

use crate::Sample;
use crate::number::Real;

/// The sample at `point` of a field that mirrors in all three planes, from its sample at |point|.
#[inline]
pub(super) fn unfold<R: Real>(folded: Sample<R>, point: Vector3<R>) -> Sample<R> {
    let mut sample = folded;
    for axis in 0..3 {
        let (derivative, degenerate) = unfold_axis(folded.gradient[axis], point[axis]);
        sample.gradient[axis] = derivative;
        sample.status.degenerate_gradient = sample.status.degenerate_gradient | degenerate;
    }
    sample
}

/// The derivative along a coordinate of a function of its magnitude, and whether there is none: on the mirror's plane,
/// where the function comes in with a slope.
#[inline]
pub(super) fn unfold_axis<R: Real>(derivative: R, coordinate: R) -> (R, R::Mask) {
    (derivative * coordinate.sign(), coordinate.is_zero() & !derivative.is_zero())
}
