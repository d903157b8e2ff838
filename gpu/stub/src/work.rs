//! Work that a stream is given: done at once, or later as a graph.

use std::collections::BTreeMap;
use std::ffi::c_void;
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use crate::kernels::Kernel;
use crate::memory::Memory;
use crate::ptx::Card;
use crate::threads::run_all;
use crate::{ILLEGAL_ADDRESS, INVALID_VALUE, SUCCESS, Status, status};

/// Work that was captured.
pub type Graph = Vec<Work>;

/// All that the driver knows.
pub struct Driver {
    pub memory: Memory,
    /// Work that is captured now.
    pub captured: Option<Graph>,
    /// Launches so far.
    pub launches: usize,
    /// Copies of other programs: their stream, the address and what goes there.
    later: Vec<(usize, u64, Source)>,
    /// Streams of other programs so far.
    streams: usize,
    /// Runs the loaded PTX, if a file of it was loaded and not one that only stands for the kernels.
    pub card: Option<Card>,
}

/// Bytes to copy: those of the host as they were, those of the card as they will be.
pub enum Source {
    Host(Vec<u8>),
    /// Address and length.
    Card(u64, usize),
}

/// The one driver of the process.
pub fn driver() -> MutexGuard<'static, Driver> {
    static DRIVER: Mutex<Driver> = Mutex::new(Driver {
        memory: Memory { lists: BTreeMap::new() },
        captured: None,
        launches: 0,
        later: vec![],
        streams: 0,
        card: None,
    });
    DRIVER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The default stream, under either of its names.
const DEFAULT_STREAMS: [usize; 2] = [0, 1];

impl Driver {
    /// Handle of a stream that is not that of `sdf-gpu`.
    pub fn new_stream(&mut self) -> usize {
        self.streams += 1;
        4096 * self.streams
    }

    /// Copies the bytes once somebody waits for the stream. They lie within one list.
    pub fn copy_later(&mut self, stream: usize, to: u64, source: Source) {
        self.later.push((stream, to, source));
    }

    /// Does the copies of a stream, or of all, in their order. A list that was freed meanwhile is neither read nor written.
    pub fn wait_for(&mut self, stream: Option<usize>) {
        let is_default = |stream: usize| DEFAULT_STREAMS.contains(&stream);
        let is_meant = |of: usize| stream.is_none_or(|stream| stream == of || is_default(stream) && is_default(of));
        let (now, later) = std::mem::take(&mut self.later).into_iter().partition(|(of, ..)| is_meant(*of));
        self.later = later;
        let now: Vec<(usize, u64, Source)> = now;
        for (_, to, source) in &now {
            let (from, bytes) = match source {
                Source::Host(bytes) => (bytes.as_ptr(), bytes.len()),
                Source::Card(from, bytes) if self.memory.holds(*from, *bytes) => (*from as *const u8, *bytes),
                Source::Card(..) => continue,
            };
            if self.memory.holds(*to, bytes) {
                // SAFETY: the bytes lie within one list each.
                unsafe { (*to as *mut u8).copy_from(from, bytes) };
            }
        }
    }

    /// Does the work now, or keeps it for a graph.
    pub fn take(&mut self, work: Work) -> Status {
        match &mut self.captured {
            Some(graph) => {
                graph.push(work);
                SUCCESS
            }
            None => self.run(&work),
        }
    }

    /// The time that has passed on the card, or here.
    pub fn microseconds(&self) -> f64 {
        static START: LazyLock<Instant> = LazyLock::new(Instant::now);
        self.card.as_ref().map_or_else(|| 1e6 * START.elapsed().as_secs_f64(), |card| card.time)
    }

    pub fn run(&mut self, work: &Work) -> Status {
        match work {
            Work::Fill { address, bytes, .. } if !self.memory.holds(*address, *bytes) => INVALID_VALUE,
            Work::Fill { address, byte, bytes } => {
                // SAFETY: the bytes lie within one list.
                unsafe { (*address as *mut u8).write_bytes(*byte, *bytes) };
                SUCCESS
            }
            Work::Launch { kernel, arguments, blocks, block } => {
                self.launches += 1;
                let addresses: Vec<*const u8> = arguments.0.iter().map(|words| words.as_ptr().cast()).collect();
                // SAFETY: the arguments are those of this kernel; their lists are the host's to get right.
                match &mut self.card {
                    Some(card) => unsafe { card.launch(kernel.name, &addresses, *blocks, *block) },
                    None => run_all(blocks * block, self.launches, || unsafe { (kernel.run)(&addresses) }),
                }
                status(self.memory.is_intact(), ILLEGAL_ADDRESS)
            }
        }
    }
}

/// The values of a kernel's arguments, each with the alignment that any of them wants.
pub struct Arguments(Vec<Vec<u128>>);

impl Arguments {
    /// # Safety
    /// There is an address for each argument of the kernel, of as many bytes as it has.
    pub unsafe fn copy(kernel: &Kernel, addresses: *const *mut c_void) -> Self {
        let copy = |(index, bytes): (usize, &usize)| {
            let mut words = vec![0u128; bytes.div_ceil(16)];
            // SAFETY: the caller's; the words have room.
            unsafe {
                let from = (*addresses.add(index)).cast::<u8>();
                words.as_mut_ptr().cast::<u8>().copy_from_nonoverlapping(from, *bytes);
            }
            words
        };
        Self(kernel.argument_bytes.iter().enumerate().map(copy).collect())
    }
}

/// One piece of work.
pub enum Work {
    Fill { address: u64, byte: u8, bytes: usize },
    Launch { kernel: &'static Kernel, arguments: Arguments, blocks: usize, block: usize },
}
