use sdf_procedural::random::unit_at;

/// The random numbers of one part of the study. They depend on its name alone.
pub struct Random {
    seed: u64,
    drawn: u64,
}

impl Random {
    pub fn new(name: &str) -> Self {
        // FNV-1a (Fowler, Noll, Vo 1991).
        let seed = name
            .bytes()
            .fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3));
        Self { seed, drawn: 0 }
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.drawn += 1;
        low + (high - low) * unit_at(self.seed, self.drawn)
    }
}
