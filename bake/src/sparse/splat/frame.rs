//! A triangle in the frame of its own plane, in voxels.
//!
//! The origin is the start A of the longest edge AB, u runs along it and v towards the third corner C; n is normal to
//! both. So A = (0, 0), B = (b, 0), C = (cₓ, c_y) with 0 ≤ cₓ ≤ b and c_y ≥ 0, and the angles at A and B are acute. The
//! squared distance of a point (u, v, w) is w² plus that of (u, v) to a triangle of the plane: the least of those to
//! its three edges, or zero inside.
//!
//! With the longest edge along u, "inside" needs three signs that rounding cannot all turn: behind A or B one of them is a
//! sum of two numbers of one sign, and the angle at C is at least 60°.

use sdf_core::nalgebra::Vector3;

/// Height over the longest edge, relative to it, below which a triangle is its longest edge.
const MIN_HEIGHT: f64 = 1e-9;

/// Shape in the plane, as a kernel needs it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shape {
    /// B = (b, 0).
    pub b: f32,
    /// C = (cₓ, c_y).
    pub c: [f32; 2],
    /// 1 / |AC|² and 1 / |BC|², or zero.
    pub inv_ac_sq: f32,
    pub inv_bc_sq: f32,
    /// cₓ − b.
    pub bc_x: f32,
}

/// Frame and shape of one triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct TriangleFrame {
    /// A, in the unit of the mesh.
    pub origin: Vector3<f64>,
    /// u, v and n.
    pub axes: [Vector3<f64>; 3],
    pub shape: Shape,
    /// 1 or −1 if n is the outward normal or its opposite, 0 if that is unknown.
    pub outward: f32,
    /// Slot of the triangle in the tree.
    pub slot: u32,
}

impl TriangleFrame {
    /// `outward` is the unit normal out of the solid, or zero.
    pub fn new(slot: u32, corners: &[Vector3<f64>; 3], outward: Vector3<f64>, inv_spacing: f64) -> Self {
        let edge_sq = |corner: usize| (corners[(corner + 1) % 3] - corners[corner]).norm_squared();
        let lengths_sq = [0, 1, 2].map(edge_sq);
        let after_first = if lengths_sq[1] >= lengths_sq[2] { 1 } else { 2 };
        let first = if lengths_sq[0] >= lengths_sq[after_first] { 0 } else { after_first };
        let [a, b, c] = [0, 1, 2].map(|step: usize| corners[(first + step) % 3]);
        let [ab, ac] = [b, c].map(|corner| (corner - a) * inv_spacing);
        let length = ab.norm();
        let u = if length > 0.0 { ab / length } else { Vector3::x() };
        let c_x = ac.dot(&u);
        let height = ac - u * c_x;
        let c_y = height.norm();
        let is_flat = c_y > MIN_HEIGHT * length;
        let any_across = || if u.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
        let v = if is_flat { height / c_y } else { u.cross(&any_across()).normalize() };
        let c_y = if is_flat { c_y } else { 0.0 };
        let n = u.cross(&v);
        let inverse = |x: f64| if x > 0.0 { (1.0 / x) as f32 } else { 0.0 };
        let bc_x = c_x - length;
        let shape = Shape {
            b: length as f32,
            c: [c_x as f32, c_y as f32],
            inv_ac_sq: inverse(c_x * c_x + c_y * c_y),
            inv_bc_sq: inverse(bc_x * bc_x + c_y * c_y),
            bc_x: bc_x as f32,
        };
        let along = outward.dot(&n);
        let outward = if along.abs() > 0.5 { along.signum() as f32 } else { 0.0 };
        Self { origin: a, axes: [u, v, n], shape, outward, slot }
    }

    /// Coordinates of a point in the frame, in voxels.
    #[inline(always)]
    pub fn coordinates(&self, point: Vector3<f64>, inv_spacing: f64) -> [f64; 3] {
        let offset = (point - self.origin) * inv_spacing;
        let dot = |axis: &Vector3<f64>| axis.x * offset.x + axis.y * offset.y + axis.z * offset.z;
        [dot(&self.axes[0]), dot(&self.axes[1]), dot(&self.axes[2])]
    }
}

#[inline(always)]
pub(super) fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
pub(super) fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// `x` between 0 and `top`; NaN, as of an edge without a length, becomes 0.
#[inline(always)]
fn clamp(x: f32, top: f32) -> f32 {
    let x = if x > 0.0 { x } else { 0.0 };
    if x < top { x } else { top }
}

/// Squared distances of a point of the plane to the edges AB, AC and BC with the offsets from them, and whether it is
/// inside the triangle.
#[inline(always)]
fn from_edges(u: f32, v: f32, shape: &Shape) -> ([[f32; 3]; 3], bool) {
    let Shape { b, c: [c_x, c_y], inv_ac_sq, inv_bc_sq, bc_x } = *shape;
    let (ab_u, v_up) = (u - clamp(u, b), v * c_y);
    let t_ac = clamp(u.mul_add(c_x, v_up) * inv_ac_sq, 1.0);
    let (ac_u, ac_v) = ((-t_ac).mul_add(c_x, u), (-t_ac).mul_add(c_y, v));
    let from_b = u - b;
    let t_bc = clamp(from_b.mul_add(bc_x, v_up) * inv_bc_sq, 1.0);
    let (bc_u, bc_v) = ((-t_bc).mul_add(bc_x, from_b), (-t_bc).mul_add(c_y, v));
    let sides = [u.mul_add(c_y, -(v * c_x)), v.mul_add(bc_x, -(from_b * c_y))];
    let is_inside = (v >= 0.0) & (sides[0] > 0.0) & (sides[1] > 0.0);
    let edge = |u: f32, v: f32| [u.mul_add(u, v * v), u, v];
    ([edge(ab_u, v), edge(ac_u, ac_v), edge(bc_u, bc_v)], is_inside)
}

/// Squared distance of a point of the plane to the triangle.
#[inline(always)]
pub(super) fn planar_distance_sq(u: f32, v: f32, shape: &Shape) -> f32 {
    let ([ab, ac, bc], is_inside) = from_edges(u, v, shape);
    let outside = lesser(lesser(ab[0], ac[0]), bc[0]);
    if is_inside { 0.0 } else { outside }
}

/// As [`planar_distance_sq`], with the offset from the nearest point.
#[inline(always)]
pub(super) fn planar_offset(u: f32, v: f32, shape: &Shape) -> [f32; 3] {
    let ([ab, ac, bc], is_inside) = from_edges(u, v, shape);
    let select = |is_second: bool, first: [f32; 3], second: [f32; 3]| {
        [0, 1, 2].map(|k| if is_second { second[k] } else { first[k] })
    };
    let nearest = select(ac[0] < ab[0], ab, ac);
    let nearest = select(bc[0] < nearest[0], nearest, bc);
    select(is_inside, nearest, [0.0; 3])
}
