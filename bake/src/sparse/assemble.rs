//! From single bricks to a grid: order, table, coarse grid and certified bounds, with the samples in memory or elsewhere.

use std::ops::Range;

use sdf_core::grid::owned::Blocks;
use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES, NO_BRICK, Scale, Sparse, brick_counts};
use sdf_core::grid::{BlockBounds, Lattice, cell_slope, slope_bound_with_outside};

use super::brick_bounds::{BoundedBricks, SampleBounds, Window};
use super::brick_map::exact_within;
use super::brick_tables::BrickTables;
use super::coarse_map::{CoarseMap, slot_at};
use super::part::{BakedPart, BrickColumns, BrickShard};
use super::{Quantize, SparseBaker, SparseGrid};
use crate::MeshDistance;
use crate::error::beyond_band::least_brick_error;
use crate::error::node_bounds::{BandCells, HaloBlock, inside_reaches_box, round_up};
use crate::error::regions::{JumpFreeBlocks, SignJumps, cells_within};
use crate::rounding::COARSE_DIFFERENCE_ROUNDING;

/// Samples of baked bricks, wherever they are kept, in the order in which they were baked: of several parts those of all
/// [`BakedPart::near`], then those of all [`BakedPart::closing`].
pub trait BrickSamples<C> {
    /// Why they cannot be read.
    type Error;
    /// All of them, if they are in memory.
    fn all(&self) -> Option<&[C]> {
        None
    }
    /// Codes of some bricks, in ascending order.
    fn read(&self, bricks: &[u32]) -> Result<Vec<C>, Self::Error>;
}

/// The bricks of a whole grid before they are bounded: of one part or of several, in their order.
#[derive(Clone, Debug, PartialEq)]
pub struct UnboundedGrid {
    lattice: Lattice,
    band: f64,
    is_continuous: bool,
    columns: BrickColumns,
    coarse: CoarseMap,
    table: Blocks<u32>,
    sources: BrickSources,
    missing: Option<[u32; 3]>,
}

/// Where the samples of a grid's bricks stand among those of [`BrickSamples`].
#[derive(Clone, Debug, PartialEq)]
pub struct BrickSources {
    /// Number of bricks near the surface, which come first. Those that close an open mesh come after them.
    near_count: u32,
    /// For each of those its place among the bricks that might have been, ascending.
    taken: Vec<u32>,
}

impl BrickSources {
    /// Place of a brick: it grows with the brick.
    pub fn place(&self, brick: u32) -> u32 {
        match brick.checked_sub(self.near_count) {
            Some(closing) => self.near_count + self.taken[closing as usize],
            None => brick,
        }
    }
}

impl UnboundedGrid {
    /// Joins the bricks of all parts, over the coarse grid that they have in common. `is_continuous`: does the sign change at triangles alone? See [`SparseBaker::is_continuous`].
    pub fn new(lattice: &Lattice, band: f64, is_continuous: bool, parts: BakedPart, coarse: CoarseMap) -> Self {
        let BakedPart { near: mut columns, closing } = parts;
        let near_count = columns.slots.len() as u32;
        let mut table = coarse.table(&columns.slots);
        let mut at_jumps = coarse.slots_at_sign_jumps(|slot| table.get(slot) == Some(NO_BRICK));
        let mut taken = vec![];
        for (brick, slot) in closing.slots.iter().enumerate() {
            if at_jumps.remove(&coarse.index(*slot)) {
                table.set(*slot, columns.slots.len() as u32);
                columns.append_one(&closing, brick);
                taken.push(brick as u32);
            }
        }
        let missing = at_jumps.first().map(|index| slot_at(coarse.counts, *index));
        let sources = BrickSources { near_count, taken };
        Self { lattice: *lattice, band, is_continuous, columns, coarse, table, sources, missing }
    }

    /// A slot whose brick should close an open mesh and is in no part: the parts are not of one bake, or the bake was cancelled.
    pub fn missing(&self) -> Option<[u32; 3]> {
        self.missing
    }

