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

use super::coarse_map::{CoarseMap, SlotSides, corner_node, map_coarse_nodes, slot_at, slot_index, slots_around};
use super::slot_bits::SlotBits;
use super::splat::frame::PlaneFrames;
use crate::rounding::COARSE_DISTANCE_ROUNDING;
use crate::sign::flood_fill::{Seed, Winding};
use crate::{MeshDistance, SignMethod};

/// Minimum slope of the coarse grid away from the surface. A greater one keeps more bricks: a sixteenth costs 0.87
/// voxels around the band.
const MIN_COARSE_SLOPE: f64 = 1.0 / 16.0;

/// Bytes for each slot at the peak of a streamed bake of a closed mesh whose faces have known sides: a node of the coarse grid,
/// and marks in bits.
const SOLID_SLOT_BYTES: usize = 5;

/// The same of other meshes that pseudo-normals sign: marks, distances, nodes, their magnitudes and sides.
const SLOT_BYTES: usize = 40;

/// The same while winding numbers sign what is known of slots and nodes.
const WINDING_SLOT_BYTES: usize = 72;

/// Bytes for each slot of the lattice at the peak of a streamed bake. The lattice holds the whole mesh.
pub fn streamed_slot_bytes(mesh: &MeshDistance) -> usize {
    match mesh.sign_method() {
        _ if mesh.outward().is_some() => SOLID_SLOT_BYTES,
        SignMethod::Winding => WINDING_SLOT_BYTES,
        SignMethod::PseudoNormal => SLOT_BYTES,
    }
}

/// Brick slots, x fastest, and nodes of the coarse grid, one more along each axis.
pub(super) struct BrickMap {
    /// The coarse grid, and the sides.
    coarse: CoarseMap,
    /// The slots of which a node can be within K.
    near: SlotBits,
    /// Signed distance at the middle of each slot: exact where a brick may be needed, elsewhere perhaps a lower bound. Empty of a
    /// solid.
    distances: Vec<f32>,
    /// `Some` if winding numbers give the sign.
    windings: Option<Windings>,
    /// Do faces with known sides sign a marked map (`solid`)?
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
    /// `frames` are those of the triangles, if signs can be carried along clear edges.
    pub fn new(mesh: &MeshDistance, lattice: &Lattice, band: f64, frames: Option<&PlaneFrames>) -> Self {
        let Some((map, marked)) = Self::marked(mesh, lattice, band, frames) else {
            return Self::by_middles(mesh, lattice, band).with_slot_sides();
        };
        if mesh.outward().is_some() {
            map.with_sides_of_solid(marked)
        } else {
            map.with_sides_of_windings(marked).with_slot_sides()
        }
    }

    /// A map of which nothing is known yet.
    fn empty(counts: [u32; 3], spacing: f64, band: f64) -> Self {
        let coarse = CoarseMap { counts, nodes: vec![], sides: SlotSides::FirstNodes };
        let (near, distances) = (SlotBits::new(0), vec![]);
        Self { coarse, near, distances, windings: None, is_solid: false, spacing, band }
    }

    /// Fills in the sides of slots that have distances at their middles.
    fn with_slot_sides(mut self) -> Self {
        let are_inside = self.distances.iter().map(|distance| distance.is_sign_negative()).collect();
        let is_winding = self.windings.is_some();
        self.coarse.sides = if is_winding { SlotSides::WithNodes(are_inside) } else { SlotSides::Own(are_inside) };
        self
    }

    /// Slots along each axis.
    fn counts(&self) -> [u32; 3] {
        self.coarse.counts
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
        self.near.len()
    }

    /// Memory of the map, of a table and a list of slots, and of a coarse grid.
    pub fn bytes(&self) -> usize {
        self.winding_bytes()
            + self.slot_count() * size_of::<(f32, u32, usize)>()
            + self.coarse.nodes.len() * size_of::<([f32; 3], bool)>()
    }

