//! Generalized winding number of a triangle soup.
//!
//! w(x) = (1/4π) Σ_t Ω_t(x), Ω_t the signed solid angle of triangle t seen from x (Jacobson, Kavan and Sorkine-Hornung
//! 2013, "Robust inside-outside segmentation using generalized winding numbers"). A far group of triangles counts by
//! its moments (Barill et al. 2018, "Fast winding numbers for soups and clouds", §4, orders 1 and 2).
//!
//! | step | question | file |
//! |---|---|---|
//! | 1 | What are the moments of a node of the tree? | `moments` |
//! | 2 | w(x) and a bound of its error, for one accuracy β | `sum` |
//! | 3 | w(x) modulo 1, from the boundary edges alone | `boundary_cone` |
//! | 4 | How fast does w change in a ball without triangles? | `boundary` |
//!
//! [`WindingNumbers::evaluate`] repeats step 2 with larger β until the error decides |w| ≥ 1/2. Step 3 makes the value
//! exact but for rounding: for closed meshes always, for open ones where the boundary has few edges. The sign of a point of a
//! closed mesh needs no sum: it is counted along a ray. Steps 1 to 3 serve only where each of twelve rays touches an edge
//! ([`whole_winding_number`](crate::mesh::intersections::whole_winding_number)).

mod boundary;
mod boundary_cone;
mod moments;
mod sum;

use std::sync::OnceLock;

use sdf_core::nalgebra::Vector3;

use crate::TriangleMesh;
use crate::bvh::{ARITY, Bvh};
use crate::mesh::topology::OrientedMesh;
pub(crate) use boundary::MeshBoundary;
use moments::{Moments, MomentsX8, WeightedTriangle};

/// Accuracies β of Barill et al.: a node counts by its moments if it is farther than β of its radii.
///
/// The paper's own choice comes first and costs least. At infinity every triangle is summed.
const BETAS: [f64; 5] = [2.0, 3.0, 5.0, 12.0, f64::INFINITY];

/// Largest error with which [`nearest_congruent`] can choose a whole number.
pub(crate) const MAX_CONGRUENT_ERROR: f64 = 0.49;

/// An approximate winding number: |exact − value| ≤ error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimate {
    pub value: f64,
    pub error: f64,
}

/// Number nearest to an estimate that is congruent to `fraction` modulo 1. `None` if the error admits several.
pub(crate) fn nearest_congruent(estimate: Estimate, fraction: f64) -> Option<f64> {
    (estimate.error <= MAX_CONGRUENT_ERROR).then(|| fraction + (estimate.value - fraction).round())
}

/// Winding numbers of the triangles of a tree.
pub(crate) struct WindingNumbers {
    /// Computed when first asked for: of a closed mesh seldom.
    moments: OnceLock<MomentTree>,
    /// Orientation of each triangle, in the tree's order.
    orientations: Vec<f64>,
    boundary: MeshBoundary,
}

/// Hierarchy of moments.
struct MomentTree {
    /// Bottom up: `levels[0]` holds the groups of [`ARITY`] triangles, the last level the root alone. Nodes with one
    /// parent stand together.
    levels: Vec<Vec<MomentsX8>>,
    /// Number of nodes of each level.
    node_counts: Vec<usize>,
}

impl MomentTree {
    fn new(tree: &Bvh, orientations: &[f64]) -> Self {
        let weighted = |slot: usize| WeightedTriangle::new(&tree.corners[slot], orientations[slot]);
        let triangles: Vec<WeightedTriangle> = sdf_parallel::map(tree.corners.len(), weighted);
        let (mut levels, mut node_counts) = (vec![], vec![]);
        let mut triangles_below = ARITY;
        loop {
            let node_moments = |node: usize| {
                let first = node * triangles_below;
                let end = triangles.len().min(first + triangles_below);
                Moments::new(&tree.corners[first..end], &triangles[first..end])
            };
            let moments = sdf_parallel::map(triangles.len().div_ceil(triangles_below), node_moments);
            levels.push(moments.chunks(ARITY).map(MomentsX8::new).collect());
            node_counts.push(moments.len());
            if moments.len() == 1 {
                return Self { levels, node_counts };
            }
            triangles_below *= ARITY;
        }
    }
}

impl WindingNumbers {
    /// Winding numbers of a mesh, by the orientations of its triangles in the tree's order.
    pub fn of_mesh(mesh: &TriangleMesh, oriented: &OrientedMesh, orientations: Vec<f64>) -> Self {
        Self::new(orientations, MeshBoundary::new(&mesh.points, oriented.boundary()))
    }

    /// Orientations, in the tree's order: 1 for a triangle wound outward, −1 for inward, 0 for one that does not count.
    /// `boundary` is that of the triangles so oriented.
    pub fn new(orientations: Vec<f64>, boundary: MeshBoundary) -> Self {
        Self { moments: OnceLock::new(), orientations, boundary }
    }

    /// Computes all moments, where many points will be asked for.
    pub fn prepare(&self, tree: &Bvh) {
        self.moments(tree);
    }

    /// The moments. They are computed outside of the lock: a thread that waits for others within it could come back to it.
    fn moments(&self, tree: &Bvh) -> &MomentTree {
        self.moments.get().unwrap_or_else(|| {
            let moments = MomentTree::new(tree, &self.orientations);
            self.moments.get_or_init(|| moments)
        })
    }

    /// Winding number with an error below `max_error`, and on the exact side of 1/2 but for rounding.
    ///
    /// Exact but for rounding if the boundary gives the fraction, as it does for every closed mesh.
    pub fn evaluate(&self, tree: &Bvh, point: Vector3<f64>, max_error: f64) -> Estimate {
        let mut estimate = Estimate { value: 0.0, error: f64::INFINITY };
        for beta in BETAS {
            let sum = self.sum(tree, point, beta);
            estimate = self.boundary.refine(sum, point).filter(|refined| refined.error <= sum.error).unwrap_or(sum);
            if estimate.error < max_error && (estimate.value.abs() - 0.5).abs() > estimate.error {
                break;
            }
        }
        estimate
    }

    pub fn boundary(&self) -> &MeshBoundary {
        &self.boundary
    }

    /// Orientation of each triangle, in the tree's order.
    pub fn orientations(&self) -> &[f64] {
        &self.orientations
    }
}

/// Signed solid angle of a triangle seen from the origin, positive from its back side.
///
/// tan(Ω/2) = a·(b × c) / (|a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|)
/// (Van Oosterom and Strackee 1983, "The solid angle of a plane triangle", eq. 8).
#[cfg(test)]
pub(crate) fn solid_angle([a, b, c]: [Vector3<f64>; 3]) -> f64 {
    let lengths = [a.norm(), b.norm(), c.norm()];
    let triple = a.dot(&b.cross(&c));
    let denominator =
        lengths[0] * lengths[1] * lengths[2] + a.dot(&b) * lengths[2] + b.dot(&c) * lengths[0] + c.dot(&a) * lengths[1];
    2.0 * triple.atan2(denominator)
}
