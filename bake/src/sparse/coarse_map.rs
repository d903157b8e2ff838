//! The coarse grid and the sides of slots, which are known before any brick: what of a [`BrickMap`](super::brick_map::BrickMap) the
//! bricks need once they are baked.
//!
//! A slot without a brick is on one side of the surface, and so is the coarse grid around it. Where two such slots around a coarse
//! node are on different sides, no triangle lies between them: the mesh is open there, and the surface that closes it needs bricks too.

use std::collections::BTreeSet;

use sdf_core::grid::Lattice;
use sdf_core::grid::owned::Blocks;
use sdf_core::grid::sparse::{NO_BRICK, brick_counts};

/// The coarse grid and the sides of slots.
#[derive(Clone, Debug, PartialEq)]
pub struct CoarseMap {
    pub(super) counts: [u32; 3],
    /// Magnitudes of nodes, x fastest, negative of nodes inside.
    pub(super) nodes: Vec<f32>,
    pub(super) sides: SlotSides,
}

/// Which slots are inside? Of those without a brick.
#[derive(Clone, Debug, PartialEq)]
pub enum SlotSides {
    /// Slots whose first node of the coarse grid is: the way from there to the slot's nodes is clear.
    FirstNodes,
    /// For each slot, x fastest: is its middle? Signs of nodes do not matter.
    Own(Vec<bool>),
    /// For each slot, x fastest: is its middle? A node on another side is at a jump of the sign too.
    WithNodes(Vec<bool>),
}

impl CoarseMap {
    /// `nodes`: see [`into_parts`](Self::into_parts). `None` unless there are as many slots and nodes as the lattice has.
    pub fn new(lattice: &Lattice, nodes: Vec<f32>, sides: SlotSides) -> Option<Self> {
        let counts = brick_counts(lattice);
        let count = |more: usize| counts.iter().try_fold(1, |n: usize, slots| n.checked_mul(*slots as usize + more));
        let fits = match &sides {
            SlotSides::FirstNodes => true,
            SlotSides::Own(slots) | SlotSides::WithNodes(slots) => Some(slots.len()) == count(0),
        };
        (fits && Some(nodes.len()) == count(1)).then_some(Self { counts, nodes, sides })
    }

    /// Magnitudes of nodes, x fastest, negative of nodes inside; and the sides of slots.
    pub fn into_parts(self) -> (Vec<f32>, SlotSides) {
        (self.nodes, self.sides)
    }

    pub(super) fn index(&self, slot: [u32; 3]) -> usize {
        slot_index(self.counts, slot)
    }

    /// Is a slot without a brick inside?
    fn is_slot_inside(&self, slot: [u32; 3]) -> bool {
        match &self.sides {
            SlotSides::FirstNodes => self.nodes[corner_node(self.counts, slot, 0)].is_sign_negative(),
            SlotSides::Own(slots) | SlotSides::WithNodes(slots) => slots[self.index(slot)],
        }
    }

    /// Index of the brick in each slot.
    pub(super) fn table(&self, slots: &[[u32; 3]]) -> Blocks<u32> {
        let mut table =
            Blocks::new(self.counts, NO_BRICK).expect("a lattice has fewer blocks of slots than u32 counts");
        (0..).zip(slots).for_each(|(brick, slot)| table.set(*slot, brick));
        table
    }

    /// Slots around the coarse nodes where the sign may jump: there the slots that may be empty, and the node, are not all on one side.
    ///
    /// With `may_be_empty` true of the slots without a brick alone, these are the slots whose bricks close the mesh.
    pub(super) fn slots_at_sign_jumps(&self, may_be_empty: impl Fn([u32; 3]) -> bool + Sync) -> BTreeSet<usize> {
        let side = |slot: &[u32; 3]| self.is_slot_inside(*slot);
        let jumps_at = |index: usize, node: [u32; 3]| {
            let has_side = matches!(self.sides, SlotSides::WithNodes(_));
            let node_side = has_side.then(|| self.nodes[index].is_sign_negative());
            // Most nodes are far from the surface.
            if self.is_amid_one_side(index, node) {
                return Vec::new();
            }
            let around: Vec<[u32; 3]> =
                slots_around_node(self.counts, node).filter(|slot| may_be_empty(*slot)).collect();
            if are_all_equal(around.iter().map(side).chain(node_side)) { Vec::new() } else { around }
        };
        let node = |index: usize| slot_at(self.counts.map(|n| n + 1), index);
        let jumps = sdf_parallel::map_chunks(self.nodes.len(), |nodes| {
            nodes.flat_map(|index| jumps_at(index, node(index))).map(|slot| self.index(slot)).collect::<Vec<_>>()
        });
        jumps.into_iter().flatten().collect()
    }

