//! Motion of contacts when the body moves a little: the claims of Fig. 2 and Fig. 4 of Macklin et al. 2020, where they hold.

use sdf_tests::stability::answer::Number;
use sdf_tests::stability::jitter::{Crossing, Jitter, MAX_SMOOTH, jitters, quantile};

fn jitter(method: &str, is_grid: bool, crossing: Crossing, number: Number) -> Jitter {
    let mut jitters = jitters(is_grid, crossing, number, 60, |name| name == method);
    jitters.pop().unwrap_or_else(|| panic!("no method is called {method}"))
}

/// Checks edges of every body, in every step of a path.
#[test]
fn golden_section_moves_a_contact_as_smoothly_as_the_body_moves() {
    for number in Number::BOTH {
        for is_grid in [false, true] {
            let golden = jitter("GoldenSection", is_grid, Crossing::Edge, number);
            let worst = quantile(&golden.jumps, 1.0).max(quantile(&golden.moves, 1.0));
            assert!(worst <= MAX_SMOOTH, "{worst} in {number:?}, grid: {is_grid}");
        }
    }
}

/// The minimum of a grid along an edge is exact.
#[test]
fn certified_edges_in_a_grid_move_as_smoothly_as_the_body_moves() {
    for number in Number::BOTH {
        let certified = jitter("Certified", true, Crossing::Edge, number);
        let worst = quantile(&certified.jumps, 1.0).max(quantile(&certified.moves, 1.0));
        assert!(worst <= MAX_SMOOTH, "{worst} in {number:?}");
    }
}

/// Checks a random step for every element and body, and on nearly every path each of its steps: see docs/stability.md.
#[test]
fn certified_and_newton_contacts_move_as_smoothly_as_the_body_moves() {
    for method in ["Certified", "Newton"] {
        for crossing in [Crossing::Edge, Crossing::Face] {
            for number in Number::BOTH {
                for is_grid in [false, true] {
                    let Jitter { moves, jumps, .. } = jitter(method, is_grid, crossing, number);
                    let (worst, jump) = (quantile(&moves, 1.0), quantile(&jumps, 0.9));
                    assert!(
                        worst <= MAX_SMOOTH && jump <= MAX_SMOOTH,
                        "{worst}, {jump} by {method} at {crossing:?} in {number:?}, grid: {is_grid}"
                    );
                }
            }
        }
    }
}

/// Shows that the tests above can fail: a contact jumps from one sampled point to the next.
#[test]
fn sampled_points_jump() {
    for crossing in [Crossing::Edge, Crossing::Face] {
        let sampling = jitter("PointSampling", false, crossing, Number::Double);
        let worst = quantile(&sampling.jumps, 1.0);
        assert!(worst > 10.0 * MAX_SMOOTH, "{worst} at {crossing:?}");
    }
}
