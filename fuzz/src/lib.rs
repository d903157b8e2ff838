//! Shared by all targets: a limit of memory, and numbers from bytes.
//!
//! | target | fed with | must hold |
//! |---|---|---|
//! | `obj`, `ply`, `stl`, `off` | a mesh file | it is read, or refused with a message |
//! | `grid` | an HDF5 grid | the same; what is read can be sampled |
//! | `field` | a `.sdf.toml` | the same, and its text reads back |
//! | `scene` | a scene's TOML | it is read, built and run for a frame, or refused |
//! | `points` | a CSV file | it is read, or refused |
//! | `contact` | a field, an element and a method, of arbitrary bits | a contact is finite, its weights are a point of the element |
//!
//! None may panic, hang, or take memory out of proportion to the input.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Memory that may be in use, whatever the input: scratch space of a thread, tables of a decoder.
const BASE_BYTES: usize = 48 << 20;

/// Memory that each byte of the input may take beside that. A text of an OBJ face with two letters a corner becomes a triangle of 12
/// bytes and more.
const BYTES_PER_BYTE: usize = 256;

struct LimitedAllocator;

#[global_allocator]
static ALLOCATOR: LimitedAllocator = LimitedAllocator;

static IN_USE: AtomicUsize = AtomicUsize::new(0);
static LIMIT: AtomicUsize = AtomicUsize::new(usize::MAX);

// SAFETY: passes everything on to the system's allocator, and aborts where that would exceed the limit.
unsafe impl GlobalAlloc for LimitedAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let before = IN_USE.fetch_add(layout.size(), Ordering::Relaxed);
        if before.saturating_add(layout.size()) > LIMIT.load(Ordering::Relaxed) {
            // libFuzzer keeps the input of an abort.
            std::process::abort();
        }
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        IN_USE.fetch_sub(layout.size(), Ordering::Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Runs `work` on an input, and aborts where it takes more memory than an input of that size may.
pub fn limited<T>(bytes: &[u8], work: impl FnOnce() -> T) -> T {
    let allowed = BASE_BYTES + BYTES_PER_BYTE * bytes.len();
    LIMIT.store(IN_USE.load(Ordering::Relaxed) + allowed, Ordering::Relaxed);
    let result = work();
    LIMIT.store(usize::MAX, Ordering::Relaxed);
    result
}

/// Reads a mesh; what is read is consistent.
pub fn read_mesh(bytes: &[u8], name: &str) {
    limited(bytes, || {
        let Ok(mesh) = sdf_formats::mesh::read_bytes(bytes, name) else { return };
        let count = mesh.points.len();
        assert!(mesh.points.iter().flatten().all(|x| x.is_finite()));
        assert!(mesh.triangles.iter().flatten().chain(mesh.segments.iter().flatten()).all(|i| (*i as usize) < count));
        assert_eq!(mesh.triangles.len(), mesh.polygons.len());
    });
}

/// Numbers from the bytes of an input; zero when they are spent.
pub struct Numbers<'a>(pub &'a [u8]);

impl Numbers<'_> {
    pub fn byte(&mut self) -> u8 {
        let (byte, rest) = self.0.split_first().map_or((0, self.0), |(byte, rest)| (*byte, rest));
        self.0 = rest;
        byte
    }

    /// A number with special ones among them, small simple ones, and any bits.
    pub fn number(&mut self) -> f64 {
        const SPECIAL: [f64; 24] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            2.0,
            f64::EPSILON,
            f64::MIN_POSITIVE,
            5e-324,
            1e-300,
            1e-154,
            1e-30,
            1e-8,
            1e8,
            1e30,
            1e150,
            -1e150,
            1e154,
            1e300,
            f64::MAX,
            f64::MIN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NAN,
        ];
        match self.byte() {
            tag @ 0..24 => SPECIAL[usize::from(tag)],
            24..200 => f64::from(i16::from_le_bytes([self.byte(), self.byte()])) / 4096.0,
            _ => f64::from_bits(u64::from_le_bytes(std::array::from_fn(|_| self.byte()))),
        }
    }

    pub fn numbers<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.number())
    }
}
