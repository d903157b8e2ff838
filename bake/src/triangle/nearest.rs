//! Nearest point of a triangle, by the Voronoi regions of its corners, edges and inside (Ericson 2005, "Real-Time
//! Collision Detection", §5.1.5).
//!
//! Let d₁ = ab·ap, d₂ = ac·ap be the projections of a point's offset from a; d₃, d₄ from b; d₅, d₆ from c. Then
//!
//! | region | condition | nearest point |
//! |---|---|---|
//! | a | d₁ ≤ 0, d₂ ≤ 0 | a |
//! | b | d₃ ≥ 0, d₄ ≤ d₃ | b |
//! | ab | d₁d₄ − d₃d₂ ≤ 0, d₁ ≥ 0, d₃ ≤ 0 | a + ab d₁ / (d₁ − d₃) |
//! | c | d₆ ≥ 0, d₅ ≤ d₆ | c |
//! | ac | d₅d₂ − d₁d₆ ≤ 0, d₂ ≥ 0, d₆ ≤ 0 | a + ac d₂ / (d₂ − d₆) |
//! | bc | d₃d₆ − d₅d₄ ≤ 0, d₄ ≥ d₃, d₅ ≥ d₆ | b + bc (d₄ − d₃) / (d₄ − d₃ + d₅ − d₆) |
//! | inside | else | p − n (n·ap) / n·n, with n = ab × ac |
//!
//! The first that holds is taken. An edge is also skipped where its divisor is zero: its length is below the rounding
//! of the point's offset then, and the next region that holds has a point as near. One kernel computes all of them and selects.
//! A loop over points so runs in SIMD lanes, with the same bits as one point at a time.

use sdf_core::nalgebra::Vector3;

use crate::simd::{Lanes, VectorX8, cross, dot, lane_of, sub};
use crate::triangle::{TriangleFeature, is_sliver};

/// The point of a triangle that is nearest to another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearestOnTriangle {
    pub point: Vector3<f64>,
    pub distance_sq: f64,
    pub feature: TriangleFeature,
}

#[inline(always)]
pub(crate) fn nearest_on_triangle(point: Vector3<f64>, corners: [Vector3<f64>; 3]) -> NearestOnTriangle {
    if is_sliver(corners) {
        return nearest_on_edges(point, corners);
    }
    let nearest = NearestKernel::new(&corners).nearest(point.into());
    NearestOnTriangle {
        point: nearest.point.into(),
        distance_sq: nearest.distance_sq,
        feature: nearest.region.feature(),
    }
}

/// Squared distances of eight points, with the bits of [`nearest_on_triangle`]. `is_sliver` is [`is_sliver`] of the
/// corners.
#[inline(always)]
pub(crate) fn distances_sq(points: &VectorX8<f64>, corners: &[Vector3<f64>; 3], is_sliver: bool) -> Lanes<f64> {
    let mut distances_sq = Lanes::default();
    for_each_point(points, corners, is_sliver, |lane, _, distance_sq| distances_sq[lane] = distance_sq);
    distances_sq
}

/// Calls `visit(lane, nearest point, squared distance)` for each of some points.
#[inline(always)]
pub(crate) fn for_each_point<const L: usize>(
    points: &[[f64; L]; 3],
    corners: &[Vector3<f64>; 3],
    is_sliver: bool,
    mut visit: impl FnMut(usize, [f64; 3], f64),
) {
    if is_sliver {
        for (lane, nearest) in nearest_on_edges_of_all(points, *corners).into_iter().enumerate() {
            visit(lane, nearest.point.into(), nearest.distance_sq);
        }
        return;
    }
    let kernel = NearestKernel::new(corners);
    for lane in 0..L {
        let nearest = kernel.nearest(lane_of(points, lane));
        visit(lane, nearest.point, nearest.distance_sq);
    }
}

/// A triangle that is not a sliver, and what does not depend on the point.
struct NearestKernel {
    a: [f64; 3],
    b: [f64; 3],
    c: [f64; 3],
    ab: [f64; 3],
    ac: [f64; 3],
    bc: [f64; 3],
    normal: [f64; 3],
    normal_sq: f64,
}

struct Nearest {
    point: [f64; 3],
    distance_sq: f64,
    region: Region,
}

/// Which conditions of the module's table hold. The first counts.
struct Region {
    a: bool,
    b: bool,
    ab: bool,
    c: bool,
    ac: bool,
    bc: bool,
}

impl NearestKernel {
    #[inline(always)]
    fn new(corners: &[Vector3<f64>; 3]) -> Self {
        let [a, b, c] = [0, 1, 2].map(|corner: usize| [corners[corner].x, corners[corner].y, corners[corner].z]);
        let [ab, ac, bc] = [sub(b, a), sub(c, a), sub(c, b)];
        let normal = cross(ab, ac);
        Self { a, b, c, ab, ac, bc, normal, normal_sq: dot(normal, normal) }
    }

