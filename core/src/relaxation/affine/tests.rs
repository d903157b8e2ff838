//! Tests of the mean of two affine functions: that it is one, and the best.

use core::array::from_fn;

use super::{highest_mean, smallest};

/// Numbers in [−1, 1], in small steps so that ties occur (Knuth's linear congruential generator).
fn numbers(count: usize) -> impl Iterator<Item = [f64; 4]> {
    let mut state = 1_u64;
    let mut next = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 60) as f64 - 8.0) / 8.0
    };
    (0..count).map(move |_| from_fn(|_| next()))
}

#[test]
fn no_mean_of_two_affine_functions_has_a_higher_minimum() {
    let functions: std::vec::Vec<_> = numbers(2000).collect();
    for pair in functions.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let best = highest_mean(a, b);
        let mean = |weight: f64| from_fn(|k| a[k] * (1.0 - weight) + b[k] * weight);
        let steps = || (0..=1000).map(|step| f64::from(step) / 1000.0);
        let highest = steps().map(|weight| smallest(mean(weight))).fold(f64::NEG_INFINITY, f64::max);
        assert!(highest <= smallest(best) + 1e-12, "{highest} of {a:?} and {b:?}, but {best:?}");
        // On the segment from a to b: its distance from the nearest of a thousand points is at most half a step.
        let distance = |other: [f64; 4]| best.iter().zip(other).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
        let nearest = steps().map(|weight| distance(mean(weight))).fold(f64::INFINITY, f64::min);
        assert!(nearest <= 1.01e-3, "{best:?} is not a mean of {a:?} and {b:?}");
    }
}

/// A mean with an unbounded function is as good as the other alone.
#[test]
fn a_function_that_is_nowhere_bounded_is_ignored() {
    let (plane, nothing) = ([0.5, -1.0, 2.0, 0.0], [f64::NEG_INFINITY; 4]);
    assert_eq!(highest_mean(plane, nothing), plane);
    assert_eq!(highest_mean(nothing, plane), plane);
    assert_eq!(highest_mean(plane, [f64::NAN; 4]), plane);
}
