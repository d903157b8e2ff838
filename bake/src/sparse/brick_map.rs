//! Map of all brick slots, before any brick is computed: which may need one, and the coarse grid.
//!
//! | how | file |
//! |---|---|
//! | triangles mark the slots that they come near, and far slots have a distance transform | `marked`, `surface`, `transform`; sides: `solid`, `winding` |
//! | where they cannot, the distance at the middle of each slot is measured | `middles` |
//!
//! The coarse grid's magnitude at a node inside is max(d, W), d its distance: the depth of a contact is a distance, up to
//! interpolation. Outside, where culls need a lower bound, it is a lower bound of the distance in the slots around the
//! node, or
//!
//! ```text
//! T(d) = W + (d − K) / 16,   d a lower bound of the node's distance.
//! ```
//!
//! At a node without a brick both interpolate to at most its distance: the first by the slot's bound, the second as
//! shown at [`BrickMap::tilted`]. The slope of T gives descent methods a direction outside the band.

mod marked;
mod middles;
mod solid;
mod surface;
mod transform;
mod winding;

use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::BRICK;
use sdf_core::nalgebra::Vector3;

use super::coarse_map::{CoarseMap, map_coarse_nodes, slots_around};
use super::splat::frame::PlaneFrame;
use crate::MeshDistance;
use crate::rounding::COARSE_DISTANCE_ROUNDING;
use crate::sign::flood_fill::{Seed, Winding};

/// Minimum slope of the coarse grid away from the surface. A greater one keeps more bricks: a sixteenth costs 0.87
/// voxels around the band.
const MIN_COARSE_SLOPE: f64 = 1.0 / 16.0;

/// Bytes for each slot at the peak of a map that pseudo-normals sign: marks, distances of slots and nodes by the transform, nodes, their
/// magnitudes and sides.
pub const STREAMED_SLOT_BYTES: usize = 40;

/// Brick slots, x fastest, and nodes of the coarse grid, one more along each axis.
pub(super) struct BrickMap {
    counts: [u32; 3],
    /// For each slot: can a node of it be within K?
    may_need_brick: Vec<bool>,
    /// Signed distance at the middle of each slot: exact where a brick may be needed, elsewhere perhaps a lower bound. Of a
    /// solid 0 where a brick may be needed, infinite elsewhere.
    distances: Vec<f32>,
    /// Magnitude of the coarse grid at each node.
    magnitudes: Vec<f32>,
    /// For each node of the coarse grid: is it inside? False of nodes around which all slots have bricks, where it is not
    /// asked for.
    are_nodes_inside: Vec<bool>,
    /// `Some` if winding numbers give the sign.
    windings: Option<Windings>,
    /// Do pseudo-normals sign a marked map (`solid`)?
    is_solid: bool,
    spacing: f64,
    band: f64,
}

/// Winding numbers at the middles of slots and at the nodes of the coarse grid.
struct Windings {
    middles: Vec<Winding>,
    nodes: Vec<Winding>,
    /// Signed distance at each node, or a lower bound of its magnitude.
    node_distances: Vec<f32>,
}

impl BrickMap {
    /// `frames` are those of all triangles, if signs can be carried along clear edges.
    pub fn new(mesh: &MeshDistance, lattice: &Lattice, band: f64, frames: &[PlaneFrame]) -> Self {
        let Some((map, marked)) = Self::marked(mesh, lattice, band, frames) else {
            return Self::by_middles(mesh, lattice, band);
        };
        if mesh.solid_normals().is_some() {
            map.with_sides_of_solid(&marked)
        } else {
            map.with_sides_of_windings(&marked)
        }
    }

    /// A map of which nothing is known yet.
    fn empty(counts: [u32; 3], spacing: f64, band: f64) -> Self {
        Self {
            counts,
            may_need_brick: vec![],
            distances: vec![],
            magnitudes: vec![],
            are_nodes_inside: vec![],
            windings: None,
            is_solid: false,
            spacing,
            band,
        }
    }

    /// Magnitude of a coarse node inside: its distance. W takes the place of a lesser one, so that no value without a
    /// brick is below those at the band's end.
    fn inside_magnitude(&self, distance: f32) -> f32 {
        distance.max(self.exact_within() as f32)
    }

    /// Magnitude of a coarse node outside at a distance from the surface, with which it grows. Rounded down.
    fn magnitude(&self, node: [u32; 3], distance: f32) -> f32 {
        let lower = self.slots_around(node).map(|index| self.lower_bound(index)).fold(f64::INFINITY, f64::min);
        let tilted = self.tilted(f64::from(distance) * (1.0 - COARSE_DISTANCE_ROUNDING));
        (lower.max(tilted) * (1.0 - COARSE_DISTANCE_ROUNDING)) as f32
    }

