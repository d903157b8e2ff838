//! A warp: 32 threads that run one instruction at a time, and how long that takes.
//!
//! Where threads part, those with the lowest instruction run first, those within a call before all others: so they meet again as soon as
//! they can. Time passes as on a machine that issues the instructions of a basic block in the best order: each when its operands are there.

use super::cache::Cache;
use super::cost::{ATOMIC, BRANCH, L1_LATENCY, L2_LATENCY, PIPES};
use super::function::{Function, LOCAL};
use super::parse::{Action, Instruction, Module, Operand};

/// Threads of a warp.
pub const LANES: usize = 32;

/// Counts of a warp.
#[derive(Clone, Copy, Debug, Default)]
pub struct WarpCounts {
    /// Machine instructions of the warp.
    pub slots: u64,
    /// Cycles of each pipe.
    pub pipes: [u64; PIPES],
    /// Cycles from its first instruction to the end of its last, alone on the machine.
    pub latency: u64,
    /// Cycles of these in which it waited for instructions.
    pub fetch: u64,
    /// Sectors of 32 bytes requested, and those of them that missed the L1 cache.
    pub sectors: u64,
    pub l1_misses: u64,
    /// Machine instructions of each thread.
    pub threads: [u64; LANES],
}

/// The place of a warp in a launch.
#[derive(Clone, Copy, Default)]
pub struct Place {
    pub block: u64,
    pub block_size: u64,
    /// In the block.
    pub first_thread: u64,
    /// Threads of the warp that there are.
    pub active: usize,
}

/// Registers and memory of 32 threads.
pub struct Warp {
    registers: Vec<[u64; LANES]>,
    /// When each register can be read.
    ready: Vec<u64>,
    own: Vec<u128>,
    own_bytes: usize,
    clock: u64,
    place: Place,
    /// Line of code of the last instruction.
    line: u64,
    /// Warps so far, by which the caches tell local memories apart.
    number: u64,
}

/// Where a thread is: calls that it is in, and its next instruction.
struct Threads {
    calls: [Vec<usize>; LANES],
    next: [usize; LANES],
    live: u32,
    /// Threads at a shuffle that others have not reached.
    waiting: u32,
}

impl Threads {
    /// The threads that run next, and their instruction.
    fn group(&self) -> Option<(u32, usize)> {
        let key = |lane: &usize| (std::cmp::Reverse(self.calls[*lane].len()), self.next[*lane]);
        let first = lanes(self.live & !self.waiting).min_by_key(key);
        assert!(first.is_some() || self.live == 0, "threads wait at a shuffle for others that have ended");
        let first = first?;
        let group = lanes(self.live & !self.waiting).filter(|lane| key(lane) == key(&first));
        Some((group.fold(0, |mask, lane| mask | 1 << lane), self.next[first]))
    }

    /// Threads of a group that shuffle now: they and all whom they wait for are here. The others wait.
    fn shuffled(&mut self, group: u32, at: usize, threads_of: impl Fn(usize) -> u32) -> u32 {
        lanes(group).for_each(|lane| self.next[lane] = at);
        let is_here = |lane: &usize| self.next[*lane] == at;
        let here = lanes(group | self.waiting).filter(is_here).fold(0, |mask, lane| mask | 1 << lane);
        let complete = lanes(here).filter(|lane| threads_of(*lane) & !here == 0).fold(0, |mask, lane| mask | 1 << lane);
        self.waiting = (self.waiting | here) & !complete;
        complete
    }
}

fn lanes(mask: u32) -> impl Iterator<Item = usize> {
    (0..LANES).filter(move |lane| mask >> lane & 1 == 1)
}

impl Warp {
    pub fn new(module: &Module) -> Self {
        let own_bytes = module.own_bytes.next_multiple_of(16);
        Self {
            registers: vec![[0; LANES]; module.registers],
            ready: vec![0; module.registers],
            own: vec![0; own_bytes / 16 * LANES],
            own_bytes,
            clock: 0,
            place: Place::default(),
            line: 0,
            number: 0,
        }
    }

    fn own_address(&self, lane: usize) -> u64 {
        self.own.as_ptr() as u64 + (lane * self.own_bytes) as u64
    }

    /// Sets a parameter of all threads.
    ///
    /// # Safety
    /// There are as many bytes at the address.
    pub unsafe fn set_parameter(&mut self, (start, length): (usize, usize), from: *const u8) {
        for lane in 0..LANES {
            // SAFETY: the caller's; the module has room for its parameters.
            unsafe {
                self.own
                    .as_mut_ptr()
                    .cast::<u8>()
                    .add(lane * self.own_bytes + start)
                    .copy_from_nonoverlapping(from, length)
            };
        }
    }

    fn value(&self, operand: Operand, lane: usize) -> u64 {
        match operand {
            Operand::Register(register) => self.registers[register as usize][lane],
            Operand::Constant(number) => number,
            Operand::Own(offset) => self.own_address(lane) + offset,
            Operand::Block => self.place.block,
            Operand::BlockSize => self.place.block_size,
            Operand::Thread => self.place.first_thread + lane as u64,
        }
    }

