//! Grids whose chunks are written as they are: the same grids, whole and in part, with the same care.

use sdf_core::Aabb;
use sdf_formats::grid_file::{self, Compression, StoredGrid, WriteOptions};

use crate::grid_samples::{KINDS, Made, about};
use crate::random::Random;

fn bytes(made: &Made, compression: Compression) -> Vec<u8> {
    let options = WriteOptions { compression, ..WriteOptions::default() };
    grid_file::to_bytes_with(&made.lattice, made.samples(), &about(), options).unwrap()
}

fn read(bytes: &[u8]) -> StoredGrid {
    grid_file::read_bytes(bytes, "grid").unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn both_compressions_give_the_same_grid_and_the_same_parts() {
    let mut random = Random::from_clock();
    for (kind, nodes) in KINDS.into_iter().flat_map(|kind| [(kind, [9, 9, 30]), (kind, [70, 33, 40])]) {
        let made = Made::new(nodes, kind);
        let [deflated, plain] = Compression::ALL.map(|compression| bytes(&made, compression));
        assert!(read(&plain).grid == made.grid() && read(&deflated).grid == made.grid(), "{kind:?} {nodes:?}");
        assert!(deflated.len() < plain.len(), "{kind:?}: {} of {}", deflated.len(), plain.len());
        for _ in 0..20 {
            let corner: [f64; 3] = std::array::from_fn(|_| random.below(400) as f64 / 100.0 - 2.0);
            let region = Aabb { min: corner, max: corner.map(|x| x + 0.3) };
            let [a, b] = [&deflated, &plain].map(|bytes| {
                grid_file::open_bytes(&bytes[..], "grid").unwrap().read_needed([region], f64::MAX).unwrap()
            });
            assert!(a.grid == b.grid && a.read.blocks == b.read.blocks, "{kind:?} {region:?}");
        }
    }
}

#[test]
fn a_byte_that_changed_in_plain_chunks_never_goes_unnoticed() {
    let mut random = Random::from_clock();
    for kind in KINDS {
        let valid = bytes(&Made::new([33, 20, 18], kind), Compression::None);
        let whole = read(&valid);
        let mut noticed = 0;
        for at in (0..valid.len()).step_by(41) {
            let mut damaged = valid.clone();
            damaged[at] ^= 1 << random.below(8);
            match grid_file::read_bytes(&damaged, "grid") {
                Ok(StoredGrid { grid, about, .. }) => {
                    assert!(grid == whole.grid && about == whole.about, "{kind:?}: another grid with byte {at}");
                }
                Err(error) => {
                    assert_eq!(error.to_string().lines().count(), 1, "{error}");
                    noticed += 1;
                }
            }
        }
        println!("{kind:?}: {noticed} of {}", valid.len() / 41);
        assert!(noticed > 50, "{noticed}");
    }
}
