//! Many threads write what one writes, read what one reads, and use little more memory.

use std::fs;

use rayon::{ThreadPool, ThreadPoolBuilder};
use sdf_core::Aabb;
use sdf_formats::grid_file;
use tempfile::TempDir;

use crate::grid_samples::{KINDS, Made, about};
use crate::memory::{peak_of, run_on_one_thread};
use crate::random::Random;

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
fn any_number_of_threads_reads_the_same_or_reports_the_same_fault() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    let mut random = Random::from_clock();
    for kind in KINDS {
        let made = Made::new([70, 40, 100], kind);
        made.write(&path);
        let valid = fs::read(&path).unwrap();
        for round in 0..20 {
            let mut bytes = valid.clone();
            for _ in 0..round {
                let at = random.below(bytes.len());
                bytes[at] ^= 1 << random.below(8);
            }
            fs::write(&path, &bytes).unwrap();
            let corner = Aabb { min: made.lattice.origin(), max: made.lattice.node([30, 20, 60]) };
            let read = [1, 2, 5].map(|count| {
                let whole = || grid_file::read(&path);
                let part = || grid_file::open(&path)?.read_needed([corner], 0.0);
                threads(count).install(|| [whole(), part()]).map(|read| read.map_err(|error| error.to_string()))
            });
            assert!(round > 0 || read[0].iter().all(Result::is_ok));
            assert!(
                read.iter().all(|results| *results == read[0]),
                "{kind:?}: {:?}",
                read.map(|results| results.map(Result::err))
            );
        }
    }
}

/// Four chunks of 128 KiB are packed at a time, each three times in memory, beside the state of deflate.
#[test]
fn writing_and_reading_hold_a_few_chunks_beside_the_grid() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    const FEW_CHUNKS: usize = 2 << 20;
    for kind in KINDS {
        let made = Made::new([150, 150, 150], kind);
        let ((), writing) = peak_of(|| run_on_one_thread(|| made.write(&path)));
        assert!(writing < FEW_CHUNKS, "{writing} bytes to write, {kind:?}");
        let (_, grid) = peak_of(|| made.clone());
        let (stored, reading) = peak_of(|| run_on_one_thread(|| grid_file::read(&path).unwrap()));
        assert!(reading < grid + grid / 5 + FEW_CHUNKS, "{reading} bytes to read a grid of {grid}, {kind:?}");
        assert_eq!(stored.about, about());
    }
}