    /// Runs a warp of a block to its end.
    ///
    /// # Safety
    /// The kernel's addresses are valid.
    pub unsafe fn run(&mut self, module: &Module, place: Place, start: usize, cache: &mut Cache) -> WarpCounts {
        self.number += 1;
        (self.place, self.line) = (place, 0);
        let (mut counts, begin) = (WarpCounts::default(), self.clock);
        let mut threads = Threads {
            calls: [const { vec![] }; LANES],
            next: [start; LANES],
            live: u32::MAX >> (LANES - place.active),
            waiting: 0,
        };
        while let Some((group, mut at)) = threads.group() {
            let (mut block, mut issued) = (self.clock, 0);
            loop {
                let instruction = &module.code[at];
                if instruction.line != self.line {
                    let fetch = cache.fetch(instruction.line, self.line);
                    (block, counts.fetch) = (block + fetch, counts.fetch + fetch);
                    self.line = instruction.line;
                }
                let (mask, when) = self.guard(instruction, group, block);
                let cost = instruction.cost;
                issued += u64::from(cost.slots);
                counts.slots += u64::from(cost.slots);
                counts.pipes[cost.pipe as usize] += u64::from(cost.occupied);
                lanes(group).for_each(|lane| counts.threads[lane] += u64::from(cost.slots));
                let latency = match &instruction.action {
                    Action::Compute(function) => {
                        self.compute(instruction, *function, mask);
                        u64::from(cost.latency)
                    }
                    Action::Split(bits) => {
                        for lane in lanes(mask) {
                            let number = self.value(instruction.operands[0], lane);
                            self.set(instruction.results[0], lane, number & ((1 << bits) - 1));
                            self.set(instruction.results[1], lane, number >> bits & ((1 << bits) - 1));
                        }
                        0
                    }
                    Action::Shuffle | Action::Ballot => {
                        let here = threads.shuffled(mask, at, |lane| self.value(instruction.operands[3], lane) as u32);
                        self.shuffle(instruction, here);
                        if here != group {
                            lanes(here).for_each(|lane| threads.next[lane] = at + 1);
                            instruction.results.iter().for_each(|result| self.ready[*result as usize] = when);
                            self.clock = when.max(block + issued) + u64::from(cost.latency);
                            break;
                        }
                        u64::from(cost.latency)
                    }
                    Action::Load { .. } | Action::Store { .. } | Action::AtomicAdd => {
                        // SAFETY: the caller's.
                        unsafe { self.access(instruction, mask, cache, &mut counts) }
                    }
                    _ => {
                        lanes(group).for_each(|lane| threads.next[lane] = at + 1);
                        lanes(mask).for_each(|lane| self.flow(module, at, lane, &mut threads));
                        self.clock = when.max(block + issued) + BRANCH;
                        break;
                    }
                };
                instruction.results.iter().for_each(|result| self.ready[*result as usize] = when + latency);
                at += 1;
                if module.code[at].is_target {
                    lanes(group).for_each(|lane| threads.next[lane] = at);
                    self.clock = block + issued;
                    break;
                }
            }
        }
        counts.latency = self.clock - begin;
        counts
    }

    /// The threads whose predicate holds, and when the instruction's operands are there.
    fn guard(&self, instruction: &Instruction, group: u32, block: u64) -> (u32, u64) {
        let (mut mask, mut when) = (group, block);
        if let Some((register, wanted)) = instruction.guard {
            let guards = &self.registers[register as usize];
            mask = lanes(mask).filter(|lane| (guards[*lane] & 1 == 1) == wanted).fold(0, |all, lane| all | 1 << lane);
            when = when.max(self.ready[register as usize]);
        }
        for operand in instruction.operands.iter().chain([&instruction.address]) {
            if let Operand::Register(register) = operand {
                when = when.max(self.ready[*register as usize]);
            }
        }
        (mask, when)
    }

    fn set(&mut self, register: u32, lane: usize, number: u64) {
        self.registers[register as usize][lane] = number;
    }

    fn compute(&mut self, instruction: &Instruction, function: Function, mask: u32) {
        let [a, b, c, _] = instruction.operands;
        for lane in lanes(mask) {
            let result = function(self.value(a, lane), self.value(b, lane), self.value(c, lane));
            self.set(instruction.results[0], lane, result);
        }
    }

    /// Gives each of these threads the value of another of them, or a bit of each.
    fn shuffle(&mut self, instruction: &Instruction, threads: u32) {
        let [own, from, segment, asked] = instruction.operands;
        let bits = lanes(threads).fold(0, |bits, lane| bits | (self.value(own, lane) & 1) << lane);
        let given = |lane: usize| {
            if let Action::Ballot = instruction.action {
                return bits & self.value(asked, lane);
            }
            let (segment, from) = (self.value(segment, lane) as usize, self.value(from, lane) as usize);
            let source = lane & (segment >> 8) | from & !(segment >> 8) & segment & (LANES - 1);
            assert!(threads >> source & 1 == 1, "a shuffle reads a thread that is not there");
            self.value(own, source)
        };
        let values: Vec<(usize, u64)> = lanes(threads).map(|lane| (lane, given(lane))).collect();
        values.into_iter().for_each(|(lane, value)| self.set(instruction.results[0], lane, value));
    }