    /// The grid without its samples, once they have been read for the bounds. Unless all are in memory, holds those of `bricks_at_a_time`
    /// bricks and of the bricks around them. Jumps of the sign are found, and
    /// what of the mesh lies outside of the box, if the mesh is there.
    pub fn bounded<C: Quantize, S: BrickSamples<C>>(
        self,
        samples: &S,
        bricks_at_a_time: usize,
        mesh: Option<&MeshDistance>,
    ) -> Result<(BoundedGrid, BrickSources), S::Error> {
        let Self { lattice, band, is_continuous, columns, coarse, table, sources, .. } = self;
        let coarse = coarse.into_values(&table);
        let BrickColumns { slots, scales, roundings, interpolations } = columns;
        let storage = Sparse::of_checked(&lattice, BrickTables { table: &table, scales: &scales, coarse: &coarse });
        let arch = pulp::Arch::new();
        let (exact_within, cells_within) =
            (exact_within(band, lattice.spacing()), cells_within(band, lattice.spacing()));
        let last_slot = lattice.cells().map(|cells| cells / BRICK);
        // Samples in f32 keep their signs, as do the codes of bricks whose least sample is not negative. Both have no negative base.
        let keeps_signs = |slot: [u32; 3]| {
            let holds_corners = (0..8_u32).map(|part| [slot[0] + part % 2, slot[1] + part / 2 % 2, slot[2] + part / 4]);
            let mut bricks = holds_corners.filter_map(|slot| storage.brick_at(slot));
            bricks.all(|brick| scales[brick].base >= 0.0)
        };
        let bound = |window: Window, brick: usize, free: &mut JumpFreeBlocks| {
            let bricks = BoundedBricks { lattice: &lattice, storage: &storage, samples: window, roundings: &roundings };
            let slot = slots[brick];
            let SampleBounds { bounds, rounding, halo } = bricks.bound(arch, slot);
            let (at_jump, cells) = if is_continuous {
                (0.0, BandCells::default())
            } else {
                let rounding_of_sign = if keeps_signs(slot) { 0.0 } else { rounding };
                largest_at_sign_change(exact_within, cells_within, &halo, [rounding, rounding_of_sign])
            };
            let jumps = mesh.filter(|_| at_jump > 0.0);
            let jumps = jumps.map(|mesh| mesh.jumps_in(&lattice, slot, &halo, cells_within, free));
            let is_at_box = (0..3).any(|axis| slot[axis] == 0 || slot[axis] == last_slot[axis]);
            let reaches_box = is_at_box && is_inside_at_box(&halo, &lattice, slot);
            // The terms of `dense::error_bound`.
            let error = interpolations[brick] + rounding + 2.0 * at_jump;
            let error = round_up(error.max(least_brick_error(rounding, lattice.spacing(), band)));
            (bounds, error, reaches_box, SignJumps { cells, jumps: jumps.unwrap_or_default() })
        };
        let mut all_bounds = Vec::with_capacity(slots.len());
        let mut errors = Vec::with_capacity(slots.len());
        let mut reaches_box = false;
        let mut jumps = SignJumps::default();
        let mut keep = |found: Vec<Vec<(BlockBounds, f32, bool, SignJumps)>>| {
            for (bounds, error, brick_reaches_box, jumps_of_brick) in found.into_iter().flatten() {
                all_bounds.push(bounds);
                errors.push(error);
                reaches_box |= brick_reaches_box;
                jumps.add(jumps_of_brick);
            }
        };
        let bound_all = |window: Window, bricks: Range<usize>| {
            sdf_parallel::map_chunks(bricks.len(), |batch| {
                let mut free = JumpFreeBlocks::default();
                batch.map(|index| bound(window, bricks.start + index, &mut free)).collect::<Vec<_>>()
            })
        };
        if let Some(codes) = samples.all() {
            keep(bound_all(Window { bricks: None, codes: C::codes(codes) }, 0..slots.len()));
        } else {
            for first in (0..slots.len()).step_by(bricks_at_a_time.max(1)) {
                let batch = first..slots.len().min(first.saturating_add(bricks_at_a_time.max(1)));
                let bricks = with_neighbours(&storage, &slots, batch.clone());
                let codes = samples.read(&bricks.iter().map(|brick| sources.place(*brick)).collect::<Vec<_>>())?;
                let window = Window { bricks: Some(&bricks), codes: C::codes(&codes) };
                keep(bound_all(window, batch));
            }
        }
        let reaches_box = reaches_box || coarse_inside_reaches_box(&lattice, &storage);
        let slope_bound = slope_bound_with_outside(slope_inside(&lattice, &storage, &all_bounds), reaches_box);
        // The inside of a closed mesh lies in a box that holds the mesh: a sample there is negative by rounding.
        let inside_reaches_box = reaches_box && !is_continuous || mesh.is_some_and(|mesh| !mesh.lies_in(&lattice));
        let is_certain = mesh.is_none_or(MeshDistance::is_sign_certain);
        let error_bound = if is_certain { errors.iter().copied().fold(0.0, f32::max).into() } else { f64::INFINITY };
        let bounds = all_bounds;
        let jumps = mesh.filter(|_| !is_continuous && is_certain).map(|_| jumps);
        let grid = BoundedGrid {
            table,
            slots,
            scales,
            bounds,
            errors,
            coarse,
            slope_bound,
            error_bound,
            inside_reaches_box,
            jumps,
        };
        Ok((grid, sources))
    }
}

