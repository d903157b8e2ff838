//! Bricks by splatting: each triangle is written into the lists of the bricks that it can matter to, and each brick is
//! measured against its list alone.
//!
//! Splatting is the scan conversion of distance fields (Mauch 2000, "A fast algorithm for computing the closest point and
//! distance transform"); that triangles search for voxels, in narrow bands, is how OpenVDB's mesh converter works too
//! (Museth 2013, "VDB: High-resolution sparse volumes with dynamic topology"). Ours adds proofs: what is left out
//! cannot be nearest, and the rounding of f32 is bounded and certified with each brick.
//!
//! | step | file |
//! |---|---|
//! | 1. which triangles are near which brick? | `lists` |
//! | 2. how far is each node from them, in f32 around the brick's middle, and how do their normals turn? | `distances`, `nearest_test`, `order`, `packed`, `frame` |
//! | 3. which nodes are inside? Sides flood along clear edges of the grid from a few exact ones | `sides`; winding numbers: `sign::flood_fill` |
//! | 4. what is stored | `values` |
//!
//! Distances are off by a bound that grows with the triangles ([`BRICK_DISTANCE_ROUNDING`]): 4e-5 voxels where triangles
//! span some voxels. It counts as rounding of the samples. Signs are those of exact f64 searches, carried only along
//! edges that no triangle can meet with that error granted.
//!
//! [`BRICK_DISTANCE_ROUNDING`]: crate::rounding::BRICK_DISTANCE_ROUNDING

mod distances;
pub(super) mod frame;
mod lists;
mod nearest_test;
mod order;
mod packed;
mod sides;
mod values;

use sdf_core::grid::Lattice;
use sdf_core::grid::owned::Precision;
use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES, Scale};

use super::{Certify, CodesMut, SparseBaker};
use crate::error::normal_cones::MAX_ERROR;
use crate::error_budget::{distance_rounding, rounding};
use crate::rounding::{BRICK_DISTANCE_ROUNDING, SINGLE_SLACK, node_position_rounding};
use crate::sign::flood_fill::NodeBlock;
use crate::triangle::nearest_on_triangle;
use crate::{MeshDistance, SignMethod};
use distances::{BrickDistances, BrickQuery};
use frame::TriangleFrame;
use lists::{SlotLists, WantedSlot};
use sides::{NODES, NodeBits};
use values::SignedBrick;

const SIDE: usize = BRICK as usize;

/// Slots along a side of the blocks that are splatted together.
pub(super) const BLOCK: u32 = lists::BLOCK;

/// A block near which there are more triangles is measured node by node: its lists would be long, and its frames large.
const MAX_TRIANGLES: usize = 1 << 18;

/// An edge is clear if the distances at its ends sum to this many of its lengths.
const CLEARANCE: f32 = 1.0001;

/// Farthest node of a slot from its middle, in voxels, rounded up.
const FARTHEST_NODE: f64 = 6.9283;

/// Facts of a brick beside its samples.
pub(super) struct BrickRecord {
    pub slot: [u32; 3],
    pub scale: Scale,
    /// Largest difference of a decoded sample from the value it stands for.
    pub rounding: f64,
    /// Error of interpolating exact distances within the band, jumps of the sign not included.
    pub interpolation: f64,
}

/// Scratch buffers of one thread.
pub(super) struct Splatter {
    lists: SlotLists,
    brick: BrickDistances,
    signed: Box<[f32; NODES]>,
}

/// How one slot is measured.
struct SlotPlan {
    wanted: WantedSlot,
    /// Does the brick hold distances throughout, for the sign of an open mesh may jump in it?
    is_at_jump: bool,
}

/// Can signs be carried along clear edges? Not if pseudo-normals were asked for where they contradict each other.
pub(super) fn can_splat(mesh: &MeshDistance) -> bool {
    mesh.solid_normals().is_some() || mesh.sign_method() == SignMethod::Winding
}

