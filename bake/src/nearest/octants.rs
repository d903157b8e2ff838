//! Eight equal parts of a cube, one per SIMD lane.

use crate::simd::{LANES, VectorX8};

/// Eight cubes in a cube, in the tree's unit frame.
#[derive(Clone, Copy)]
pub(super) struct Octants {
    /// Center of the outer cube.
    pub center: [f32; 3],
    /// Distance from there to the eight centers along each axis.
    pub step: f32,
    /// Half side of each of the eight.
    pub half_side: f32,
    /// Largest error of a length computed in this frame.
    pub rounding: f32,
}

impl Octants {
    /// Centers of the eight.
    #[inline(always)]
    pub fn centers(&self) -> VectorX8<f32> {
        let mut centers = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            for axis in 0..3 {
                centers[axis][lane] = self.step * signs(lane)[axis];
            }
        }
        for axis in 0..3 {
            for lane in 0..LANES {
                centers[axis][lane] += self.center[axis];
            }
        }
        centers
    }

    /// Center of one of the eight.
    #[inline(always)]
    pub fn octant_center(&self, octant: usize) -> [f32; 3] {
        [0, 1, 2].map(|axis: usize| self.center[axis] + signs(octant)[axis] * self.step)
    }

    /// Corners of one of the eight.
    #[inline(always)]
    pub fn corners_of(&self, octant: usize) -> VectorX8<f32> {
        Self { center: self.octant_center(octant), step: self.half_side, ..*self }.centers()
    }
}

/// Position of an octant along each axis: 0 or 1.
#[inline(always)]
pub(super) fn corner(octant: usize) -> [usize; 3] {
    [octant & 1, octant >> 1 & 1, octant >> 2 & 1]
}

/// Position of an octant along each axis: −1 or 1.
#[inline(always)]
fn signs(octant: usize) -> [f32; 3] {
    corner(octant).map(|side| 2.0 * side as f32 - 1.0)
}
