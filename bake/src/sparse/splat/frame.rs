//! A triangle in the frame of its own plane, in voxels.
//!
//! The origin is the start A of the longest edge AB, u runs along it and v towards the third corner C; n is normal to
//! both. So A = (0, 0), B = (b, 0), C = (cₓ, c_y) with 0 ≤ cₓ ≤ b and c_y ≥ 0, and the angles at A and B are acute. The
//! squared distance of a point (u, v, w) is w² plus that of (u, v) to a triangle of the plane: the least of those to
//! its three edges, or zero inside.
//!
//! With the longest edge along u, "inside" needs three signs that rounding cannot all turn: behind A or B one of them is a
//! sum of two numbers of one sign, and the angle at C is at least 60°.

use crate::bvh::Bvh;
use crate::rounding::SLIVER_SINE_SQ;
use crate::simd::{LANES, Lanes, VectorX8, cross, dot, lane_of, sub};

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
}

/// A triangle seen from one point, such as the middle of a block of slots.
#[derive(Clone, Copy, Debug, Default)]
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

    /// Corners of the triangles in eight slots.
    #[inline(always)]
    pub fn corners(&self, slots: &Lanes<u32>) -> [VectorX8<f64>; 3] {
        let mut all: [VectorX8<f64>; 3] = [[[0.0; LANES]; 3]; 3];
        for (lane, slot) in slots.iter().enumerate() {
            for (corners, corner) in all.iter_mut().zip(&self.tree.corners[*slot as usize]) {
                (0..3).for_each(|axis| corners[axis][lane] = corner[axis]);
            }
        }
        all
    }

    /// Frames of the triangles in eight slots, of which these are the corners, side by side, each seen from its own point.
    #[inline(always)]
    pub fn eight(
        &self,
        slots: &Lanes<u32>,
        corners: &[VectorX8<f64>; 3],
        points: &VectorX8<f64>,
    ) -> [TriangleFrame; LANES] {
        let orientation = |slot: u32| self.orientations.map_or(0.0, |orientations| orientations[slot as usize]);
        side_by_side(corners, &slots.map(orientation), points, self.inv_spacing).frames(slots)
    }
}

/// Frames as a structure of arrays.
#[derive(Default)]
struct FramesX8 {
    middle: VectorX8<f32>,
    middle_rest: VectorX8<f32>,
    /// u, v and n of each, by coordinate.
    axes: [VectorX8<f32>; 3],
    /// The fields of [`Shape`].
    shape: [Lanes<f32>; 6],
    outward: Lanes<f32>,
}

impl FramesX8 {
    #[inline(always)]
    fn frames(&self, slots: &Lanes<u32>) -> [TriangleFrame; LANES] {
        let mut frames = [TriangleFrame::default(); LANES];
        for lane in 0..LANES {
            let axes = [0, 1, 2].map(|axis: usize| lane_of(&self.axes[axis], lane));
            let [b, c_x, c_y, inv_ac_sq, inv_bc_sq, bc_x] = self.shape.map(|numbers| numbers[lane]);
            let shape = Shape { b, c: [c_x, c_y], inv_ac_sq, inv_bc_sq, bc_x };
            let plane = PlaneFrame { axes, shape, outward: self.outward[lane] };
            let (middle, middle_rest) = (lane_of(&self.middle, lane), lane_of(&self.middle_rest, lane));
            frames[lane] = TriangleFrame { middle, middle_rest, plane, slot: slots[lane] };
        }
        frames
    }
}

/// Frames of eight triangles. Branches would keep the loop from becoming vectors: compilers move what a choice chooses between into
/// the branches of an `if`.
#[inline(always)]
fn side_by_side(
    corners: &[VectorX8<f64>; 3],
    orientations: &Lanes<f64>,
    points: &VectorX8<f64>,
    inv_spacing: f64,
) -> FramesX8 {
    let mut frames = FramesX8::default();
    for lane in 0..LANES {
        let [a, b, c] = [lane_of(&corners[0], lane), lane_of(&corners[1], lane), lane_of(&corners[2], lane)];
        let edges = [sub(b, a), sub(c, b), sub(a, c)];
        let [first_sq, second_sq, third_sq] =
            [dot(edges[0], edges[0]), dot(edges[1], edges[1]), dot(edges[2], edges[2])];
        let is_second = second_sq >= third_sq;
        let is_first = first_sq >= select(is_second, second_sq, third_sq);
        // Of the first, second and third corner, that at which the longest edge begins: A.
        let of_first = |first, second, third| choose(is_first, first, choose(is_second, second, third));
        let ab = scaled(of_first(edges[0], edges[1], edges[2]), inv_spacing);
        let ac = scaled(of_first(edges[2], edges[0], edges[1]), -inv_spacing);
        let point = lane_of(points, lane);
        let from_a = scaled(of_first(sub(point, a), sub(point, b), sub(point, c)), inv_spacing);
        let length = dot(ab, ab).sqrt();
        let u = choose(length > 0.0, scaled(ab, 1.0 / length), [1.0, 0.0, 0.0]);
        let c_x = dot(ac, u);
        let height = sub(ac, scaled(u, c_x));
        let c_y = dot(height, height).sqrt();
        let has_height = c_y > MIN_HEIGHT * length;
        let across = cross(u, choose(u[0].abs() < 0.6, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]));
        let v = choose(has_height, scaled(height, 1.0 / c_y), scaled(across, 1.0 / dot(across, across).sqrt()));
        let c_y = select(has_height, c_y, 0.0);
        let n = cross(u, v);
        let bc_x = c_x - length;
        let inverse = |x: f64| select(x > 0.0, 1.0 / x, 0.0) as f32;
        // n is the winding's normal: v points to the third corner. In voxels, nothing overflows.
        let doubled_area = cross(ab, ac);
        let is_sliver = dot(doubled_area, doubled_area) <= SLIVER_SINE_SQ * dot(ab, ab) * dot(ac, ac);
        frames.outward[lane] = select(is_sliver, 0.0, orientations[lane]) as f32;
        frames.shape[0][lane] = length as f32;
        frames.shape[1][lane] = c_x as f32;
        frames.shape[2][lane] = c_y as f32;
        frames.shape[3][lane] = inverse(c_x * c_x + c_y * c_y);
        frames.shape[4][lane] = inverse(bc_x * bc_x + c_y * c_y);
        frames.shape[5][lane] = bc_x as f32;
        let axes = [single(u), single(v), single(n)];
        for axis in 0..3 {
            for coordinate in 0..3 {
                frames.axes[axis][coordinate][lane] = axes[axis][coordinate];
            }
            let [x, y, z] = axes[axis];
            let along = dot(from_a, [f64::from(x), f64::from(y), f64::from(z)]);
            frames.middle[axis][lane] = along as f32;
            frames.middle_rest[axis][lane] = (along - f64::from(along as f32)) as f32;
        }
    }
    frames
}

#[inline(always)]
fn select(is_first: bool, first: f64, second: f64) -> f64 {
    std::hint::select_unpredictable(is_first, first, second)
}

#[inline(always)]
fn choose(is_first: bool, [a, b, c]: [f64; 3], [d, e, f]: [f64; 3]) -> [f64; 3] {
    [select(is_first, a, d), select(is_first, b, e), select(is_first, c, f)]
}

#[inline(always)]
fn scaled([x, y, z]: [f64; 3], by: f64) -> [f64; 3] {
    [x * by, y * by, z * by]
}

#[inline(always)]
fn single([x, y, z]: [f64; 3]) -> [f32; 3] {
    [x as f32, y as f32, z as f32]
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
