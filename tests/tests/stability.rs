//! Stiff and extreme cases: for each a bounded error or an honest status, never a NaN, never a lost contact, and in f32 an
//! answer within the bound that docs/stability.md promises.

use nalgebra::Vector3;
use sdf_core::minimize::{Certified, Minimizer};
use sdf_core::shapes::HalfSpace;
use sdf_core::{Float, Sdf, Simplex};
use sdf_tests::methods::Method;
use sdf_tests::oracle::{cast, lattice_weights};
use sdf_tests::random::Random;
use sdf_tests::stability::answer::{Fate, Number, ask};
use sdf_tests::stability::cases::CASES;
use sdf_tests::stability::problem::Problem;
use sdf_tests::stability::tally::tallies;

#[test]
fn every_promise_holds_in_every_case() {
    for case in &CASES {
        let broken: Vec<String> = tallies(case).into_iter().flat_map(|tally| tally.broken).collect();
        let some = broken.iter().take(5).cloned().collect::<Vec<_>>().join("\n");
        assert!(broken.is_empty(), "{}: {} promises broken:\n{some}", case.name, broken.len());
    }
}

/// With evaluations enough, and a margin beyond its tolerance. In f64 it converges, too.
#[test]
fn a_certified_search_misses_no_contact() {
    let method = Method::Certified(Certified { evaluations: 20_000, ..Certified::default() });
    let (mut converged, mut all) = (0, 0);
    for case in &CASES {
        for body in &(case.bodies)() {
            for triangle in body.elements.iter().take(2) {
                for corners in 1..=3 {
                    let problem = Problem::new(body, triangle, corners);
                    for number in Number::BOTH {
                        let margin = number.round_up(problem.truth + problem.gap(number, problem.truth));
                        let answer = ask(&body.field, &method, margin, &problem.corners, number);
                        let told = || format!("{}, {} in {number:?}: {answer:?}, {margin}", case.name, body.name);
                        let is_open = matches!(&answer.found, Some(found) if !found.converged);
                        assert!(matches!(answer.fate, Fate::Contact(_)) || is_open, "{}", told());
                        // Finer than rounding nothing can be told apart, and a vertex is never finer.
                        if number == Number::Double && corners > 1 {
                            all += 1;
                            converged += usize::from(!is_open);
                        }
                    }
                }
            }
        }
    }
    println!("{converged} of {all}");
    assert!(converged * 1000 >= all * 995, "{converged} of {all} in time");
}

/// Elements that lie along a plane ten thousand of their sizes away: all that tells their points apart is rounding, and a bound
/// that left it out would lie above some of them.
#[test]
fn a_certified_bound_holds_where_rounding_is_all_there_is() {
    fn check<R: Float>(random: &mut Random) {
        for _ in 0..200 {
            let normal = random.direction();
            let plane = HalfSpace::new(normal.into(), 1e4).unwrap();
            let along = |way: Vector3<f64>| normal * 1e4 + way - normal * normal.dot(&way);
            let corners = [(); 3].map(|()| along(random.in_cube(1.0)));
            let simplex = cast::<R, 3>(&Simplex { corners });
            let minimum = Certified::default().minimize(&plane, &simplex);
            for weights in lattice_weights::<3>(12) {
                let value = plane.value(simplex.point(weights.map(R::from_f64)));
                assert!(minimum.lower_bound <= value, "{minimum:?} on {simplex:?}, but {value:?} at {weights:?}");
            }
        }
    }
    let mut random = Random::of_test();
    check::<f32>(&mut random);
    check::<f64>(&mut random);
}
