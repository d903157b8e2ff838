//! Winding number at a point by moments, with a bound of its error.
//!
//! A point y with normal n contributes n·(y − x)/|y − x|³ = −n·∇(1/|y − x|) to 4π w(x), ∇ with respect to y. About a
//! node's center c at distance d = |x − c|, with γ the angle between y − c and x − c,
//!
//! ```text
//! 1/|y − x| = Σ_l |y − c|ˡ/dˡ⁺¹ P_l(cos γ).
//! ```
//!
//! With r = c − x the gradients of the terms l = 1, 2 integrate to dipole·r/d³ + (tr Q − 3 rᵀQr/d²)/d³.
//!
//! T(γ) = P_l(cos γ) is a trigonometric polynomial of degree l with |T| ≤ 1, so T′² + l² T² ≤ l² (Bernstein and Szegő).
//! So the gradient of term l is at most l |y − c|ˡ⁻¹/dˡ⁺¹ long. With t = |y − c|/d, all terms l ≥ 3 are at most
//!
//! ```text
//! Σ_{l≥3} l tˡ⁻¹/d² = t² (3 − 2t)/(1 − t)²/d².
//! ```
//!
//! The factor of t² grows with t, and t ≤ τ = radius/d. Integrated over the node, the error is at most
//! inertia/d⁴ · (3 − 2τ)/(1 − τ)².

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use sdf_core::nalgebra::Vector3;

use super::moments::MomentsX8;
use super::{Estimate, MomentTree, WindingNumbers};
use crate::bvh::{ARITY, Bvh, STACK};
use crate::rounding::SUM_SLACK;
use crate::simd::{Lanes, cross, dot, lane_of};

struct FastSum<'a> {
    moments: &'a MomentTree,
    orientations: &'a [f64],
    tree: &'a Bvh,
    point: Vector3<f64>,
    beta: f64,
}

/// Sums of 4π w and of its error.
struct Sums {
    values: Lanes<f64>,
    errors: Lanes<f64>,
}

impl pulp::WithSimd for FastSum<'_> {
    type Output = Estimate;
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Estimate {
        self.sum()
    }
}

impl WindingNumbers {
    /// Nodes farther than `beta` of their radii count by their moments, others by their triangles.
    pub(super) fn sum(&self, tree: &Bvh, point: Vector3<f64>, beta: f64) -> Estimate {
        let (moments, orientations) = (self.moments(tree), &self.orientations[..]);
        tree.arch.dispatch(FastSum { moments, orientations, tree, point, beta })
    }
}

impl FastSum<'_> {
    #[inline(always)]
    fn sum(&self) -> Estimate {
        let Self { moments: MomentTree { levels, node_counts }, orientations, tree, point, beta } = *self;
        let mut sums = Sums { values: [0.0; ARITY], errors: [0.0; ARITY] };
        let mut stack = [(0, 0); STACK];
        let mut waiting = 1;
        stack[0] = (levels.len() - 1, 0);
        while waiting > 0 {
            waiting -= 1;
            let (level, parent) = stack[waiting];
            let is_far = add_far_nodes(&levels[level][parent], point, beta, &mut sums);
            for node in parent * ARITY..node_counts[level].min((parent + 1) * ARITY) {
                if is_far[node % ARITY] {
                    continue;
                }
                if level > 0 {
                    stack[waiting] = (level - 1, node);
                    waiting += 1;
                } else {
                    let leaf = node * ARITY..tree.corners.len().min((node + 1) * ARITY);
                    add_triangles(&tree.corners[leaf.clone()], &orientations[leaf], point, &mut sums.values);
                }
            }
        }
        let [value, error] = [sums.values, sums.errors].map(|sums| sums.iter().sum::<f64>() / (4.0 * PI));
        Estimate { value, error: error + SUM_SLACK }
    }
}

