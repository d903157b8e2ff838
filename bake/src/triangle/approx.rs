//! Approximate distance of a triangle from eight points at once, in f32, with bounds that hold whatever the rounding.
//!
//! Let q be any point of the triangle near to the nearest, x a query point and w = x − q. Then |w| is an upper bound
//! of the distance. The triangle lies behind the plane across w through its foremost corner, so from x + v its
//! distance is at least
//!
//! ```text
//! (gap + v·w) / |w|,   gap = w·x − max over the corners t of w·t,
//! ```
//!
//! for any w: errors of q make the bounds wider, not wrong.

use sdf_core::Aabb;
use sdf_core::nalgebra::Vector3;

use crate::rounding::{APPROX_DISTANCE_ROUNDING, MIN_SQ_F32};
use crate::simd::{LANES, Lanes, VectorX8, dot, fused_dot, lane_of, max, sub};
use crate::triangle::is_sliver;

/// Coordinates in which a mesh spans −1 … 1, the range in which f32 is accurate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UnitFrame {
    center: Vector3<f64>,
    pub inv_length: f64,
}

/// A triangle in a [`UnitFrame`], and what of its nearest point does not depend on the query point.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ApproxTriangle {
    pub is_sliver: bool,
    a: [f32; 3],
    ab: [f32; 3],
    ac: [f32; 3],
    ab_sq: f32,
    ac_sq: f32,
    ab_ac: f32,
    inv_ab_sq: f32,
    inv_ac_sq: f32,
    inv_bc_sq: f32,
    inv_area_sq: f32,
}

/// Bounds of a triangle's distance around eight points. The module's |w| is left as a square: callers seldom need the
/// root.
#[derive(Clone, Copy)]
pub(crate) struct ApproxDistance {
    /// w: offset from a point of the triangle near to the nearest.
    pub offset: VectorX8<f32>,
    /// |w|².
    pub distance_sq: Lanes<f32>,
    /// Zero if |w| < 1e-18: then the lower bound says nothing.
    pub gap: Lanes<f32>,
}

impl UnitFrame {
    pub fn enclosing(bounds: &Aabb) -> Self {
        let center = Vector3::from_fn(|axis, _| 0.5 * bounds.min[axis] + 0.5 * bounds.max[axis]);
        Self { center, inv_length: 2.0 / bounds.longest_side() }
    }

    pub fn unit_from_mesh(&self, point: Vector3<f64>) -> Vector3<f64> {
        (point - self.center) * self.inv_length
    }

    #[inline(always)]
    pub fn unit_from_mesh_f32(&self, point: Vector3<f64>) -> [f32; 3] {
        [0, 1, 2].map(|axis: usize| ((point[axis] - self.center[axis]) * self.inv_length) as f32)
    }

    /// Largest error of a bound of [`ApproxDistance`] from points with coordinates up to `max_coordinate`.
    pub fn rounding(max_coordinate: f32) -> f32 {
        APPROX_DISTANCE_ROUNDING * (1.0 + max_coordinate)
    }
}

impl ApproxTriangle {
    pub fn new(corners: [Vector3<f64>; 3], frame: &UnitFrame) -> Self {
        let [a, b, c] = corners.map(|corner| frame.unit_from_mesh_f32(corner));
        let [ab, ac] = [sub(b, a), sub(c, a)];
        let [ab_sq, ac_sq, ab_ac] = [dot(ab, ab), dot(ac, ac), dot(ab, ac)];
        let area_sq = ab_sq * ac_sq - ab_ac * ab_ac;
        Self {
            is_sliver: is_sliver(corners),
            a,
            ab,
            ac,
            ab_sq,
            ac_sq,
            ab_ac,
            inv_ab_sq: inv_or_zero(ab_sq),
            inv_ac_sq: inv_or_zero(ac_sq),
            inv_bc_sq: inv_or_zero(ab_sq + ac_sq - 2.0 * ab_ac),
            // NaN fails all comparisons: without an area no point is inside.
            inv_area_sq: if area_sq > MIN_SQ_F32 { 1.0 / area_sq } else { f32::NAN },
        }
    }

    pub fn first_corner(&self) -> [f32; 3] {
        self.a
    }

