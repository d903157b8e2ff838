//! The coarse grid and the sides of slots, which are known before any brick: what of a [`BrickMap`](super::brick_map::BrickMap) the
//! bricks need once they are baked.
//!
//! A slot without a brick is on one side of the surface, and so is the coarse grid around it. Where two such slots around a coarse
//! node are on different sides, no triangle lies between them: the mesh is open there, and the surface that closes it needs bricks too.

use std::collections::BTreeSet;

use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::{NO_BRICK, brick_counts};

/// The coarse grid's magnitudes and the sides of slots and nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct CoarseMap {
    pub(super) counts: [u32; 3],
    pub(super) magnitudes: Vec<f32>,
    pub(super) are_slots_inside: Vec<bool>,
    pub(super) are_nodes_inside: Option<Vec<bool>>,
}

impl CoarseMap {
    /// `None` unless there are as many slots and nodes as the lattice has.
    pub fn new(
        lattice: &Lattice,
        magnitudes: Vec<f32>,
        are_slots_inside: Vec<bool>,
        are_nodes_inside: Option<Vec<bool>>,
    ) -> Option<Self> {
        let counts = brick_counts(lattice);
        let count = |more: usize| counts.iter().try_fold(1, |n: usize, slots| n.checked_mul(*slots as usize + more));
        let fits = Some(magnitudes.len()) == count(1)
            && Some(are_slots_inside.len()) == count(0)
            && are_nodes_inside.as_ref().is_none_or(|nodes| nodes.len() == magnitudes.len());
        fits.then_some(Self { counts, magnitudes, are_slots_inside, are_nodes_inside })
    }

    /// Arguments of [`new`](Self::new): for each node, x fastest, the magnitude; for each slot, is its middle inside? For each node, is it
    /// inside? `None` where pseudo-normals give the sign.
    pub fn into_parts(self) -> (Vec<f32>, Vec<bool>, Option<Vec<bool>>) {
        (self.magnitudes, self.are_slots_inside, self.are_nodes_inside)
    }

    pub(super) fn index(&self, slot: [u32; 3]) -> usize {
        slot_index(self.counts, slot)
    }

    /// Index of the brick in each slot.
    pub(super) fn table(&self, slots: &[[u32; 3]]) -> Vec<u32> {
        let mut table = vec![NO_BRICK; self.are_slots_inside.len()];
        for (brick, slot) in (0..).zip(slots) {
            table[self.index(*slot)] = brick;
        }
        table
    }

    /// Slots around the coarse nodes where the sign may jump: there the slots that may be empty, and the node, are not all on one side.
    ///
    /// With `may_be_empty` true of the slots without a brick alone, these are the slots whose bricks close the mesh.
    pub(super) fn slots_at_sign_jumps(&self, may_be_empty: impl Fn(usize) -> bool + Sync) -> BTreeSet<usize> {
        let side = |slot: &usize| self.are_slots_inside[*slot];
        let jumps_at = |index: usize, node: [u32; 3]| {
            let node_side = self.are_nodes_inside.as_ref().map(|nodes| nodes[index]);
            // Most nodes are far from the surface.
            if are_all_equal(slots_around(self.counts, node).map(|slot| side(&slot)).chain(node_side)) {
                return Vec::new();
            }
            let around: Vec<usize> = slots_around(self.counts, node).filter(|slot| may_be_empty(*slot)).collect();
            if are_all_equal(around.iter().map(side).chain(node_side)) { Vec::new() } else { around }
        };
        map_coarse_nodes(self.counts, jumps_at).into_iter().flatten().collect()
    }

    /// Values of the coarse grid. The sign of a node is that of the slots around it without a brick.
    pub(super) fn into_values(self, table: &[u32]) -> Vec<f32> {
        let Self { counts, magnitudes, are_slots_inside, .. } = self;
        map_coarse_nodes(counts, |index, node| {
            let without_brick = slots_around(counts, node).find(|slot| table[*slot] == NO_BRICK);
            let signed = |slot: usize| if are_slots_inside[slot] { -magnitudes[index] } else { magnitudes[index] };
            without_brick.map_or(0.0, signed)
        })
    }
}

fn are_all_equal(mut sides: impl Iterator<Item = bool>) -> bool {
    let first = sides.next();
    sides.all(|side| Some(side) == first)
}

pub(super) fn slot_index([row, rows, _]: [u32; 3], [x, y, z]: [u32; 3]) -> usize {
    (z as usize * rows as usize + y as usize) * row as usize + x as usize
}

/// Indices of the slots around a coarse node, at most eight.
pub(super) fn slots_around(counts: [u32; 3], node: [u32; 3]) -> impl Iterator<Item = usize> {
    (0..8_u32).filter_map(move |corner| {
        let slot: [Option<u32>; 3] = std::array::from_fn(|axis| {
            let slot = node[axis].checked_sub(corner >> axis & 1)?;
            (slot < counts[axis]).then_some(slot)
        });
        let [Some(x), Some(y), Some(z)] = slot else { return None };
        Some(slot_index(counts, [x, y, z]))
    })
}

/// The results of `map` for all nodes of the coarse grid with their indices, x fastest: one more along each axis than there are slots.
pub(super) fn map_coarse_nodes<T: Send>(counts: [u32; 3], map: impl Fn(usize, [u32; 3]) -> T + Sync) -> Vec<T> {
    let [row, rows, layers] = counts.map(|n| n as usize + 1);
    let node = move |index: usize| [index % row, index / row % rows, index / row / rows].map(|n| n as u32);
    sdf_parallel::map(row * rows * layers, |index| map(index, node(index)))
}
