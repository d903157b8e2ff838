//! Sparse grid: exact distances in bricks of 8 × 8 × 8 nodes near the surface, a coarse grid of every eighth node
//! elsewhere.
//!
//! Let h be the spacing, B the band and W = B + √3 h. A *slot* is a block of 8 × 8 × 8 nodes that can have a brick.
//!
//! | nodes | value |
//! |---|---|
//! | within W of the surface | exact distance, but for rounding in f32; all corners of a cell that the band enters are such, so it interpolates what a dense grid would |
//! | beyond, in a brick | the lesser of the distance and the coarse grid's interpolant, but no less than W |
//! | in a slot without a brick, all its nodes beyond K = W + √3/2 h | the coarse grid's interpolant |
//!
//! The coarse grid holds the distance d at its nodes inside, but no less than W, and far from bricks perhaps h more. Outside, its
//! magnitude is a lower bound of the distance in the slots around the node, or a value that rises slowly with the node's
//! distance (`brick_map`). There it interpolates to at most the distance at nodes without a brick. It is 1-Lipschitz along each
//! axis, as the distance is; so is the lesser of both.
//!
//! Inside, a coarse cell is 8 h wide and d is 1-Lipschitz, so its interpolant errs by at most 4√3 h, and with the last
//! cells of bricks by 4.5√3 h (docs/error-bounds.md). A brick that the jump of an open mesh's sign crosses holds exact
//! distances throughout.
//!
//! A point x outside, beyond the band, with nearest surface point q, r = |x − q|, gets at most
//!
//! ```text
//! Σ wᵢ |xᵢ − q| ≤ Σ wᵢ (|xᵢ − q|² + r²) / (2 r) ≤ r + 3 h² / (8 B).
//! ```
//!
//! | step | file |
//! |---|---|
//! | 1. mark the slots near the surface; which may need bricks, and what is the coarse grid? | `brick_map` |
//! | 2. compute the samples of bricks by writing triangles into their lists, and certify a fast error bound | `splat` |
//! | or, where signs cannot be carried along edges and at the jumps of an open mesh, node by node | `brick` |
//! | 3. certify a tight error of interpolation | `interpolation_error` |
//! | 4. encode samples | `quantize` |
//! | 5. cut the Hilbert curve into parts, add the bricks that close an open mesh | `part`; what is left of the map: `coarse_map` |
//! | 6. compute bricks, join them, and bound values, slopes and errors | `compute`, `assemble`, `brick_tables`, `brick_bounds` |

mod assemble;
mod brick;
mod brick_bounds;
mod brick_map;
mod brick_tables;
mod coarse_map;
mod compute;
mod interpolation_error;
mod part;
mod quantize;
mod slot_bits;
mod splat;

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use sdf_core::grid::sparse::{BRICK_SAMPLES, Bricks, Code, Scale};
use sdf_core::grid::{BlockBounds, Lattice};

use thiserror::Error;

use crate::MeshDistance;
pub use crate::error::regions::{SignJumps, code_step};
pub use assemble::{BoundedGrid, BrickSamples, BrickSources, UnboundedGrid};
use brick_map::BrickMap;
pub use brick_map::streamed_slot_bytes;
pub use brick_tables::NoSample;
pub(crate) use coarse_map::slot_at;
pub use coarse_map::{CoarseMap, SlotSides};
pub use part::{BakedPart, BrickColumns, BrickShard};
pub use quantize::Quantize;
use quantize::{CodesMut, CodesRef};
use splat::can_splat;
use splat::frame::PlaneFrames;
pub use splat::node_rounding;

/// A baked sparse grid and certified bounds. Bricks are in Hilbert order; after them, in the same order, those that
/// only close an open mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct SparseGrid<C> {
    /// Index of the brick in each slot, x fastest.
    pub table: Vec<u32>,
    /// Slot of each brick, counted in bricks from the first node.
    pub slots: Vec<[u32; 3]>,
    /// Decoding of each brick's codes.
    pub scales: Vec<Scale>,
    /// Codes of one brick after the other, x fastest.
    pub samples: Vec<C>,
    /// Bounds of each brick's nodes.
    pub bounds: Vec<BlockBounds>,
    /// For each brick, over the cells whose first corner it holds: the largest difference of the interpolant from the
    /// signed distance within the band. Proven for closed meshes. The sign of an open mesh also jumps at a surface
    /// that closes its holes; a part of it that cuts no edge of a cell is not found.
    pub errors: Vec<f32>,
    /// Every eighth node and one more along each axis, x fastest: distances inside, lower bounds of them outside. Zero
    /// where all slots around have bricks.
    pub coarse: Vec<f32>,
    /// Lipschitz constant of the interpolant. [`Self::bounds`] has those of single bricks.
    pub slope_bound: f64,
    /// Largest of [`Self::errors`].
    pub error_bound: f64,
    /// See [`Grid::with_inside_at_box`](sdf_core::grid::Grid::with_inside_at_box). Also true if the box does not hold the whole mesh.
    pub inside_reaches_box: bool,
    /// Cells in which the sign may jump. `None` where the signed distance is continuous, or the mesh was not at hand.
    pub jumps: Option<SignJumps>,
}