    /// Are a node and all eight slots around it on one side? False at the lattice's box.
    fn is_amid_one_side(&self, index: usize, node: [u32; 3]) -> bool {
        let all_equal = |side: bool, first: usize, more: usize, is_inside: &dyn Fn(usize) -> bool| {
            let [row, rows, _] = self.counts.map(|n| n as usize + more);
            let below = |corner: usize| (corner & 1) + row * (corner >> 1 & 1) + row * rows * (corner >> 2);
            (0..8).all(|corner| is_inside(first - below(corner)) == side)
        };
        if (0..3).any(|axis| node[axis] == 0 || node[axis] >= self.counts[axis]) {
            return false;
        }
        let node_side = self.nodes[index].is_sign_negative();
        match &self.sides {
            SlotSides::FirstNodes => all_equal(node_side, index, 1, &|node| self.nodes[node].is_sign_negative()),
            SlotSides::Own(slots) => all_equal(slots[self.index(node)], self.index(node), 0, &|slot| slots[slot]),
            SlotSides::WithNodes(slots) => all_equal(node_side, self.index(node), 0, &|slot| slots[slot]),
        }
    }

    /// Values of the coarse grid. The sign of a node is that of the slots around it without a brick.
    pub(super) fn into_values(mut self, table: &Blocks<u32>) -> Vec<f32> {
        let [row, rows, layers] = self.counts.map(|n| n + 1);
        let is_empty = |slot: &[u32; 3]| table.get(*slot) == Some(NO_BRICK);
        // Downward: slots ask for the sides of nodes that come before.
        for z in (0..layers).rev() {
            for y in (0..rows).rev() {
                for x in (0..row).rev() {
                    let without_brick = slots_around_node(self.counts, [x, y, z]).find(is_empty);
                    let is_inside = without_brick.map(|slot| self.is_slot_inside(slot));
                    let node = &mut self.nodes[corner_node(self.counts, [x, y, z], 0)];
                    *node = is_inside.map_or(0.0, |is_inside| with_side(node.abs(), is_inside));
                }
            }
        }
        self.nodes
    }
}

fn are_all_equal(mut sides: impl Iterator<Item = bool>) -> bool {
    let first = sides.next();
    sides.all(|side| Some(side) == first)
}

/// A magnitude with the sign of its side.
pub(super) fn with_side(magnitude: f32, is_inside: bool) -> f32 {
    if is_inside { -magnitude } else { magnitude }
}

/// Index of a slot or node among so many along each axis, x fastest.
pub(super) fn slot_index([row, rows, _]: [u32; 3], [x, y, z]: [u32; 3]) -> usize {
    (z as usize * rows as usize + y as usize) * row as usize + x as usize
}

/// The slot or node of an index: see [`slot_index`].
pub(crate) fn slot_at([row, rows, _]: [u32; 3], index: usize) -> [u32; 3] {
    let [row, rows] = [row as usize, rows as usize];
    [index % row, index / row % rows, index / row / rows].map(|n| n as u32)
}

/// Index of the coarse node at a corner of a slot.
pub(super) fn corner_node(counts: [u32; 3], slot: [u32; 3], corner: u32) -> usize {
    let [row, rows, _] = counts.map(|n| n as usize + 1);
    let [x, y, z]: [usize; 3] = std::array::from_fn(|axis| (slot[axis] + (corner >> axis & 1)) as usize);
    (z * rows + y) * row + x
}

/// The slots around a coarse node, at most eight; first the one that begins there.
fn slots_around_node(counts: [u32; 3], node: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    (0..8_u32).filter_map(move |corner| {
        let slot: [Option<u32>; 3] = std::array::from_fn(|axis| {
            let slot = node[axis].checked_sub(corner >> axis & 1)?;
            (slot < counts[axis]).then_some(slot)
        });
        let [Some(x), Some(y), Some(z)] = slot else { return None };
        Some([x, y, z])
    })
}

/// Indices of the slots around a coarse node, at most eight.
pub(super) fn slots_around(counts: [u32; 3], node: [u32; 3]) -> impl Iterator<Item = usize> {
    slots_around_node(counts, node).map(move |slot| slot_index(counts, slot))
}

/// The results of `map` for all nodes of the coarse grid with their indices, x fastest: one more along each axis than there are slots.
pub(super) fn map_coarse_nodes<T: Send>(counts: [u32; 3], map: impl Fn(usize, [u32; 3]) -> T + Sync) -> Vec<T> {
    let node_counts = counts.map(|n| n + 1);
    let count = node_counts.iter().map(|n| *n as usize).product();
    sdf_parallel::map(count, |index| map(index, slot_at(node_counts, index)))
}
