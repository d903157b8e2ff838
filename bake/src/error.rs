//! Certified error of trilinear interpolation.
//!
//! A grid holds exact distances φ(xᵢ) at the nodes. How far is the interpolant I(x) = Σ wᵢ φ(xᵢ) of a cell from φ(x)?
//! The proofs are in `docs/error-bounds.md`, with the same letters; its sections are named below.
//!
//! | step | question | file | section |
//! |---|---|---|---|
//! | 1 | Which triangles are near a brick? | `local_triangles` | – |
//! | 2 | Which of them can be nearest to a point of a block? | `candidates` | "Which triangles can be nearest" |
//! | 3 | How far do gradients that combine their normals differ, and so how large is the error? | `normal_cones` | "Where the gradient …", "Gradients are …" |
//! | 4 | What do rounding and jumps of the sign add? | `node_bounds` | "What is added" |
//! | 5 | What do bricks need beyond the band, where samples are rounded? | `beyond_band` | "Beyond the band" |
//! | 6 | Where may the sign of an open mesh jump? | `regions` | – |
//!
//! Errors are in voxels. Blocks are of 2 × 2 × 2 cells; only the worst are searched again cell by cell.

pub mod beyond_band;
pub mod block;
pub mod candidates;
pub mod local_triangles;
pub mod node_bounds;
pub mod normal_cones;
pub mod regions;

use std::ops::Range;

use sdf_core::nalgebra::Vector3;

use crate::MeshDistance;
use crate::error::block::{ErrorBlock, Query};
use crate::error::candidates::{BlocksX8, Candidates};
use crate::error::local_triangles::LocalTriangles;
use crate::error::normal_cones::{MAX_ERROR, Normals, cone_error_bound, cone_error_bounds_x8};
use crate::rounding::SINGLE_SLACK;
use crate::simd::LANES;

/// Error bound of two parallel sheets. Only above it is a cone for each corner of the mesh worth its time.
const TWO_SHEETS_ERROR: f64 = 0.5;

/// Error bounds of the blocks of one brick.
pub(crate) struct BrickErrors<'a> {
    mesh: &'a MeshDistance<'a>,
    local_triangles: LocalTriangles<'a>,
    cell_candidates: Candidates<'a>,
    /// Candidates of block after block, as triangles of the tree.
    candidates: Vec<u32>,
    /// Scratch buffers.
    normals: Vec<Vector3<f64>>,
    cone_normals: Normals,
}

/// A block with its candidates, and a first bound of its error.
#[derive(Clone, Debug)]
pub(crate) struct BoundedBlock {
    block: ErrorBlock,
    candidates: Range<usize>,
    /// Upper bound of [`BrickErrors::block_error`].
    pub error_bound: f64,
}

impl<'a> BrickErrors<'a> {
    /// Gathers the triangles near a brick. The blocks' centers lie in the cube `centers`, at most `max_distance` from
    /// the surface, and all have one half side.
    pub fn new(mesh: &'a MeshDistance<'a>, centers: ErrorBlock, half_side: f64, max_distance: f64) -> Self {
        let diagonals = 3.0_f64.sqrt() * (centers.half_side + 2.0 * half_side);
        let local_triangles = LocalTriangles::gather(mesh.tree(), centers.center, max_distance + diagonals, half_side);
        let (cell_candidates, cone_normals) = (Candidates::new(mesh.tree()), Normals::default());
        Self { mesh, local_triangles, cell_candidates, candidates: vec![], normals: vec![], cone_normals }
    }

    /// Finds the candidates of up to eight blocks, and bounds their errors cheaply.
    pub fn bound_blocks(&mut self, queries: &[Query]) -> Vec<BoundedBlock> {
        let Self { mesh, local_triangles, normals, .. } = self;
        local_triangles.find_candidates(queries);
        let found = &local_triangles.candidates;
        normals.clear();
        normals.extend(local_triangles.picked.iter().map(|slot| mesh.outward_normal(*slot)));
        let error_bounds = cone_error_bounds_x8(mesh.tree().arch, normals, found.lists(), found.memberships());
        (0..queries.len()).map(|index| self.bounded_block(index, queries[index].block, error_bounds[index])).collect()
    }

