use nalgebra::Vector3;

use crate::number::Real;

/// The eight corner values of a cell, x fastest: 000, 100, 010, 110, 001, 101, 011, 111.
pub(super) type Corners<R> = [R; 8];

/// The trilinear interpolant at `share` of the cell along each axis, 0 to 1, and its derivative by the shares.
#[inline(always)]
pub(super) fn interpolate<R: Real>(c: Corners<R>, share: Vector3<R>) -> (R, Vector3<R>) {
    let along_x =
        [mix(c[0], c[1], share.x), mix(c[2], c[3], share.x), mix(c[4], c[5], share.x), mix(c[6], c[7], share.x)];
    let along_y = [mix(along_x[0], along_x[1], share.y), mix(along_x[2], along_x[3], share.y)];
    let by_x = mix(mix(c[1] - c[0], c[3] - c[2], share.y), mix(c[5] - c[4], c[7] - c[6], share.y), share.z);
    let by_y = mix(along_x[1] - along_x[0], along_x[3] - along_x[2], share.z);
    let by_z = along_y[1] - along_y[0];
    (mix(along_y[0], along_y[1], share.z), Vector3::new(by_x, by_y, by_z))
}

#[inline(always)]
pub(super) fn mix<R: Real>(from: R, to: R, share: R) -> R {
    from + (to - from) * share
}
