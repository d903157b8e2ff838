//! Random numbers. A failing test prints its seed; `SDF_SEED=7 cargo test -p sdf-tests` sets it.

use std::ops::{Deref, DerefMut};

use nalgebra::Vector3;
use sdf_procedural::random;

/// A generator of random numbers and vectors.
pub struct Random {
    numbers: random::Random,
}

impl Random {
    /// The generator of one test, seeded by `SDF_SEED` or by default. Prints the seed, which the harness shows on failure.
    pub fn seeded() -> Self {
        Self::with_seed(random::test_seed(20_200_814))
    }

    pub fn with_seed(seed: u64) -> Self {
        Self { numbers: random::Random::new(seed) }
    }

    /// A point of the cube |x|, |y|, |z| ≤ `half`.
    pub fn in_cube(&mut self, half: f64) -> Vector3<f64> {
        self.point_in_cube(half).into()
    }

    /// A unit vector, evenly distributed over the sphere.
    pub fn direction(&mut self) -> Vector3<f64> {
        loop {
            let candidate = self.in_cube(1.0);
            let length = candidate.norm();
            if length > 0.1 && length <= 1.0 {
                return candidate / length;
            }
        }
    }
}

impl Deref for Random {
    type Target = random::Random;

    fn deref(&self) -> &random::Random {
        &self.numbers
    }
}

impl DerefMut for Random {
    fn deref_mut(&mut self) -> &mut random::Random {
        &mut self.numbers
    }
}
