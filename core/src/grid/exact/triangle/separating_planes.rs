use core::array::from_fn;

use nalgebra::Vector3;

use crate::number::{Float, Real};
use crate::rounding::PLANE_DISTANCE;

/// A triangle's plane and the three planes through its edges across it, their normals pointing inwards.
pub(super) struct SeparatingPlanes<R> {
    pub x: [R; 4],
    pub y: [R; 4],
    pub z: [R; 4],
    /// Their sizes.
    pub sizes: [[R; 4]; 3],
    pub offset: [R; 4],
    /// More than what is off by rounding in how far a point of the triangle's box lies from a plane, times its normal's length.
    pub rounding: [R; 4],
}

impl<R: Float> SeparatingPlanes<R> {
    #[cfg_attr(feature = "std", inline(always))]
    pub fn new(&[a, b, c]: &[Vector3<R>; 3], normal: Vector3<R>, slack: R) -> Self {
        let size = |of: Vector3<R>| of.x.abs() + of.y.abs() + of.z.abs();
        let (u, v, w) = (b - a, c - a, c - b);
        let normals = [normal, normal.cross(&u), normal.cross(&w), v.cross(&normal)];
        let at = [a, a, b, a];
        let (extent, square) = (size(u) + size(v), size(u) * size(v));
        let squares = [square, square * size(u), square * size(w), square * size(v)];
        let part = extent * R::from_f64(PLANE_DISTANCE * R::EPSILON);
        Self {
            sizes: [0, 1, 2].map(|axis: usize| normals.map(|normal| normal[axis % 3].abs())),
            x: normals.map(|normal| normal.x),
            y: normals.map(|normal| normal.y),
            z: normals.map(|normal| normal.z),
            offset: from_fn(|k| normals[k].dot(&at[k])),
            rounding: from_fn(|k| size(normals[k]) * slack + squares[k] * part),
        }
    }

    /// Whether a box, no part of which is outside of the triangle's, certainly holds no point of the triangle.
    #[inline(always)]
    pub fn is_disjoint(&self, middle: Vector3<R>, half: Vector3<R>) -> bool {
        self.room(middle, half) < R::zero()
    }

    /// How far a box reaches into the triangle's side of that plane which it reaches across the least, times the length of its
    /// normal: below zero if the box misses the triangle.
    #[inline(always)]
    pub fn room(&self, middle: Vector3<R>, half: Vector3<R>) -> R {
        let of_plane = |k: usize| {
            let [inwards, reach] = self.across(k, middle, half);
            if k == 0 { reach - inwards.abs() } else { inwards + reach }
        };
        Real::min(Real::min(of_plane(0), of_plane(1)), Real::min(of_plane(2), of_plane(3)))
    }

    /// How far a box's middle lies across a plane, and how far the box reaches to either side, times its normal's length.
    #[cfg_attr(feature = "std", inline(always))]
    fn across(&self, k: usize, middle: Vector3<R>, half: Vector3<R>) -> [R; 2] {
        let (x, y, z) = (self.x[k % 4], self.y[k % 4], self.z[k % 4]);
        let inwards = x * middle.x + y * middle.y + z * middle.z - self.offset[k % 4];
        let [size_x, size_y, size_z] = &self.sizes;
        [inwards, size_x[k % 4] * half.x + size_y[k % 4] * half.y + size_z[k % 4] * half.z + self.rounding[k % 4]]
    }
}