/// A [`SparseGrid`] without its samples, whose table is in blocks.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "fields are those of a `SparseGrid`")]
pub struct BoundedGrid {
    pub table: Blocks<u32>,
    pub slots: Vec<[u32; 3]>,
    pub scales: Vec<Scale>,
    pub bounds: Vec<BlockBounds>,
    pub errors: Vec<f32>,
    pub coarse: Vec<f32>,
    pub slope_bound: f64,
    pub error_bound: f64,
    pub inside_reaches_box: bool,
    pub jumps: Option<SignJumps>,
}

impl BoundedGrid {
    /// The grid with its samples.
    pub fn with_samples<C>(self, samples: Vec<C>) -> SparseGrid<C> {
        let Self { table, slots, scales, bounds, errors, coarse, slope_bound, error_bound, inside_reaches_box, jumps } =
            self;
        let table = table.to_vec();
        SparseGrid {
            table,
            slots,
            scales,
            samples,
            bounds,
            errors,
            coarse,
            slope_bound,
            error_bound,
            inside_reaches_box,
            jumps,
        }
    }
}

/// Some bricks and all around them, ascending.
fn with_neighbours(storage: &Sparse<BrickTables>, slots: &[[u32; 3]], batch: std::ops::Range<usize>) -> Vec<u32> {
    let outside = |brick: usize| {
        let slot = slots[batch.start + brick];
        let neighbours = (0..27_u32).map(move |part| {
            let step = [part % 3, part / 3 % 3, part / 9];
            std::array::from_fn(|axis| (slot[axis] + step[axis]).wrapping_sub(1))
        });
        neighbours.filter_map(|slot| storage.brick_at(slot)).filter(|brick| !batch.contains(brick))
    };
    let outside = sdf_parallel::map_chunks(batch.len(), |bricks| bricks.flat_map(outside).collect::<Vec<_>>());
    let mut bricks: Vec<u32> = batch.chain(outside.into_iter().flatten()).map(|brick| brick as u32).collect();
    bricks.sort_unstable();
    bricks.dedup();
    bricks
}

/// All samples, in memory.
struct AllSamples<C>(Vec<C>);

impl<C> BrickSamples<C> for AllSamples<C> {
    type Error = std::convert::Infallible;
    fn all(&self) -> Option<&[C]> {
        Some(&self.0)
    }
    fn read(&self, _bricks: &[u32]) -> Result<Vec<C>, Self::Error> {
        unreachable!("all samples are in memory")
    }
}

impl SparseBaker<'_> {
    /// Bakes the grid. In all cells that the band enters, it interpolates the samples, but for rounding, of a dense grid of the
    /// lattice, which is never allocated.
    ///
    /// Calls `on_slots_done` with the number of slots just finished, out of [`Self::slot_count`], from any thread. The
    /// result does not depend on the number of threads.
    pub fn bake<C: Quantize>(&self, on_slots_done: &(dyn Fn(usize) + Sync)) -> SparseGrid<C> {
        let mut all = AllSamples(Vec::new());
        let mut take = |samples: Vec<C>| {
            // The first are those of all bricks near the surface.
            if all.0.is_empty() {
                all.0 = samples;
            } else {
                all.0.extend(samples);
            }
            Ok::<(), std::convert::Infallible>(())
        };
        let Ok(part) = self.bake_part(BrickShard::WHOLE, usize::MAX, &mut take, on_slots_done);
        all.0.shrink_to_fit();
        let coarse = self.coarse_map().clone();
        let unbounded = UnboundedGrid::new(&self.lattice, self.band(), self.is_continuous(), part, coarse);
        let Ok((grid, _)) = unbounded.bounded(&all, usize::MAX, Some(self.mesh));
        grid.with_samples(all.0)
    }
}

