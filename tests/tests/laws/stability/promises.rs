//! Every promise of docs/stability.md in stiff and extreme cases: bounded errors, no NaN, no lost contact.

use sdf_core::minimize::Certified;
use sdf_tests::methods::Method;
use sdf_tests::stability::answer::{Fate, Number, query};
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

/// Gives it enough evaluations, and a margin beyond its tolerance. In f64 it also converges.
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
                        let answer = query(&body.field, &method, margin, &problem.corners, number);
                        let context = || format!("{}, {} in {number:?}: {answer:?}, {margin}", case.name, body.name);
                        let is_open = matches!(&answer.minimum, Some(found) if !found.converged);
                        assert!(matches!(answer.fate, Fate::Contact(_)) || is_open, "{}", context());
                        // f32 cannot always resolve the tolerance, and a vertex has none.
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
    assert!(converged * 1000 >= all * 995, "{converged} of {all} converged");
}
