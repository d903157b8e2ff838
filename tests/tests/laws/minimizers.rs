//! Laws of minimizers: promises 3, 4, 8 and 9, checked for every method, field, number type and kind of simplex.
//!
//! Laws of all methods are in `lanes`, `values`, `bounds`, `budgets` and `scaling`; `point_sampling`, `certified` and `newton` hold what
//! one method promises beyond them.

mod bounds;
mod budgets;
mod certified;
mod lanes;
mod newton;
mod point_sampling;
mod projected_gradient;
mod scaling;
mod unions;
mod values;

use std::fmt;

use sdf_core::minimize::Minimizer;
use sdf_core::{Real, Simplex};
use sdf_tests::methods::{Method, methods};
use sdf_tests::oracle::{cast, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{Scene, scenes};

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