/// Largest magnitude at a corner of a cell of the brick that the band can enter and whose corners can have both
/// signs, and the cells with corners within `cells_within`. Samples are off by the first of `roundings` at most, and by the second where their
/// sign is not that of the distance.
fn largest_at_sign_change(
    exact_within: f64,
    cells_within: f32,
    halo: &HaloBlock,
    roundings: [f64; 2],
) -> (f64, BandCells) {
    let [rounding, rounding_of_sign] = roundings.map(round_up);
    let exact_within = round_up(exact_within) + rounding;
    let (largest, cells) = halo.largest_at_sign_change(rounding_of_sign, exact_within.next_up(), cells_within);
    (largest.into(), cells)
}

/// Is a node of the brick that lies on the lattice's box inside?
fn is_inside_at_box(halo: &HaloBlock, lattice: &Lattice, slot: [u32; 3]) -> bool {
    let nodes = lattice.nodes();
    (0..BRICK_SAMPLES as u32).any(|index| {
        let step = [index % BRICK, index / BRICK % BRICK, index / BRICK / BRICK];
        let node: [u32; 3] = std::array::from_fn(|axis| slot[axis] * BRICK + step[axis]);
        let is_on_box = (0..3).any(|axis| node[axis] == 0 || node[axis] + 1 == nodes[axis]);
        let [x, y, z] = step.map(|n| n as usize + 1);
        is_on_box && halo.values[z][y][x] < 0.0
    })
}

/// Lipschitz constant of the grid in its box. A cell without a corner in a brick lies in one cell of the coarse grid. It is at most as steep, up
/// to the rounding of interpolation in f32.
fn slope_inside(lattice: &Lattice, storage: &Sparse<BrickTables>, bricks: &[BlockBounds]) -> f64 {
    let counts = brick_counts(lattice);
    let slot_count = counts.iter().map(|n| *n as usize).product();
    let slot = |index: usize| slot_at(counts, index);
    let coarse_slope = |slot: [u32; 3]| {
        let corners = storage.coarse_corners(slot);
        let max_magnitude = corners.iter().fold(0.0_f32, |max, corner| max.max(corner.abs()));
        let rounding = COARSE_DIFFERENCE_ROUNDING * f64::from(max_magnitude) / lattice.spacing();
        cell_slope(corners, lattice.spacing() * f64::from(BRICK)) + 3.0_f64.sqrt() * rounding
    };
    let is_empty = |slot: &[u32; 3]| storage.brick_at(*slot).is_none();
    let steepest = |slots: Range<usize>| slots.map(slot).filter(is_empty).map(coarse_slope).fold(0.0, f64::max);
    let coarse = sdf_parallel::map_chunks(slot_count, steepest).into_iter().fold(0.0, f64::max);
    bricks.iter().map(|brick| f64::from(brick.slope_bound)).fold(coarse, f64::max)
}

/// Is a node of the coarse grid inside at the lattice's box?
fn coarse_inside_reaches_box(lattice: &Lattice, storage: &Sparse<BrickTables>) -> bool {
    let counts = brick_counts(lattice);
    // Nodes in bricks count as zero here, and no interpolant of a coarse cell is negative unless a corner is.
    let last_slot = lattice.cells().map(|cells| cells / BRICK);
    let slots = 0..counts.iter().map(|n| *n as usize).product();
    let may_reach_box = slots.map(|index| slot_at(counts, index)).any(|slot| {
        let is_at_box = (0..3).any(|axis| slot[axis] == 0 || slot[axis] == last_slot[axis]);
        is_at_box && storage.brick_at(slot).is_none() && storage.coarse_corners(slot).iter().any(|corner| *corner < 0.0)
    });
    may_reach_box && inside_reaches_box(lattice, |node| storage.node(node))
}
