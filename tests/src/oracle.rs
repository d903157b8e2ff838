//! What a shape, a simplex and a field are, by brute force.

use nalgebra::Vector3;
use sdf_core::{EnclosedSdf, Real, Simplex};

use crate::random::Random;

/// Points on the surface of a solid that is known by membership alone, each within `size`·2⁻⁴⁶ of it: on random lines
/// through the cube that reaches `size` to either side, every change of membership is bisected. Half of the lines aim at
/// the z axis, lest they miss a needle.
pub fn surface_points(
    holds: impl Fn(Vector3<f64>) -> bool,
    size: f64,
    lines: usize,
    random: &mut Random,
) -> Vec<Vector3<f64>> {
    const STEPS: usize = 200;
    let mut found = vec![];
    for line in 0..lines {
        let (from, aim) = (random.in_cube(1.3 * size), random.in_cube(1.3 * size));
        let to = if line % 2 == 0 { aim } else { aim.component_mul(&Vector3::new(0.03, 0.03, 1.0)) };
        let at = |step: usize| from + (to - from) * (step as f64 / STEPS as f64);
        for step in 0..STEPS {
            let (mut a, mut b) = (at(step), at(step + 1));
            let side = holds(a);
            if side == holds(b) {
                continue;
            }
            for _ in 0..50 {
                let middle = (a + b) * 0.5;
                if holds(middle) == side {
                    a = middle;
                } else {
                    b = middle;
                }
            }
            found.push(a);
        }
    }
    found
}

/// Barycentric weights of an even lattice on the simplex, `parts` to an edge.
pub fn lattice_weights<const N: usize>(parts: usize) -> Vec<[f64; N]> {
    fn fill<const N: usize>(at: usize, left: usize, parts: usize, weights: &mut [f64; N], all: &mut Vec<[f64; N]>) {
        if at + 1 == N {
            weights[at] = left as f64 / parts as f64;
            all.push(*weights);
            return;
        }
        for count in 0..=left {
            weights[at] = count as f64 / parts as f64;
            fill(at + 1, left - count, parts, weights, all);
        }
    }
    let mut all = vec![];
    fill(0, parts, parts, &mut [0.0; N], &mut all);
    all
}

/// The least value on the lattice of a simplex. No point is farther from a lattice point than the longest edge over
/// `parts`, so the truth is at most slope bound · longest edge / parts below.
pub fn least_on_lattice<R: Real<Mask = bool>, const N: usize>(
    field: &impl EnclosedSdf,
    simplex: &Simplex<R, N>,
    parts: usize,
) -> R {
    let values = lattice_weights::<N>(parts).into_iter().map(|w| field.value(simplex.point(w.map(R::from_f64))));
    values.reduce(Real::min).unwrap()
}

/// The least value of a convex field on a simplex of one to three corners, to `slope bound · longest edge · 1e-9`: on
/// a convex function ternary search is sure, and the least along one weight is convex in the other.
pub fn least_of_convex<const N: usize>(field: &impl EnclosedSdf, simplex: &Simplex<f64, N>) -> f64 {
    let value = |weights: [f64; N]| field.value(simplex.point(weights));
    let weights = |b: f64, c: f64| {
        let mut weights = [0.0; N];
        for (slot, weight) in weights.iter_mut().zip([1.0 - b - c, b, c]) {
            *slot = weight;
        }
        value(weights)
    };
    match N {
        1 => weights(0.0, 0.0),
        2 => ternary(1.0, |b| weights(b, 0.0)),
        _ => ternary(1.0, |b| ternary(1.0 - b, |c| weights(b, c))),
    }
}

fn ternary(end: f64, value: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, end);
    for _ in 0..52 {
        let third = (high - low) / 3.0;
        if value(low + third) < value(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    value(0.0).min(value(end)).min(value(0.5 * (low + high)))
}

/// Simplices of the given kind around a scene of `size`: most of ordinary shape, some slivers, some with corners that
/// coincide, some tiny, some on the shape's own axes.
pub fn random_simplex<const N: usize>(random: &mut Random, size: f64) -> Simplex<f64, N> {
    let first = random.in_cube(1.2 * size);
    let spread = random.pick(&[1.5, 0.5, 0.1]) * size;
    let mut corners = [first; N];
    for corner in corners.iter_mut().skip(1) {
        *corner = first + random.in_cube(spread);
    }
    match random.below(12) {
        0 if N > 2 => corners[2] = corners[0] + (corners[1] - corners[0]) * random.unit() + random.in_cube(1e-9 * size),
        1 if N > 1 => corners[N - 1] = corners[0],
        2 => corners = [first; N],
        3 => corners.iter_mut().for_each(|corner| corner.x = 0.0),
        4 => corners.iter_mut().for_each(|corner| *corner = corner.map(|x| (x / size * 8.0).round() / 8.0 * size)),
        _ => {}
    }
    Simplex { corners }
}

/// A simplex in another number type.
pub fn cast<R: Real, const N: usize>(simplex: &Simplex<f64, N>) -> Simplex<R, N> {
    Simplex { corners: simplex.corners.map(|corner| corner.map(R::from_f64)) }
}