    #[inline(always)]
    fn nearest(&self, point: [f64; 3]) -> Nearest {
        let [from_a, from_b, from_c] = [sub(point, self.a), sub(point, self.b), sub(point, self.c)];
        let (d1, d2) = (dot(self.ab, from_a), dot(self.ac, from_a));
        let (d3, d4) = (dot(self.ab, from_b), dot(self.ac, from_b));
        let (d5, d6) = (dot(self.ab, from_c), dot(self.ac, from_c));
        let (along_bc, along_cb) = (d4 - d3, d5 - d6);
        let region = Region {
            a: (d1 <= 0.0) & (d2 <= 0.0),
            b: (d3 >= 0.0) & (d4 <= d3),
            ab: (d1 * d4 - d3 * d2 <= 0.0) & (d1 >= 0.0) & (d3 <= 0.0) & (d1 > d3),
            c: (d6 >= 0.0) & (d5 <= d6),
            ac: (d5 * d2 - d1 * d6 <= 0.0) & (d2 >= 0.0) & (d6 <= 0.0) & (d2 > d6),
            bc: (d3 * d6 - d5 * d4 <= 0.0) & (along_bc >= 0.0) & (along_cb >= 0.0) & (along_bc + along_cb > 0.0),
        };
        let select = |ab: f64, ac: f64, bc: f64, inside: f64| {
            let chosen = if region.bc { bc } else { inside };
            let chosen = if region.ac { ac } else { chosen };
            if region.ab { ab } else { chosen }
        };
        let t = select(d1, d2, along_bc, dot(self.normal, from_a))
            / select(d1 - d3, d2 - d6, along_bc + along_cb, self.normal_sq);
        let is_inside = region.is_inside();
        let (mut nearest, mut offset) = ([0.0; 3], [0.0; 3]);
        for axis in 0..3 {
            let start = select(self.a[axis], self.a[axis], self.b[axis], 0.0);
            let along = select(self.ab[axis], self.ac[axis], self.bc[axis], self.normal[axis]) * t;
            let on_feature = start + along;
            let on_feature = if region.c & !region.ab { self.c[axis] } else { on_feature };
            let on_feature = if region.b { self.b[axis] } else { on_feature };
            let on_feature = if region.a { self.a[axis] } else { on_feature };
            // Inside, the offset along the normal keeps its digits near the surface; a point made of weights would not.
            offset[axis] = if is_inside { along } else { point[axis] - on_feature };
            nearest[axis] = if is_inside { point[axis] - along } else { on_feature };
        }
        Nearest { point: nearest, distance_sq: dot(offset, offset), region }
    }
}

impl Region {
    #[inline(always)]
    fn is_inside(&self) -> bool {
        !(self.a | self.b | self.ab | self.c | self.ac | self.bc)
    }

    #[inline(always)]
    fn feature(&self) -> TriangleFeature {
        match self {
            Self { a: true, .. } => TriangleFeature::Corner(0),
            Self { b: true, .. } => TriangleFeature::Corner(1),
            Self { ab: true, .. } => TriangleFeature::Edge(0),
            Self { c: true, .. } => TriangleFeature::Corner(2),
            Self { ac: true, .. } => TriangleFeature::Edge(2),
            Self { bc: true, .. } => TriangleFeature::Edge(1),
            _ => TriangleFeature::Inside,
        }
    }
}

/// For slivers: the nearest point of the three edges.
fn nearest_on_edges(point: Vector3<f64>, corners: [Vector3<f64>; 3]) -> NearestOnTriangle {
    let on_edge = |edge: usize| {
        let next = (edge + 1) % 3;
        let (start, along) = (corners[edge], corners[next] - corners[edge]);
        let length_sq = along.norm_squared();
        let t = if length_sq > 0.0 { (point - start).dot(&along) / length_sq } else { 0.0 };
        let (nearest, feature) = match t {
            _ if t <= 0.0 => (start, TriangleFeature::Corner(edge)),
            _ if t >= 1.0 => (corners[next], TriangleFeature::Corner(next)),
            _ => (start + along * t, TriangleFeature::Edge(edge)),
        };
        NearestOnTriangle { point: nearest, distance_sq: (point - nearest).norm_squared(), feature }
    };
    let nearer = |a: NearestOnTriangle, b: NearestOnTriangle| if b.distance_sq < a.distance_sq { b } else { a };
    nearer(nearer(on_edge(0), on_edge(1)), on_edge(2))
}

#[inline(never)]
fn nearest_on_edges_of_all<const L: usize>(
    points: &[[f64; L]; 3],
    corners: [Vector3<f64>; 3],
) -> [NearestOnTriangle; L] {
    std::array::from_fn(|lane| nearest_on_edges(lane_of(points, lane).into(), corners))
}

#[cfg(test)]
mod tests;
