//! The generalized winding number of a triangle soup (Jacobson et al. 2013), summed over a tree whose far nodes count
//! as one dipole and its first correction (Barill et al. 2018, "Fast winding numbers for soups and clouds", §4, orders
//! 1 and 2).

mod boundary;
mod boundary_cone;
mod moments;
mod sum;

use rayon::prelude::*;
use sdf_core::nalgebra::Vector3;

use crate::bvh::{ARITY, Bvh};
pub(crate) use boundary::MeshBoundary;
use moments::{Moments, MomentsX8, Weighted};

/// A node is far when it is farther than this many of its radii: the paper's own choice first, which costs the least, and more
/// until the sum's error leaves no doubt. At last every triangle is summed.
const FAR_RADII: [f64; 5] = [2.0, 3.0, 5.0, 12.0, f64::INFINITY];

/// Up to this it is told which whole number to add to what the rim says.
pub(crate) const MAX_DOUBT: f64 = 0.49;

/// A winding number, and by how much it may be off.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimate {
    pub value: f64,
    pub error: f64,
}

/// The number nearest to what is known that has a fraction. `None` where too much doubt is left which one it is.
pub(crate) fn round_to_fraction(about: Estimate, fraction: f64) -> Option<f64> {
    (about.error <= MAX_DOUBT).then(|| fraction + (about.value - fraction).round())
}

/// Sums over the triangles below each node of a tree.
pub(crate) struct WindingNumbers {
    /// From the triangles up: of the groups of [`ARITY`] triangles, of the groups of those, and so on to the root. Each level
    /// holds as many nodes at a time as have one parent.
    levels: Vec<Vec<MomentsX8>>,
    /// How many nodes each level has.
    sizes: Vec<usize>,
    /// Of each triangle, in the order of the tree: its sense, and zero for one that does not count.
    orientations: Vec<f64>,
    boundary: MeshBoundary,
}

impl WindingNumbers {
    /// `orientations`: 1 for each triangle of the tree wound outward, −1 inward, 0 where it is not to count. `boundary`: of those.
    pub fn new(tree: &Bvh, orientations: Vec<f64>, boundary: MeshBoundary) -> Self {
        let triangles: Vec<Weighted> = tree
            .corners
            .par_iter()
            .zip(&orientations)
            .map(|(corners, orientation)| Weighted::new(corners, *orientation))
            .collect();
        let (mut levels, mut sizes) = (vec![], vec![]);
        let mut triangles_below = ARITY;
        loop {
            let of_node = |from: usize| {
                let to = triangles.len().min(from + triangles_below);
                Moments::new(&tree.corners[from..to], &triangles[from..to])
            };
            let moments: Vec<Moments> =
                (0..triangles.len()).into_par_iter().step_by(triangles_below).map(of_node).collect();
            levels.push(moments.chunks(ARITY).map(MomentsX8::new).collect());
            sizes.push(moments.len());
            if moments.len() == 1 {
                return Self { levels, sizes, orientations, boundary };
            }
            triangles_below *= ARITY;
        }
    }

    /// Exact but for rounding where the rim tells the fraction, as it does of a closed mesh. Elsewhere off by less than `most`, and by
    /// so little that the side of one half is that of the exact winding number, but for rounding.
    pub fn at(&self, tree: &Bvh, point: Vector3<f64>, most: f64) -> Estimate {
        let mut found = Estimate { value: 0.0, error: f64::INFINITY };
        for far_radii in FAR_RADII {
            let sum = self.sum(tree, point, far_radii);
            found = self.boundary.sharpen(sum, point).filter(|found| found.error <= sum.error).unwrap_or(sum);
            if found.error < most && (found.value.abs() - 0.5).abs() > found.error {
                break;
            }
        }
        found
    }

    pub fn boundary(&self) -> &MeshBoundary {
        &self.boundary
    }

    /// Of each triangle, in the order of the tree.
    pub fn orientations(&self) -> &[f64] {
        &self.orientations
    }
}

/// The angle that a triangle fills as seen from the origin, positive from its back side. (Van Oosterom and Strackee
/// 1983, "The solid angle of a plane triangle", eq. 8.)
#[cfg(test)]
pub(crate) fn solid_angle([a, b, c]: [Vector3<f64>; 3]) -> f64 {
    let lengths = [a.norm(), b.norm(), c.norm()];
    let triple = a.dot(&b.cross(&c));
    let denominator =
        lengths[0] * lengths[1] * lengths[2] + a.dot(&b) * lengths[2] + b.dot(&c) * lengths[0] + c.dot(&a) * lengths[1];
    2.0 * triple.atan2(denominator)
}
