//! SplitMix64 (Steele, Lea and Flood 2014, "Fast splittable pseudorandom number generators", OOPSLA): the same numbers on
//! every machine, good enough for test points.
//!
//! The state grows by a constant γ per number: number i of a seed s is mix(s + (i + 1)·γ). [`unit_at`] computes it without
//! the numbers before it.

const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// A generator of random numbers.
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

impl Random {
    pub const fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    pub fn bits(&mut self) -> u64 {
        next_bits(&mut self.state)
    }

    /// 0 ≤ x < 1, a multiple of 2⁻⁵³.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * 0.5_f64.powi(53)
    }

    /// `low` ≤ x ≤ `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A whole number below `count`, which must not be 0.
    pub fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    /// One of `choices`, which must not be empty.
    pub fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    /// A point of the cube |x|, |y|, |z| ≤ `half`.
    pub fn point_in_cube(&mut self, half: f64) -> [f64; 3] {
        std::array::from_fn(|_| self.between(-half, half))
    }

    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for end in (1..items.len()).rev() {
            items.swap(end, self.below(end + 1));
        }
    }
}

/// Advances a state that is not kept in a [`Random`], and returns its bits.
pub fn next_bits(state: &mut u64) -> u64 {
    *state = state.wrapping_add(GAMMA);
    mix(*state)
}

/// Number `index` of the sequence of a seed: 0 ≤ x < 1.
pub fn unit_at(seed: u64, index: u64) -> f64 {
    let bits = mix(seed.wrapping_add(index.wrapping_add(1).wrapping_mul(GAMMA)));
    bits as f64 / u64::MAX as f64 * (1.0 - f64::EPSILON)
}

/// The seed of a random test: the number in the environment variable `SDF_SEED`, or else `default`. Prints it, so that the
/// output of a failed test says how to repeat it. Panics if the variable is not a whole number.
pub fn test_seed(default: u64) -> u64 {
    let seed = match std::env::var("SDF_SEED") {
        Ok(text) => text.parse().unwrap_or_else(|_| panic!("SDF_SEED: expected a whole number, found {text:?}")),
        Err(_) => default,
    };
    println!("to repeat: SDF_SEED={seed}");
    seed
}

fn mix(bits: u64) -> u64 {
    let bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From <https://prng.di.unimi.it/splitmix64.c> with the seed 1234567.
    #[test]
    fn the_bits_are_those_of_the_reference_implementation() {
        let mut random = Random::new(1_234_567);
        let bits = [(); 5].map(|()| random.bits());
        let expected = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
            4_593_380_528_125_082_431,
            16_408_922_859_458_223_821,
        ];
        assert_eq!(bits, expected);
    }

    #[test]
    fn a_number_by_its_index_is_the_number_of_the_sequence() {
        let mut random = Random::new(7);
        for index in 0..1000 {
            let [one, other] = [random.unit(), unit_at(7, index)];
            assert!((one - other).abs() < 1e-15, "{index}: {one} and {other}");
        }
    }
}
