//! Separating plane test of boxes against a triangle.
//!
//! As in Akenine-Möller 2001, "Fast 3D Triangle-Box Overlap Testing", a box with centre m and half extents h is
//! disjoint from the triangle if a plane separates them. Four planes are tested: that of the triangle, and through
//! each edge the one perpendicular to it. With n the plane's normal (pointing inwards for an edge) and p a point of
//! it,
//!
//! ```text
//! signed distance of the box's centre    s = n·m − n·p
//! reach of the box to either side        r = Σ_i |n_i| h_i
//! overlap (both times |n|)               r − |s| for the triangle's plane,  r + s for an edge's
//! ```
//!
//! A negative overlap proves that box and triangle are disjoint. The paper's nine axes (edge × axis) are left out, so
//! the test is necessary but not sufficient: some boxes that the triangle just misses are kept. Its three box axes
//! are not needed, because all boxes here lie in the triangle's own box.

use core::array::from_fn;

use nalgebra::Vector3;

use crate::number::{Float, Real};
use crate::rounding::PLANE_DISTANCE;

/// The four planes: the triangle's, then those of the edges ab, bc and ca. Arrays are by plane.
pub(super) struct SeparatingPlanes<R> {
    pub normal_x: [R; 4],
    pub normal_y: [R; 4],
    pub normal_z: [R; 4],
    /// |n_x|, |n_y| and |n_z|.
    pub abs_normals: [[R; 4]; 3],
    /// n·p.
    pub offset: [R; 4],
    /// Bound of the rounding in s + r, times |n|.
    pub rounding: [R; 4],
}

impl<R: Float> SeparatingPlanes<R> {
    /// `coordinate_rounding` bounds the rounding of a corner's coordinate.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn new(&[a, b, c]: &[Vector3<R>; 3], normal: Vector3<R>, coordinate_rounding: R) -> Self {
        let norm_1 = |vector: Vector3<R>| vector.x.abs() + vector.y.abs() + vector.z.abs();
        let (u, v, w) = (b - a, c - a, c - b);
        let normals = [normal, normal.cross(&u), normal.cross(&w), v.cross(&normal)];
        let points = [a, a, b, a];
        // Bounds of the factors of each normal: |n| ≤ |u||v|, |n × u| ≤ |u|²|v|, ...
        let (extent, square) = (norm_1(u) + norm_1(v), norm_1(u) * norm_1(v));
        let factors = [square, square * norm_1(u), square * norm_1(w), square * norm_1(v)];
        let extent_rounding = extent * R::from_f64(PLANE_DISTANCE * R::EPSILON);
        Self {
            abs_normals: [0, 1, 2].map(|axis: usize| normals.map(|normal| normal[axis % 3].abs())),
            normal_x: normals.map(|normal| normal.x),
            normal_y: normals.map(|normal| normal.y),
            normal_z: normals.map(|normal| normal.z),
            offset: from_fn(|k| normals[k].dot(&points[k])),
            rounding: from_fn(|k| norm_1(normals[k]) * coordinate_rounding + factors[k] * extent_rounding),
        }
    }

    /// Is the box certainly disjoint from the triangle? The box must lie in the triangle's box.
    #[inline(always)]
    pub fn is_disjoint(&self, center: Vector3<R>, half_extents: Vector3<R>) -> bool {
        self.overlap(center, half_extents) < R::zero()
    }

    /// Smallest overlap over the four planes, rounding included. Each is scaled by its |n|; only the sign is
    /// meaningful.
    #[inline(always)]
    pub fn overlap(&self, center: Vector3<R>, half_extents: Vector3<R>) -> R {
        let plane_overlap = |k: usize| {
            let [distance, reach] = self.distance_and_reach(k, center, half_extents);
            if k == 0 { reach - distance.abs() } else { distance + reach }
        };
        Real::min(Real::min(plane_overlap(0), plane_overlap(1)), Real::min(plane_overlap(2), plane_overlap(3)))
    }

    /// s and r of plane `k`.
    #[cfg_attr(feature = "std", inline(always))]
    fn distance_and_reach(&self, k: usize, center: Vector3<R>, half_extents: Vector3<R>) -> [R; 2] {
        let (x, y, z) = (self.normal_x[k % 4], self.normal_y[k % 4], self.normal_z[k % 4]);
        let distance = x * center.x + y * center.y + z * center.z - self.offset[k % 4];
        let [abs_x, abs_y, abs_z] = &self.abs_normals;
        let reach = abs_x[k % 4] * half_extents.x + abs_y[k % 4] * half_extents.y + abs_z[k % 4] * half_extents.z;
        [distance, reach + self.rounding[k % 4]]
    }
}
