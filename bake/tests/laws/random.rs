//! Random numbers whose seed is printed when a test fails, and can be given: `SDF_SEED=7 cargo test -p sdf-bake`.

use sdf_core::nalgebra::{Rotation3, Vector3};
use sdf_procedural::random::next_bits;

/// SplitMix64 (Steele, Lea and Flood 2014).
pub struct Random {
    state: u64,
}

impl Random {
    /// Generator of one test, seeded by `SDF_SEED` if that is set. The test harness shows the seed on failure.
    pub fn from_env() -> Self {
        let seed = match std::env::var("SDF_SEED") {
            Ok(text) => text.parse().unwrap_or_else(|_| panic!("SDF_SEED: expected a whole number, found {text:?}")),
            Err(_) => 20_200_814,
        };
        println!("to repeat: SDF_SEED={seed}");
        Self { state: seed }
    }

    pub fn bits(&mut self) -> u64 {
        next_bits(&mut self.state)
    }

    /// 0 ≤ x < 1, a multiple of 2⁻⁵³.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * 0.5_f64.powi(53)
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A whole number below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    /// A point of the cube |x|, |y|, |z| ≤ `half`.
    pub fn point_in_cube(&mut self, half: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.between(-half, half))
    }

    pub fn point_in_box(&mut self, min: [f64; 3], max: [f64; 3]) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.between(min[axis], max[axis]))
    }

    pub fn rotation(&mut self) -> Rotation3<f64> {
        Rotation3::new(self.point_in_cube(3.0))
    }

    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for end in (1..items.len()).rev() {
            items.swap(end, self.below(end + 1));
        }
    }
}
