//! Costs of an instruction on an H100, per warp: issue slots and cycles of its pipe on a quarter of a multiprocessor, and cycles until its
//! result can be read.
//!
//! Rates are assumed after what is published of compute capability 9.0. The counts of machine instructions that ptxas makes of
//! one of PTX (divisions, roots, 64 bits) and the latencies are assumptions, which the measured times of docs/gpu.md hold to account.

/// The units that an instruction occupies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pipe {
    /// Products and sums of f32: a warp a cycle.
    F32,
    /// Integer numbers, comparisons and choices: a warp in two cycles.
    Integer,
    /// f64: a warp in two cycles.
    F64,
    /// Reciprocals, roots and conversions of 64 bits: a warp in eight cycles.
    Special,
    /// Loads and stores: a warp in four cycles.
    Memory,
}

pub const PIPES: usize = 5;

/// The costs of one instruction.
#[derive(Clone, Copy, Debug)]
pub struct Cost {
    /// Machine instructions.
    pub slots: u8,
    pub pipe: Pipe,
    /// Cycles that its pipe is taken.
    pub occupied: u8,
    pub latency: u16,
}

impl Cost {
    pub fn is_memory(&self) -> bool {
        self.pipe == Pipe::Memory
    }
}

/// Cycles of a load that hits the L1 cache.
pub const L1_LATENCY: u64 = 36;
/// Cycles of a load from the L2 cache.
pub const L2_LATENCY: u64 = 260;
/// Cycles of an atomic addition in the L2 cache.
pub const ATOMIC: u64 = 400;
/// Cycles from a branch to the instruction behind it.
pub const BRANCH: u64 = 10;

/// The costs of an operation such as `add.rn.f32`.
pub fn cost(operation: &str) -> Cost {
    use Pipe::{F32, F64, Integer, Memory, Special};
    let parts: Vec<&str> = operation.split('.').collect();
    let (base, type_) = (parts[0], parts[parts.len() - 1]);
    let is_wide = type_.ends_with("64");
    let (slots, pipe, occupied, latency) = match (base, type_) {
        // Copies, signs and extensions vanish.
        ("mov" | "cvta" | "neg" | "abs", _) => (0, Integer, 0, 0),
        ("cvt", _) if parts[1].starts_with(['u', 's']) && type_.starts_with(['u', 's']) => (0, Integer, 0, 0),
        ("ld" | "st", _) if parts[1] == "param" => (1, Integer, 2, 8),
        ("ld" | "st" | "atom", _) => (1, Memory, 4, 4),
        ("shfl" | "vote", _) => (1, Memory, 4, 24),
        ("div", "f32") => (10, F32, 10, 48),
        ("sqrt", "f32") => (9, F32, 9, 44),
        ("rcp", "f32") => (7, F32, 7, 36),
        ("div" | "sqrt" | "rcp", "f64") => (20, F64, 40, 180),
        ("div", _) => (16, Integer, 32, 80),
        ("cvt", _) if is_wide || parts[parts.len() - 2].ends_with("64") => (1, Special, 8, 12),
        ("cvt", _) => (1, Integer, 2, 6),
        ("add" | "sub" | "mul", "f32") => (1, F32, 1, 4),
        (_, "f64") => (1, F64, 2, 8),
        ("mul" | "mad", _) if is_wide => (4, Integer, 8, 12),
        ("mul" | "mad", _) => (1, Integer, 2, 5),
        ("popc", _) => (1, Special, 8, 12),
        ("bra" | "brx" | "ret" | "exit" | "call", _) => (1, Integer, 2, 0),
        _ if is_wide => (2, Integer, 4, 6),
        _ => (1, Integer, 2, 4),
    };
    Cost { slots, pipe, occupied, latency }
}
