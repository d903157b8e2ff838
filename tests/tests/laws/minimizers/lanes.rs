//! Equality bit for bit: lanes and scalars, dual numbers and their values, quick passes and whole searches.

use std::cell::Cell;

use sdf_core::minimize::{Minimizer, Minimum};
use sdf_core::{Float, Real, Simplex};
use sdf_tests::dual::Dual;
use sdf_tests::lanes::{lane_sample, pack_simplices};
use sdf_tests::methods::{Method, methods};
use sdf_tests::oracle::{cast, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::scenes;

use super::{Case, everywhere};

/// All numbers of a minimum, as bits, in one lane.
fn bits<R: Real, const N: usize>(minimum: &Minimum<R, N>, to_f64: impl Fn(R) -> f64) -> Vec<u64> {
    let Minimum { weights, point, sample, lower_bound, evaluations, .. } = minimum;
    let numbers = weights.iter().chain(point.iter()).chain(sample.gradient.iter());
    numbers.chain([&sample.value, lower_bound, evaluations]).map(|x| to_f64(*x).to_bits()).collect()
}

fn one_lane_equals_the_scalar<R: Float, const L: usize, const N: usize>()
where
    Method: Minimizer<N>,
{
    let mut random = Random::seeded();
    for scene in &scenes(1.0) {
        for method in &methods(N, 24) {
            for _ in 0..12 {
                let scalar: [Simplex<R, N>; L] =
                    std::array::from_fn(|_| cast(&random_simplex(&mut random, scene.size)));
                let packed = method.minimize(&scene.field, &pack_simplices(&scalar));
                for (lane, simplex) in scalar.iter().enumerate() {
                    let minimum = method.minimize(&scene.field, simplex);
                    let case = Case { scene, method, simplex };
                    assert_eq!(bits(&minimum, R::to_f64), bits(&packed, |x| x.0[lane].to_f64()), "{case}");
                    assert_eq!(minimum.converged, packed.converged.0[lane], "{case}");
                    assert_eq!(minimum.sample.status, lane_sample(&packed.sample, lane).status, "{case}");
                }
            }
        }
    }
}

#[test]
fn one_lane_of_a_minimizer_equals_the_scalar_bit_for_bit_in_f32() {
    one_lane_equals_the_scalar::<f32, 8, 1>();
    one_lane_equals_the_scalar::<f32, 8, 2>();
    one_lane_equals_the_scalar::<f32, 8, 3>();
}

#[test]
fn one_lane_of_a_minimizer_equals_the_scalar_bit_for_bit_in_f64() {
    one_lane_equals_the_scalar::<f64, 4, 1>();
    one_lane_equals_the_scalar::<f64, 4, 2>();
    one_lane_equals_the_scalar::<f64, 4, 3>();
}

#[test]
fn a_dual_number_takes_the_same_steps_as_its_value() {
    fn check<const N: usize>()
    where
        Method: Minimizer<N>,
    {
        everywhere::<f64, N>(16, 20, |case| {
            let dual = case.method.minimize(&case.scene.field, &cast::<Dual<f64>, N>(case.simplex));
            let plain = case.method.minimize(&case.scene.field, case.simplex);
            assert_eq!(bits(&plain, |x| x), bits(&dual, |x| x.value), "{case}");
        });
    }
    check::<1>();
    check::<2>();
    check::<3>();
}

#[test]
fn where_the_quick_pass_converges_it_returns_what_the_method_does() {
    fn check<R: Float, const N: usize>()
    where
        Method: Minimizer<N>,
    {
        let (converged, left_over) = (Cell::new(0), Cell::new(0));
        everywhere::<R, N>(24, 20, |case| {
            let Some(quick_pass) = Minimizer::<N>::quick_pass(case.method) else { return };
            let quick = quick_pass.minimize(&case.scene.field, case.simplex);
            if !quick.converged {
                left_over.set(left_over.get() + 1);
                return;
            }
            converged.set(converged.get() + 1);
            let whole = case.method.minimize(&case.scene.field, case.simplex);
            assert!(whole.converged, "{case}");
            assert_eq!(bits(&quick, R::to_f64), bits(&whole, R::to_f64), "{case}");
        });
        assert!(converged.get() > 0 && (N == 1 || left_over.get() > 0), "both outcomes occur");
    }
    check::<f32, 2>();
    check::<f32, 3>();
    check::<f64, 1>();
    check::<f64, 2>();
    check::<f64, 3>();
}
