use sdf_procedural::random::next_bits;

/// SplitMix64 (Steele, Lea and Flood 2014).
pub struct Random(u64);

impl Random {
    /// Seeded by the variable `SEED`, else by `seed`. Prints the seed, which a failing test then shows.
    pub fn new(seed: u64) -> Self {
        let seed = std::env::var("SEED").map_or(seed, |seed| seed.parse().unwrap());
        println!("to repeat this: SEED={seed}");
        Self(seed)
    }

    /// Seeded by the variable `SEED`, else by the time.
    pub fn from_clock() -> Self {
        Self::new(std::time::UNIX_EPOCH.elapsed().unwrap().as_nanos() as u64)
    }

    pub fn bits(&mut self) -> u64 {
        next_bits(&mut self.0)
    }

    pub fn below(&mut self, end: usize) -> usize {
        (self.bits() % end as u64) as usize
    }

    pub fn pick<'a>(&mut self, choices: &[&'a str]) -> &'a str {
        choices[self.below(choices.len())]
    }

    /// A multiple of 2^-20 in [0, 1): exact as f32, and so are small sums.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 44) as f64 / f64::from(1 << 20)
    }
}
