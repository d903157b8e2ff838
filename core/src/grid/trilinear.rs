//! Trilinear interpolation by seven linear ones: four along x, two along y, one along z.

use nalgebra::Vector3;

use crate::number::Real;

/// φ at `fraction` of a cell, 0 to 1 along each axis, and ∂φ/∂fraction. `c` is in the order of
/// [`Storage::corners`](super::Storage::corners).
#[inline(always)]
pub(super) fn interpolate<R: Real>(c: [R; 8], fraction: Vector3<R>) -> (R, Vector3<R>) {
    let along_x = [
        mix(c[0], c[1], fraction.x),
        mix(c[2], c[3], fraction.x),
        mix(c[4], c[5], fraction.x),
        mix(c[6], c[7], fraction.x),
    ];
    let along_y = [mix(along_x[0], along_x[1], fraction.y), mix(along_x[2], along_x[3], fraction.y)];
    let by_x = mix(mix(c[1] - c[0], c[3] - c[2], fraction.y), mix(c[5] - c[4], c[7] - c[6], fraction.y), fraction.z);
    let by_y = mix(along_x[1] - along_x[0], along_x[3] - along_x[2], fraction.z);
    let by_z = along_y[1] - along_y[0];
    (mix(along_y[0], along_y[1], fraction.z), Vector3::new(by_x, by_y, by_z))
}

/// (1 − t) a + t b.
#[inline(always)]
pub(super) fn mix<R: Real>(a: R, b: R, t: R) -> R {
    a + (b - a) * t
}
