//! The value of a game against the best of many mixed strategies.

use super::game_value;
use sdf_procedural::random::{Random, test_seed};

#[test]
fn no_weights_of_the_corners_give_more_than_the_value_and_the_given_ones_give_it() {
    let seed = test_seed(7);
    println!("to repeat: SDF_SEED={seed}");
    let mut random = Random::new(seed);
    for _ in 0..500 {
        let corners = 2 + random.below(2) as usize;
        let count = 1 + random.below(6) as usize;
        let rows: Vec<[f64; 3]> = (0..count).map(|_| random.point_in_cube(1.0)).collect();
        let lowest = |weights: [f64; 3]| {
            let mean = |row: &[f64; 3]| (0..corners).map(|corner| weights[corner] * row[corner]).sum::<f64>();
            rows.iter().map(mean).fold(f64::INFINITY, f64::min)
        };
        let value = game_value(&rows, corners, f64::NEG_INFINITY);
        assert!((lowest(value.weights) - value.upper).abs() < 1e-9, "{rows:?} {corners}: {value:?}");
        for i in 0..=20 {
            for j in 0..=20 - i {
                let [u, v] = [f64::from(i) / 20.0, f64::from(j) / 20.0];
                let weights = if corners == 2 { [1.0 - u, u, 0.0] } else { [1.0 - u - v, u, v] };
                assert!(lowest(weights) <= value.upper + 1e-12, "{rows:?} {corners}: {weights:?}");
            }
        }
    }
}
