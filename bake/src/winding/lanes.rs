//! The same sum with a node's children, or a leaf's triangles, side by side in the lanes of registers.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use sdf_core::nalgebra::Vector3;

use super::moments::Fan;
use super::{FAN, STACK, WindingNumbers};
use crate::tree::Tree;

type Lanes = [f64; FAN];

struct FastSum<'a> {
    windings: &'a WindingNumbers,
    tree: &'a Tree,
    point: Vector3<f64>,
    far_radii: f64,
}

impl pulp::WithSimd for FastSum<'_> {
    type Output = f64;
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> f64 {
        self.windings.sum_here(self.tree, self.point, self.far_radii)
    }
}

impl WindingNumbers {
    /// What `sum` gives, but for rounding.
    pub(super) fn sum_in_lanes(&self, tree: &Tree, point: Vector3<f64>, far_radii: f64) -> f64 {
        pulp::Arch::new().dispatch(FastSum { windings: self, tree, point, far_radii })
    }

    #[inline(always)]
    fn sum_here(&self, tree: &Tree, point: Vector3<f64>, far_radii: f64) -> f64 {
        let mut sums = [0.0; FAN];
        let mut stack = [(0, 0); STACK];
        let mut waiting = 1;
        stack[0] = (self.levels.len() - 1, 0);
        while waiting > 0 {
            waiting -= 1;
            let (level, parent) = stack[waiting];
            let is_far = add_far(&self.levels[level][parent], point, far_radii, &mut sums);
            for node in parent * FAN..self.sizes[level].min((parent + 1) * FAN) {
                if is_far[node % FAN] {
                    continue;
                }
                if level > 0 {
                    stack[waiting] = (level - 1, node);
                    waiting += 1;
                } else {
                    let end = tree.corners.len().min((node + 1) * FAN);
                    add_triangles(&tree.corners[node * FAN..end], &self.senses[node * FAN..end], point, &mut sums);
                }
            }
        }
        sums.iter().sum::<f64>() / (4.0 * PI)
    }
}

/// Adds what nodes far away are seen as. Which of them are far.
#[inline(always)]
fn add_far(fan: &Fan, point: Vector3<f64>, far_radii: f64, sums: &mut Lanes) -> [bool; FAN] {
    let mut is_far = [false; FAN];
    for lane in 0..FAN {
        let [x, y, z] = [0, 1, 2].map(|axis| fan.center[axis][lane] - point[axis]);
        let q = |row: usize, column: usize| fan.quadrupole[3 * column + row][lane];
        let distance_sq = x * x + y * y + z * z;
        let first = fan.dipole[0][lane] * x + fan.dipole[1][lane] * y + fan.dipole[2][lane] * z;
        let stretched = x * (q(0, 0) * x + (q(0, 1) + q(1, 0)) * y + (q(0, 2) + q(2, 0)) * z)
            + y * (q(1, 1) * y + (q(1, 2) + q(2, 1)) * z)
            + z * (q(2, 2) * z);
        let second = q(0, 0) + q(1, 1) + q(2, 2) - 3.0 * stretched / distance_sq;
        let seen = (first + second) / (distance_sq * distance_sq.sqrt());
        is_far[lane] = distance_sq > far_radii * far_radii * fan.radius_sq[lane];
        sums[lane] += if is_far[lane] { seen } else { 0.0 };
    }
    is_far
}

/// Adds the angles that at most [`FAN`] triangles fill.
#[inline(always)]
fn add_triangles(triangles: &[[Vector3<f64>; 3]], senses: &[f64], point: Vector3<f64>, sums: &mut Lanes) {
    let mut corners = [[[0.0; FAN]; 3]; 3];
    let mut twice = [0.0; FAN];
    for (lane, (triangle, sense)) in triangles.iter().zip(senses).enumerate().take(FAN) {
        twice[lane] = 2.0 * sense;
        for corner in 0..3 {
            for axis in 0..3 {
                corners[corner][axis][lane] = triangle[corner][axis] - point[axis];
            }
        }
    }
    let [a, b, c] = corners;
    for lane in 0..FAN {
        let [a, b, c] = [&a, &b, &c].map(|corner| [corner[0][lane], corner[1][lane], corner[2][lane]]);
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let across = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
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
    use crate::gradient_spread::tests::{random, random_vector};
    use crate::winding::{FAR_RADII, SURE_FAR_RADII};

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

    #[test]
    fn the_sum_in_lanes_is_the_plain_one() {
        let mut state = 37;
        for triangles in [1, 7, 8, 9, 64, 65, 700] {
            let points: Vec<[f64; 3]> = (0..triangles)
                .flat_map(|_| {
                    let first = random_vector(&mut state);
                    [0.0, 0.2, 0.2].map(|size| (first + random_vector(&mut state) * size).into())
                })
                .collect();
            let corners: Vec<[u32; 3]> = (0..triangles).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            let mesh = TriangleMesh::new(&points, &corners).unwrap();
            let tree = Tree::new(&mesh);
            let senses: Vec<f64> = (0..triangles).map(|t| f64::from(t % 3) - 1.0).collect();
            let windings = WindingNumbers::new(&tree, senses.clone());
            for _ in 0..300 {
                let point = random_vector(&mut state) * 1.5;
                for far_radii in [FAR_RADII, SURE_FAR_RADII] {
                    let [plain, lanes] =
                        [windings.sum(&tree, point, far_radii), windings.sum_in_lanes(&tree, point, far_radii)];
                    assert!((plain - lanes).abs() < 1e-10, "{plain} {lanes} at {point}");
                }
            }
        }
    }
}