impl<C: Code> Bricks for SparseGrid<C> {
    type Code = C;
    fn table(&self) -> &[u32] {
        &self.table
    }
    fn scales(&self) -> &[Scale] {
        &self.scales
    }
    fn samples(&self) -> &[C] {
        &self.samples
    }
    fn bounds(&self) -> &[BlockBounds] {
        &self.bounds
    }
    fn coarse(&self) -> &[f32] {
        &self.coarse
    }
    fn errors(&self) -> &[f32] {
        &self.errors
    }
}

/// A band that is NaN, infinite or negative.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("the band must be a finite length of at least 0, not {0:?}")]
pub struct InvalidBand(pub f64);

/// Bakes a sparse grid: [`SparseBaker::new`] and [`SparseBaker::bake`]. `band` is a length.
pub fn bake<C: Quantize>(
    mesh: &MeshDistance,
    lattice: &Lattice,
    band: f64,
    on_slots_done: &(dyn Fn(usize) + Sync),
) -> Result<SparseGrid<C>, InvalidBand> {
    Ok(SparseBaker::new(mesh, lattice, band)?.bake(on_slots_done))
}

/// A sparse grid before it is baked: its bricks are known up to a few, and its memory and error can be bounded.
pub struct SparseBaker<'a> {
    mesh: &'a MeshDistance<'a>,
    lattice: Lattice,
    map: BrickMap,
    /// Frames of the triangles, if they are to be splatted.
    frames: Option<PlaneFrames<'a>>,
    certify: Certify,
}

/// How the error of each brick is bounded. Both bounds are proven; neither is stated where nothing is known of the normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Certify {
    /// Bound by the cap of the normals that can matter to 4 × 4 × 4 cells: (√3/2) sin θ, at no cost.
    #[default]
    Fast,
    /// Bound by the normals of single cells and of single corners of the mesh where that is smaller: half the time of a bake. As
    /// [`Self::Fast`] for meshes of several shells.
    Tight,
}

/// Slots whose bricks are computed in parallel before they are joined: so many that threads seldom wait, so few that
/// the samples are hardly ever in memory twice.
const SLOTS_AT_A_TIME: usize = 1024;

impl<'a> SparseBaker<'a> {
    /// Finds which slots are near the surface. `band` is a length. The lattice should hold the whole mesh, as that of
    /// [`lattice_around`](crate::lattice_around) does: of others the error is bounded in the box alone, and
    /// [`SparseGrid::inside_reaches_box`] is true.
    pub fn new(mesh: &'a MeshDistance<'a>, lattice: &Lattice, band: f64) -> Result<Self, InvalidBand> {
        if !(band >= 0.0 && band.is_finite()) {
            return Err(InvalidBand(band));
        }
        let frames = || PlaneFrames::new(mesh.tree(), mesh.outward(), lattice.spacing());
        let frames = can_splat(mesh).then(frames);
        let map = BrickMap::new(mesh, lattice, band, frames.as_ref());
        Ok(Self { mesh, lattice: *lattice, map, frames, certify: Certify::default() })
    }

    /// The same grid with other error bounds.
    pub fn certified(self, certify: Certify) -> Self {
        Self { certify, ..self }
    }

    /// The band, a length.
    pub fn band(&self) -> f64 {
        self.map.band()
    }

    /// The lattice of the full resolution.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Number of brick slots in the lattice.
    pub fn slot_count(&self) -> usize {
        self.map.slot_count()
    }

    /// The coarse grid and the sides of slots, which parts have in common.
    pub fn coarse_map(&self) -> &CoarseMap {
        self.map.coarse()
    }

    /// [`coarse_map`](Self::coarse_map), without a copy.
    pub fn into_coarse_map(self) -> CoarseMap {
        self.map.into_coarse()
    }

    /// Upper bound of the number of bricks.
    pub fn max_bricks(&self) -> usize {
        self.map.max_bricks()
    }

