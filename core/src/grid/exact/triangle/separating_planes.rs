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

use super::grid_triangle::GridTriangle;
use crate::number::{Float, Real};
use crate::rounding::{CELL_COORDINATE, PLANE_DISTANCE};

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
    /// Planes of positions that count from the triangle's first cell.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn new(triangle: &GridTriangle<R>) -> Self {
        let (normal, coordinate_rounding) = (triangle.normal, triangle.rounding);
        let first = triangle.first_node();
        let [a, b, c] = triangle.corners.map(|corner| corner - first);
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

    /// The same planes in single precision, with normals of length 1 in the sum norm, for points as far from the first cell
    /// as `extent`.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn to_single(&self, extent: R) -> SeparatingPlanes<f32> {
        let coordinate_rounding = extent * R::from_f64(CELL_COORDINATE * <f32 as Real>::EPSILON);
        let [x, y, z] = &self.abs_normals;
        let scale: [R; 4] = from_fn(|k| {
            let length = x[k % 4] + y[k % 4] + z[k % 4];
            let inverse = R::one() / length;
            // A plane whose direction underflows excludes nothing.
            R::select(inverse.is_finite(), inverse, R::zero())
        });
        let single = |by_plane: &[R; 4]| from_fn(|k| (by_plane[k % 4] * scale[k % 4]).to_single());
        SeparatingPlanes {
            normal_x: single(&self.normal_x),
            normal_y: single(&self.normal_y),
            normal_z: single(&self.normal_z),
            abs_normals: [single(x), single(y), single(z)],
            offset: single(&self.offset),
            rounding: from_fn(|k| (self.rounding[k % 4] * scale[k % 4] + coordinate_rounding).to_single()),
        }
    }

    /// Is the box certainly disjoint from the triangle? The box must lie in the triangle's box, its centre counts from the first cell.
    #[inline(always)]
    pub fn is_disjoint(&self, center: Vector3<R>, half_extents: Vector3<R>) -> bool {
        self.overlap(center, half_extents) < R::zero()
    }

    /// Smallest overlap over the four planes, rounding included. Each is scaled by its |n|; only the sign is
    /// meaningful.
    #[inline(always)]
    pub fn overlap(&self, center: Vector3<R>, half_extents: Vector3<R>) -> R {
        self.overlap_and_edges(center, half_extents).0
    }

    /// [`overlap`](Self::overlap), and the sum of 1, 2 and 4 for the planes through ab, ac and bc that the box meets.
    #[inline(always)]
    pub fn overlap_and_edges(&self, center: Vector3<R>, half_extents: Vector3<R>) -> (R, R) {
        let [distance, reach] = self.distance_and_reach(0, center, half_extents);
        let (mut overlap, mut edges) = (reach - distance.abs(), R::zero());
        for (k, bit) in [(1, 1.0), (2, 4.0), (3, 2.0)] {
            let [distance, reach] = self.distance_and_reach(k, center, half_extents);
            overlap = Real::min(overlap, distance + reach);
            edges += R::select(distance.le(reach), R::from_f64(bit), R::zero());
        }
        (overlap, edges)
    }

    /// Lower and upper bounds, along each axis, of the triangle's part in a box; the lower one is above the upper where there is none. Each
    /// plane bounds one coordinate by the box's bounds of the others. A thousandth of a cell is allowed for the rounding of divisions.
    #[inline(always)]
    pub fn met_part(&self, lower: [R; 3], upper: [R; 3]) -> [[R; 3]; 2] {
        let (mut from, mut to) = (lower, upper);
        let normals = [&self.normal_x, &self.normal_y, &self.normal_z];
        let slack = R::from_f64(1e-3);
        for k in 0..4 {
            // Of n·p − n·p0 over the box, along each axis.
            let term = |axis: usize| {
                let normal = normals[axis % 3][k % 4];
                let (a, b) = (normal * lower[axis % 3], normal * upper[axis % 3]);
                [Real::min(a, b), Real::max(a, b)]
            };
            let terms = [term(0), term(1), term(2)];
            let (offset, rounding) = (self.offset[k], self.rounding[k]);
            for axis in 0..3 {
                let [one, other] = [terms[(axis + 1) % 3], terms[(axis + 2) % 3]];
                let least = offset - rounding - one[1] - other[1];
                let most = if k == 0 { offset + rounding - one[0] - other[0] } else { R::from_f64(f64::INFINITY) };
                let normal = normals[axis][k];
                if normal.is_zero() {
                    continue;
                }
                let ends = [least / normal, most / normal];
                let [low, high] = if normal < R::zero() { [ends[1], ends[0]] } else { ends };
                from[axis] = Real::max(from[axis], low - slack);
                to[axis] = Real::min(to[axis], high + slack);
            }
        }
        [from, to]
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
