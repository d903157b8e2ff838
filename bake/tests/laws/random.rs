//! Random numbers whose seed is printed when a test fails, and can be given: `SDF_SEED=7 cargo test -p sdf-bake`.

use std::ops::{Deref, DerefMut};

use sdf_core::nalgebra::{Rotation3, Vector3};
use sdf_procedural::random;

/// The generator of [`sdf_procedural`], with points and rotations of nalgebra.
pub struct Random(random::Random);

impl Random {
    /// Generator of one test, seeded by `SDF_SEED` if that is set. The test harness shows the seed on failure.
    pub fn from_env() -> Self {
        Self(random::Random::new(random::test_seed(20_200_814)))
    }

    /// A point of the cube |x|, |y|, |z| ≤ `half`.
    pub fn point_in_cube(&mut self, half: f64) -> Vector3<f64> {
        self.0.point_in_cube(half).into()
    }

    pub fn point_in_box(&mut self, min: [f64; 3], max: [f64; 3]) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.between(min[axis], max[axis]))
    }

    pub fn rotation(&mut self) -> Rotation3<f64> {
        Rotation3::new(self.point_in_cube(3.0))
    }
}

impl Deref for Random {
    type Target = random::Random;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl DerefMut for Random {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}
