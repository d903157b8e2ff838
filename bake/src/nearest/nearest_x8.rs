use crate::bvh::PacketTree;
use crate::nearest::NearestToNode;
use crate::simd::{LANES, Lanes, VectorX8};
use crate::triangle::nearest::distances_sq;

/// Nearest triangles of eight points, so far.
pub(super) struct NearestX8 {
    slots: Lanes<u32>,
    distances_sq: Lanes<f64>,
}

impl NearestX8 {
    #[inline(always)]
    pub fn new(tree: PacketTree, points: &VectorX8<f64>, slot: u32) -> Self {
        Self { slots: [slot; LANES], distances_sq: distances_to_slot_sq(tree, points, slot) }
    }

    /// Takes a triangle where it is nearer, or equally near and of a lower slot.
    #[inline(always)]
    pub fn update(&mut self, tree: PacketTree, points: &VectorX8<f64>, slot: u32) {
        let found_sq = distances_to_slot_sq(tree, points, slot);
        for lane in 0..LANES {
            let (best, best_sq) = (self.slots[lane], self.distances_sq[lane]);
            let is_tied = (found_sq[lane] == best_sq) & (slot < best);
            let is_nearer = (found_sq[lane] < best_sq) | is_tied;
            self.distances_sq[lane] = if is_nearer { found_sq[lane] } else { best_sq };
            self.slots[lane] = if is_nearer { slot } else { best };
        }
    }

    #[inline(always)]
    pub fn lane(&self, lane: usize) -> NearestToNode {
        NearestToNode { slot: Some(self.slots[lane]), distance_sq: self.distances_sq[lane] }
    }
}

#[inline(always)]
fn distances_to_slot_sq(tree: PacketTree, points: &VectorX8<f64>, slot: u32) -> Lanes<f64> {
    let slot = slot as usize;
    distances_sq(points, &tree.corners[slot], tree.approx[slot].is_sliver)
}
