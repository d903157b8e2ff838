//! Projected gradient descent: what steps of the right length and creases found by tangents are worth, and what "converged" means.

use nalgebra::Vector3;
use sdf_core::Simplex;
use sdf_core::combine::Intersection;
use sdf_core::minimize::{FrankWolfe, Minimizer, ProjectedGradient};
use sdf_core::shapes::{HalfSpace, Sphere};
use sdf_tests::oracle::{convex_minimum, random_simplex};
use sdf_tests::random::Random;

use super::{converged_and_wrong, sorted_errors};

/// Three quarters and nine tenths of all shapes, and of all grids.
#[test]
fn after_ten_steps_it_is_as_near_as_frank_wolfe_after_32() {
    fn check<const N: usize>(random: &mut Random) {
        let gradient = ProjectedGradient { iterations: 10, ..ProjectedGradient::default() };
        for is_grid in [false, true] {
            let errors = sorted_errors::<N>(random, is_grid, &gradient, &FrankWolfe::default());
            let [gradient, frank_wolfe] =
                errors.map(|errors| [75, 90].map(|percent| errors[errors.len() * percent / 100]));
            println!("{N} corners, in grids {is_grid}: {gradient:?}, Frank-Wolfe {frank_wolfe:?}");
            let is_near = gradient.iter().zip(frank_wolfe).all(|(gradient, frank_wolfe)| *gradient <= frank_wolfe);
            assert!(is_near, "{N} corners, in grids {is_grid}: {gradient:?}, Frank-Wolfe {frank_wolfe:?}");
        }
    }
    let mut random = Random::seeded();
    check::<2>(&mut random);
    check::<3>(&mut random);
}

/// A triangle has two directions, and the steps are those of a quadratic function's gradients: few are needed, but on slivers.
#[test]
fn a_smooth_minimum_takes_few_steps() {
    let mut random = Random::seeded();
    let sphere = Sphere::new(0.3).unwrap();
    let (mut evaluations, mut errors) = (vec![], vec![]);
    while evaluations.len() < 1000 {
        let simplex = random_simplex::<3>(&mut random, 1.0);
        let truth = convex_minimum(&sphere, &simplex);
        // Near its center a distance is a cone.
        if truth > 0.0 {
            let minimum = ProjectedGradient::default().minimize(&sphere, &simplex);
            evaluations.push(minimum.evaluations);
            errors.push((minimum.sample.value - truth) / simplex.longest_edge().max(1e-6));
        }
    }
    let [evaluations, errors] = [evaluations, errors].map(|mut numbers| {
        numbers.sort_by(f64::total_cmp);
        [500, 900, 980, 999].map(|rank: usize| numbers[rank])
    });
    println!("evaluations {evaluations:?}, errors {errors:?}");
    assert!(evaluations[0] <= 8.0 && evaluations[1] <= 14.0, "{evaluations:?}");
    assert!(errors[2] <= 1e-5 && errors[3] <= 0.02, "{errors:?}");
}

/// Two planes meet under an edge, at a slope of up to 45° each.
#[test]
fn the_crease_of_two_planes_is_found_in_few_steps() {
    let mut random = Random::seeded();
    for _ in 0..500 {
        let planes = [-1.0, 1.0].map(|side| {
            let normal = [side * random.between(0.2, 1.0), random.between(-0.5, 0.5), 1.0];
            HalfSpace::new(normal, random.between(-0.1, 0.1)).unwrap()
        });
        let wedge = Intersection(planes[0], planes[1]);
        let edge = Simplex { corners: [-1.0, 1.0].map(|x| Vector3::new(x, random.between(-0.2, 0.2), 1.0)) };
        let minimum = ProjectedGradient { iterations: 2, ..ProjectedGradient::default() }.minimize(&wedge, &edge);
        let error = minimum.sample.value - convex_minimum(&wedge, &edge);
        assert!(error <= 1e-9, "{error:e}: {wedge:?} on {edge:?}: {minimum:?}");
    }
}

#[test]
fn a_converged_search_is_seldom_off_a_local_minimum() {
    fn check<const N: usize>(random: &mut Random) {
        for is_convex in [true, false] {
            let (converged, wrong) = converged_and_wrong::<N>(random, is_convex, &ProjectedGradient::default());
            println!("{N} corners, convex {is_convex}: {wrong} of {converged}");
            assert!(wrong * 20 < converged, "{N} corners: {wrong} of {converged}");
        }
    }
    let mut random = Random::seeded();
    check::<2>(&mut random);
    check::<3>(&mut random);
}
