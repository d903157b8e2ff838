//! Budgets: no answer takes more evaluations than its method was given, and what it says within them is true.

use nalgebra::Vector3;
use sdf_core::combine::{Compound, Union};
use sdf_core::minimize::{Certified, Minimizer};
use sdf_core::shapes::{Sphere, Torus};
use sdf_core::{EnclosedSdf, Float, Simplex};
use sdf_tests::methods::{Method, methods};
use sdf_tests::oracle::{cast, lattice_minimum, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{scenes, shifted};

/// Largest number of evaluations that a method promises on a simplex of `corners` corners.
fn max_evaluations(method: &Method, corners: u32) -> u32 {
    match method {
        Method::Certified(method) => method.evaluations.max(1),
        Method::PointSampling(method) => method.samples.max(1),
        Method::FrankWolfe(method) => corners + method.iterations,
        Method::ProjectedGradient(method) => corners + method.iterations,
        Method::Newton(method) => corners + method.iterations,
        // Two probes before the first step.
        Method::GoldenSection(method) => corners + method.iterations + 2,
    }
}

/// Budgets from none to more than most searches need; 13, 46 and 259 were taken of 1, 32 and 256.
const BUDGETS: [u32; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 12, 16, 32, 64, 256, 1024];

#[test]
fn no_method_takes_more_evaluations_than_its_budget() {
    fn check<R: Float, const N: usize>(random: &mut Random)
    where
        Method: Minimizer<N>,
    {
        for scene in &scenes(1.0) {
            for round in 0..4 {
                let simplex = &cast::<R, N>(&random_simplex(random, scene.size));
                let level = R::from_f64([f64::INFINITY, 0.0][round % 2]);
                for budget in BUDGETS {
                    let mut all = methods(N, budget);
                    all.push(Method::Certified(Certified { evaluations: budget, ..Certified::default() }));
                    for method in &all {
                        let minimum = method.minimize_below(&scene.field, simplex, level);
                        let allowed = f64::from(max_evaluations(method, N as u32));
                        let taken = minimum.evaluations.to_f64();
                        let case = || format!("{} by {method:?} on {simplex:?}: {minimum:?}", scene.name);
                        assert!((1.0..=allowed).contains(&taken), "{taken} of {allowed}: {}", case());
                    }
                }
            }
        }
    }
    let mut random = Random::seeded();
    check::<f64, 1>(&mut random);
    check::<f64, 2>(&mut random);
    check::<f64, 3>(&mut random);
    check::<f32, 2>(&mut random);
    check::<f32, 3>(&mut random);
}

/// The bound holds and convergence is earned, in every scene and in unions of parts with a search each.
#[test]
fn a_certified_answer_is_true_within_any_budget() {
    fn check<R: Float, const N: usize>(field: &impl EnclosedSdf, name: &str, size: f64, random: &mut Random) {
        for _ in 0..3 {
            let simplex = cast::<R, N>(&random_simplex(random, size));
            let lowest = lattice_minimum(field, &simplex, 24).to_f64();
            let rounding = 6.0 * 8.0 * 32.0 * R::EPSILON * size * field.slope_bound().max(1.0);
            for evaluations in BUDGETS {
                let method = Certified { evaluations, ..Certified::default() };
                let minimum = method.minimize(field, &simplex);
                let case = || format!("{name} within {evaluations} on {simplex:?}: {minimum:?}, but {lowest}");
                assert!(minimum.evaluations.to_f64() <= f64::from(evaluations.max(1)), "{}", case());
                assert_eq!(minimum.sample, field.evaluate(minimum.point), "{}", case());
                assert!(minimum.lower_bound.to_f64() <= lowest, "the bound does not hold: {}", case());
                let gap = method.tolerance * simplex.longest_edge().to_f64() * field.slope_bound() + rounding;
                let is_global = minimum.sample.value.to_f64() <= lowest + gap;
                assert!(!minimum.converged || is_global, "not the global minimum: {}", case());
            }
        }
    }
    fn check_all(field: &impl EnclosedSdf, name: &str, size: f64, random: &mut Random) {
        check::<f64, 1>(field, name, size, random);
        check::<f64, 2>(field, name, size, random);
        check::<f64, 3>(field, name, size, random);
        check::<f32, 3>(field, name, size, random);
    }
    let mut random = Random::seeded();
    for scene in &scenes(1.0) {
        check_all(&scene.field, scene.name, scene.size, &mut random);
    }
    let ring = |x: f64| shifted(Torus::new(0.4, 0.15).unwrap(), [x, 0.0, 0.1]);
    let rings = Compound::new(vec![ring(-0.9), ring(0.0), ring(0.5), ring(0.9)]).unwrap();
    check_all(&rings, "four rings", 1.0, &mut random);
    check_all(&Union(&rings, Sphere::new(0.3).unwrap()), "four rings and a ball", 1.0, &mut random);
}

/// The part that the budget does not reach is the lowest at a corner.
#[test]
fn a_union_whose_budget_ends_at_the_first_part_still_knows_its_corners() {
    let ring = shifted(Torus::new(0.4, 0.15).unwrap(), [0.0, 0.0, 0.3]);
    let ball = shifted(Sphere::new(0.3).unwrap(), [1.0, 0.0, 0.0]);
    let triangle: Simplex<f64, 3> =
        Simplex { corners: [[-1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 0.0, 0.0]].map(Vector3::from) };
    for evaluations in 3..64 {
        let method = Certified { evaluations, ..Certified::default() };
        let minimum = method.minimize(&Union(&ring, &ball), &triangle);
        assert!(minimum.sample.value <= -0.3 && minimum.lower_bound <= -0.3, "{evaluations}: {minimum:?}");
        assert!(minimum.evaluations <= f64::from(evaluations), "{minimum:?}");
    }
}

/// A level between the bounds asks for a finer search: if that runs out, what was known before is known still.
#[test]
fn a_level_takes_nothing_from_what_converged_within_the_same_budget() {
    let mut random = Random::seeded();
    let (mut decided, mut open) = (0, 0);
    for scene in &scenes(1.0) {
        for _ in 0..4 {
            let simplex = &random_simplex::<3>(&mut random, scene.size);
            for evaluations in [16, 24, 32, 48, 64, 96] {
                let method = Certified { evaluations, tolerance: 0.02, ..Certified::default() };
                let before = method.minimize(&scene.field, simplex);
                if !before.converged {
                    continue;
                }
                let gap = before.sample.value - before.lower_bound;
                for share in [0.01, 0.5, 0.99] {
                    let level = before.sample.value - share * gap;
                    let after = method.minimize_below(&scene.field, simplex, level);
                    let context = || format!("{} on {simplex:?}: {before:?} and {after:?} at {level}", scene.name);
                    let is_above = level < after.lower_bound;
                    assert!(after.converged || is_above, "{}", context());
                    let is_open = !is_above && level < after.sample.value;
                    *if is_open { &mut open } else { &mut decided } += 1;
                }
            }
        }
    }
    assert!(decided > 100 && open > 20, "{decided} decided, {open} open");
}