    pub fn slot_count(&self) -> usize {
        self.distances.len()
    }

    /// Memory of the map, of a table and a list of slots, and of a coarse grid.
    pub fn bytes(&self) -> usize {
        self.winding_bytes()
            + self.distances.len() * size_of::<(f32, u32, usize)>()
            + self.magnitudes.len() * size_of::<([f32; 3], bool)>()
    }

    /// Peak memory of the map, and what is left of it and a table when bricks are joined.
    pub fn streamed_bytes(&self) -> usize {
        self.winding_bytes() + self.magnitudes.len() * STREAMED_SLOT_BYTES
    }

    fn winding_bytes(&self) -> usize {
        self.windings.as_ref().map_or(0, |windings| {
            (windings.middles.len() + windings.nodes.len()) * size_of::<Winding>()
                + size_of_val(&windings.node_distances[..])
        })
    }

    pub fn band(&self) -> f64 {
        self.band
    }

    pub fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        (z as usize * self.counts[1] as usize + y as usize) * self.counts[0] as usize + x as usize
    }

    pub fn slot(&self, index: usize) -> [u32; 3] {
        let [row, rows, _] = self.counts.map(|n| n as usize);
        [index % row, index / row % rows, index / row / rows].map(|n| n as u32)
    }

    /// R: distance from the middle of a slot to its corners.
    fn half_diagonal(&self) -> f64 {
        0.5 * f64::from(BRICK) * 3.0_f64.sqrt() * self.spacing
    }

    /// W: nodes within this of the surface hold their exact distances. They include all corners of cells that the band
    /// enters.
    pub fn exact_within(&self) -> f64 {
        exact_within(self.band, self.spacing)
    }

    /// K: a node within this of the surface has a brick. The excess over W is what [`Self::tilted`] can be too great
    /// by.
    pub fn kept_within(&self) -> f64 {
        self.exact_within() + MIN_COARSE_SLOPE * 2.0 * self.half_diagonal()
    }

    /// T(d) = W + s (d − K), with s = [`MIN_COARSE_SLOPE`].
    ///
    /// A node without a brick is at a distance d ≥ K, and the corners of its slot are at most 2R farther. So T
    /// interpolates there to at most W + s (d + 2R − K) = d − (1 − s) (d − K) ≤ d, as K = W + 2 s R.
    fn tilted(&self, distance: f64) -> f64 {
        self.exact_within() + MIN_COARSE_SLOPE * (distance - self.kept_within())
    }

    /// Can a node of the slot be within K?
    pub fn may_need_brick(&self, index: usize) -> bool {
        self.may_need_brick[index]
    }

    /// Can all nodes of the slot be beyond K? Its middle is one of them.
    pub fn may_have_no_brick(&self, index: usize) -> bool {
        f64::from(self.distances[index].abs()) * (1.0 + COARSE_DISTANCE_ROUNDING) >= self.kept_within()
    }

    /// max(D − R, W): lower bound of the distance at the nodes of a slot without a brick.
    fn lower_bound(&self, index: usize) -> f64 {
        (f64::from(self.distances[index].abs()) * (1.0 - COARSE_DISTANCE_ROUNDING) - self.half_diagonal())
            .max(self.exact_within())
    }

    /// Upper bound of the number of bricks: slots near the surface, and slots that may have to close a mesh.
    pub fn max_bricks(&self) -> usize {
        let may_have_no_brick = |index: usize| self.may_have_no_brick(index);
        let may_be_at_jump = |index: usize| {
            let slot = self.slot(index);
            let nodes = (0..8_u32).map(|corner| std::array::from_fn(|axis| slot[axis] + (corner >> axis & 1)));
            let is_inside = self.is_inside(index);
            nodes
                .flat_map(|node| self.slots_around(node))
                .any(|other| self.is_inside(other) != is_inside && may_have_no_brick(other))
                || self.windings.as_ref().is_some_and(|windings| {
                    let mut nodes = (0..8_u32).map(|corner| corner_node(self.counts, slot, corner));
                    may_have_no_brick(index) && nodes.any(|node| windings.is_node_inside(node) != is_inside)
                })
        };
        let may_have = |index: &usize| self.may_need_brick(*index) || !self.is_solid && may_be_at_jump(*index);
        sdf_parallel::map_chunks(self.slot_count(), |slots| slots.filter(may_have).count()).into_iter().sum()
    }

    fn slots_around(&self, node: [u32; 3]) -> impl Iterator<Item = usize> + '_ {
        slots_around(self.counts, node)
    }

    fn map_coarse_nodes<T: Send>(&self, map: impl Fn([u32; 3]) -> T + Sync) -> Vec<T> {
        map_coarse_nodes(self.counts, |_, node| map(node))
    }

    /// The coarse grid and the sides, which outlive the map.
    pub fn coarse_map(&self) -> CoarseMap {
        let is_slot_inside = |index: usize| {
            if self.is_solid {
                // Of a slot without a brick: the segment from a corner to its nearest node is clear.
                self.are_nodes_inside[corner_node(self.counts, self.slot(index), 0)]
            } else {
                self.is_inside(index)
            }
        };
        CoarseMap {
            counts: self.counts,
            magnitudes: self.magnitudes.clone(),
            are_slots_inside: (0..self.slot_count()).map(is_slot_inside).collect(),
            are_nodes_inside: self
                .windings
                .as_ref()
                .map(|windings| windings.nodes.iter().map(|node| node.is_inside()).collect()),
        }
    }

    /// Magnitudes of the coarse grid at the corners of a slot, x fastest.
    pub fn corner_magnitudes(&self, slot: [u32; 3]) -> [f64; 8] {
        std::array::from_fn(|corner| f64::from(self.magnitudes[corner_node(self.counts, slot, corner as u32)]))
    }

    /// Are the middle of a slot and its corners all inside, or all outside?
    pub fn is_on_one_side(&self, slot: [u32; 3]) -> bool {
        let is_inside = self.is_inside(self.index(slot));
        (0..8).all(|corner| self.are_nodes_inside[corner_node(self.counts, slot, corner)] == is_inside)
    }

    /// Distance at the middle of a slot.
    pub fn middle_distance(&self, slot: [u32; 3]) -> f64 {
        self.distances[self.index(slot)].abs().into()
    }

    /// Points with known winding numbers around a slot: its middle and its corners.
    pub fn seeds(&self, lattice: &Lattice, slot: [u32; 3]) -> Vec<Seed> {
        let Some(windings) = &self.windings else { return vec![] };
        let index = self.index(slot);
        let middle = Seed {
            node: [BRICK as usize / 2; 3],
            position: middle(lattice, slot.map(|n| n as usize)),
            length: 0.0,
            distance: self.distances[index].abs(),
            winding: windings.middles[index],
        };
        let at_corner = |corner: u32| {
            // The slot's last node is one before the next slot's first, where the corner is.
            let steps: [usize; 3] = std::array::from_fn(|axis| (corner >> axis & 1) as usize);
            let node = corner_node(self.counts, slot, corner);
            Seed {
                node: steps.map(|step| step * (BRICK as usize - 1)),
                position: lattice.node(std::array::from_fn(|axis| (slot[axis] + steps[axis] as u32) * BRICK)).into(),
                length: (steps.iter().sum::<usize>() as f64).sqrt(),
                distance: windings.node_distances[node].abs(),
                winding: windings.nodes[node],
            }
        };
        [middle].into_iter().chain((0..8).map(at_corner)).collect()
    }

    fn is_inside(&self, index: usize) -> bool {
        self.distances[index].is_sign_negative()
    }
}

impl Windings {
    fn is_node_inside(&self, node: usize) -> bool {
        self.nodes[node].is_inside()
    }
}

/// W of a band in a grid of this spacing: see [`BrickMap::exact_within`].
pub(super) fn exact_within(band: f64, spacing: f64) -> f64 {
    band + 3.0_f64.sqrt() * spacing
}

/// Middle of a slot: of the cells whose first corners it contains.
pub(super) fn middle(lattice: &Lattice, slot: [usize; 3]) -> Vector3<f64> {
    let steps = |axis: usize| f64::from(BRICK) * (slot[axis] as f64 + 0.5);
    Vector3::from_fn(|axis, _| lattice.origin()[axis] + lattice.spacing() * steps(axis))
}

/// Index of the coarse node at a corner of a slot.
fn corner_node(counts: [u32; 3], slot: [u32; 3], corner: u32) -> usize {
    let [row, rows, _] = counts.map(|n| n as usize + 1);
    let [x, y, z]: [usize; 3] = std::array::from_fn(|axis| (slot[axis] + (corner >> axis & 1)) as usize);
    (z * rows + y) * row + x
}

#[cfg(test)]
mod tests;
