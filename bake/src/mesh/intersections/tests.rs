//! Early rejections, rounded planes and winding changes, compared with exact predicates.

use super::*;
use crate::testing::{random, random_vector};
use crate::{MeshDistance, SignMethod};

impl Plane {
    /// Do all corners of a triangle except those shared with `other` certainly lie on one side, and is there one?
    fn separates(&self, (points, corners): Corners, other: &[u32; 3]) -> bool {
        let own = || points.iter().zip(corners).filter(|(point, _)| !other.contains(point));
        let sides = || own().map(|(_, corner)| self.certain_side(corner));
        own().next().is_some() && (sides().all(|side| side > 0.0) || sides().all(|side| side < 0.0))
    }
}

/// Triangles with corners on a small integer grid: they often touch, lie in one plane or have no area.
fn coarse_triangles(state: &mut u64) -> [([u32; 3], [Vector3<f64>; 3]); 2] {
    let points: Vec<Vector3<f64>> = (0..6).map(|_| random_vector(state).map(|x| (1.6 * x).round())).collect();
    let first_at = |point: usize| points.iter().position(|other| *other == points[point]).unwrap();
    [[0, 1, 2], [3, 4, 5]].map(|corners| (corners.map(|c| first_at(c) as u32), corners.map(|c| points[c])))
}

/// Wide enough that some pairs are parted by planes, and nearer.
const GAP: f64 = 0.4;

#[test]
fn a_pair_that_is_rejected_early_does_not_intersect() {
    let mut state = 23;
    let (mut intersecting, mut rejected, mut across_edge) = (0, 0, 0);
    let (mut apart, mut off_planes, mut around_corner, mut beyond_gap) = ([0; 2], [0; 2], 0, 0);
    for _ in 0..200_000 {
        let triangles = coarse_triangles(&mut state);
        if triangles.iter().any(|(_, corners)| area_vector(*corners) == Vector3::zeros()) {
            continue;
        }
        let [a, b]: [Corners; 2] = triangles.each_ref().map(|(points, corners)| (points, corners));
        let shared = a.0.iter().filter(|point| b.0.contains(point)).count();
        let is_flat = b.1.iter().all(|corner| side_of_plane(*a.1, *corner) == 0.0);
        let crosses = shared < 2 && (an_edge_crosses(a, b) || an_edge_crosses(b, a));
        let wanted = if is_flat { overlap_in_plane(*a.1, *b.1) } else { crosses };
        intersecting += usize::from(wanted);
        assert_eq!(intersect(a, b), wanted, "{a:?} {b:?}");
        let planes = [a, b].map(|(_, corners)| Plane::new(corners, 0.0));
        let is_rejected = planes[0].separates(b, a.0);
        assert!(!is_rejected || !wanted && !are_in_contact(a, b), "{a:?} {b:?}");
        rejected += usize::from(is_rejected);
        if are_apart_across_centroids(a, b) {
            assert!(!wanted, "{a:?} {b:?}");
            apart[shared] += 1;
        }
        let of_b = CornersX8::new(&[0], |_| b);
        assert_eq!(of_b.apart_by_own_planes(a, 0.0) & 1 != 0, planes[1].separates(a, b.0), "{a:?} {b:?}");
        let by_own_plane = of_b.apart_by_own_planes(a, GAP) & 1 != 0;
        assert_eq!(by_own_plane, Plane::new(b.1, GAP).separates(a, b.0), "{a:?} {b:?}");
        if shared == 0 && (by_own_plane || Plane::new(a.1, GAP).separates(b, a.0)) {
            assert!(nearest_pair(a.1, *b.1).distance_sq > GAP * GAP, "{a:?} {b:?}");
            beyond_gap += 1;
        }
        if of_b.apart_around_corner(a) & 1 != 0 {
            assert!(!wanted && shared == 1, "{a:?} {b:?}");
            around_corner += 1;
        }
        if are_apart_across_edge(a, b) {
            assert!(!wanted && !are_in_contact(a, b), "{a:?} {b:?}");
            across_edge += 1;
        }
        if are_apart_off_planes(planes.each_ref(), a, b) {
            assert!(!are_in_contact(a, b) && (shared > 0 || !have_common_point(a, b)), "{a:?} {b:?}");
            off_planes[shared] += 1;
        }
    }
    let counts =
        apart.iter().chain(&off_planes).chain([&intersecting, &rejected, &across_edge, &around_corner, &beyond_gap]);
    assert!(counts.clone().all(|count| *count > 500), "{:?}", counts.collect::<Vec<_>>());
}

#[test]
fn a_side_that_is_certain_is_that_of_the_exact_predicate() {
    let mut state = 41;
    println!("seed {state}");
    let (mut certain, mut hidden) = (0, 0);
    for round in 0..300_000 {
        let size = [1.0, 1e30, 1e-30, 1e-90][round % 4];
        let far_off = random_vector(&mut state) * [0.0, 0.1, 1e3][round / 4 % 3];
        let triangle = [0, 1, 2].map(|_| (random_vector(&mut state) + far_off) * (1e-4 * size));
        let [a, b, c] = triangle;
        // As near to the plane as coordinates allow.
        let point = a + (b - a) * random(&mut state) + (c - a) * random(&mut state);
        let side = Plane::new(&triangle, 0.0).certain_side(&point);
        let exact = -side_of_plane(triangle, point);
        assert!(side == 0.0 || side * exact > 0.0, "{triangle:?} {point:?} {side:e} {exact:e}");
        (certain, hidden) = (certain + usize::from(side != 0.0), hidden + usize::from(side == 0.0 && exact != 0.0));
    }
    assert!(hidden > 1000, "{certain} {hidden}");
}

#[test]
fn between_two_points_the_winding_number_changes_by_the_triangles_between() {
    let mut state = 29;
    let points: Vec<[f64; 3]> = (0..60).map(|_| random_vector(&mut state).into()).collect();
    let tetrahedra = (0..60).step_by(4).flat_map(|a: u32| {
        [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|corners: [u32; 3]| corners.map(|corner| a + corner))
    });
    let mesh = TriangleMesh::new(&points, &tetrahedra.collect::<Vec<_>>()).unwrap();
    let distance = MeshDistance::new(&mesh, Some(SignMethod::Winding));
    for _ in 0..2000 {
        let from = random_vector(&mut state);
        let to = from + random_vector(&mut state) * random(&mut state).abs();
        let [before, after] = [from, to].map(|point| distance.winding_number(point.into()));
        let change = distance.winding_change([from, to]).unwrap();
        assert!((after - before - change).abs() < 0.2, "{before} to {after}, {change}");
    }
    // Through a corner, and from one.
    let corner = Vector3::from(points[0]);
    assert_eq!(distance.winding_change([corner * 2.0, Vector3::zeros()]).filter(|_| corner * 2.0 != corner), None);
    assert_eq!(distance.winding_change([corner, corner + Vector3::x()]), None);
}
