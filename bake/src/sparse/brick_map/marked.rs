//! Map of a mesh whose triangles mark the slots that they come near (`surface`): what is far is known from a distance transform
//! of the crossed slots (`transform`).
//!
//! Let L(s) ≥ 0 be the distance of slot s from the slots that the surface crosses, e(c) that of a node c of the coarse grid,
//! and m(c) the least L of the slots around it, in voxels. A slot is deep if m ≥ max(8, W) at all of its corners. Outside, the
//! magnitude of c is
//!
//! ```text
//! e(c) − 24 / m(c)               where all slots around c are deep,
//! max(m(c), W, T(e(c)))          where some are,
//! max(m(c), W, T(d(c)))          where none is: there d(c) is searched, up to a tolerance.
//! ```
//!
//! Then magnitudes are lowered until they differ by no more than the way between neighbours. No node of a slot without a
//! brick gets more than its distance (docs/error-bounds.md, "The coarse grid outside"). Inside, the magnitude of c is
//! its distance, searched up to the tolerance.
//!
//! | who gives the sides | file |
//! |---|---|
//! | faces with known sides: slots that are not near are on one side with their neighbours | `solid` |
//! | winding numbers, flooded from middle to middle and from node to node | `winding` |

use std::ops::Range;

use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::{BRICK, brick_counts};
use sdf_core::nalgebra::Vector3;

use super::surface::{MAX_LISTED, SurfaceSlots};
use super::transform::{From, distances, limit_signed_steps, limit_steps};
use super::{BrickMap, corner_node};
use crate::MeshDistance;
use crate::rounding::COARSE_DISTANCE_ROUNDING;
use crate::sparse::coarse_map::{slot_at, with_side};
use crate::sparse::slot_bits::SlotBits;
use crate::sparse::splat::frame::PlaneFrames;

/// Nodes within this of the surface are near whatever the band, in voxels: beyond it the segment between the middles of
/// neighbouring slots, 8 long, meets no triangle.
const MIN_REACH: f64 = 4.5;

/// Error of distances that are searched at nodes of the coarse grid, in voxels: they are greater by no more than this.
const TOLERANCE: f64 = 1.0;

/// Nodes nearer to the surface than this, in voxels, have exact distances.
const NEAR: f64 = 8.0;

/// Marked slots, and how far the others are from the surface.
pub(super) struct Marked<'a> {
    pub mesh: &'a MeshDistance<'a>,
    pub lattice: &'a Lattice,
    slots: SurfaceSlots,
    /// Distance from the surface of the nodes of slots that are not near, in voxels.
    pub reach: f64,
    window: Window,
}

/// Distances known for some layers of nodes and for the slots around them.
#[derive(Default)]
struct Window {
    /// L of slots, in voxels, from a slot on.
    gaps: FromIndex<f32>,
    /// e of nodes, in voxels, from a node on.
    node_gaps: FromIndex<f32>,
    /// For slots from one on: are they deep?
    deep: FromIndex<bool>,
}

/// A part of a list: from an index on.
#[derive(Default)]
struct FromIndex<T> {
    first: usize,
    list: Vec<T>,
}

impl<T: Copy> FromIndex<T> {
    #[inline(always)]
    fn get(&self, index: usize) -> T {
        self.list[index - self.first]
    }
}

/// A node of the coarse grid, and what is known of the surface around it.
pub(super) struct MarkedNode {
    pub node: [u32; 3],
    pub position: Vector3<f64>,
    /// e and m, in voxels.
    pub gap: f32,
    least_gap: f32,
    /// Is some slot around the node deep? Are all?
    pub is_beside_deep: bool,
    is_deep: bool,
}

impl<'a> Marked<'a> {
    /// Triangles are listed for each of so many slots, see [`MAX_LISTED`].
    pub fn new(
        map: &BrickMap,
        mesh: &'a MeshDistance,
        lattice: &'a Lattice,
        frames: &PlaneFrames,
        max_listed: usize,
    ) -> Self {
        let reach = (map.kept_within() / map.spacing).max(MIN_REACH);
        let slots = SurfaceSlots::new(mesh, frames, lattice, map.counts(), reach, max_listed);
        Self { mesh, lattice, slots, reach, window: Window::default() }
    }

    /// The slots that may need bricks.
    pub fn into_near(self) -> SlotBits {
        self.slots.near
    }

