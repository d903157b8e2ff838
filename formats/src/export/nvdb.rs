//! NanoVDB (Museth 2021) level sets in f32, version 32.6: written from a grid, a leaf for each brick; and the sizes that the reader
//! in [`import`](crate::import) shares.
//!
//! A leaf is 8 × 8 × 8 nodes, as our bricks are: a sparse grid's bricks become leaves one by one. A dense grid keeps the leaves that
//! its band needs. Nodes with |φ| < band are active. Leaves hold the samples as they are, also of nodes that are not active, so that
//! a reader that interpolates finds our values everywhere in the band. Blocks without a leaf have the value ± band. Nodes of a leaf
//! beyond the grid's box have the value of the field there, at most the band: what ends at the box does not go on beyond it.

mod bytes;
mod tree;

use sdf_core::grid::Lattice;
use sdf_core::grid::owned::{OwnedGrid, OwnedStorage};
use sdf_core::grid::sparse::{BRICK, BrickData, Sparse};
use sdf_core::{Interval, Sdf};

use bytes::Writer;
use tree::{Slot, Tree};

/// Bytes of the parts of a file.
pub(crate) mod size {
    pub const FILE: usize = 16;
    pub const META: usize = 176;
    pub const GRID: usize = 672;
    pub const TREE: usize = 64;
    pub const ROOT: usize = 64;
    pub const TILE: usize = 32;
    pub const UPPER: usize = 8256 + 8 * 32768;
    pub const LOWER: usize = 1088 + 8 * 4096;
    pub const LEAF: usize = 96 + 4 * 512;
}

/// "NanoVDB0", little-endian.
pub(crate) const MAGIC: [u8; 8] = *b"NanoVDB0";

/// NanoVDB's number of the type `float`.
pub(crate) const FLOAT: u32 = 1;

/// NanoVDB's number of the class of level sets.
pub(crate) const LEVEL_SET: u32 = 1;

/// A NanoVDB file of one level set. Values are distances where |φ| < `band`, which should not exceed the grid's own. `None` if no
/// node is within the band, or there are more leaves than can be numbered.
pub fn nvdb(grid: &OwnedGrid, name: &str, band: f64) -> Option<Vec<u8>> {
    let lattice = grid.lattice();
    // All corners of a cell in which |φ| < band somewhere: no further than the cell's diagonal.
    let reach = band + 3_f64.sqrt() * lattice.spacing() * grid.slope_bound();
    let dense_slot = |range: Interval<f32>| match (f64::from(range.lower), f64::from(range.upper)) {
        (lower, upper) if lower < reach && upper > -reach => Slot::Leaf,
        (_, upper) if upper < 0.0 => Slot::Inside,
        _ => Slot::Outside,
    };
    match grid.storage() {
        OwnedStorage::Dense(dense) => {
            let samples = dense.storage().samples();
            let counts = sdf_core::grid::sparse::brick_counts(lattice).map(|count| count as usize);
            let slot = |slot: [u32; 3]| {
                let [x, y, z] = slot.map(|index| index as usize);
                dense_slot(dense.bounds()[(z * counts[1] + y) * counts[0] + x].range)
            };
            write(lattice, name, band, slot, |node| samples[lattice.index(node)])
        }
        OwnedStorage::DenseU16(blocks) => write_blocks(lattice, name, band, blocks, dense_slot),
        OwnedStorage::DenseU8(blocks) => write_blocks(lattice, name, band, blocks, dense_slot),
        OwnedStorage::SparseF32(sparse) => write_sparse(lattice, name, band, sparse),
        OwnedStorage::SparseU16(sparse) => write_sparse(lattice, name, band, sparse),
        OwnedStorage::SparseU8(sparse) => write_sparse(lattice, name, band, sparse),
    }
}

fn write_blocks<B: BrickData + Sync>(
    lattice: &Lattice,
    name: &str,
    band: f64,
    blocks: &Sparse<B>,
    dense_slot: impl Fn(Interval<f32>) -> Slot,
) -> Option<Vec<u8>> {
    let range = |slot| blocks.brick_at(slot).and_then(|block| blocks.bricks().bounds_of_brick(block));
    let slot = |slot| range(slot).map_or(Slot::Outside, |bounds| dense_slot(bounds.range));
    write(lattice, name, band, slot, |node| blocks.node(node))
}

fn write_sparse<B: BrickData + Sync>(lattice: &Lattice, name: &str, band: f64, sparse: &Sparse<B>) -> Option<Vec<u8>> {
    let slot = |slot| {
        if sparse.brick_at(slot).is_some() {
            Slot::Leaf
        } else if sparse.coarse_corners(slot).iter().all(|corner| *corner < 0.0) {
            Slot::Inside
        } else {
            Slot::Outside
        }
    };
    write(lattice, name, band, slot, |node| sparse.node(node))
}

/// φ outside of a grid's box, where it is `value` at the nearest point of the box, so far `away`: see `sdf_core::grid::Grid`.
fn outside(value: f64, away: f64) -> f64 {
    if value < 0.0 { value + away } else { value.hypot(away) }
}

fn write(
    lattice: &Lattice,
    name: &str,
    band: f64,
    slot: impl Fn([u32; 3]) -> Slot,
    value: impl Fn([u32; 3]) -> f32 + Sync,
) -> Option<Vec<u8>> {
    let tree = Tree::new(sdf_core::grid::sparse::brick_counts(lattice), slot);
    let last = lattice.cells();
    // Nodes beyond the lattice are not active. They have the value of the field there, and no more than the background.
    let leaf = |slot: [u32; 3]| {
        let first = slot.map(|index| index * BRICK);
        let mut values = [0.0_f32; 512];
        let mut is_inside = [false; 512];
        for (index, (value_at, inside)) in (0_u32..).zip(values.iter_mut().zip(&mut is_inside)) {
            // z runs fastest in a leaf.
            let node = [first[0] + (index >> 6), first[1] + (index >> 3 & 7), first[2] + (index & 7)];
            *inside = (0..3).all(|axis| node[axis] <= last[axis]);
            let nearest: [u32; 3] = std::array::from_fn(|axis| node[axis].min(last[axis]));
            *value_at = value(nearest);
            if !*inside {
                let steps = [0, 1, 2].map(|axis| f64::from(node[axis] - nearest[axis]));
                let away = lattice.spacing() * steps.iter().map(|step| step * step).sum::<f64>().sqrt();
                *value_at = outside((*value_at).into(), away).min(band) as f32;
            }
        }
        (values, is_inside)
    };
    Writer { lattice, name, band: band as f32, tree: &tree }.write(leaf)
}
