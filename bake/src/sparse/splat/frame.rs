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

use crate::bvh::Bvh;
use crate::rounding::SLIVER_SINE_SQ;
use crate::simd::{cross, dot, sub};

/// Height over the longest edge, relative to it, below which a triangle is its longest edge.
const MIN_HEIGHT: f64 = 1e-9;

/// Shape in the plane, as a kernel needs it.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::sparse) struct Shape {
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

/// Axes and shape of one triangle, wherever it is seen from.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::sparse) struct PlaneFrame {
    /// u, v and n.
    pub axes: [[f32; 3]; 3],
    pub shape: Shape,
    /// 1 or −1 if n is the outward normal or its opposite, 0 if that is unknown.
    pub outward: f32,
    /// Corner of the triangle that is A.
    first: u8,
}

/// A triangle seen from one point, such as the middle of a block of slots.
#[derive(Clone, Copy, Debug)]
pub(in crate::sparse) struct TriangleFrame {
    /// Coordinates of the point: rounded, and what rounding took.
    pub middle: [f32; 3],
    pub middle_rest: [f32; 3],
    pub plane: PlaneFrame,
    /// Slot of the triangle in the tree.
    pub slot: u32,
}

/// Frames of a tree's triangles, computed on demand: a small part of the time of a triangle's bricks, and no memory.
#[derive(Clone, Copy)]
pub(in crate::sparse) struct PlaneFrames<'a> {
    tree: &'a Bvh,
    orientations: Option<&'a [f64]>,
    inv_spacing: f64,
}

impl<'a> PlaneFrames<'a> {
    /// `orientations` are 1 for triangles wound outward, −1 for inward.
    pub fn new(tree: &'a Bvh, orientations: Option<&'a [f64]>, spacing: f64) -> Self {
        Self { tree, orientations, inv_spacing: 1.0 / spacing }
    }

    /// Frame of the triangle in a slot.
    #[inline(always)]
    pub fn get(&self, slot: usize) -> PlaneFrame {
        let orientation = self.orientations.map_or(0.0, |orientations| orientations[slot]);
        PlaneFrame::new(&self.tree.corners[slot], orientation, self.inv_spacing)
    }
}

impl PlaneFrame {
    #[inline(always)]
    fn new(corners: &[Vector3<f64>; 3], orientation: f64, inv_spacing: f64) -> Self {
        let corners = [0, 1, 2].map(|corner: usize| [corners[corner].x, corners[corner].y, corners[corner].z]);
        let edges = [0, 1, 2].map(|corner: usize| sub(corners[(corner + 1) % 3], corners[corner]));
        let lengths_sq = edges.map(|edge| dot(edge, edge));
        let after_first = if lengths_sq[1] >= lengths_sq[2] { 1 } else { 2 };
        let first = if lengths_sq[0] >= lengths_sq[after_first] { 0 } else { after_first };
        let scaled = |vector: [f64; 3], by: f64| vector.map(|x| x * by);
        let (ab, ac) = (scaled(edges[first], inv_spacing), scaled(edges[(first + 2) % 3], -inv_spacing));
        let length = dot(ab, ab).sqrt();
        let u = if length > 0.0 { scaled(ab, 1.0 / length) } else { [1.0, 0.0, 0.0] };
        let c_x = dot(ac, u);
        let height = sub(ac, scaled(u, c_x));
        let c_y = dot(height, height).sqrt();
        let has_height = c_y > MIN_HEIGHT * length;
        let v = if has_height {
            scaled(height, 1.0 / c_y)
        } else {
            let across = cross(u, if u[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] });
            scaled(across, 1.0 / dot(across, across).sqrt())
        };
        let c_y = if has_height { c_y } else { 0.0 };
        let n = cross(u, v);
        let inverse = |x: f64| if x > 0.0 { (1.0 / x) as f32 } else { 0.0 };
        let bc_x = c_x - length;
        let shape = Shape {
            b: length as f32,
            c: [c_x as f32, c_y as f32],
            inv_ac_sq: inverse(c_x * c_x + c_y * c_y),
            inv_bc_sq: inverse(bc_x * bc_x + c_y * c_y),
            bc_x: bc_x as f32,
        };
        // n is the winding's normal: v points to the third corner. In voxels, nothing overflows.
        let doubled_area = cross(ab, ac);
        let is_sliver = dot(doubled_area, doubled_area) <= SLIVER_SINE_SQ * dot(ab, ab) * dot(ac, ac);
        let outward = if is_sliver { 0.0 } else { orientation as f32 };
        Self { axes: [u, v, n].map(|axis| axis.map(|x| x as f32)), shape, outward, first: first as u8 }
    }
}

impl TriangleFrame {
    #[inline(always)]
    pub fn new(slot: u32, plane: &PlaneFrame, corners: &[Vector3<f64>; 3], middle: [f64; 3], inv_spacing: f64) -> Self {
        let a = corners[usize::from(plane.first)];
        let from_a = sub(middle, [a.x, a.y, a.z]).map(|x| x * inv_spacing);
        let coordinates = plane.axes.map(|axis| dot(from_a, axis.map(f64::from)));
        let middle = coordinates.map(|x| x as f32);
        let middle_rest = [0, 1, 2].map(|axis: usize| (coordinates[axis] - f64::from(middle[axis])) as f32);
        Self { middle, middle_rest, plane: *plane, slot }
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

/// Linear interpolation from `a` to `b`.
#[inline(always)]
pub(super) fn mix(a: f32, b: f32, t: f32) -> f32 {
    (b - a).mul_add(t, a)
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
pub(in crate::sparse) fn planar_distance_sq(u: f32, v: f32, shape: &Shape) -> f32 {
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
