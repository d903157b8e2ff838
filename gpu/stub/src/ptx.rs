//! The kernels as NVIDIA's driver gets them: their PTX, run instruction by instruction, and a model of how long an H100 would take.
//!
//! The time of a launch is the longest of
//!
//! - latency: on each multiprocessor, as many warps at once as registers allow, each as long as it takes alone;
//! - issue: four machine instructions a cycle, and the cycles of the pipe that is taken most, on the multiprocessor that has most to do;
//! - memory: sectors from the L1 cache, four a cycle on a multiprocessor, and its misses, from the L2 cache at 5.5 TB/s on all;
//!
//! and a time that each launch costs. It leaves out that warps wait for each other's pipes, contention of atomics, and misses of the
//! L2 cache.

mod cache;
mod cost;
mod declared;
mod function;
mod parse;
mod warp;

use std::collections::HashMap;

use cache::Cache;
pub use function::function;
use parse::{Entry, Module, parse};
use warp::{LANES, Place, Warp, WarpCounts};

/// Multiprocessors of an H100 SXM.
const MULTIPROCESSORS: usize = 132;
/// Cycles a microsecond.
const CLOCK: f64 = 1700.0;
/// Warps at once on a multiprocessor, and its registers.
const WARPS: usize = 64;
const REGISTERS: usize = 65_536;
/// Bytes a cycle from the L2 cache to all multiprocessors.
const L2_BYTES: f64 = 5.5e6 / CLOCK;
/// Microseconds of a launch in a graph.
const LAUNCH: f64 = 1.5;

/// A loaded file of PTX, and a warp to run it.
pub struct Card {
    module: Module,
    warp: Warp,
    /// Registers of each kernel.
    registers: HashMap<String, usize>,
    /// Caches of the multiprocessors, which stay warm.
    caches: Vec<Cache>,
    /// Microseconds so far.
    pub time: f64,
}

impl Card {
    pub fn new(text: &str) -> Self {
        let module = parse(text);
        let lines = include_str!("../../../.ci/gpu.txt").lines().filter(|line| line.contains(" sm_90 "));
        let counts = lines.filter_map(|line| {
            let mut words = line.split(' ');
            Some((words.next()?.to_owned(), words.nth(1)?.parse().ok()?))
        });
        Self {
            warp: Warp::new(&module),
            module,
            registers: counts.collect(),
            caches: (0..MULTIPROCESSORS).map(|_| Cache::new()).collect(),
            time: 0.0,
        }
    }

    /// Runs a kernel, and passes the time that it would take.
    ///
    /// # Safety
    /// The arguments are those of the kernel, and their addresses are valid.
    pub unsafe fn launch(&mut self, name: &str, arguments: &[*const u8], blocks: usize, block: usize) {
        let Entry { start, parameters } = self.module.entries[name].clone();
        for (parameter, argument) in parameters.iter().zip(arguments) {
            // SAFETY: the caller's.
            unsafe { self.warp.set_parameter(*parameter, *argument) };
        }
        self.caches.iter_mut().for_each(Cache::forget_code);
        let mut warps: Vec<Vec<WarpCounts>> = vec![vec![]; MULTIPROCESSORS];
        for number in 0..blocks {
            for first in (0..block).step_by(LANES) {
                let on = number % MULTIPROCESSORS;
                let active = (block - first).min(LANES);
                let place =
                    Place { block: number as u64, block_size: block as u64, first_thread: first as u64, active };
                // SAFETY: the caller's.
                warps[on].push(unsafe { self.warp.run(&self.module, place, start, &mut self.caches[on]) });
            }
        }
        let registers = self.registers.get(name).copied().unwrap_or(64).next_multiple_of(8);
        let resident = (REGISTERS / (registers * LANES)).clamp(1, WARPS);
        let model = LaunchTime::new(&warps, resident);
        self.time += LAUNCH + model.total();
        if std::env::var_os("SDF_STUB_LAUNCHES").is_some() {
            eprintln!("{name}: {}", model.report(&warps));
        }
    }
}

/// Microseconds of a launch, by each of its bounds.
struct LaunchTime {
    latency: f64,
    issue: f64,
    memory: f64,
}

impl LaunchTime {
    fn new(warps: &[Vec<WarpCounts>], resident: usize) -> Self {
        let most = |of: &dyn Fn(&[WarpCounts]) -> f64| warps.iter().map(|list| of(list)).fold(0.0, f64::max) / CLOCK;
        let misses: u64 = warps.iter().flatten().map(|warp| warp.l1_misses).sum();
        let l1 = most(&|list| list.iter().map(|warp| warp.sectors).sum::<u64>() as f64 / 4.0);
        Self {
            latency: most(&|list| latency(list, resident)),
            issue: most(&issue),
            memory: l1.max(32.0 * misses as f64 / L2_BYTES / CLOCK),
        }
    }

    fn total(&self) -> f64 {
        self.latency.max(self.issue).max(self.memory)
    }

    /// Bounds and counts. Threads that only see that there is nothing for them do not count.
    fn report(&self, warps: &[Vec<WarpCounts>]) -> String {
        let all: Vec<&WarpCounts> = warps.iter().flatten().collect();
        let sum = |of: fn(&WarpCounts) -> u64| all.iter().map(|warp| of(warp)).sum::<u64>();
        let least = all.iter().flat_map(|warp| warp.threads).filter(|count| *count > 0).min().unwrap_or(0);
        let mut busy: Vec<u64> = all.iter().flat_map(|warp| warp.threads).filter(|count| *count > least + 8).collect();
        busy.sort_unstable();
        let at = |part: usize| busy.get(busy.len() * part / 100).or(busy.last()).copied().unwrap_or(0);
        let slots = sum(|warp| warp.slots);
        let longest = all.iter().max_by_key(|warp| warp.latency).map_or([0; 2], |warp| [warp.latency, warp.fetch]);
        format!(
            "latency {:.1} µs, issue {:.1}, memory {:.1}; {} threads with {:.0} instructions each, half {}, 99 % {}, at most {}; \
             {slots} of warps, {:.0} % of lanes at work; longest warp {} cycles, {} for instructions; {:.0} bytes a thread, {:.0} from L2",
            self.latency,
            self.issue,
            self.memory,
            busy.len(),
            busy.iter().sum::<u64>() as f64 / busy.len().max(1) as f64,
            at(50),
            at(99),
            at(100),
            100.0 * busy.iter().sum::<u64>() as f64 / (slots.max(1) * LANES as u64) as f64,
            longest[0],
            longest[1],
            32.0 * sum(|warp| warp.sectors) as f64 / busy.len().max(1) as f64,
            32.0 * sum(|warp| warp.l1_misses) as f64 / busy.len().max(1) as f64,
        )
    }
}

/// Cycles of a multiprocessor that runs so many warps at once, each as long as it takes alone.
fn latency(warps: &[WarpCounts], resident: usize) -> f64 {
    let mut ends = vec![0; resident];
    for warp in warps {
        let first = ends.iter_mut().min().expect("a place for a warp");
        *first += warp.latency;
    }
    ends.into_iter().max().unwrap_or(0) as f64
}

/// Cycles of the four issuing units, or of the pipe that is taken most.
fn issue(warps: &[WarpCounts]) -> f64 {
    let slots = warps.iter().map(|warp| warp.slots).sum::<u64>();
    let pipes = (0..warps.first().map_or(0, |warp| warp.pipes.len()))
        .map(|pipe| warps.iter().map(|warp| warp.pipes[pipe]).sum());
    pipes.fold(slots, u64::max) as f64 / 4.0
}
