//! Random numbers. A failing test prints its seed; `SDF_SEED=7 cargo test -p sdf-tests` sets it.

use nalgebra::Vector3;

/// SplitMix64 (Steele, Lea, Flood 2014): small, good enough for test points, the same on every machine.
pub struct Random {
    state: u64,
}

impl Random {
    /// The generator of one test, seeded by `SDF_SEED` or by default. Prints the seed, which the harness shows on failure.
    pub fn seeded() -> Self {
        let seed = match std::env::var("SDF_SEED") {
            Ok(text) => text.parse().unwrap_or_else(|_| panic!("SDF_SEED: expected an integer, found {text:?}")),
            Err(_) => 20_200_814,
        };
        println!("to repeat: SDF_SEED={seed}");
        Self::with_seed(seed)
    }

    pub fn with_seed(seed: u64) -> Self {
        Self { state: seed }
    }

    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// 0 ≤ x < 1, in multiples of 2⁻⁵³.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (0.5_f64).powi(53)
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A whole number below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }

    /// In the cube around the origin that reaches `half` to either side.
    pub fn in_cube(&mut self, half: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.between(-half, half))
    }

    /// Of unit length, evenly over the sphere.
    pub fn direction(&mut self) -> Vector3<f64> {
        loop {
            let candidate = self.in_cube(1.0);
            let length = candidate.norm();
            if length > 0.1 && length <= 1.0 {
                return candidate / length;
            }
        }
    }

    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for end in (1..items.len()).rev() {
            items.swap(end, self.below(end + 1));
        }
    }
}
