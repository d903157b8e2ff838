//! The distance from each of eight points to a triangle, all at once, with the bits of [`nearest_on_triangle`].

use sdf_core::nalgebra::Vector3;

use crate::simd::{LANES, Lanes, VectorX8, cross, dot, lane_of, sub};
use crate::triangle::nearest_on_triangle;

/// The squared distance of each point, as [`nearest_on_triangle`] finds it. `is_sliver`: as
/// [`is_sliver`](crate::triangle::is_sliver) says of the corners.
#[inline(always)]
pub(crate) fn distances_sq(points: &VectorX8<f64>, corners: &[Vector3<f64>; 3], is_sliver: bool) -> Lanes<f64> {
    if is_sliver {
        return distances_sq_one_by_one(points, *corners);
    }
    let triangle = Triangle::new(corners);
    let mut distances_sq = [0.0; LANES];
    for lane in 0..LANES {
        distances_sq[lane] = triangle.distance_sq(lane_of(points, lane));
    }
    distances_sq
}

#[inline(never)]
fn distances_sq_one_by_one(points: &VectorX8<f64>, corners: [Vector3<f64>; 3]) -> Lanes<f64> {
    let point = |lane: usize| Vector3::from_fn(|axis, _| points[axis][lane]);
    std::array::from_fn(|lane| nearest_on_triangle(point(lane), corners).distance_sq)
}

/// What does not depend on the point.
pub(crate) struct Triangle {
    a: [f64; 3],
    b: [f64; 3],
    c: [f64; 3],
    ab: [f64; 3],
    ac: [f64; 3],
    bc: [f64; 3],
    normal: [f64; 3],
    normal_sq: f64,
}

impl Triangle {
    #[inline(always)]
    pub fn new(corners: &[Vector3<f64>; 3]) -> Self {
        let [a, b, c] = [0, 1, 2].map(|corner: usize| [corners[corner].x, corners[corner].y, corners[corner].z]);
        let [ab, ac, bc] = [sub(b, a), sub(c, a), sub(c, b)];
        let normal = cross(ab, ac);
        Self { a, b, c, ab, ac, bc, normal, normal_sq: dot(normal, normal) }
    }

    #[inline(always)]
    fn distance_sq(&self, point: [f64; 3]) -> f64 {
        let (way, _) = self.way_to(point);
        dot(way, way)
    }

    /// To the point from what of the triangle is nearest to it, and whether that is inside. The steps of [`nearest_on_triangle`], all
    /// of them taken and one chosen, so that points can go side by side.
    #[inline(always)]
    pub fn way_to(&self, point: [f64; 3]) -> ([f64; 3], bool) {
        let [from_a, from_b, from_c] = [sub(point, self.a), sub(point, self.b), sub(point, self.c)];
        let (d1, d2) = (dot(self.ab, from_a), dot(self.ac, from_a));
        let (d3, d4) = (dot(self.ab, from_b), dot(self.ac, from_b));
        let (d5, d6) = (dot(self.ab, from_c), dot(self.ac, from_c));
        let opposite_a = d3 * d6 - d5 * d4;
        let opposite_b = d5 * d2 - d1 * d6;
        let opposite_c = d1 * d4 - d3 * d2;
        let (from_b_on, to_c_on) = (d4 - d3, d5 - d6);

        let at_a = (d1 <= 0.0) & (d2 <= 0.0);
        let at_b = (d3 >= 0.0) & (d4 <= d3);
        let at_c = (d6 >= 0.0) & (d5 <= d6);
        let on_ab = (opposite_c <= 0.0) & (d1 >= 0.0) & (d3 <= 0.0);
        let on_ac = (opposite_b <= 0.0) & (d2 >= 0.0) & (d6 <= 0.0);
        let on_bc = (opposite_a <= 0.0) & (from_b_on >= 0.0) & (to_c_on >= 0.0);

        // From the last choice to the first, which so prevails.
        let choose = |ab: f64, ac: f64, bc: f64, inside: f64| {
            let chosen = if on_bc { bc } else { inside };
            let chosen = if on_ac { ac } else { chosen };
            if on_ab { ab } else { chosen }
        };
        let share = choose(d1, d2, from_b_on, dot(self.normal, from_a))
            / choose(d1 - d3, d2 - d6, from_b_on + to_c_on, self.normal_sq);
        let on_edge = on_ab | on_ac | on_bc;
        let way = |axis: usize| {
            let from = choose(self.a[axis], self.a[axis], self.b[axis], 0.0);
            let along = choose(self.ab[axis], self.ac[axis], self.bc[axis], self.normal[axis]) * share;
            let to_edge = point[axis] - (from + along);
            let way = if on_edge { to_edge } else { along };
            let way = if at_c & !on_ab { from_c[axis] } else { way };
            let way = if at_b { from_b[axis] } else { way };
            if at_a { from_a[axis] } else { way }
        };
        ([way(0), way(1), way(2)], !(at_a | at_b | at_c | on_edge))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{instruction_sets, random, random_vector};
    use crate::triangle::is_sliver;

    struct Measure(VectorX8<f64>, [Vector3<f64>; 3]);

    impl pulp::NullaryFnOnce for Measure {
        type Output = Lanes<f64>;

        #[inline(always)]
        fn call(self) -> Lanes<f64> {
            distances_sq(&self.0, &self.1, is_sliver(self.1))
        }
    }

    #[test]
    fn eight_distances_have_the_bits_of_each_by_itself_on_any_instruction_set() {
        let mut state = 17;
        println!("seed {state}");
        for round in 0..20_000 {
            let thickness = [1.0, 1e-3, 1e-6, 1e-9, 0.0][round % 5];
            let scale = [1.0, 1e-30, 1e30][round / 5 % 3];
            let a = random_vector(&mut state);
            let b = a + random_vector(&mut state);
            let c = a + (b - a) * (2.0 * random(&mut state)) + random_vector(&mut state) * thickness;
            let corners = [a, b, c].map(|corner| corner * scale);
            // Anywhere, on the plane, on edges and on corners.
            let weights: [[f64; 2]; LANES] = std::array::from_fn(|_| [random(&mut state), random(&mut state)]);
            let off: [Vector3<f64>; LANES] =
                std::array::from_fn(|lane| random_vector(&mut state) * [1.0, 0.0, 1e-9, 10.0][lane % 4]);
            let point = |lane: usize| {
                let [u, v] = weights[lane].map(|weight| if lane < 2 { weight.round() } else { 2.0 * weight });
                corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v + off[lane] * scale
            };
            let points: VectorX8<f64> = [0, 1, 2].map(|axis| std::array::from_fn(|lane| point(lane)[axis]));
            let wanted: [u64; LANES] =
                std::array::from_fn(|lane| nearest_on_triangle(point(lane), corners).distance_sq.to_bits());
            for arch in instruction_sets() {
                let found = arch.dispatch(Measure(points, corners)).map(f64::to_bits);
                assert_eq!(found, wanted, "{arch:?} {corners:?} {points:?}");
            }
        }
    }
}
