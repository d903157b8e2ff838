//! How near do an element (a vertex, an edge or a face of another mesh) and a triangle come?
//!
//! Two convex bodies that do not cross are nearest at a corner of one and a point of the other, or at an edge of both. So the distance is
//! the least over corner and triangle, triangle's corner and element, edge and edge (Ericson 2005, "Real-Time Collision Detection",
//! §5.1.9 and §5.1.10); or zero where an edge of one passes through the other.

use sdf_core::nalgebra::Vector3;

use crate::triangle::{NearestOnTriangle, TriangleFeature, nearest_on_triangle};

/// The nearest points of an element and a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
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
#[inline(always)]
pub(super) fn nearest_pair(element: &[Vector3<f64>], triangle: [Vector3<f64>; 3]) -> Pair {
    let mut best = Pair::NONE;
    for (index, corner) in element.iter().enumerate() {
        best.keep_nearer(*corner, nearest_on_triangle(*corner, triangle).point, || unit(index));
    }
    let can_cross = !is_on_one_side(element, triangle);
    for (from, to) in sides(element.len()) {
        let along = element[to] - element[from];
        for side in 0..3 {
            let (a, b) = (triangle[side], triangle[(side + 1) % 3]);
            let (s, t) = nearest_on_segments(element[from], along, a, b - a);
            best.keep_nearer(element[from] + along * s, a + (b - a) * t, || on_side(from, to, s));
        }
        if can_cross && let Some((s, point)) = crossing(element[from], along, triangle) {
            best.keep_nearer(point, point, || on_side(from, to, s));
        }
    }
    if let &[a, b, c] = element {
        for (index, corner) in triangle.iter().enumerate() {
            let nearest = nearest_on_triangle(*corner, [a, b, c]);
            best.keep_nearer(nearest.point, *corner, || face_weights(&nearest, [a, b, c]));
            let along = triangle[(index + 1) % 3] - corner;
            if can_cross && let Some((_, point)) = crossing(*corner, along, [a, b, c]) {
                best.keep_nearer(point, point, || face_weights(&nearest_on_triangle(point, [a, b, c]), [a, b, c]));
            }
        }
    }
    best
}

/// Are all corners of an element strictly on one side of a triangle's plane?
fn is_on_one_side(element: &[Vector3<f64>], [a, b, c]: [Vector3<f64>; 3]) -> bool {
    let normal = (b - a).cross(&(c - a));
    let offset = |corner: &Vector3<f64>| normal.dot(&(corner - a));
    element.iter().all(|corner| offset(corner) > 0.0) || element.iter().all(|corner| offset(corner) < 0.0)
}

/// Edges of an element as pairs of corners.
fn sides(count: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..count).map(move |from| (from, (from + 1) % count)).take(if count < 3 { count - 1 } else { 3 })
}

fn unit(index: usize) -> [f64; 3] {
    std::array::from_fn(|corner| if corner == index { 1.0 } else { 0.0 })
}

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

/// Parameters of the nearest points of two segments, p + s d and q + t e (Ericson 2005, §5.1.9).
fn nearest_on_segments(p: Vector3<f64>, d: Vector3<f64>, q: Vector3<f64>, e: Vector3<f64>) -> (f64, f64) {
    let r = p - q;
    let (a, b, c, f) = (d.norm_squared(), e.norm_squared(), d.dot(&r), e.dot(&r));
    let ratio = |numerator: f64, denominator: f64| if denominator > 0.0 { numerator / denominator } else { 0.0 };
    let mixed = d.dot(&e);
    let s = ratio(mixed * f - c * b, a * b - mixed * mixed).clamp(0.0, 1.0);
    let t = ratio(mixed * s + f, b);
    if t < 0.0 {
        (ratio(-c, a).clamp(0.0, 1.0), 0.0)
    } else if t > 1.0 {
        (ratio(mixed - c, a).clamp(0.0, 1.0), 1.0)
    } else {
        (s, t)
    }
}

/// Where a segment passes through a triangle, up to rounding: where it decides, the pair of two edges is near zero as well.
fn crossing(from: Vector3<f64>, along: Vector3<f64>, [a, b, c]: [Vector3<f64>; 3]) -> Option<(f64, Vector3<f64>)> {
    let normal = (b - a).cross(&(c - a));
    let (start, end) = (normal.dot(&(from - a)), normal.dot(&(from + along - a)));
    if start * end > 0.0 || start == end {
        return None;
    }
    let s = start / (start - end);
    let point = from + along * s;
    let is_left = |from: Vector3<f64>, to: Vector3<f64>| (to - from).cross(&(point - from)).dot(&normal) >= 0.0;
    (is_left(a, b) && is_left(b, c) && is_left(c, a)).then_some((s, point))
}
