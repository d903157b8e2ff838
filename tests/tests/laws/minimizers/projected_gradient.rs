//! Projected gradient descent: what steps of the right length and creases found by tangents are worth, and what "converged" means.

use nalgebra::Vector3;
use sdf_core::combine::Intersection;
use sdf_core::minimize::{FrankWolfe, Minimizer, Minimum, ProjectedGradient};
use sdf_core::shapes::{HalfSpace, Sphere};
use sdf_core::{Sdf, Simplex};
use sdf_tests::oracle::{convex_minimum, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{Meaning, scenes};

/// Three quarters and nine tenths of all shapes, and of all grids.
#[test]
fn after_ten_steps_it_is_as_near_as_frank_wolfe_after_32() {
    fn check<const N: usize>(random: &mut Random) {
        for is_grid in [false, true] {
            let (mut by_gradient, mut by_frank_wolfe) = (vec![], vec![]);
            for scene in scenes(1.0).iter().filter(|scene| (scene.meaning == Meaning::Samples) == is_grid) {
                for _ in 0..60 {
                    let simplex = random_simplex::<N>(random, scene.size);
                    let gradient = ProjectedGradient { iterations: 10, ..ProjectedGradient::default() };
                    let gradient = gradient.minimize(&scene.field, &simplex);
                    let frank_wolfe = FrankWolfe::default().minimize(&scene.field, &simplex);
                    let lowest =
                        FrankWolfe { iterations: 1000, ..FrankWolfe::default() }.minimize(&scene.field, &simplex);
                    let lowest = lowest.sample.value.min(gradient.sample.value).min(frank_wolfe.sample.value);
                    let error =
                        |minimum: &Minimum<f64, N>| (minimum.sample.value - lowest) / simplex.longest_edge().max(1e-6);
                    by_gradient.push(error(&gradient));
                    by_frank_wolfe.push(error(&frank_wolfe));
                }
            }
            let [gradient, frank_wolfe] = [by_gradient, by_frank_wolfe].map(|mut errors| {
                errors.sort_by(f64::total_cmp);
                [75, 90].map(|percent| errors[errors.len() * percent / 100])
            });
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

/// Off a local minimum, the point a thousandth of the way to some corner is lower.
#[test]
fn a_converged_search_is_seldom_off_a_local_minimum() {
    fn check<const N: usize>(random: &mut Random) {
        for is_convex in [true, false] {
            let (mut searches, mut converged, mut wrong) = (0, 0, 0);
            for scene in scenes(1.0).iter().filter(|scene| scene.convex == is_convex) {
                for _ in 0..200 {
                    let simplex = random_simplex::<N>(random, scene.size);
                    let minimum = ProjectedGradient::default().minimize(&scene.field, &simplex);
                    searches += 1;
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
            println!("{N} corners, convex {is_convex}: {wrong} of {converged} of {searches}");
            assert!(wrong * 20 < converged, "{N} corners: {wrong} of {converged} of {searches}");
        }
    }
    let mut random = Random::seeded();
    check::<2>(&mut random);
    check::<3>(&mut random);
}
