use sdf_procedural::random::unit_at;

/// Random numbers that depend on the name of a set of problems alone.
pub struct NamedRandom {
    seed: u64,
    index: u64,
}

impl NamedRandom {
    pub fn new(name: &str) -> Self {
        // FNV-1a (Fowler, Noll, Vo 1991).
        let seed = name
            .bytes()
            .fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3));
        Self { seed, index: 0 }
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.index += 1;
        low + (high - low) * unit_at(self.seed, self.index)
    }
}
