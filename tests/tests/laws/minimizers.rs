//! Laws of minimizers: promises 3, 4, 8 and 9, checked for every method, field, number type and kind of simplex.
//!
//! Laws of all methods are in `lanes`, `values`, `bounds`, `budgets` and `scaling`; `point_sampling`, `projected_gradient`, `certified` and
//! `newton` hold what one method promises beyond them.

mod bounds;
mod budgets;
mod certified;
mod known_minima;
mod lanes;
mod newton;
mod point_sampling;
mod projected_gradient;
mod scaling;
mod unions;
mod values;

use std::fmt;

use nalgebra::Vector3;
use sdf_core::minimize::{FrankWolfe, Minimizer, Minimum};
use sdf_core::{Real, Sdf, Simplex};
use sdf_tests::methods::{Method, methods};
use sdf_tests::oracle::{cast, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{Meaning, Scene, scenes};

/// One simplex with one field and one method. Displays all three.
struct Case<'a, R: Real, const N: usize> {
    scene: &'a Scene,
    method: &'a Method,
    simplex: &'a Simplex<R, N>,
}

impl<R: Real, const N: usize> fmt::Display for Case<'_, R, N> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { scene, method, simplex } = self;
        write!(f, "{} by {method:?} on {simplex:?}", scene.name)
    }
}

/// Checks the law on random simplices of every kind with every field and method.
fn everywhere<R: Real<Mask = bool>, const N: usize>(budget: u32, rounds: usize, law: impl Fn(&Case<R, N>))
where
    Method: Minimizer<N>,
{
    everywhere_with(budget, rounds, |_, _| (), |case, ()| law(case));
}

/// The same, with an oracle's answer for each simplex.
fn everywhere_with<R: Real<Mask = bool>, T, const N: usize>(
    budget: u32,
    rounds: usize,
    oracle: impl Fn(&Scene, &Simplex<R, N>) -> T,
    law: impl Fn(&Case<R, N>, &T),
) where
    Method: Minimizer<N>,
{
    let mut random = Random::seeded();
    for scene in &scenes(1.0) {
        for _ in 0..rounds {
            let simplex = &cast(&random_simplex(&mut random, scene.size));
            let truth = oracle(scene, simplex);
            for method in &methods(N, budget) {
                law(&Case { scene, method, simplex }, &truth);
            }
        }
    }
}

/// Errors of two methods in edges, sorted, on random simplices over all shapes, or over all grids: above the lowest value that they
/// or 1,000 steps of Frank-Wolfe find.
fn sorted_errors<const N: usize>(
    random: &mut Random,
    is_grid: bool,
    first: &impl Minimizer<N>,
    second: &impl Minimizer<N>,
) -> [Vec<f64>; 2] {
    let mut errors = [vec![], vec![]];
    for scene in scenes(1.0).iter().filter(|scene| (scene.meaning == Meaning::Samples) == is_grid) {
        for _ in 0..60 {
            let simplex = random_simplex::<N>(random, scene.size);
            let values = [first.minimize(&scene.field, &simplex), second.minimize(&scene.field, &simplex)]
                .map(|minimum| minimum.sample.value);
            let long = FrankWolfe { iterations: 1000, ..FrankWolfe::default() }.minimize(&scene.field, &simplex);
            let lowest = values.iter().fold(long.sample.value, |lowest, value| lowest.min(*value));
            for (errors, value) in errors.iter_mut().zip(values) {
                errors.push((value - lowest) / simplex.longest_edge().max(1e-6));
            }
        }
    }
    errors.iter_mut().for_each(|errors| errors.sort_by(f64::total_cmp));
    errors
}

/// How many of 200 searches over each field converged, and how many of these ended off a local minimum: the point a thousandth of
/// the way to some corner is lower.
fn converged_and_wrong<const N: usize>(
    random: &mut Random,
    is_convex: bool,
    method: &impl Minimizer<N>,
) -> (usize, usize) {
    let (mut converged, mut wrong) = (0, 0);
    for scene in scenes(1.0).iter().filter(|scene| scene.convex == is_convex) {
        for _ in 0..200 {
            let simplex = random_simplex::<N>(random, scene.size);
            let minimum: Minimum<f64, N> = method.minimize(&scene.field, &simplex);
            if minimum.converged {
                converged += 1;
                let unit = simplex.longest_edge() * scene.slope_bound();
                let falls_to = |corner: &Vector3<f64>| {
                    let nearby = minimum.point + (corner - minimum.point) * 1e-3;
                    scene.value(nearby) < minimum.sample.value - 1e-5 * unit
                };
                wrong += usize::from(simplex.corners.iter().any(falls_to));
            }
        }
    }
    (converged, wrong)
}
