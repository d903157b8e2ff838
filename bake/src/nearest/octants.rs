//! The eight parts of a cube, side by side in lanes.

use crate::simd::{LANES, VectorX8};

/// From a middle to those of eight parts, so far along each axis.
#[inline(always)]
pub(super) fn steps(step: f32) -> VectorX8<f32> {
    let mut steps = [[0.0; LANES]; 3];
    for lane in 0..LANES {
        for axis in 0..3 {
            steps[axis][lane] = step * sides(lane)[axis];
        }
    }
    steps
}

/// On which side of the middle one of eight parts lies, along each axis: 0 or 1.
#[inline(always)]
pub(super) fn corner(part: usize) -> [usize; 3] {
    [part & 1, part >> 1 & 1, part >> 2 & 1]
}

/// The same as −1 or 1.
#[inline(always)]
pub(super) fn sides(part: usize) -> [f32; 3] {
    corner(part).map(|side| 2.0 * side as f32 - 1.0)
}
