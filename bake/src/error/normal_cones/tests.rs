//! Normal cones: lanes equal scalars, cones hold combinations of normals, and error bounds hold.

use super::*;
use crate::testing::{random, random_vector};

pub fn collected(vectors: &[Vector3<f64>]) -> Normals {
    let mut normals = Normals::default();
    vectors.iter().for_each(|vector| normals.push(*vector));
    normals
}

/// Whether the cone of these normals may hold a unit vector, judged along random directions.
pub fn may_contain(normals: &Normals, vector: Vector3<f64>, state: &mut u64) -> bool {
    let cone = Cone::enclosing(normals);
    (0..40).all(|_| {
        let direction = random_vector(state).normalize();
        let [lower, upper] = cone.range_along(direction);
        (lower - 1e-9..=upper + 1e-9).contains(&vector.dot(&direction))
    })
}

#[test]
fn what_is_found_in_lanes_is_what_is_found_one_by_one() {
    let mut state = 13;
    println!("seed {state}");
    for round in 0..3000 {
        // Some vectors are repeated, and some have a zero component.
        let mut vectors: Vec<_> = (0..1 + round % 30).map(|_| random_vector(&mut state).map(f64::round)).collect();
        vectors.retain(|vector| *vector != Vector3::zeros());
        vectors.push(random_vector(&mut state).normalize());
        let normals = collected(&vectors);
        let direction = if round % 2 == 0 { -Vector3::x() } else { random_vector(&mut state) };
        let cosine = |vector: &Vector3<f64>| vector.dot(&direction);
        let farthest = vectors.iter().min_by(|a, b| cosine(a).total_cmp(&cosine(b))).unwrap();
        assert_eq!(normals.farthest_from(direction), *farthest, "{vectors:?} {direction}");
        let cosines = || vectors.iter().map(cosine);
        let range = [cosines().fold(1.0, f64::min), cosines().fold(-1.0, f64::max)];
        assert_eq!(normals.range_along(direction), range, "{vectors:?} {direction}");
        let sines_sq = vectors.iter().map(|vector| vector.cross(&direction).norm_squared());
        assert_eq!(normals.max_sine_sq(direction), sines_sq.fold(0.0, f64::max), "{vectors:?} {direction}");
    }
}

#[test]
fn a_cone_holds_the_combinations_of_its_normals() {
    let mut state = 3;
    for round in 0..3000 {
        let middle = random_vector(&mut state).normalize();
        let spread = 1.5 * random(&mut state).abs();
        let count = 1 + round % 6;
        let normals: Vec<_> = (0..count).map(|_| (middle + random_vector(&mut state) * spread).normalize()).collect();
        for _ in 0..10 {
            // Cubes of random numbers: often one or two normals have nearly all the weight.
            let sum: Vector3<f64> = normals.iter().map(|normal| normal * random(&mut state).abs().powi(3)).sum();
            let Some(direction) = sum.try_normalize(1e-6) else { continue };
            assert!(may_contain(&collected(&normals), direction, &mut state), "{direction} {normals:?}");
        }
    }
}

/// The error Σ wᵢ gᵢ·(xᵢ − x), with the worst gradient gᵢ towards each corner.
#[test]
fn no_choice_of_gradients_is_off_by_more_than_the_bound() {
    let mut state = 5;
    let mut worst = 0.0_f64;
    for round in 0..3000 {
        let middle = random_vector(&mut state).normalize();
        let spread = random(&mut state).abs();
        let cones: Vec<Vec<_>> = (0..1 + round % 3)
            .map(|_| (0..3).map(|_| (middle + random_vector(&mut state) * spread).normalize()).collect())
            .collect();
        let bound = cone_error_bound(&cones.iter().map(|normals| collected(normals)).collect::<Vec<_>>());
        for _ in 0..10 {
            let point = random_vector(&mut state).abs();
            let gradients: Vec<Vector3<f64>> = cones
                .iter()
                .map(|normals| normals.iter().map(|normal| normal * random(&mut state).abs()).sum::<Vector3<f64>>())
                .filter_map(|sum| sum.try_normalize(1e-6))
                .chain(cones.iter().flatten().copied())
                .collect();
            let corner_term = |corner: usize| {
                let corner = Vector3::from_fn(|axis, _| (corner >> axis & 1) as f64);
                let weight: f64 = (0..3).map(|axis| 1.0 - (corner[axis] - point[axis]).abs()).product();
                weight * gradients.iter().map(|gradient| gradient.dot(&(corner - point))).fold(-2.0, f64::max)
            };
            let error: f64 = (0..8).map(corner_term).sum();
            assert!(error <= bound + 1e-12, "{error} > {bound}: {cones:?}");
            worst = worst.max(error / bound);
        }
    }
    assert!(worst > 0.8, "{worst}: the bound is too wide");
}
