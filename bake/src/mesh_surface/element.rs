//! How near do an element (a vertex, an edge or a face of another mesh) and a triangle come?
//!
//! Two convex bodies that do not cross are nearest at a corner of one and a point of the other, or at an edge of both. So the distance is
//! the least over corner and triangle, triangle's corner and element, edge and edge (Ericson 2005, "Real-Time Collision Detection",
//! §5.1.9 and §5.1.10); or zero where an edge of one passes through the other.

use sdf_core::nalgebra::Vector3;

use crate::simd::{cross, dot, lane_of, max, min, sub};
use crate::triangle::nearest::for_each_point;
use crate::triangle::{NearestOnTriangle, TriangleFeature, is_sliver, nearest_on_triangle};

/// The nearest points of an element and a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    /// Barycentric weights of the element's point; zero beyond its corners.
    pub weights: [f64; 3],
    pub on_element: Vector3<f64>,
    pub on_triangle: Vector3<f64>,
    pub distance_sq: f64,
}

impl Pair {
    const NONE: Self = Self {
        weights: [0.0; 3],
        on_element: Vector3::new(0.0, 0.0, 0.0),
        on_triangle: Vector3::new(0.0, 0.0, 0.0),
        distance_sq: f64::INFINITY,
    };

    #[inline(always)]
    fn keep_nearer(&mut self, on_element: Vector3<f64>, on_triangle: Vector3<f64>, weights: impl FnOnce() -> [f64; 3]) {
        let distance_sq = (on_element - on_triangle).norm_squared();
        if distance_sq < self.distance_sq {
            *self = Self { weights: weights(), on_element, on_triangle, distance_sq };
        }
    }
}

/// The nearest points of an element with one to three corners and a triangle. Where they cross, some point of both.
///
/// Inlined into what is compiled for a machine's own instructions; in a browser's module, one copy.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
pub(crate) fn nearest_pair(element: &[Vector3<f64>], triangle: [Vector3<f64>; 3]) -> Pair {
    let mut best = Pair::NONE;
    let on_triangle = NearestPoints::new(element, &triangle);
    for (index, corner) in element.iter().enumerate() {
        best.keep_nearer(*corner, on_triangle.point(index), || unit(index));
    }
    let can_cross = !is_on_one_side(element, triangle);
    for (from, to) in sides(element.len()) {
        let along = element[to] - element[from];
        let on_sides = NearestOnSides::new(element[from], along, &triangle);
        let nearest = (1..3).fold(0, |best, side| if on_sides.is_nearer(side, best) { side } else { best });
        let s = on_sides.s[nearest];
        best.keep_nearer(element[from] + along * s, on_sides.point(nearest), || on_side(from, to, s));
        if can_cross && let Some((s, point)) = crossing(element[from], along, triangle) {
            best.keep_nearer(point, point, || on_side(from, to, s));
        }
    }
    if let &[a, b, c] = element {
        let on_element = NearestPoints::new(&triangle, &[a, b, c]);
        for (index, corner) in triangle.iter().enumerate() {
            let weights = || face_weights(&nearest_on_triangle(*corner, [a, b, c]), [a, b, c]);
            best.keep_nearer(on_element.point(index), *corner, weights);
            let along = triangle[(index + 1) % 3] - corner;
            if can_cross && let Some((_, point)) = crossing(*corner, along, [a, b, c]) {
                best.keep_nearer(point, point, || face_weights(&nearest_on_triangle(point, [a, b, c]), [a, b, c]));
            }
        }
    }
    best
}

/// The points of a triangle that are nearest to up to three others, one per lane.
struct NearestPoints([[f64; SIDES]; 3]);

impl NearestPoints {
    #[inline(always)]
    fn new(points: &[Vector3<f64>], triangle: &[Vector3<f64>; 3]) -> Self {
        let lanes: [[f64; SIDES]; 3] =
            [0, 1, 2].map(|axis| std::array::from_fn(|lane: usize| points[lane.min(points.len() - 1)][axis]));
        let mut nearest = [[0.0; SIDES]; 3];
        for_each_point(&lanes, triangle, is_sliver(*triangle), |lane, point, _| {
            (0..3).for_each(|axis| nearest[axis][lane] = point[axis]);
        });
        Self(nearest)
    }

    #[inline(always)]
    fn point(&self, lane: usize) -> Vector3<f64> {
        lane_of(&self.0, lane).into()
    }
}

/// The nearest points of a segment, from + s along, and each side of a triangle (Ericson 2005, §5.1.9), one side per lane.
struct NearestOnSides {
    s: [f64; SIDES],
    points: [[f64; SIDES]; 3],
    distances_sq: [f64; SIDES],
}

/// The three sides of a triangle, and the first again: as many as fill a register.
const SIDES: usize = 4;

