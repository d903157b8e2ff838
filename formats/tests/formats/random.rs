//! Random numbers. A failing test prints its seed; `SDF_SEED=7 cargo test -p sdf-formats` sets it.

use std::ops::{Deref, DerefMut};

use sdf_procedural::random;

/// The generator of [`sdf_procedural`], with short fractions.
pub struct Random(random::Random);

impl Random {
    /// The generator of one test, seeded by `SDF_SEED`, or else by `seed`.
    pub fn new(seed: u64) -> Self {
        Self(random::Random::new(random::test_seed(seed)))
    }

    /// Like [`Self::new`], with the time as seed.
    pub fn from_clock() -> Self {
        Self::new(std::time::UNIX_EPOCH.elapsed().unwrap().as_nanos() as u64)
    }

    /// A multiple of 2^-20 in [0, 1): exact as f32, and so are small sums.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 44) as f64 / f64::from(1 << 20)
    }
}

impl Deref for Random {
    type Target = random::Random;

    fn deref(&self) -> &random::Random {
        &self.0
    }
}

impl DerefMut for Random {
    fn deref_mut(&mut self) -> &mut random::Random {
        &mut self.0
    }
}
