use rayon::prelude::*;
use robust::{Coord, Coord3D, orient2d, orient3d};
use sdf_core::nalgebra::Vector3;

use crate::TriangleMesh;
use crate::tree::Tree;
use crate::winding::area_vector;

/// How many pairs of triangles pass through each other, or lie on each other in one plane. Exact predicates decide;
/// triangles that only touch, with a corner or along an edge, are not counted.
pub(crate) fn intersecting_pairs(mesh: &TriangleMesh, tree: &Tree, senses: &[f64]) -> usize {
    let counts = |slot: usize| senses[slot] != 0.0;
    let pairs_of = |slot: usize| {
        let corners = tree.corners[slot];
        let [a, b, c] = corners;
        let points = mesh.triangles[tree.triangles[slot] as usize];
        let mut pairs = 0;
        tree.overlapping(a.inf(&b).inf(&c), a.sup(&b).sup(&c), |other| {
            if other > slot && counts(other) {
                let other_points = mesh.triangles[tree.triangles[other] as usize];
                pairs += usize::from(intersect((points, corners), (other_points, tree.corners[other])));
            }
        });
        pairs
    };
    (0..tree.corners.len()).into_par_iter().filter(|slot| counts(*slot)).map(pairs_of).sum()
}

type Corners = ([u32; 3], [Vector3<f64>; 3]);

fn intersect(a: Corners, b: Corners) -> bool {
    if b.1.iter().all(|corner| side_of_plane(a.1, *corner) == 0.0) {
        return overlap_in_plane(a.1, b.1);
    }
    let shared = a.0.iter().filter(|point| b.0.contains(point)).count();
    shared < 2 && (an_edge_crosses(a, b) || an_edge_crosses(b, a))
}

/// Two triangles in one plane have some area in common: no side of either parts them.
fn overlap_in_plane(a: [Vector3<f64>; 3], b: [Vector3<f64>; 3]) -> bool {
    let upright = area_vector(a).iamax();
    let flat = |corners: [Vector3<f64>; 3]| {
        let [a, b, c] = corners.map(|p| Coord { x: p[(upright + 1) % 3], y: p[(upright + 2) % 3] });
        if orient2d(a, b, c) < 0.0 { [a, c, b] } else { [a, b, c] }
    };
    let (a, b) = (flat(a), flat(b));
    let a_side_parts = |a: [Coord<f64>; 3], b: [Coord<f64>; 3]| {
        (0..3).any(|corner| b.iter().all(|point| orient2d(a[corner], a[(corner + 1) % 3], *point) <= 0.0))
    };
    !a_side_parts(a, b) && !a_side_parts(b, a)
}

/// An edge of `a` that has no corner in common with `b` passes through it.
fn an_edge_crosses(a: Corners, b: Corners) -> bool {
    (0..3).any(|corner| {
        let next = (corner + 1) % 3;
        let touches = b.0.contains(&a.0[corner]) || b.0.contains(&a.0[next]);
        !touches && crosses([a.1[corner], a.1[next]], b.1)
    })
}

fn crosses([from, to]: [Vector3<f64>; 2], triangle: [Vector3<f64>; 3]) -> bool {
    let (from_side, to_side) = (side_of_plane(triangle, from), side_of_plane(triangle, to));
    let are_parted = (from_side < 0.0 && to_side > 0.0) || (from_side > 0.0 && to_side < 0.0);
    if !are_parted {
        return false;
    }
    let [a, b, c] = triangle;
    let around = [[from, to, a], [from, to, b], [from, to, c]];
    let around = [side_of_plane(around[0], b), side_of_plane(around[1], c), side_of_plane(around[2], a)];
    around.iter().all(|side| *side >= 0.0) || around.iter().all(|side| *side <= 0.0)
}

/// Exactly zero for a point in the triangle's plane, else of a sign that tells the side.
fn side_of_plane([a, b, c]: [Vector3<f64>; 3], point: Vector3<f64>) -> f64 {
    let [a, b, c, point] = [a, b, c, point].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    orient3d(a, b, c, point)
}
