//! Lower bounds and values against lattices, and errors on convex fields.

use sdf_core::minimize::{Minimizer, PointSampling};
use sdf_core::shapes::HalfSpace;
use sdf_core::{Float, Real, Sdf, Simplex};
use sdf_tests::methods::{Method, methods};
use sdf_tests::oracle::{cast, convex_minimum, lattice_minimum, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{Scene, scenes};

use super::{Case, everywhere_with};

/// Uses edges along a plane's normal, where φ is as steep as the slope bound: only rounding is left between bound and value.
#[test]
fn the_lower_bound_holds_where_the_slope_bound_is_met() {
    fn check<R: Float>() {
        let mut random = Random::seeded();
        let middle = PointSampling { samples: 1, corners: false };
        for _ in 0..5000 {
            let normal = random.direction();
            let plane = HalfSpace::new(normal.into(), random.between(-1.0, 1.0)).unwrap();
            let (from, length) = (random.in_cube(2.0), random.between(0.0, 2.0));
            let simplex = cast::<R, 2>(&Simplex { corners: [from, from + normal * length] });
            let minimum = middle.minimize(&plane, &simplex);
            let lowest = simplex.corners.map(|corner| plane.value(corner)).into_iter().reduce(Real::min).unwrap();
            assert!(minimum.lower_bound <= lowest, "{minimum:?} on {simplex:?}, but {lowest:?}");
        }
    }
    check::<f32>();
    check::<f64>();
}

#[test]
fn the_lower_bound_is_below_every_value_on_the_simplex() {
    fn check<R: Float, const N: usize>()
    where
        Method: Minimizer<N>,
    {
        for budget in [0, 1, 24] {
            let on_lattice = |scene: &Scene, simplex: &Simplex<R, N>| lattice_minimum(&scene.field, simplex, 12);
            everywhere_with::<R, _, N>(budget, 40, on_lattice, |case, lowest| {
                let minimum = case.method.minimize(&case.scene.field, case.simplex);
                assert!(minimum.lower_bound <= minimum.sample.value, "{case}");
                assert!(minimum.lower_bound <= *lowest, "{case}: {minimum:?}, but {lowest:?}");
            });
        }
    }
    for_every_simplex!(check);
}

/// The lattice misses the truth by at most slope bound · longest edge / parts.
#[test]
fn the_value_is_not_below_what_a_lattice_allows() {
    fn check<const N: usize>()
    where
        Method: Minimizer<N>,
    {
        const PARTS: usize = 16;
        let on_lattice = |scene: &Scene, simplex: &Simplex<f64, N>| lattice_minimum(&scene.field, simplex, PARTS);
        everywhere_with::<f64, _, N>(24, 40, on_lattice, |case, lowest| {
            let minimum = case.method.minimize(&case.scene.field, case.simplex);
            let slack = case.scene.slope_bound() * case.simplex.longest_edge() / PARTS as f64;
            let rounding = 1e-12 * case.scene.size;
            assert!(minimum.sample.value >= lowest - slack - rounding, "{case}: {} < {lowest}", minimum.sample.value);
        });
    }
    check::<1>();
    check::<2>();
    check::<3>();
}

/// Errors over longest edge · slope bound that each method may have on a convex field after 32 steps: median and worst.
///
/// The worst case is a wedge, where the gradient jumps at the minimum: Frank-Wolfe returns to it as 2/(i + 2), a fixed step
/// jumps over it. 33 points on a segment leave at most half an
/// interval, 1/66; on a triangle about the diameter of a sixteenth, 1/4. Golden section ends at its tolerance, and so does a
/// certified search nearly always, with the 128 evaluations that it has here.
#[test]
fn on_convex_fields_every_method_comes_near_the_truth() {
    fn check<const N: usize>(allowed: &[(&str, f64, f64)])
    where
        Method: Minimizer<N>,
    {
        let mut random = Random::seeded();
        let mut errors: Vec<Vec<f64>> = vec![vec![]; allowed.len()];
        for scene in scenes(1.0).iter().filter(|scene| scene.convex) {
            for _ in 0..40 {
                let simplex = &random_simplex::<N>(&mut random, scene.size);
                let unit = scene.slope_bound() * simplex.longest_edge();
                let truth = convex_minimum(&scene.field, simplex);
                for (index, method) in methods(N, 32).iter().enumerate() {
                    let minimum = method.minimize(&scene.field, simplex);
                    let error = minimum.sample.value - truth;
                    let case = Case { scene, method, simplex };
                    assert!(error >= -1e-9 * scene.size, "{case}: {error} below the truth");
                    if unit > 1e-6 {
                        errors[index].push(error / unit);
                    }
                }
            }
        }
        for ((name, median, worst), mut errors) in allowed.iter().zip(errors) {
            errors.sort_by(f64::total_cmp);
            let (middle, last) = (errors[errors.len() / 2], errors[errors.len() - 1]);
            println!("{name}: median {middle:e}, worst {last:e} of {}", errors.len());
            assert!(middle <= *median && last <= *worst, "{name}: median {middle:e}, worst {last:e}");
        }
    }
    check::<2>(&[
        ("Frank-Wolfe", 1e-9, 0.5),
        ("projected gradient", 1e-9, 0.5),
        ("points", 0.01, 1.0 / 66.0 + 1e-9),
        ("Newton", 1e-9, 1e-3),
        ("certified", 1e-4, 1.1e-3),
        ("golden section", 1e-9, 2e-6),
    ]);
    check::<3>(&[
        ("Frank-Wolfe", 1e-9, 0.5),
        ("projected gradient", 1e-9, 0.5),
        ("points", 0.05, 0.25),
        ("Newton", 1e-9, 1e-3),
        ("certified", 1e-4, 1.5e-3),
    ]);
}