impl Splatter {
    pub fn new() -> Self {
        Self { lists: SlotLists::new(), brick: BrickDistances::new(), signed: Box::new([0.0; NODES]) }
    }
}

impl SparseBaker<'_> {
    /// Bakes some slots of one block, whose codes follow each other in `codes`. `None` without frames, or if too many triangles are near.
    pub(super) fn splat(
        &self,
        splatter: &mut Splatter,
        slots: &[[u32; 3]],
        codes: &mut CodesMut,
    ) -> Option<Vec<BrickRecord>> {
        let plans: Vec<SlotPlan> = slots.iter().map(|slot| self.slot_plan(*slot)).collect();
        let wanted: Vec<WantedSlot> = plans.iter().map(|plan| plan.wanted).collect();
        let frames = self.frames.as_ref()?;
        if !splatter.lists.fill(self.mesh, &self.lattice, frames, &wanted, MAX_TRIANGLES) {
            return None;
        }
        let mut records = vec![];
        for plan in &plans {
            // A slot without a brick leaves its place to the next.
            let start = records.len() * BRICK_SAMPLES;
            records.extend(self.splat_brick(splatter, plan, codes.range(start, start + BRICK_SAMPLES)));
        }
        Some(records)
    }

    fn slot_plan(&self, slot: [u32; 3]) -> SlotPlan {
        let Self { mesh, lattice, map, .. } = self;
        let inv_spacing = 1.0 / lattice.spacing();
        let is_at_jump = !(mesh.is_continuous() || map.is_on_one_side(slot));
        // No distance beyond the coarse grid's magnitudes is stored; inside they can exceed K.
        let mut length = map.corner_magnitudes(slot).into_iter().fold(map.kept_within(), f64::max);
        if is_at_jump {
            length = length.max(map.middle_distance(slot) + FARTHEST_NODE * lattice.spacing());
        }
        let reach = length * inv_spacing * (1.0 + SINGLE_SLACK);
        SlotPlan { wanted: WantedSlot { slot, reach: (reach as f32).next_up() }, is_at_jump }
    }

    /// Bakes the brick of a slot. `None` if none of its nodes lies within K of the surface.
    fn splat_brick(&self, splatter: &mut Splatter, plan: &SlotPlan, codes: CodesMut) -> Option<BrickRecord> {
        let Self { mesh, lattice, map, .. } = self;
        let SlotPlan { wanted: WantedSlot { slot, reach }, is_at_jump } = *plan;
        let Splatter { lists, brick, signed } = splatter;
        let list = lists.list(slot);
        if list.is_empty() {
            return None;
        }
        let (spacing, inv_spacing, arch) = (lattice.spacing(), 1.0 / lattice.spacing(), mesh.tree().arch);
        let in_voxels = |length: f64| (length * inv_spacing) as f32;
        let coarse = (!is_at_jump).then(|| map.corner_magnitudes(slot).map(in_voxels));
        let (is_solid, has_normals) = (mesh.solid_normals().is_some(), mesh.outward().is_some());
        let is_certified = has_normals && !(is_solid && self.certify == Certify::Tight);
        brick.measure(
            arch,
            BrickQuery {
                triangles: &lists.triangles,
                list,
                offset: lists.offset(slot),
                reach,
                kept_within: in_voxels(map.kept_within()),
                coarse,
                position_rounding: in_voxels(position_rounding(mesh, lattice)),
                certified_band: is_certified.then(|| in_voxels(map.band())),
            },
        );
        let rounding = brick.rounding;
        let kept_within = in_voxels(map.kept_within()) + rounding;
        if !brick.distances.iter().any(|distance| *distance <= kept_within) {
            return None;
        }
        for (bound, distance) in signed.iter_mut().zip(brick.distances.iter()) {
            *bound = (distance.min(reach) - rounding).max(0.0);
        }
        let triangle = |index: u32| lists.triangles[list[(index as usize).min(list.len() - 1)] as usize].slot as usize;
        let offset = |step: [usize; 3]| step.map(|n| n as f32 - 0.5 * (SIDE - 1) as f32);
        let inside = if has_normals {
            let known = [brick.decided, brick.inside];
            let is_inside = |node: usize| {
                let (step, position) = (step_of(node), self.node(slot, step_of(node)));
                if !is_solid {
                    return mesh.is_inside_by_winding(position);
                }
                let candidates = brick.nearest_to(arch, offset(step), list.len());
                if signed[node] >= in_voxels(map.kept_within()) - 2.0 * rounding {
                    // Its nearest triangle may not be in the list.
                    return mesh.nearest(position, triangle(candidates[0])).is_inside;
                }
                mesh.is_inside_by_nearest_of(position, candidates.iter().map(|index| triangle(*index)))
            };
            sides::nodes_inside(arch, signed, known, CLEARANCE + rounding, is_inside)
        } else {
            self.inside_by_winding(slot, signed)
        };
        let signed_brick = SignedBrick {
            distances: &brick.distances,
            inside: &inside,
            coarse,
            exact_within: in_voxels(map.exact_within()),
            spacing: spacing as f32,
        };
        let (scale, code_rounding) = signed_brick.encode(arch, codes);
        let interpolation = if is_certified {
            f64::from(brick.interpolation).min(MAX_ERROR) * spacing
        } else {
            self.slot_error(slot, 0.0, |step| {
                let triangle = triangle(brick.nearest_to(arch, offset(step), list.len())[0]);
                let nearest = nearest_on_triangle(self.node(slot, step), mesh.tree().corners[triangle]);
                (nearest.distance_sq.sqrt(), triangle)
            })
        };
        let rounding = f64::from(code_rounding) + f64::from(rounding) * spacing;
        Some(BrickRecord { slot, scale, rounding, interpolation })
    }

    /// Sides by winding numbers. `bounds` are lower bounds of the distances, in voxels.
    fn inside_by_winding(&self, slot: [u32; 3], bounds: &mut [f32; NODES]) -> NodeBits {
        let spacing = self.lattice.spacing();
        bounds.iter_mut().for_each(|bound| *bound *= spacing as f32);
        let block = NodeBlock { counts: [SIDE; 3], spacing, position: &|step| self.node(slot, step) };
        block.sign(self.mesh, &self.map.seeds(&self.lattice, slot), bounds);
        let layer =
            |z: usize| (0..64).fold(0, |bits, node| bits | u64::from(bounds[64 * z + node].is_sign_negative()) << node);
        std::array::from_fn(layer)
    }
}

