//! Boxes and planes of many pairs of triangles at once: which cannot be told apart by them?

use sdf_core::Aabb;

use super::{Corners, Plane};
use crate::rounding::MIN_VOLUME;
use crate::simd::{LANES, Lanes, VectorX8, bits_of, dot, max, min};

/// [`CornersX8::not_apart`] of many triangles, dispatched to the instruction set of the machine.
pub(super) struct FindNotApart<'a> {
    pub triangles: &'a [CornersX8],
    pub bounds: &'a Aabb,
    pub plane: &'a Plane,
    pub points: &'a [u32; 3],
    pub masks: &'a mut [u32],
}

impl pulp::NullaryFnOnce for FindNotApart<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (triangles, mask) in self.triangles.iter().zip(self.masks) {
            *mask = triangles.not_apart(self.bounds, self.plane, self.points);
        }
    }
}

/// Eight triangles side by side. Lanes after the last hold NaN.
pub(super) struct CornersX8 {
    points: [Lanes<u64>; 3],
    positions: [VectorX8<f64>; 3],
}

impl CornersX8 {
    pub fn new<'a>(slots: &[usize], corners: impl Fn(usize) -> Corners<'a>) -> Self {
        let mut all = Self { points: [[0; LANES]; 3], positions: [[[f64::NAN; LANES]; 3]; 3] };
        for (lane, slot) in slots.iter().enumerate() {
            let (points, positions) = corners(*slot);
            for corner in 0..3 {
                all.points[corner][lane] = points[corner].into();
                for axis in 0..3 {
                    all.positions[corner][axis][lane] = positions[corner][axis];
                }
            }
        }
        all
    }

    /// Bits of the triangles whose boxes meet a box, and which a plane does not certainly separate from the triangle of
    /// some points ([`Plane::separates`]).
    #[inline(always)]
    fn not_apart(&self, bounds: &Aabb, plane: &Plane, points: &[u32; 3]) -> u32 {
        let points = points.map(u64::from);
        let mut is_kept = [false; LANES];
        for lane in 0..LANES {
            let mut meets = true;
            for axis in 0..3 {
                let [a, b, c] = [0, 1, 2].map(|corner: usize| self.positions[corner][axis][lane]);
                meets &= (bounds.min[axis] <= max(max(a, b), c)) & (min(min(a, b), c) <= bounds.max[axis]);
            }
            let (mut are_above, mut are_below, mut is_any) = (true, true, false);
            for corner in 0..3 {
                let point = self.points[corner][lane];
                let is_shared = (point == points[0]) | (point == points[1]) | (point == points[2]);
                let offset = [0, 1, 2].map(|axis: usize| self.positions[corner][axis][lane] - plane.origin[axis]);
                let side = dot(plane.normal.into(), offset);
                let rounding = dot(plane.rounding.into(), offset.map(f64::abs)) + MIN_VOLUME;
                are_above &= is_shared | (side > rounding);
                are_below &= is_shared | (side < -rounding);
                is_any |= !is_shared;
            }
            is_kept[lane] = meets & !(is_any & (are_above | are_below));
        }
        bits_of(&is_kept)
    }
}
