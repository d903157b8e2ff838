//! Nearest triangles of packets of 8 × 8 × 8 grid nodes, with the bits of [`Bvh::nearest`] for each.
//!
//! All nodes of a packet share one descent of the tree. A packet has eight octants of 4³ nodes, each of eight
//! suboctants of 2³ nodes. A cube passes on to its parts only the candidates that can be nearest in them:
//!
//! | step | question | file |
//! |---|---|---|
//! | 1 | Where do the nodes stand, and does the surface come near them at all? | `nodes`, this file |
//! | 2 | Which nodes of the tree can hold the nearest to one of 8³ nodes? | `bvh/prune` |
//! | 3 | In which octants? Each one expands its own candidates | `descent`, `octant_cull` (f32, eight octants side by side) |
//! | 4 | Which triangles can be nearest in which suboctant, and to which of its nodes? | `prefilter` (f32), or more of step 3 |
//! | 5 | Exact distances of the survivors to 2³ nodes, side by side | `nearest_x8`, `triangle/nearest` (f64) |
//!
//! The steps in f32 are conservative: rounding only lets more candidates through (`rounding`).

mod descent;
mod nearest_x8;
mod nodes;
pub mod octant_cull;
mod octants;
mod prefilter;

use crate::bvh::{Bvh, MAX_EXPANDED, NearestTriangle, PacketTree};
use crate::simd::{LANES, LaneLists};
pub(crate) use nodes::{NODES, PacketNodes, SIDE, packet_rows};
use octants::corner;
use prefilter::Prefilter;

/// Searches packets, and keeps the nearest triangle of each node of the last one.
pub(crate) struct PacketSearch<'a> {
    tree: PacketTree<'a>,
    /// Results, x fastest. Entries of nodes outside the packet's counts are meaningless.
    nearest: Vec<NearestToNode>,
    /// Slot of the triangle nearest to the center of the last packet.
    guess: usize,
    last: Option<PacketNodes>,
    /// [`MAX_EXPANDED`], but for tests.
    max_expanded: usize,
    // Scratch buffers.
    candidates: Vec<u32>,
    expanded: Vec<u32>,
    octant_lists: LaneLists,
    suboctant_lists: LaneLists,
    prefilter: Prefilter,
}

/// Nearest triangle of one node.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NearestToNode {
    /// `None` if the node is farther than was searched: then `distance_sq` is a lower bound.
    pub slot: Option<u32>,
    pub distance_sq: f64,
}

impl<'a> PacketSearch<'a> {
    pub fn new(tree: &'a Bvh) -> Self {
        Self {
            tree: tree.prepare_packets(),
            nearest: vec![NearestToNode::default(); NODES],
            guess: 0,
            last: None,
            max_expanded: MAX_EXPANDED,
            candidates: vec![],
            expanded: vec![],
            octant_lists: LaneLists::new(),
            suboctant_lists: LaneLists::new(),
            prefilter: Prefilter::new(),
        }
    }

    /// Finds the nearest triangle of each node whose distance is at most `max_distance`; farther nodes get theirs or a
    /// lower bound. Returns false, and finds nothing, if no node is within `required` of the mesh.
    pub fn find(&mut self, nodes: &PacketNodes, required: f64, max_distance: f64) -> bool {
        let center = nodes.center([0; 3], SIDE);
        let adjacent = self.last.and_then(|last| self.nearest(last.step_near(center)).slot);
        let nearest = self.tree.nearest(center, adjacent.map_or(self.guess, |slot| slot as usize));
        self.guess = nearest.slot;
        if self.is_beyond(nodes, nearest, required) {
            return false;
        }
        self.descend(nodes, nearest.on_triangle.point, max_distance);
        self.last = Some(*nodes);
        true
    }

    /// Is no node within `required` of the mesh? Nodes outside the packet's counts are tested as well.
    fn is_beyond(&self, nodes: &PacketNodes, nearest: NearestTriangle, required: f64) -> bool {
        let is_within = |distance_sq: f64, first, side| distance_sq.sqrt() <= required + nodes.radius(first, side);
        let is_octant_within = |octant: usize| {
            let first = corner(octant).map(|side| side * SIDE / 2);
            let nearest = self.tree.nearest(nodes.center(first, SIDE / 2), nearest.slot);
            is_within(nearest.on_triangle.distance_sq, first, SIDE / 2)
        };
        let distance_sq = nearest.on_triangle.distance_sq;
        let is_any_within =
            distance_sq.sqrt() <= required || is_within(distance_sq, [0; 3], SIDE) && (0..LANES).any(is_octant_within);
        !is_any_within
    }

    /// Result for a node of the last packet.
    pub fn nearest(&self, [x, y, z]: [usize; 3]) -> NearestToNode {
        self.nearest[(z * SIDE + y) * SIDE + x]
    }

    /// Slot of a triangle near the last packet.
    pub fn guess(&self) -> usize {
        self.guess
    }
}

#[cfg(test)]
pub(crate) mod tests;