    /// Makes what lies around some layers of nodes known; what was known of others no longer is.
    pub fn look_at(&mut self, map: &BrickMap, layers: Range<usize>) {
        let counts = map.counts().map(|n| n as usize);
        let slots = |below: usize, above: usize| layers.start.saturating_sub(below)..counts[2].min(layers.end + above);
        let distances = |from, layers: Range<usize>, layer: usize| {
            let first = layers.start * layer;
            if self.mesh.is_cancelled() {
                return FromIndex { first, list: vec![0.0; layers.len() * layer] };
            }
            let mut list = distances(self.mesh.tree().arch, &self.slots.crossed, counts, from, layers);
            list.iter_mut().for_each(|gap| *gap *= BRICK as f32);
            FromIndex { first, list }
        };
        let (layer, node_layer) = (counts[0] * counts[1], (counts[0] + 1) * (counts[1] + 1));
        // A slot is deep by the least gaps at its corners, and these by the slots around them.
        let (gaps, node_gaps) = sdf_parallel::join(
            || distances(From::Slots, slots(2, 1), layer),
            || distances(From::Corners, layers.clone(), node_layer),
        );
        self.window = Window { gaps, node_gaps, deep: FromIndex::default() };
        let deep = slots(1, 0);
        self.window.deep =
            FromIndex { first: deep.start * layer, list: self.deep_slots(map, deep.start * layer..deep.end * layer) };
    }

    /// Distance of the middle of each slot from the crossed slots, in voxels.
    pub fn middle_gaps(&self, map: &BrickMap) -> Vec<f32> {
        let counts = map.counts().map(|n| n as usize);
        let mut gaps = distances(self.mesh.tree().arch, &self.slots.crossed, counts, From::Middles, 0..counts[2]);
        gaps.iter_mut().for_each(|gap| *gap *= BRICK as f32);
        gaps
    }

    /// L of a slot, in voxels.
    pub fn gap(&self, slot: usize) -> f32 {
        self.window.gaps.get(slot)
    }

    /// May a node of the slot be within the reach of the surface?
    pub fn is_near(&self, slot: usize) -> bool {
        self.slots.near.contains(slot)
    }

    /// Distance of a point from one of the triangles that are near some slots, or from `guess`, which becomes that triangle.
    pub fn nearest_around(&self, slots: impl Iterator<Item = usize>, point: Vector3<f64>, guess: &mut usize) -> f64 {
        self.slots.nearest_around(self.mesh.tree(), slots, point, guess)
    }

    /// m(c), in voxels.
    fn least_gap(&self, map: &BrickMap, node: [u32; 3]) -> f32 {
        map.slots_around(node).map(|index| self.gap(index)).fold(f32::INFINITY, f32::min)
    }

    /// For each of some whole layers of slots: is it deep?
    fn deep_slots(&self, map: &BrickMap, slots: Range<usize>) -> Vec<bool> {
        let min_gap = (map.exact_within() / map.spacing).max(f64::from(BRICK)) as f32;
        let counts = map.counts();
        let [row, rows, _] = counts.map(|n| n as usize + 1);
        let first = map.slot(slots.start)[2] as usize * row * rows;
        let end = (map.slot(slots.end.saturating_sub(1))[2] as usize + 2) * row * rows;
        let node = |index: usize| slot_at(counts.map(|n| n + 1), index);
        let least = sdf_parallel::map(end - first, |index| self.least_gap(map, node(first + index)));
        let is_deep = |index: usize| {
            let slot = map.slot(slots.start + index);
            (0..8).all(|corner| least[corner_node(counts, slot, corner) - first] >= min_gap)
        };
        sdf_parallel::map(slots.len(), is_deep)
    }

    pub fn node(&self, map: &BrickMap, node: [u32; 3]) -> MarkedNode {
        MarkedNode {
            node,
            position: self.lattice.node(node.map(|n| n * BRICK)).into(),
            gap: self.window.node_gaps.get(corner_node(map.counts(), node, 0)),
            least_gap: self.least_gap(map, node),
            is_beside_deep: map.slots_around(node).any(|index| self.window.deep.get(index)),
            is_deep: map.slots_around(node).all(|index| self.window.deep.get(index)),
        }
    }

