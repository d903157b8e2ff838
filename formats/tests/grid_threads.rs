//! Many threads write what one writes, read what one reads, and hold little more.

mod grid_samples;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::fs;

use grid_samples::{KINDS, Made, Random, about};
use rayon::{ThreadPool, ThreadPoolBuilder};
use sdf_core::Aabb;
use sdf_formats::grid_file;
use tempfile::TempDir;

/// Notes the most memory that the thread had in use.
struct Watched;

thread_local! {
    static IN_USE: Cell<isize> = const { Cell::new(0) };
    static MOST: Cell<isize> = const { Cell::new(0) };
}

fn note(change: isize) {
    let _ = IN_USE.try_with(|in_use| {
        in_use.set(in_use.get() + change);
        let _ = MOST.try_with(|most| most.set(most.get().max(in_use.get())));
    });
}

// SAFETY: System does the work.
unsafe impl GlobalAlloc for Watched {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(layout.size() as isize);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        note(-(layout.size() as isize));
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static MEMORY: Watched = Watched;

/// The most memory that the work takes beyond what is in use before it.
fn most_memory(work: impl FnOnce()) -> usize {
    let before = IN_USE.get();
    MOST.set(before);
    work();
    (MOST.get() - before) as usize
}

fn threads(count: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(count).build().unwrap()
}

#[test]
fn any_number_of_threads_writes_the_same_bytes() {
    let folder = TempDir::new().unwrap();
    for kind in KINDS {
        for nodes in [[2, 3, 5], [33, 65, 40], [90, 70, 100]] {
            let made = Made::new(nodes, kind);
            let written = [1, 2, 3, 7].map(|count| {
                let path = folder.path().join(format!("{count}.sdf.h5"));
                threads(count).install(|| made.write(&path));
                fs::read(&path).unwrap()
            });
            assert!(written.iter().all(|bytes| *bytes == written[0]), "{kind:?}, {nodes:?}");
        }
    }
}

#[test]
fn any_number_of_threads_reads_the_same_or_the_same_fault() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    let mut random = Random::told();
    for kind in KINDS {
        let made = Made::new([70, 40, 100], kind);
        made.write(&path);
        let sound = fs::read(&path).unwrap();
        for round in 0..20 {
            let mut bytes = sound.clone();
            for _ in 0..round {
                let at = random.below(bytes.len());
                bytes[at] ^= 1 << random.below(8);
            }
            fs::write(&path, &bytes).unwrap();
            let corner = Aabb { min: made.lattice.origin(), max: made.lattice.node([30, 20, 60]) };
            let read = [1, 2, 5].map(|count| {
                let whole = || grid_file::read(&path);
                let part = || grid_file::open(&path)?.read_reached([corner], 0.0);
                threads(count).install(|| [whole(), part()]).map(|read| read.map_err(|error| error.to_string()))
            });
            assert!(round > 0 || read[0].iter().all(Result::is_ok));
            assert!(
                read.iter().all(|of_count| *of_count == read[0]),
                "{kind:?}: {:?}",
                read.map(|of| of.map(Result::err))
            );
        }
    }
}

/// Some four chunks of 128 KiB are packed at a time, each in memory thrice, and what deflate holds.
#[test]
fn writing_and_reading_hold_a_few_chunks_beside_the_grid() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    let pool = ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().unwrap();
    const FEW_CHUNKS: usize = 2 << 20;
    for kind in KINDS {
        let made = Made::new([150, 150, 150], kind);
        let writing = most_memory(|| pool.install(|| made.write(&path)));
        assert!(writing < FEW_CHUNKS, "{writing} bytes to write, {kind:?}");
        let grid = most_memory(|| drop(made.clone()));
        let reading = most_memory(|| drop(pool.install(|| grid_file::read(&path).unwrap())));
        assert!(reading < grid + grid / 5 + FEW_CHUNKS, "{reading} bytes to read a grid of {grid}, {kind:?}");
        assert_eq!(pool.install(|| grid_file::read(&path).unwrap()).about, about());
    }
}
