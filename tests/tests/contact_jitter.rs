//! How far contacts move when a pose hardly does: what Fig. 2 and Fig. 4 of Macklin et al. 2020 claim, held where it holds.

use sdf_tests::stability::answer::Number;
use sdf_tests::stability::jitter::{ALLOWED, Crossing, Jitter, jitters, quantile};

fn of(method: &str, is_grid: bool, crossing: Crossing, number: Number) -> Jitter {
    let mut jitters = jitters(is_grid, crossing, number, 60, |name| name == method);
    jitters.pop().unwrap_or_else(|| panic!("there is no {method}"))
}

/// On edges, of every body, at every step of a way.
#[test]
fn golden_section_moves_a_contact_as_smoothly_as_the_body_moves() {
    for number in Number::BOTH {
        for is_grid in [false, true] {
            let golden = of("GoldenSection", is_grid, Crossing::Edge, number);
            let worst = quantile(&golden.jumps, 1.0).max(quantile(&golden.moves, 1.0));
            assert!(worst <= ALLOWED, "{worst} in {number:?}, grid: {is_grid}");
        }
    }
}

/// The least value of a grid along an edge is exact.
#[test]
fn certified_edges_in_a_grid_move_as_smoothly_as_the_body_moves() {
    for number in Number::BOTH {
        let certified = of("Certified", true, Crossing::Edge, number);
        let worst = quantile(&certified.jumps, 1.0).max(quantile(&certified.moves, 1.0));
        assert!(worst <= ALLOWED, "{worst} in {number:?}");
    }
}

/// Of every element and body at a random step, and on nearly every way at each of its steps: see docs/stability.md.
#[test]
fn certified_contacts_and_newtons_move_as_smoothly_as_the_body_moves() {
    for method in ["Certified", "Newton"] {
        for crossing in [Crossing::Edge, Crossing::Face] {
            for number in Number::BOTH {
                for is_grid in [false, true] {
                    let of = of(method, is_grid, crossing, number);
                    let (worst, jump) = (quantile(&of.moves, 1.0), quantile(&of.jumps, 0.9));
                    let told = format!("{worst}, {jump} by {method} at {crossing:?} in {number:?}, grid: {is_grid}");
                    assert!(worst <= ALLOWED && jump <= ALLOWED, "{told}");
                }
            }
        }
    }
}

/// At one random step. On some ways there is one at which it jumps: see docs/stability.md.
#[test]
fn a_line_search_moves_a_contact_smoothly_at_a_random_step() {
    for crossing in [Crossing::Edge, Crossing::Face] {
        for number in Number::BOTH {
            for is_grid in [false, true] {
                let line = of("LineSearch", is_grid, crossing, number);
                let (worst, jump) = (quantile(&line.moves, 1.0), quantile(&line.jumps, 0.5));
                assert!(worst <= ALLOWED && jump <= ALLOWED, "{worst}, {jump} at {crossing:?} in {number:?}");
            }
        }
    }
}

/// So that the laws above are laws: fixed points jump from one to the next.
#[test]
fn sampled_points_jump() {
    for crossing in [Crossing::Edge, Crossing::Face] {
        let sampling = of("PointSampling", false, crossing, Number::Double);
        let worst = quantile(&sampling.jumps, 1.0);
        assert!(worst > 10.0 * ALLOWED, "{worst} at {crossing:?}");
    }
}