    fn bounded_block(&mut self, index: usize, block: ErrorBlock, error_bound: f64) -> BoundedBlock {
        let first = self.candidates.len();
        let indices = self.local_triangles.candidates.list(index).iter();
        self.candidates.extend(indices.map(|index| self.local_triangles.picked[*index as usize]));
        BoundedBlock { block, candidates: first..self.candidates.len(), error_bound }
    }

    /// Error bound of all cells of a block.
    pub fn block_error(&mut self, bounded: &BoundedBlock) -> f64 {
        let Self { mesh, cone_normals, candidates, .. } = self;
        cone_normals.clear();
        candidates[bounded.candidates.clone()].iter().for_each(|slot| cone_normals.push(mesh.outward_normal(*slot)));
        cone_error_bound(std::slice::from_ref(cone_normals))
    }

    #[cfg(test)]
    pub fn candidates(&self, bounded: &BoundedBlock) -> &[u32] {
        &self.candidates[bounded.candidates.clone()]
    }

    /// Largest of `floor` and the error bounds of those cells of a block that come within `band` of the surface.
    ///
    /// Each cell has its own candidates, fewer than the block's.
    pub fn cell_error(&mut self, bounded: &BoundedBlock, band: f64, floor: f64) -> f64 {
        let Self { mesh, cell_candidates, normals, cone_normals, candidates, .. } = self;
        let candidates = &candidates[bounded.candidates.clone()];
        normals.clear();
        normals.extend(candidates.iter().map(|slot| mesh.outward_normal(*slot)));
        let half_side = 0.5 * bounded.block.half_side;
        let cell = |cell: usize| {
            let offset = Vector3::from_fn(|axis, _| if cell >> axis & 1 == 0 { -half_side } else { half_side });
            (ErrorBlock { center: bounded.block.center + offset, half_side }, f64::INFINITY)
        };
        cell_candidates.find(candidates, &BlocksX8::new(LANES, cell));
        let error_bounds =
            cone_error_bounds_x8(mesh.tree().arch, normals, cell_candidates.lists(), cell_candidates.memberships());
        let mut max_error = floor;
        for cell in 0..LANES {
            let Some(nearest) = cell_candidates.nearest(cell) else { return MAX_ERROR };
            let is_beyond_band = nearest.distance_sq.sqrt() > band + 3.0_f64.sqrt() * half_side * (1.0 + SINGLE_SLACK);
            if is_beyond_band || error_bounds[cell] <= max_error {
                continue;
            }
            cone_normals.collect(normals, cell_candidates.list(cell));
            let one_cone = cone_error_bound(std::slice::from_ref(cone_normals));
            let corner_cones = || {
                let slots: Vec<u32> =
                    cell_candidates.list(cell).iter().map(|index| candidates[*index as usize]).collect();
                cone_error_bound(&mesh.normals_by_corner(&slots))
            };
            let error = if one_cone <= TWO_SHEETS_ERROR { one_cone } else { one_cone.min(corner_cones()) };
            max_error = max_error.max(error);
        }
        max_error
    }
}

impl MeshDistance<'_> {
    /// Outward unit normal of a triangle of the tree; zero if unknown.
    pub(crate) fn outward_normal(&self, slot: u32) -> Vector3<f64> {
        let normals = self.solid_normals();
        normals.map_or_else(Vector3::zeros, |normals| normals.face(self.tree().triangles[slot as usize]))
    }

    /// Normals of the candidates around each corner of the mesh, one cone for each.
    ///
    /// The faces that meet at a nearest point share a corner, so each gradient lies in one of these cones.
    fn normals_by_corner(&self, candidates: &[u32]) -> Vec<Normals> {
        let corners = |slot: &u32| self.corner_indices(*slot as usize).map(|point| (point, self.outward_normal(*slot)));
        let mut by_corner: Vec<(u32, Vector3<f64>)> = candidates.iter().flat_map(corners).collect();
        by_corner.sort_by_key(|(corner, _)| *corner);
        let cone = |around_corner: &[(u32, Vector3<f64>)]| {
            let mut normals = Normals::default();
            around_corner.iter().for_each(|(_, normal)| normals.push(*normal));
            normals
        };
        by_corner.chunk_by(|a, b| a.0 == b.0).map(cone).collect()
    }
}

#[cfg(test)]
mod tests;