    /// Estimate of the peak memory of [`Self::bake`] in bytes, without the mesh, the same for any number of threads. It leaves out what
    /// threads beside the first take while they work on other blocks: buffers of some kilobytes, and up to [`Self::triangle_bytes`] each, as
    /// much only where nearly all triangles are near each of their blocks.
    pub fn max_bytes<C>(&self) -> usize {
        let per_brick =
            BRICK_SAMPLES * size_of::<C>() + size_of::<([u32; 3], Scale, [f64; 2], [BlockBounds; 2], f32)>();
        let in_progress = self.slot_count().min(SLOTS_AT_A_TIME) * BRICK_SAMPLES * size_of::<C>();
        let bricks = self.max_bricks().saturating_mul(per_brick);
        let in_progress = in_progress + self.triangle_bytes();
        bricks.saturating_add(in_progress).saturating_add(self.map.bytes())
    }

    /// The part of [`max_bytes`](Self::max_bytes) and [`max_streamed_bytes`](Self::max_streamed_bytes) that grows with the mesh's triangles,
    /// whatever the lattice: their frames, and lists of them, of one thread. The triangles near one block are counted, which all may be.
    pub fn triangle_bytes(&self) -> usize {
        splat::max_bytes(self.mesh)
    }

    /// Does the sign change at triangles alone? It jumps elsewhere too at the holes of an open mesh.
    pub fn is_continuous(&self) -> bool {
        self.mesh.is_continuous()
    }

    /// Estimate of the peak memory of [`Self::bake_part`] that gives away the samples of so many slots at once, and of joining the parts
    /// again, in bytes, without the mesh. It leaves out what [`max_bytes`](Self::max_bytes) does.
    pub fn max_streamed_bytes<C>(&self, slots_at_a_time: usize) -> usize {
        // The numbers of a brick, its place in a list that is sorted, and its share of a table in blocks.
        let per_brick = size_of::<([u32; 3], Scale, [f64; 2], BlockBounds, f32, [u32; 12])>();
        let bricks = self.max_bricks();
        let at_a_time = 3 * bricks.min(slots_at_a_time) * BRICK_SAMPLES * size_of::<C>();
        let in_progress = at_a_time + self.triangle_bytes();
        self.map.streamed_bytes(bricks.saturating_mul(per_brick)).saturating_add(in_progress)
    }

    /// Bound of the error of interpolating exact distances within the band, in the grid that [`Self::bake`] returns. `None` if it
    /// exceeds `max_error`, or if the sign jumps. It is not tightened below `sufficient`. Both save time. For
    /// `on_slots_done` see [`Self::bake`].
    pub fn interpolation_error(
        &self,
        sufficient: f64,
        max_error: f64,
        on_slots_done: &(dyn Fn(usize) + Sync),
    ) -> Option<f64> {
        if !self.mesh.is_continuous() {
            return None;
        }
        self.mesh.tree().prepare_packets();
        let is_exceeded = AtomicBool::new(false);
        // With more triangles than bricks, as of a scanned body, hardly a slot is flat enough to be bounded as a whole.
        let is_fine = sufficient > 0.0 && self.mesh.tree().corners.len() < self.max_bricks();
        let slot_error = |index: usize| {
            if self.mesh.is_cancelled() || is_exceeded.load(Ordering::Relaxed) {
                return None;
            }
            let slot = self.map.slot(index);
            let mut guess = 0;
            let mut nearest_at = |step: [usize; 3]| {
                let nearest = self.mesh.nearest(self.node(slot, step), guess);
                guess = nearest.guess;
                (nearest.distance, nearest.guess)
            };
            let whole = if is_fine { self.whole_slot_error(slot, &mut nearest_at) } else { f64::INFINITY };
            let error = if whole <= sufficient { whole } else { self.slot_error(slot, sufficient, nearest_at) };
            if error <= max_error {
                return Some(error);
            }
            is_exceeded.store(true, Ordering::Relaxed);
            None
        };
        let wanted = |slots: Range<usize>| slots.filter(|index| self.map.may_need_brick(*index));
        let max_of_slots = |slots: Range<usize>| {
            let count = slots.len();
            let max = wanted(slots).map(slot_error).try_fold(0.0, |max: f64, error| Some(error?.max(max)));
            if !self.mesh.is_cancelled() {
                on_slots_done(count);
            }
            max
        };
        let errors = sdf_parallel::map_chunks(self.slot_count(), max_of_slots);
        errors.into_iter().try_fold(0.0, |max: f64, error| Some(error?.max(max)))
    }
}
