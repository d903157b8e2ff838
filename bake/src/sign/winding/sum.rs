//! The sum with a node's children, or a leaf's triangles, side by side in the lanes of registers.
//!
//! Seen from x, at a distance d of a node's center c, a point y of the node with a normal n adds n · ∇ of 1/|y − x| to 4π times the
//! winding number: of Σ |y − c|ˡ/dˡ⁺¹ Pₗ(cos γ), with γ the angle between y − c and x − c. The first two terms of that gradient
//! sum up to the dipole and its correction. The gradient of the term l is no longer than l |y − c|ˡ⁻¹/dˡ⁺¹, for the trigonometric
//! polynomial T(γ) = Pₗ(cos γ) of degree l is at most 1, and so T′² + l² T² ≤ l² (the inequality of Bernstein and Szegő). With
//! t = |y − c|/d all terms after the second are Σ l tˡ⁻¹/d² = t² (3 − 2t)/(1 − t)²/d² at most. That over t² grows with t, and
//! t is at most the radius over d: integrated over the node, |y − c|² gives its inertia.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use sdf_core::nalgebra::Vector3;

use super::moments::MomentsX8;
use super::{Estimate, WindingNumbers};
use crate::bvh::{ARITY, Bvh, STACK};
use crate::rounding::SUM_SLACK;
use crate::simd::{Lanes, cross, dot, lane_of};

struct FastSum<'a> {
    windings: &'a WindingNumbers,
    tree: &'a Bvh,
    point: Vector3<f64>,
    far_radii: f64,
}

/// Times 4π.
struct Sums {
    values: Lanes<f64>,
    errors: Lanes<f64>,
}

impl pulp::WithSimd for FastSum<'_> {
    type Output = Estimate;
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Estimate {
        self.windings.sum_here(self.tree, self.point, self.far_radii)
    }
}

impl WindingNumbers {
    /// Of nodes farther than so many of their radii by their moments, of others by their triangles.
    pub(super) fn sum(&self, tree: &Bvh, point: Vector3<f64>, far_radii: f64) -> Estimate {
        pulp::Arch::new().dispatch(FastSum { windings: self, tree, point, far_radii })
    }

    #[inline(always)]
    fn sum_here(&self, tree: &Bvh, point: Vector3<f64>, far_radii: f64) -> Estimate {
        let mut sums = Sums { values: [0.0; ARITY], errors: [0.0; ARITY] };
        let mut stack = [(0, 0); STACK];
        let mut waiting = 1;
        stack[0] = (self.levels.len() - 1, 0);
        while waiting > 0 {
            waiting -= 1;
            let (level, parent) = stack[waiting];
            let is_far = add_far(&self.levels[level][parent], point, far_radii, &mut sums);
            for node in parent * ARITY..self.sizes[level].min((parent + 1) * ARITY) {
                if is_far[node % ARITY] {
                    continue;
                }
                if level > 0 {
                    stack[waiting] = (level - 1, node);
                    waiting += 1;
                } else {
                    let end = tree.corners.len().min((node + 1) * ARITY);
                    let of_node = node * ARITY..end;
                    add_triangles(&tree.corners[of_node.clone()], &self.orientations[of_node], point, &mut sums.values);
                }
            }
        }
        let [value, error] = [sums.values, sums.errors].map(|sums| sums.iter().sum::<f64>() / (4.0 * PI));
        Estimate { value, error: error + SUM_SLACK }
    }
}

/// Adds what nodes far away are seen as. Which of them are far.
#[inline(always)]
fn add_far(fan: &MomentsX8, point: Vector3<f64>, far_radii: f64, sums: &mut Sums) -> [bool; ARITY] {
    let mut is_far = [false; ARITY];
    for lane in 0..ARITY {
        let [x, y, z] = [0, 1, 2].map(|axis| fan.center[axis][lane] - point[axis]);
        let q = |row: usize, column: usize| fan.quadrupole[3 * column + row][lane];
        let distance_sq = x * x + y * y + z * z;
        let inv_distance_sq = 1.0 / distance_sq;
        let first = fan.dipole[0][lane] * x + fan.dipole[1][lane] * y + fan.dipole[2][lane] * z;
        let stretched = x * (q(0, 0) * x + (q(0, 1) + q(1, 0)) * y + (q(0, 2) + q(2, 0)) * z)
            + y * (q(1, 1) * y + (q(1, 2) + q(2, 1)) * z)
            + z * (q(2, 2) * z);
        let second = q(0, 0) + q(1, 1) + q(2, 2) - 3.0 * stretched * inv_distance_sq;
        let inv_distance = inv_distance_sq.sqrt();
        let seen = (first + second) * inv_distance_sq * inv_distance;
        let t = fan.radius[lane] * inv_distance;
        let unseen = fan.inertia[lane] * inv_distance_sq * inv_distance_sq * (3.0 - 2.0 * t) / ((1.0 - t) * (1.0 - t));
        is_far[lane] = t * far_radii < 1.0;
        sums.values[lane] += if is_far[lane] { seen } else { 0.0 };
        sums.errors[lane] += if is_far[lane] { unseen } else { 0.0 };
    }
    is_far
}