/// Adds the moments of the far nodes, and returns which nodes are far.
#[inline(always)]
fn add_far_nodes(nodes: &MomentsX8, point: Vector3<f64>, beta: f64, sums: &mut Sums) -> [bool; ARITY] {
    let mut is_far = [false; ARITY];
    for lane in 0..ARITY {
        let [x, y, z] = [0, 1, 2].map(|axis| nodes.center[axis][lane] - point[axis]);
        let q = |row: usize, column: usize| nodes.quadrupole[3 * column + row][lane];
        let distance_sq = x * x + y * y + z * z;
        let inv_distance_sq = 1.0 / distance_sq;
        let first = nodes.dipole[0][lane] * x + nodes.dipole[1][lane] * y + nodes.dipole[2][lane] * z;
        let quadratic_form = x * (q(0, 0) * x + (q(0, 1) + q(1, 0)) * y + (q(0, 2) + q(2, 0)) * z)
            + y * (q(1, 1) * y + (q(1, 2) + q(2, 1)) * z)
            + z * (q(2, 2) * z);
        let second = q(0, 0) + q(1, 1) + q(2, 2) - 3.0 * quadratic_form * inv_distance_sq;
        let inv_distance = inv_distance_sq.sqrt();
        let value = (first + second) * inv_distance_sq * inv_distance;
        let t = nodes.radius[lane] * inv_distance;
        let error = nodes.inertia[lane] * inv_distance_sq * inv_distance_sq * (3.0 - 2.0 * t) / ((1.0 - t) * (1.0 - t));
        is_far[lane] = t * beta < 1.0;
        sums.values[lane] += if is_far[lane] { value } else { 0.0 };
        sums.errors[lane] += if is_far[lane] { error } else { 0.0 };
    }
    is_far
}

/// Adds the solid angles of at most [`ARITY`] triangles ([`super::solid_angle`] in lanes).
#[inline(always)]
fn add_triangles(triangles: &[[Vector3<f64>; 3]], orientations: &[f64], point: Vector3<f64>, sums: &mut Lanes<f64>) {
    let mut corners = [[[0.0; ARITY]; 3]; 3];
    let mut twice = [0.0; ARITY];
    for (lane, (triangle, orientation)) in triangles.iter().zip(orientations).enumerate().take(ARITY) {
        twice[lane] = 2.0 * orientation;
        for corner in 0..3 {
            for axis in 0..3 {
                corners[corner][axis][lane] = triangle[corner][axis] - point[axis];
            }
        }
    }
    let [a, b, c] = corners;
    for lane in 0..ARITY {
        let [a, b, c] = [&a, &b, &c].map(|corner| lane_of(corner, lane));
        let lengths = [a, b, c].map(|corner| dot(corner, corner).sqrt());
        let product = lengths[0] * lengths[1] * lengths[2];
        let denominator = product + dot(a, b) * lengths[2] + dot(b, c) * lengths[0] + dot(c, a) * lengths[1];
        let triple = dot(a, cross(b, c));
        sums[lane] += twice[lane] * atan2(triple, denominator);
    }
}

/// `y.atan2(x)` without branches, to 1e-14; 0 at the origin.
///
/// arctan t = t + t³ N(t²)/D(t²) for t ≤ 0.66 (Cephes 2.8, `atan.c`).
#[inline(always)]
pub(super) fn atan2(y: f64, x: f64) -> f64 {
    const NUMERATOR: [f64; 5] = [
        -8.750_608_600_031_904e-1,
        -1.615_753_718_733_365e1,
        -7.500_855_792_314_705e1,
        -1.228_866_684_490_136_1e2,
        -6.485_021_904_942_025e1,
    ];
    const DENOMINATOR: [f64; 6] = [
        1.0,
        2.485_846_490_142_306_3e1,
        1.650_270_098_316_988_5e2,
        4.328_810_604_912_902_7e2,
        4.853_903_996_359_137e2,
        1.945_506_571_482_614e2,
    ];
    const MAX_T: f64 = 0.66;
    let (x_abs, y_abs) = (x.abs(), y.abs());
    let (small, large) = if x_abs < y_abs { (x_abs, y_abs) } else { (y_abs, x_abs) };
    let is_steep = small > MAX_T * large;
    let (dividend, divisor) = if is_steep { (small - large, small + large) } else { (small, large) };
    let t = dividend / if divisor > 0.0 { divisor } else { 1.0 };
    let polynomial =
        |coefficients: &[f64]| coefficients.iter().fold(0.0, |sum, coefficient| sum * (t * t) + coefficient);
    let arctan = t + t * (t * t) * polynomial(&NUMERATOR) / polynomial(&DENOMINATOR);
    let octant = if is_steep { FRAC_PI_4 + arctan } else { arctan };
    let quadrant = if x_abs < y_abs { FRAC_PI_2 - octant } else { octant };
    let half_plane = if x < 0.0 { PI - quadrant } else { quadrant };
    half_plane.copysign(y)
}

#[cfg(test)]
mod tests;