    /// Peak memory of the map, and of what is left of it beside so many bytes for bricks.
    pub fn streamed_bytes(&self, bricks: usize) -> usize {
        let nodes = self.coarse.nodes.len();
        if self.is_solid {
            // Marks are gone before there are bricks.
            let marks = nodes * (SOLID_SLOT_BYTES - size_of::<f32>());
            return (nodes * size_of::<f32>()).saturating_add(bricks.max(marks));
        }
        (self.winding_bytes() + nodes * SLOT_BYTES).saturating_add(bricks)
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
        slot_index(self.counts(), [x, y, z])
    }

    pub fn slot(&self, index: usize) -> [u32; 3] {
        slot_at(self.counts(), index)
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
        self.near.contains(index)
    }

    /// Can all nodes of the slot be beyond K? Its middle is one of them.
    pub fn may_have_no_brick(&self, index: usize) -> bool {
        f64::from(self.distance(index)) * (1.0 + COARSE_DISTANCE_ROUNDING) >= self.kept_within()
    }

    /// Distance at the middle of a slot, without a sign. Of a solid 0 where a brick may be needed, infinite elsewhere.
    fn distance(&self, index: usize) -> f32 {
        match (self.is_solid, self.may_need_brick(index)) {
            (false, _) => self.distances[index].abs(),
            (true, true) => 0.0,
            (true, false) => f32::INFINITY,
        }
    }

    /// max(D − R, W): lower bound of the distance at the nodes of a slot without a brick.
    fn lower_bound(&self, index: usize) -> f64 {
        (f64::from(self.distance(index)) * (1.0 - COARSE_DISTANCE_ROUNDING) - self.half_diagonal())
            .max(self.exact_within())
    }

    /// Upper bound of the number of bricks: slots near the surface, and slots that may have to close a mesh.
    pub fn max_bricks(&self) -> usize {
        if self.is_solid {
            return self.near.count();
        }
        let at_jumps = self.coarse.slots_at_sign_jumps(|slot| self.may_have_no_brick(self.index(slot)));
        self.near.count() + at_jumps.into_iter().filter(|index| !self.may_need_brick(*index)).count()
    }

    fn slots_around(&self, node: [u32; 3]) -> impl Iterator<Item = usize> + '_ {
        slots_around(self.counts(), node)
    }

    fn map_coarse_nodes<T: Send>(&self, map: impl Fn([u32; 3]) -> T + Sync) -> Vec<T> {
        map_coarse_nodes(self.counts(), |_, node| map(node))
    }

    /// The coarse grid and the sides.
    pub fn coarse(&self) -> &CoarseMap {
        &self.coarse
    }

    /// The coarse grid and the sides, which outlive the map.
    pub fn into_coarse(self) -> CoarseMap {
        self.coarse
    }

    /// Magnitudes of the coarse grid at the corners of a slot, x fastest.
    pub fn corner_magnitudes(&self, slot: [u32; 3]) -> [f64; 8] {
        std::array::from_fn(|corner| {
            f64::from(self.coarse.nodes[corner_node(self.counts(), slot, corner as u32)].abs())
        })
    }

    /// Are the middle of a slot and its corners all inside, or all outside?
    pub fn is_on_one_side(&self, slot: [u32; 3]) -> bool {
        let is_inside = self.is_inside(self.index(slot));
        (0..8).all(|corner| self.is_node_inside(corner_node(self.counts(), slot, corner)) == is_inside)
    }

    /// Distance at the middle of a slot.
    pub fn middle_distance(&self, slot: [u32; 3]) -> f64 {
        self.distance(self.index(slot)).into()
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
            let node = corner_node(self.counts(), slot, corner);
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

    /// Is the middle of a slot inside? False of a solid.
    fn is_inside(&self, index: usize) -> bool {
        !self.is_solid && self.distances[index].is_sign_negative()
    }

    /// Is a node of the coarse grid inside? False of nodes around which all slots have bricks, where it is not asked for.
    fn is_node_inside(&self, index: usize) -> bool {
        self.coarse.nodes[index].is_sign_negative()
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

#[cfg(test)]
mod tests;
