//! Integer parts and indices of numbers from 0 to 2³¹ are exact.

use sdf_core::{Float, Lanes, Real};
use sdf_tests::random::Random;

const END: f64 = 2_147_483_648.0;

/// Integers, halves and random numbers of all sizes, each with its neighbours.
fn numbers<R: Float>(random: &mut Random, step: impl Fn(R, bool) -> R) -> Vec<R> {
    let powers = (0..31).flat_map(|power| [-1.0, -0.5, 0.0, 0.5, 1.0].map(|off| f64::from(1_u32 << power) + off));
    let small = (0..4000).map(|count| f64::from(count) * 0.25);
    let random = (0..4000).map(|count| random.unit() * f64::from(1_u32 << (count % 31)));
    let numbers = powers.chain(small).chain(random).map(R::from_f64);
    let with_neighbours = numbers.flat_map(|x| [step(x, false), x, step(x, true)]);
    with_neighbours.filter(|x| (0.0..END).contains(&x.to_f64())).collect()
}

fn integer_parts_and_indices_are_exact<R: Float>(step: impl Fn(R, bool) -> R) {
    for x in numbers::<R>(&mut Random::seeded(), step) {
        let integer = x.to_f64().floor();
        assert_eq!(Real::trunc(x).to_f64().to_bits(), integer.to_bits(), "the integer part of {x:?}");
        let Lanes(lanes) = Real::trunc(Lanes([x; 5]));
        assert!(
            lanes.iter().all(|lane| lane.to_f64().to_bits() == integer.to_bits()),
            "the integer part of {x:?} in lanes"
        );
        assert_eq!(f64::from(Real::trunc(x).to_index()), integer, "the index of {x:?}");
        assert_eq!(Real::trunc(-x), R::zero(), "the integer part of {:?}", -x);
    }
}

#[test]
fn integer_parts_and_indices_are_exact_in_f32() {
    integer_parts_and_indices_are_exact::<f32>(|x, up| if up { x.next_up() } else { x.next_down() });
}

#[test]
fn integer_parts_and_indices_are_exact_in_f64() {
    integer_parts_and_indices_are_exact::<f64>(|x, up| if up { x.next_up() } else { x.next_down() });
}

#[test]
fn stored_numbers_keep_their_bits() {
    for stored in numbers::<f32>(&mut Random::seeded(), |x, up| if up { x.next_up() } else { x.next_down() }) {
        for stored in [stored, -stored, 1.0 / stored, f32::INFINITY] {
            assert_eq!(f32::from_stored(stored).to_bits(), stored.to_bits());
            assert_eq!((f64::from_stored(stored) as f32).to_bits(), stored.to_bits());
        }
    }
}
