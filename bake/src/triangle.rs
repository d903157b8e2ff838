pub mod approx;
pub mod nearest_x8;

use sdf_core::nalgebra::Vector3;

use crate::rounding::SLIVER_SINE_SQ;

/// The part of a triangle that a point lies on: corner i, the edge from corner i to the next, or the inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TriangleFeature {
    Corner(usize),
    Edge(usize),
    Inside,
}

/// The point of a triangle that is nearest to another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearestOnTriangle {
    pub point: Vector3<f64>,
    pub distance_sq: f64,
    pub feature: TriangleFeature,
}

/// So thin that its normal means nothing.
#[inline(always)]
pub(crate) fn is_sliver([a, b, c]: [Vector3<f64>; 3]) -> bool {
    let (ab, ac) = (b - a, c - a);
    ab.cross(&ac).norm_squared() <= SLIVER_SINE_SQ * ab.norm_squared() * ac.norm_squared()
}

/// Half the cross product of two edges: normal to the triangle, as long as its area.
pub(crate) fn area_vector([a, b, c]: [Vector3<f64>; 3]) -> Vector3<f64> {
    (b - a).cross(&(c - a)) * 0.5
}

/// The Voronoi regions of the triangle's features (Ericson 2004, "Real-Time Collision Detection", §5.1.5).
#[inline(always)]
pub(crate) fn nearest_on_triangle(point: Vector3<f64>, corners: [Vector3<f64>; 3]) -> NearestOnTriangle {
    let [a, b, c] = corners;
    let (ab, ac) = (b - a, c - a);
    if is_sliver(corners) {
        return nearest_on_edges(point, corners);
    }
    let at = |nearest: Vector3<f64>, feature| NearestOnTriangle {
        point: nearest,
        distance_sq: (point - nearest).norm_squared(),
        feature,
    };
    let from_a = point - a;
    let (d1, d2) = (ab.dot(&from_a), ac.dot(&from_a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return at(a, TriangleFeature::Corner(0));
    }
    let from_b = point - b;
    let (d3, d4) = (ab.dot(&from_b), ac.dot(&from_b));
    if d3 >= 0.0 && d4 <= d3 {
        return at(b, TriangleFeature::Corner(1));
    }
    let opposite_c = d1 * d4 - d3 * d2;
    if opposite_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return at(a + ab * (d1 / (d1 - d3)), TriangleFeature::Edge(0));
    }
    let from_c = point - c;
    let (d5, d6) = (ab.dot(&from_c), ac.dot(&from_c));
    if d6 >= 0.0 && d5 <= d6 {
        return at(c, TriangleFeature::Corner(2));
    }
    let opposite_b = d5 * d2 - d1 * d6;
    if opposite_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return at(a + ac * (d2 / (d2 - d6)), TriangleFeature::Edge(2));
    }
    let opposite_a = d3 * d6 - d5 * d4;
    let (from_b_on, to_c_on) = (d4 - d3, d5 - d6);
    if opposite_a <= 0.0 && from_b_on >= 0.0 && to_c_on >= 0.0 {
        return at(b + (c - b) * (from_b_on / (from_b_on + to_c_on)), TriangleFeature::Edge(1));
    }
    // The way to the plane, and not to a point composed of weights, keeps its digits near the surface.
    let normal = ab.cross(&ac);
    let way = normal * (normal.dot(&from_a) / normal.norm_squared());
    NearestOnTriangle { point: point - way, distance_sq: way.norm_squared(), feature: TriangleFeature::Inside }
}

fn nearest_on_edges(point: Vector3<f64>, corners: [Vector3<f64>; 3]) -> NearestOnTriangle {
    let on_edge = |edge: usize| {
        let next = (edge + 1) % 3;
        let (from, along) = (corners[edge], corners[next] - corners[edge]);
        let length_sq = along.norm_squared();
        let share = if length_sq > 0.0 { (point - from).dot(&along) / length_sq } else { 0.0 };
        let (nearest, feature) = match share {
            _ if share <= 0.0 => (from, TriangleFeature::Corner(edge)),
            _ if share >= 1.0 => (corners[next], TriangleFeature::Corner(next)),
            _ => (from + along * share, TriangleFeature::Edge(edge)),
        };
        NearestOnTriangle { point: nearest, distance_sq: (point - nearest).norm_squared(), feature }
    };
    let nearer = |a: NearestOnTriangle, b: NearestOnTriangle| if b.distance_sq < a.distance_sq { b } else { a };
    nearer(nearer(on_edge(0), on_edge(1)), on_edge(2))
}