impl NearestOnSides {
    #[inline(always)]
    fn new(from: Vector3<f64>, along: Vector3<f64>, triangle: &[Vector3<f64>; 3]) -> Self {
        let (from, along) = ([from.x, from.y, from.z], [along.x, along.y, along.z]);
        let corner = |lane: usize, axis: usize| triangle[lane % 3][axis];
        let starts: [[f64; SIDES]; 3] = [0, 1, 2].map(|axis| std::array::from_fn(|lane| corner(lane, axis)));
        let ends: [[f64; SIDES]; 3] = [0, 1, 2].map(|axis| std::array::from_fn(|lane| corner(lane + 1, axis)));
        let mut nearest = Self { s: [0.0; SIDES], points: [[0.0; SIDES]; 3], distances_sq: [0.0; SIDES] };
        let length_sq = dot(along, along);
        for lane in 0..SIDES {
            let [start, end] = [&starts, &ends].map(|points| [points[0][lane], points[1][lane], points[2][lane]]);
            let (side, offset) = (sub(end, start), sub(from, start));
            let (side_sq, mixed) = (dot(side, side), dot(along, side));
            let (c, f) = (dot(along, offset), dot(side, offset));
            // By cross products: where the segments are nearly parallel, differences of products of lengths have lost their digits.
            let across = cross(side, along);
            let s = to_unit(ratio(dot(cross(offset, side), across), dot(across, across)));
            let free = ratio(mixed * s + f, side_sq);
            let t = to_unit(free);
            let s = if t == free { s } else { to_unit(ratio(mixed * t - c, length_sq)) };
            let mut distance_sq = 0.0;
            for axis in 0..3 {
                let point = start[axis] + side[axis] * t;
                let between = from[axis] + along[axis] * s - point;
                nearest.points[axis][lane] = point;
                distance_sq += between * between;
            }
            (nearest.s[lane], nearest.distances_sq[lane]) = (s, distance_sq);
        }
        nearest
    }

    #[inline(always)]
    fn is_nearer(&self, side: usize, other: usize) -> bool {
        self.distances_sq[side] < self.distances_sq[other]
    }

    #[inline(always)]
    fn point(&self, side: usize) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.points[axis][side])
    }
}

#[inline(always)]
fn ratio(numerator: f64, denominator: f64) -> f64 {
    let quotient = numerator / denominator;
    if denominator > 0.0 { quotient } else { 0.0 }
}

#[inline(always)]
fn to_unit(t: f64) -> f64 {
    max(min(t, 1.0), 0.0)
}

/// Are all corners of an element strictly on one side of a triangle's plane?
#[inline(always)]
fn is_on_one_side(element: &[Vector3<f64>], [a, b, c]: [Vector3<f64>; 3]) -> bool {
    let normal = (b - a).cross(&(c - a));
    let offset = |corner: &Vector3<f64>| normal.dot(&(corner - a));
    element.iter().all(|corner| offset(corner) > 0.0) || element.iter().all(|corner| offset(corner) < 0.0)
}

/// Edges of an element as pairs of corners.
fn sides(count: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..count).map(move |from| (from, (from + 1) % count)).take(if count < 3 { count - 1 } else { 3 })
}

#[inline(always)]
fn unit(index: usize) -> [f64; 3] {
    std::array::from_fn(|corner| if corner == index { 1.0 } else { 0.0 })
}

#[inline(always)]
fn on_side(from: usize, to: usize, s: f64) -> [f64; 3] {
    std::array::from_fn(|corner| match corner {
        _ if corner == from => 1.0 - s,
        _ if corner == to => s,
        _ => 0.0,
    })
}

/// The barycentric weights of a point of a face.
fn face_weights(nearest: &NearestOnTriangle, corners: [Vector3<f64>; 3]) -> [f64; 3] {
    match nearest.feature {
        TriangleFeature::Corner(corner) => unit(corner),
        TriangleFeature::Edge(edge) => {
            let next = (edge + 1) % 3;
            let along = corners[next] - corners[edge];
            let s = (nearest.point - corners[edge]).dot(&along) / along.norm_squared();
            on_side(edge, next, s.clamp(0.0, 1.0))
        }
        TriangleFeature::Inside => {
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            let area = |corner: usize| {
                let [from, to] = [corners[(corner + 1) % 3], corners[(corner + 2) % 3]].map(|at| at - nearest.point);
                from.cross(&to).dot(&normal).max(0.0)
            };
            let areas = [area(0), area(1), area(2)];
            let sum: f64 = areas.iter().sum();
            let (u, v) = (areas[1] / sum, areas[2] / sum);
            [(1.0 - u - v).max(0.0), u, v]
        }
    }
}

/// Where a segment passes through a triangle, up to rounding: where it decides, the pair of two edges is near zero as well.
#[inline(always)]
fn crossing(from: Vector3<f64>, along: Vector3<f64>, [a, b, c]: [Vector3<f64>; 3]) -> Option<(f64, Vector3<f64>)> {
    let normal = (b - a).cross(&(c - a));
    let normal = normal / normal.amax();
    let (start, end) = (normal.dot(&(from - a)), normal.dot(&(from + along - a)));
    // Not their product, which may underflow. NaN without a normal.
    let are_on_one_side = start > 0.0 && end > 0.0 || start < 0.0 && end < 0.0;
    if are_on_one_side || start == end || start.is_nan() {
        return None;
    }
    let s = start / (start - end);
    let point = from + along * s;
    let is_left = |from: Vector3<f64>, to: Vector3<f64>| (to - from).cross(&(point - from)).dot(&normal) >= 0.0;
    (is_left(a, b) && is_left(b, c) && is_left(c, a)).then_some((s, point))
}
