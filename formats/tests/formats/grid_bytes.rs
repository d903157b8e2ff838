//! Grids as bytes: written and read as files are.

use std::fs;

use sdf_core::Aabb;
use sdf_formats::grid_file::{self, GridFault, StoredGrid};
use tempfile::TempDir;

use crate::grid_samples::{DENSE, KINDS, Made, about};
use crate::memory::{peak_of, run_on_one_thread};
use crate::random::Random;

#[test]
fn bytes_and_files_are_the_same() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    for (kind, nodes) in KINDS.into_iter().flat_map(|kind| [(kind, [9, 9, 30]), (kind, [40, 33, 70])]) {
        let made = Made::new(nodes, kind);
        made.write(&path);
        let bytes = grid_file::to_bytes(&made.lattice, made.samples(), &about()).unwrap();
        assert!(bytes == fs::read(&path).unwrap(), "{kind:?} {nodes:?}");

        assert_eq!(grid_file::open_bytes(&bytes[..], "").unwrap().summary(), grid_file::open(&path).unwrap().summary());
        let file = grid_file::read(&path).unwrap();
        assert!(grid_file::read_bytes(&bytes, "").unwrap() == file, "{kind:?} {nodes:?}");
        let owned = grid_file::open_bytes(bytes.clone(), "").unwrap();
        assert!(owned.read().unwrap() == file, "{kind:?} {nodes:?}");

        let corner = Aabb { min: made.lattice.origin(), max: made.lattice.origin() };
        let part = grid_file::open(&path).unwrap().read_needed([corner], f64::MAX).unwrap();
        let part_of_bytes = grid_file::open_bytes(&bytes[..], "").unwrap().read_needed([corner], f64::MAX).unwrap();
        assert!(part_of_bytes == part, "{kind:?} {nodes:?}");
    }
}

#[test]
fn a_grid_that_cannot_be_written_to_a_file_gives_no_bytes() {
    let made = Made::new([2, 3, 5], DENSE);
    let mut about = about();
    about.options = "a\0b".into();
    let fault = grid_file::to_bytes(&made.lattice, made.samples(), &about).unwrap_err();
    assert!(matches!(fault, GridFault::Refused(_)) && fault.to_string().contains("NUL"), "{fault}");
}

#[test]
fn refusals_name_the_bytes() {
    let refusal = |bytes: &[u8]| grid_file::read_bytes(bytes, "upload 7").unwrap_err().to_string();
    assert_eq!(refusal(b""), "upload 7: not an HDF5 file; give a grid that `sdftool bake` wrote");
    assert_eq!(refusal(b"# OBJ\nv 0 0 0\n"), refusal(b""));
}

/// Damaged, cut short or extended bytes, on any number of threads, need little memory and give the fault of the file.
#[test]
fn damaged_bytes_are_refused_as_damaged_files_are() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    let name = path.to_str().unwrap();
    let mut random = Random::from_clock();
    for kind in KINDS {
        let made = Made::new([33, 30, 20], kind);
        let valid = grid_file::to_bytes(&made.lattice, made.samples(), &about()).unwrap();
        for round in 0..300 {
            let mut bytes = valid.clone();
            for _ in 0..random.below(4) {
                let at = random.below(bytes.len());
                bytes[at] ^= 1 << random.below(8);
            }
            if round % 3 == 0 {
                bytes.resize(random.below(valid.len() + 100), 0);
            }
            fs::write(&path, &bytes).unwrap();
            let file = run_on_one_thread(|| grid_file::read(&path));
            let (read, memory) = peak_of(|| run_on_one_thread(|| grid_file::read_bytes(&bytes, name)));
            assert!(memory < (1 << 20) + 5 * valid.len(), "{memory} bytes of memory");
            let message =
                |read: Result<StoredGrid, _>| read.map_err(|error: grid_file::GridFileError| error.to_string());
            assert!(message(read) == message(file), "{kind:?}, round {round}");
        }
    }
}
