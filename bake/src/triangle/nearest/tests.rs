//! Distances from a triangle: lanes equal scalars, and both equal a search branch by branch, bit for bit.

use super::*;
use crate::testing::{instruction_sets, random, random_vector};

struct Measure(VectorX8<f64>, [Vector3<f64>; 3]);

impl pulp::NullaryFnOnce for Measure {
    type Output = Lanes<f64>;

    #[inline(always)]
    fn call(self) -> Lanes<f64> {
        distances_sq(&self.0, &self.1, is_sliver(self.1))
    }
}

/// A triangle of any thickness and scale, and points anywhere, in its plane, on edges and on corners.
fn triangle_and_points(round: usize, state: &mut u64) -> ([Vector3<f64>; 3], Lanes<Vector3<f64>>) {
    let thickness = [1.0, 1e-3, 1e-6, 1e-9, 0.0][round % 5];
    let scale = [1.0, 1e-30, 1e30][round / 5 % 3];
    let a = random_vector(state);
    let b = a + random_vector(state);
    let c = a + (b - a) * (2.0 * random(state)) + random_vector(state) * thickness;
    let corners = [a, b, c].map(|corner| corner * scale);
    let weights: Lanes<[f64; 2]> = std::array::from_fn(|_| [random(state), random(state)]);
    let off: Lanes<Vector3<f64>> = std::array::from_fn(|lane| random_vector(state) * [1.0, 0.0, 1e-9, 10.0][lane % 4]);
    let point = |lane: usize| {
        let [u, v] = weights[lane].map(|weight| if lane < 2 { weight.round() } else { 2.0 * weight });
        corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v + off[lane] * scale
    };
    (corners, std::array::from_fn(point))
}

#[test]
fn eight_distances_have_the_bits_of_each_by_itself_on_any_instruction_set() {
    let mut state = 17;
    println!("seed {state}");
    for round in 0..20_000 {
        let (corners, points) = triangle_and_points(round, &mut state);
        let wanted = points.map(|point| nearest_on_triangle(point, corners).distance_sq.to_bits());
        let points = [0, 1, 2].map(|axis| points.map(|point| point[axis]));
        for arch in instruction_sets() {
            let found = arch.dispatch(Measure(points, corners)).map(f64::to_bits);
            assert_eq!(found, wanted, "{arch:?} {corners:?} {points:?}");
        }
    }
}

/// Ericson's own order, one region after the other, each formula by itself.
fn nearest_by_branches(point: Vector3<f64>, [a, b, c]: [Vector3<f64>; 3]) -> NearestOnTriangle {
    let at = |nearest: Vector3<f64>, feature| NearestOnTriangle {
        point: nearest,
        distance_sq: (point - nearest).norm_squared(),
        feature,
    };
    let (ab, ac) = (b - a, c - a);
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
    if d1 * d4 - d3 * d2 <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3 {
        return at(a + ab * (d1 / (d1 - d3)), TriangleFeature::Edge(0));
    }
    let from_c = point - c;
    let (d5, d6) = (ab.dot(&from_c), ac.dot(&from_c));
    if d6 >= 0.0 && d5 <= d6 {
        return at(c, TriangleFeature::Corner(2));
    }
    if d5 * d2 - d1 * d6 <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 > d6 {
        return at(a + ac * (d2 / (d2 - d6)), TriangleFeature::Edge(2));
    }
    let (along_bc, along_cb) = (d4 - d3, d5 - d6);
    if d3 * d6 - d5 * d4 <= 0.0 && along_bc >= 0.0 && along_cb >= 0.0 && along_bc + along_cb > 0.0 {
        return at(b + (c - b) * (along_bc / (along_bc + along_cb)), TriangleFeature::Edge(1));
    }
    let normal = ab.cross(&ac);
    let offset = normal * (normal.dot(&from_a) / normal.norm_squared());
    NearestOnTriangle { point: point - offset, distance_sq: offset.norm_squared(), feature: TriangleFeature::Inside }
}

#[test]
fn the_region_and_every_bit_are_those_of_one_branch_after_the_other() {
    let mut state = 18;
    println!("seed {state}");
    let mut visits = std::collections::BTreeMap::new();
    for round in 0..20_000 {
        let (corners, points) = triangle_and_points(round, &mut state);
        if is_sliver(corners) {
            continue;
        }
        for point in points {
            let found = nearest_on_triangle(point, corners);
            let wanted = nearest_by_branches(point, corners);
            assert_eq!(found.feature, wanted.feature, "{point:?} {corners:?}");
            assert_eq!(found.distance_sq.to_bits(), wanted.distance_sq.to_bits(), "{point:?} {corners:?}");
            assert_eq!(found.point.map(f64::to_bits), wanted.point.map(f64::to_bits), "{point:?} {corners:?}");
            *visits.entry(format!("{:?}", found.feature)).or_insert(0) += 1;
        }
    }
    assert!(visits.len() == 7 && visits.values().all(|count| *count > 1000), "{visits:?}");
}

#[test]
fn a_needle_is_as_near_as_its_long_edge() {
    let mut state = 19;
    println!("seed {state}");
    // Half of them on small integers, where differences are exact and projections zero.
    let vector = |is_whole: bool, state: &mut u64| {
        let vector = random_vector(state);
        if is_whole { (vector * 3.0).map(f64::round) } else { vector }
    };
    for round in 0..40_000 {
        let is_whole = round % 2 == 0;
        let [start, end, point, across] = std::array::from_fn(|_| vector(is_whole, &mut state));
        let thickness = 10.0_f64.powf(-17.0 + 8.0 * random(&mut state));
        let along = end - start;
        let across = if round % 3 == 0 { across } else { along.cross(&across) } * thickness;
        let mut corners = [start, start + across, end];
        corners.rotate_left(round % 3);
        if round / 3 % 2 == 1 {
            corners.swap(0, 1);
        }
        // On the plane through the middle of the needle, or anywhere.
        let point = if round / 6 % 2 == 0 { start + along * 0.5 + along.cross(&point) } else { point * 2.0 };
        let wanted = nearest_on_edges(point, [start, end, end]).distance_sq.sqrt();
        let found = nearest_on_triangle(point, corners).distance_sq.sqrt();
        // Points of the needle are off its long edge by the short one; coordinates are at most 30.
        let allowed = across.norm() + 256.0 * f64::EPSILON * 30.0;
        assert!((found - wanted).abs() <= allowed, "{found}, not {wanted}: {point:?} {corners:?}");
    }
}
