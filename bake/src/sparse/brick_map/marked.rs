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
//! | pseudo-normals: slots that are not near are on one side with their neighbours | `solid` |
//! | winding numbers, flooded from middle to middle and from node to node | `winding` |

use std::sync::atomic::{AtomicBool, Ordering};

use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::{BRICK, brick_counts};
use sdf_core::nalgebra::Vector3;

use super::surface::SurfaceSlots;
use super::transform::{From, distances, limit_steps};
use super::{BrickMap, corner_node};
use crate::MeshDistance;
use crate::rounding::COARSE_DISTANCE_ROUNDING;
use crate::sparse::splat::frame::PlaneFrame;

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
    /// L of slots and e of nodes, in voxels.
    pub gaps: Vec<f32>,
    node_gaps: Vec<f32>,
    deep: Vec<bool>,
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
    pub fn new(map: &BrickMap, mesh: &'a MeshDistance, lattice: &'a Lattice, frames: &[PlaneFrame]) -> Self {
        let reach = (map.kept_within() / map.spacing).max(MIN_REACH);
        let slots = SurfaceSlots::new(mesh.tree(), frames, lattice, map.counts, reach);
        let crossed: Vec<bool> = slots.crossed.iter().map(is_set).collect();
        let in_voxels = |from| {
            let mut gaps = distances(mesh.tree().arch, &crossed, map.counts.map(|n| n as usize), from);
            gaps.iter_mut().for_each(|gap| *gap *= BRICK as f32);
            gaps
        };
        let (gaps, node_gaps) = sdf_parallel::join(|| in_voxels(From::Slots), || in_voxels(From::Corners));
        let mut marked = Self { mesh, lattice, slots, reach, gaps, node_gaps, deep: vec![] };
        marked.deep = marked.deep_slots(map);
        marked
    }

    /// Distance of the middle of each slot from the crossed slots, in voxels.
    pub fn middle_gaps(&self, map: &BrickMap) -> Vec<f32> {
        let crossed: Vec<bool> = self.slots.crossed.iter().map(is_set).collect();
        let mut gaps = distances(self.mesh.tree().arch, &crossed, map.counts.map(|n| n as usize), From::Middles);
        gaps.iter_mut().for_each(|gap| *gap *= BRICK as f32);
        gaps
    }

    /// May a node of the slot be within the reach of the surface?
    pub fn is_near(&self, slot: usize) -> bool {
        is_set(&self.slots.near[slot])
    }

    /// Distance of a point from one of the triangles that are near some slots, or from `guess`, which becomes that triangle.
    pub fn nearest_around(&self, slots: impl Iterator<Item = usize>, point: Vector3<f64>, guess: &mut usize) -> f64 {
        self.slots.nearest_around(self.mesh.tree(), slots, point, guess)
    }

    /// m(c), in voxels.
    fn least_gap(&self, map: &BrickMap, node: [u32; 3]) -> f32 {
        map.slots_around(node).map(|index| self.gaps[index]).fold(f32::INFINITY, f32::min)
    }

    fn deep_slots(&self, map: &BrickMap) -> Vec<bool> {
        let min_gap = (map.exact_within() / map.spacing).max(f64::from(BRICK)) as f32;
        let least: Vec<f32> = map.map_coarse_nodes(|node| self.least_gap(map, node));
        let is_deep = |index: usize| {
            let slot = map.slot(index);
            (0..8).all(|corner| least[corner_node(map.counts, slot, corner)] >= min_gap)
        };
        sdf_parallel::map(self.gaps.len(), is_deep)
    }

    pub fn node(&self, map: &BrickMap, node: [u32; 3]) -> MarkedNode {
        MarkedNode {
            node,
            position: self.lattice.node(node.map(|n| n * BRICK)).into(),
            gap: self.node_gaps[corner_node(map.counts, node, 0)],
            least_gap: self.least_gap(map, node),
            is_beside_deep: map.slots_around(node).any(|index| self.deep[index]),
            is_deep: map.slots_around(node).all(|index| self.deep[index]),
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
        frames: &[PlaneFrame],
    ) -> Option<(Self, Marked<'a>)> {
        let (outer, inner) = (lattice.bounds(), mesh.bounds());
        let is_within = (0..3).all(|axis| outer.min[axis] <= inner.min[axis] && inner.max[axis] <= outer.max[axis]);
        if frames.is_empty() || !is_within {
            return None;
        }
        let mut map = Self::empty(brick_counts(lattice), lattice.spacing(), band);
        let marked = Marked::new(&map, mesh, lattice, frames);
        map.may_need_brick = marked.slots.near.iter().map(is_set).collect();
        Some((map, marked))
    }

    /// Fills in magnitudes, lowered until neighbours on one side differ by no more than the way between them.
    pub(super) fn set_magnitudes(&mut self, mesh: &MeshDistance, mut magnitudes: Vec<f32>, inside: Vec<bool>) {
        let step = f64::from(BRICK) * self.spacing * (1.0 - COARSE_DISTANCE_ROUNDING);
        for side in [false, true] {
            let on_side = |(value, inside): (&f32, &bool)| if *inside == side { *value } else { f32::INFINITY };
            let mut limited: Vec<f32> = magnitudes.iter().zip(&inside).map(on_side).collect();
            limit_steps(mesh.tree().arch, &mut limited, self.counts.map(|n| n as usize + 1), step as f32);
            let values = magnitudes.iter_mut().zip(limited).zip(&inside).filter(|(_, inside)| **inside == side);
            values.for_each(|((value, limited), _)| *value = limited);
        }
        (self.magnitudes, self.are_nodes_inside) = (magnitudes, inside);
    }
}

fn is_set(mark: &AtomicBool) -> bool {
    mark.load(Ordering::Relaxed)
}