/// Error of the positions of nodes and of the surface: their coordinates can be large.
pub(super) fn position_rounding(mesh: &MeshDistance, lattice: &Lattice) -> f64 {
    node_position_rounding(lattice) + mesh.rounding()
}

/// Largest rounding of a node's sample in a brick, a length, but for half a step of its code.
///
/// Distances are rounded relative to a node's coordinates in the frame of its nearest triangle. They sum to what grows with the
/// triangle's length and the brick's size, and √3 times the distance between the two: the band and some voxels.
pub fn node_rounding(mesh: &MeshDistance, lattice: &Lattice, band: f64) -> f64 {
    let spacing = lattice.spacing();
    let of_band = f64::from(BRICK_DISTANCE_ROUNDING) * 3.0_f64.sqrt() * band;
    let of_samples = rounding(Precision::F32, band / spacing) * spacing;
    distance_rounding(mesh, spacing) + of_band + of_samples + position_rounding(mesh, lattice)
}

/// Memory of the triangles around one block, of which each thread has its own.
pub(super) fn max_bytes(mesh: &MeshDistance) -> usize {
    mesh.tree().corners.len().min(MAX_TRIANGLES) * (size_of::<TriangleFrame>() + 16 * size_of::<u32>())
}

fn step_of(node: usize) -> [usize; 3] {
    [node % SIDE, node / SIDE % SIDE, node / (SIDE * SIDE)]
}