/// Adds the angles that at most [`ARITY`] triangles fill.
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
        let across = cross(b, c);
        let lengths = [a, b, c].map(|corner| dot(corner, corner).sqrt());
        let product = lengths[0] * lengths[1] * lengths[2];
        let denominator = product + dot(a, b) * lengths[2] + dot(b, c) * lengths[0] + dot(c, a) * lengths[1];
        let triple = dot(a, across);
        sums[lane] += twice[lane] * angle(triple, denominator);
    }
}

/// `y.atan2(x)` but for the last digits, and at the origin 0. (Cephes 2.8, `atan.c`: the arc tangent up to 0.66 as a
/// quotient of polynomials.)
#[inline(always)]
pub(super) fn angle(y: f64, x: f64) -> f64 {
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
    const LARGEST: f64 = 0.66;
    let (wide, high) = (x.abs(), y.abs());
    let (least, most) = if wide < high { (wide, high) } else { (high, wide) };
    let is_steep = least > LARGEST * most;
    let (dividend, divisor) = if is_steep { (least - most, least + most) } else { (least, most) };
    let t = dividend / if divisor > 0.0 { divisor } else { 1.0 };
    let of = |coefficients: &[f64]| coefficients.iter().fold(0.0, |sum, coefficient| sum * (t * t) + coefficient);
    let small = t + t * (t * t) * of(&NUMERATOR) / of(&DENOMINATOR);
    let acute = if is_steep { FRAC_PI_4 + small } else { small };
    let right = if wide < high { FRAC_PI_2 - acute } else { acute };
    let obtuse = if x < 0.0 { PI - right } else { right };
    obtuse.copysign(y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TriangleMesh;
    use crate::sign::winding::{FAR_RADII, MeshBoundary, solid_angle};
    use crate::testing::{random, random_vector};
    use crate::triangle::area_vector;

    #[test]
    fn the_angle_is_that_of_the_library() {
        let mut state = 31;
        for _ in 0..100_000 {
            let [x, y] = [0, 1].map(|_| random(&mut state) * 10.0_f64.powf(3.0 * random(&mut state)));
            assert!((angle(y, x) - y.atan2(x)).abs() < 1e-14, "{y} {x}");
        }
        for [y, x] in [[0.0, 1.0], [0.0, -1.0], [1.0, 0.0], [-1.0, 0.0], [1.0, 1.0], [-1.0, -1.0]] {
            assert!((angle(y, x) - y.atan2(x)).abs() < 1e-14, "{y} {x}");
        }
        assert_eq!(angle(0.0, 0.0), 0.0);
    }

    /// Also where many layers lie one over the other, all seen from one side, so that errors add up.
    #[test]
    fn no_sum_is_off_by_more_than_its_error() {
        let mut state = 37;
        println!("seed {state}");
        let mut tightest = 0.0_f64;
        for (triangles, flood) in [(1, 1.0), (7, 1.0), (9, 1.0), (64, 1.0), (65, 0.1), (700, 1.0), (700, 1e-3)] {
            let points: Vec<[f64; 3]> = (0..triangles)
                .flat_map(|_| {
                    let first = random_vector(&mut state).component_mul(&Vector3::new(1.0, 1.0, flood));
                    [0.0, 0.2, 0.2].map(|size| {
                        (first + random_vector(&mut state).component_mul(&Vector3::new(1.0, 1.0, flood)) * size).into()
                    })
                })
                .collect();
            let corners: Vec<[u32; 3]> = (0..triangles).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            let mesh = TriangleMesh::new(&points, &corners).unwrap();
            let tree = Bvh::new(&mesh);
            // Sheets are turned to agree.
            let upward = |t: usize| area_vector(tree.corners[t]).z.signum();
            let orientation = |t: usize| if flood < 1.0 { upward(t) } else { (t % 3) as f64 - 1.0 };
            let orientations: Vec<f64> = (0..triangles as usize).map(orientation).collect();
            let windings = WindingNumbers::new(&tree, orientations.clone(), MeshBoundary::new(std::iter::empty()));
            for _ in 0..300 {
                let point = random_vector(&mut state) * 2.0;
                let angles = tree.corners.iter().map(|corners| solid_angle(corners.map(|corner| corner - point)));
                let exact =
                    angles.zip(&orientations).map(|(angle, orientation)| angle * orientation).sum::<f64>() / (4.0 * PI);
                for far_radii in FAR_RADII.into_iter().chain([1.1]) {
                    let Estimate { value, error } = windings.sum(&tree, point, far_radii);
                    assert!((value - exact).abs() <= error, "{value} for {exact}, {error} at {point}");
                    tightest = tightest.max((value - exact).abs() / error);
                }
            }
        }
        assert!(tightest > 0.1, "{tightest}: the error is wider than it need be");
    }
}
