use rayon::prelude::*;
use robust::{Coord3D, orient3d};
use sdf_core::nalgebra::Vector3;

use crate::TriangleMesh;
use crate::tree::Tree;

/// How many pairs of triangles pass through each other. Exact predicates decide; triangles that share an edge, or lie in
/// one plane, are not counted.
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
    let shared = a.0.iter().filter(|point| b.0.contains(point)).count();
    shared < 2 && (an_edge_crosses(a, b) || an_edge_crosses(b, a))
}

/// An edge of `a` that has no corner in common with `b` passes through it.
fn an_edge_crosses(a: Corners, b: Corners) -> bool {
    (0..3).any(|corner| {
        let next = (corner + 1) % 3;
        let touches = b.0.contains(&a.0[corner]) || b.0.contains(&a.0[next]);
        !touches && crosses([a.1[corner], a.1[next]], b.1)
    })
}

fn crosses([from, to]: [Vector3<f64>; 2], [a, b, c]: [Vector3<f64>; 3]) -> bool {
    let side = |a: Vector3<f64>, b: Vector3<f64>, c: Vector3<f64>, d: Vector3<f64>| {
        let [a, b, c, d] = [a, b, c, d].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
        orient3d(a, b, c, d)
    };
    let (from_side, to_side) = (side(a, b, c, from), side(a, b, c, to));
    if from_side * to_side >= 0.0 && !(from_side < 0.0 && to_side > 0.0) && !(from_side > 0.0 && to_side < 0.0) {
        return false;
    }
    let around = [side(from, to, a, b), side(from, to, b, c), side(from, to, c, a)];
    around.iter().all(|side| *side >= 0.0) || around.iter().all(|side| *side <= 0.0)
}