    #[inline(always)]
    pub fn corners(&self) -> [[f32; 3]; 3] {
        let corner = |edge: [f32; 3]| [self.a[0] + edge[0], self.a[1] + edge[1], self.a[2] + edge[2]];
        [self.a, corner(self.ab), corner(self.ac)]
    }

    /// Squared radius of a ball around the triangle: a third of its longest edge's square (Jung 1901), and rounding.
    #[inline(always)]
    pub fn radius_sq(&self) -> f32 {
        0.34 * max(max(self.ab_sq, self.ac_sq), self.ab_sq + self.ac_sq - 2.0 * self.ab_ac)
    }

    #[inline(always)]
    pub fn distances_from(&self, points: &VectorX8<f32>) -> ApproxDistance {
        let Self { a, ab, ac, .. } = *self;
        let mut distances = ApproxDistance { offset: [[0.0; LANES]; 3], distance_sq: [0.0; LANES], gap: [0.0; LANES] };
        for lane in 0..LANES {
            let from_a = sub(lane_of(points, lane), a);
            let [u, v] = self.nearest_weights(fused_dot(ab, from_a), fused_dot(ac, from_a));
            let offset = |axis: usize| (-v).mul_add(ac[axis], (-u).mul_add(ab[axis], from_a[axis]));
            let offset = [offset(0), offset(1), offset(2)];
            let distance_sq = fused_dot(offset, offset);
            let foremost = max(max(fused_dot(ab, offset), fused_dot(ac, offset)), 0.0);
            let gap = fused_dot(from_a, offset) - foremost;
            distances.distance_sq[lane] = distance_sq;
            distances.gap[lane] = if distance_sq > MIN_SQ_F32 { gap } else { 0.0 };
            for axis in 0..3 {
                distances.offset[axis][lane] = offset[axis];
            }
        }
        distances
    }

    /// Weights of b and c at the nearest point, from the projections d₁ = ab·ap and d₂ = ac·ap: those of the plane's
    /// nearest point if it is inside, else of the nearest of the three edges' points. At a + t e, the squared distance
    /// less |ap|² is t (t e·e − 2 e·ap).
    #[inline(always)]
    fn nearest_weights(&self, d1: f32, d2: f32) -> [f32; 2] {
        let inside_u = self.ac_sq.mul_add(d1, -self.ab_ac * d2) * self.inv_area_sq;
        let inside_v = self.ab_sq.mul_add(d2, -self.ab_ac * d1) * self.inv_area_sq;
        let is_inside = (inside_u >= 0.0) & (inside_v >= 0.0) & (inside_u + inside_v <= 1.0);
        let t_ab = clamp_to_unit(d1 * self.inv_ab_sq);
        let t_ac = clamp_to_unit(d2 * self.inv_ac_sq);
        let t_bc = clamp_to_unit((d2 - d1 + (self.ab_sq - self.ab_ac)) * self.inv_bc_sq);
        let along_ab = |t: f32| t * t.mul_add(self.ab_sq, -2.0 * d1);
        let along_ac = |t: f32| t * t.mul_add(self.ac_sq, -2.0 * d2);
        let (ab_distance, ac_distance, t_cb) = (along_ab(t_ab), along_ac(t_ac), 1.0 - t_bc);
        let bc_distance = (2.0 * t_bc * t_cb).mul_add(self.ab_ac, along_ab(t_cb) + along_ac(t_bc));
        let is_ac = ac_distance < ab_distance;
        let [edge_distance, edge_u, edge_v] = [
            if is_ac { ac_distance } else { ab_distance },
            if is_ac { 0.0 } else { t_ab },
            if is_ac { t_ac } else { 0.0 },
        ];
        let is_bc = bc_distance < edge_distance;
        let [edge_u, edge_v] = [if is_bc { t_cb } else { edge_u }, if is_bc { t_bc } else { edge_v }];
        [if is_inside { inside_u } else { edge_u }, if is_inside { inside_v } else { edge_v }]
    }
}

/// Zero for an edge without length: all its points are the same.
#[inline(always)]
fn inv_or_zero(square: f32) -> f32 {
    if square > MIN_SQ_F32 { 1.0 / square } else { 0.0 }
}

#[inline(always)]
fn clamp_to_unit(t: f32) -> f32 {
    let t = max(t, 0.0);
    if t < 1.0 { t } else { 1.0 }
}

#[cfg(test)]
mod tests;