    /// Moves a thread to where the instruction leads it.
    fn flow(&mut self, module: &Module, at: usize, lane: usize, threads: &mut Threads) {
        let instruction = &module.code[at];
        match &instruction.action {
            Action::Branch(to) => threads.next[lane] = *to,
            Action::Switch(ends) => threads.next[lane] = ends[self.value(instruction.operands[0], lane) as usize],
            Action::Call { to, arguments, .. } => {
                arguments.iter().for_each(|copy| self.copy(lane, *copy));
                threads.calls[lane].push(at);
                threads.next[lane] = *to;
            }
            _ => match threads.calls[lane].pop() {
                Some(call) => {
                    if let Action::Call { result: Some(copy), .. } = &module.code[call].action {
                        self.copy(lane, *copy);
                    }
                    threads.next[lane] = call + 1;
                }
                None => threads.live &= !(1 << lane),
            },
        }
    }

    /// Copies bytes within the thread's own memory.
    fn copy(&mut self, lane: usize, [from, to, length]: [usize; 3]) {
        let own = self.own_address(lane) as *mut u8;
        // SAFETY: the module has room for its parameters.
        unsafe { own.add(to).copy_from(own.add(from), length) };
    }

    /// Loads, stores or adds. The cycles until the result is there.
    ///
    /// # Safety
    /// The addresses are valid.
    unsafe fn access(
        &mut self,
        instruction: &Instruction,
        mask: u32,
        cache: &mut Cache,
        counts: &mut WarpCounts,
    ) -> u64 {
        let (count, bytes) = match instruction.action {
            Action::Load { count, bytes } | Action::Store { count, bytes } => (count, bytes),
            _ => (1, 4),
        };
        let (own_start, own_end) = (self.own_address(0), self.own_address(LANES));
        let mut sectors = vec![];
        for lane in lanes(mask) {
            let address = self.value(instruction.address, lane).wrapping_add(instruction.offset);
            assert!(address & LOCAL == if instruction.is_local { LOCAL } else { 0 }, "{address:x} of another memory");
            let address = address & !LOCAL;
            assert!(
                address.is_multiple_of((count * bytes) as u64),
                "{address:x} is not aligned for {count} × {bytes} bytes"
            );
            for k in 0..count {
                let at = address + (k * bytes) as u64;
                // SAFETY: the caller's.
                unsafe {
                    match instruction.action {
                        Action::Load { .. } => self.set(instruction.results[k], lane, load(at, bytes)),
                        Action::Store { .. } => store(at, bytes, self.value(instruction.operands[k], lane)),
                        _ => {
                            let old = load(at, 4);
                            store(at, 4, old.wrapping_add(self.value(instruction.operands[0], lane)));
                            self.set(instruction.results[0], lane, old);
                        }
                    }
                }
                if !instruction.cost.is_memory() {
                    continue;
                }
                if (own_start..own_end).contains(&at) {
                    // Words of a thread's own memory lie side by side for the threads of a warp.
                    let word = (at - own_start) % self.own_bytes as u64 / 4;
                    let own = |word: u64| (1 << 63) | (self.number << 32) | (word * 4 + lane as u64 / 8);
                    sectors.extend((0..bytes.div_ceil(4) as u64).map(|k| own(word + k)));
                } else {
                    sectors.push(at >> 5);
                }
            }
        }
        if !instruction.cost.is_memory() {
            return u64::from(instruction.cost.latency);
        }
        sectors.sort_unstable();
        sectors.dedup();
        let misses = sectors.iter().filter(|sector| !cache.has(**sector)).count() as u64;
        counts.sectors += sectors.len() as u64;
        counts.l1_misses += misses;
        match instruction.action {
            Action::AtomicAdd => ATOMIC,
            _ if misses > 0 => L2_LATENCY,
            _ => L1_LATENCY,
        }
    }
}

unsafe fn load(address: u64, bytes: usize) -> u64 {
    // SAFETY: the caller's.
    unsafe {
        match bytes {
            1 => u64::from((address as *const u8).read()),
            2 => u64::from((address as *const u16).read_unaligned()),
            4 => u64::from((address as *const u32).read_unaligned()),
            _ => (address as *const u64).read_unaligned(),
        }
    }
}

unsafe fn store(address: u64, bytes: usize, number: u64) {
    // SAFETY: the caller's.
    unsafe {
        match bytes {
            1 => (address as *mut u8).write(number as u8),
            2 => (address as *mut u16).write_unaligned(number as u16),
            4 => (address as *mut u32).write_unaligned(number as u32),
            _ => (address as *mut u64).write_unaligned(number),
        }
    }
}