    /// Error of the distance of a node inside, a length: none at the corners of slots that may need a brick.
    pub fn tolerance_inside(&self, map: &BrickMap, node: &MarkedNode) -> f64 {
        let is_corner = map.slots_around(node.node).any(|slot| self.is_near(slot));
        if is_corner { 0.0 } else { TOLERANCE * map.spacing }
    }

    /// Error of the distance of a node that is not known to be inside, a length, from an upper bound of its distance.
    pub fn tolerance_outside(&self, map: &BrickMap, upper: f64) -> f64 {
        if upper > NEAR * map.spacing { TOLERANCE * map.spacing } else { 0.0 }
    }

    /// Magnitude of a node outside. `lower` is a lower bound of its distance; without one, e is taken.
    pub fn outside_magnitude(&self, map: &BrickMap, node: &MarkedNode, lower: f64) -> f32 {
        let (gap, least) = (f64::from(node.gap), f64::from(node.least_gap));
        let magnitude = if node.is_deep {
            map.spacing * (gap - 24.0 / least)
        } else {
            let lower = if node.is_beside_deep { 0.0 } else { lower };
            let tilted = map.tilted(lower.max(gap * map.spacing) * (1.0 - COARSE_DISTANCE_ROUNDING));
            (least * map.spacing).max(map.exact_within()).max(tilted)
        };
        (magnitude * (1.0 - COARSE_DISTANCE_ROUNDING)) as f32
    }
}

impl BrickMap {
    /// A map that is to be filled, with slots that may need bricks marked. `None` if triangles cannot mark all slots: without
    /// frames, and where the lattice does not hold the whole mesh.
    pub(super) fn marked<'a>(
        mesh: &'a MeshDistance,
        lattice: &'a Lattice,
        band: f64,
        frames: Option<&PlaneFrames>,
    ) -> Option<(Self, Marked<'a>)> {
        let (outer, inner) = (lattice.bounds(), mesh.bounds());
        let is_within = (0..3).all(|axis| outer.min[axis] <= inner.min[axis] && inner.max[axis] <= outer.max[axis]);
        let frames = frames.filter(|_| is_within)?;
        let map = Self::empty(brick_counts(lattice), lattice.spacing(), band);
        let marked = Marked::new(&map, mesh, lattice, frames, MAX_LISTED);
        Some((map, marked))
    }

    /// Fills in the coarse grid of magnitudes, lowered until neighbours on one side differ by no more than the way between them.
    pub(super) fn set_magnitudes(&mut self, mesh: &MeshDistance, mut magnitudes: Vec<f32>, inside: &[bool]) {
        for side in [false, true] {
            let on_side = |(value, inside): (&f32, &bool)| if *inside == side { *value } else { f32::INFINITY };
            let mut limited: Vec<f32> = magnitudes.iter().zip(inside).map(on_side).collect();
            limit_steps(mesh.tree().arch, &mut limited, self.coarse_counts(), self.max_step());
            let values = magnitudes.iter_mut().zip(limited).zip(inside).filter(|(_, inside)| **inside == side);
            values.for_each(|((value, limited), _)| *value = limited);
        }
        self.coarse.nodes = magnitudes;
        self.coarse.nodes.iter_mut().zip(inside).for_each(|(node, inside)| *node = with_side(*node, *inside));
    }

    /// Fills in the coarse grid of a closed mesh, likewise. All magnitudes are at least W, and those of nodes beside one on the other
    /// side at most W + 8 h or 9 h, as the surface is between them: `limit_signed_steps` loses nothing.
    pub(super) fn set_solid_nodes(&mut self, mesh: &MeshDistance, nodes: Vec<f32>) {
        self.coarse.nodes = nodes;
        let (counts, step) = (self.coarse_counts(), self.max_step());
        if mesh.is_cancelled() {
            return;
        }
        limit_signed_steps(mesh.tree().arch, &mut self.coarse.nodes, counts, step);
    }

    /// Nodes of the coarse grid along each axis.
    fn coarse_counts(&self) -> [usize; 3] {
        self.counts().map(|n| n as usize + 1)
    }

    /// Most that magnitudes of neighbours may differ by.
    fn max_step(&self) -> f32 {
        (f64::from(BRICK) * self.spacing * (1.0 - COARSE_DISTANCE_ROUNDING)) as f32
    }
}
