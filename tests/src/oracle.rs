//! Brute-force oracles: surface points by bisection, minima by lattices and ternary search; and random simplices.

use nalgebra::Vector3;
use sdf_core::contact::Element;
use sdf_core::{EnclosedSdf, Real, Simplex};

use crate::random::Random;

/// Points on the surface of a solid that is given by membership alone, each within `size`·2⁻⁴⁶ of it.
///
/// Random lines cross the cube [−size, size]³, and every change of membership along them is bisected. Half of the lines aim
/// at the z axis: random ones seldom meet a needle.
pub fn surface_points(
    is_inside: impl Fn(Vector3<f64>) -> bool,
    size: f64,
    lines: usize,
    random: &mut Random,
) -> Vec<Vector3<f64>> {
    const STEPS: usize = 200;
    let mut points = vec![];
    for line in 0..lines {
        let (from, aim) = (random.in_cube(1.3 * size), random.in_cube(1.3 * size));
        let to = if line % 2 == 0 { aim } else { aim.component_mul(&Vector3::new(0.03, 0.03, 1.0)) };
        let at = |step: usize| from + (to - from) * (step as f64 / STEPS as f64);
        let mut previous = is_inside(from);
        for step in 0..STEPS {
            let (mut a, mut b) = (at(step), at(step + 1));
            let (side_of_a, side_of_b) = (previous, is_inside(b));
            previous = side_of_b;
            if side_of_a == side_of_b {
                continue;
            }
            for _ in 0..50 {
                let middle = (a + b) * 0.5;
                if is_inside(middle) == side_of_a {
                    a = middle;
                } else {
                    b = middle;
                }
            }
            points.push(a);
        }
    }
    points
}

/// Barycentric weights of a regular lattice on the simplex, with `parts` intervals per edge.
pub fn lattice_weights<const N: usize>(parts: usize) -> Vec<[f64; N]> {
    fn fill<const N: usize>(corner: usize, left: usize, parts: usize, weights: &mut [f64; N], all: &mut Vec<[f64; N]>) {
        if corner + 1 == N {
            weights[corner] = left as f64 / parts as f64;
            all.push(*weights);
            return;
        }
        for count in 0..=left {
            weights[corner] = count as f64 / parts as f64;
            fill(corner + 1, left - count, parts, weights, all);
        }
    }
    let mut all = vec![];
    fill(0, parts, parts, &mut [0.0; N], &mut all);
    all
}

/// The minimum over a lattice on the simplex.
///
/// Every point is within `longest edge / parts` of a lattice point, so the true minimum is at most
/// `slope bound · longest edge / parts` lower.
pub fn lattice_minimum<R: Real<Mask = bool>, const N: usize>(
    field: &impl EnclosedSdf,
    simplex: &Simplex<R, N>,
    parts: usize,
) -> R {
    let values = lattice_weights::<N>(parts).into_iter().map(|w| field.value(simplex.point(w.map(R::from_f64))));
    values.reduce(Real::min).unwrap()
}

/// The minimum of a convex field on a simplex of one to three corners, to `slope bound · longest edge · 1e-9`.
///
/// Nested ternary search: a convex function is unimodal, and its minimum over one weight is convex in the other.
pub fn convex_minimum<const N: usize>(field: &impl EnclosedSdf, simplex: &Simplex<f64, N>) -> f64 {
    let value = |b: f64, c: f64| {
        let mut weights = [0.0; N];
        for (slot, weight) in weights.iter_mut().zip([1.0 - b - c, b, c]) {
            *slot = weight;
        }
        field.value(simplex.point(weights))
    };
    match N {
        1 => value(0.0, 0.0),
        2 => ternary_search(1.0, |b| value(b, 0.0)),
        _ => ternary_search(1.0, |b| ternary_search(1.0 - b, |c| value(b, c))),
    }
}

/// The minimum of a unimodal function over [0, end].
fn ternary_search(end: f64, value: impl Fn(f64) -> f64) -> f64 {
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

/// A random simplex near a scene of `size`: mostly of ordinary shape, but also slivers, coinciding corners, tiny ones, and
/// ones on the shape's symmetry planes or on round coordinates.
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

/// A random triangle near the surface of a field: its centre within 0.1 `size` of it along each axis, its corners up to 1.5
/// `size` / √3 away.
pub fn face_near_surface(field: &impl EnclosedSdf, size: f64, random: &mut Random) -> Simplex<f64, 3> {
    let mut foot = random.in_cube(1.2 * size);
    for _ in 0..4 {
        let sample = field.sample(foot);
        let slope_sq = sample.gradient.norm_squared();
        foot -= if slope_sq > 1e-6 { sample.gradient * (sample.value / slope_sq) } else { Vector3::zeros() };
    }
    let center = foot + random.in_cube(0.1 * size);
    let radius = random.between(0.1, 1.5) * size / 3.0_f64.sqrt();
    Simplex { corners: [(); 3].map(|()| center + random.direction() * radius) }
}

/// A triangle with a corner at `first`, and the others at most `spread` from it along each axis.
pub fn random_triangle(first: Vector3<f64>, spread: f64, random: &mut Random) -> [Vector3<f64>; 3] {
    [first, first + random.in_cube(spread), first + random.in_cube(spread)]
}

/// The simplex in another number type.
pub fn cast<R: Real, const N: usize>(simplex: &Simplex<f64, N>) -> Simplex<R, N> {
    Simplex { corners: simplex.corners.map(|corner| corner.map(R::from_f64)) }
}

/// An element whose vertices belong to no other element.
pub fn element<R: Real, const N: usize>(id: u32, simplex: Simplex<R, N>) -> Element<R, N> {
    Element { id, vertices: std::array::from_fn(|corner| 10 * id + corner as u32), simplex }
}
