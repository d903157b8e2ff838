//! From single bricks to a grid: order, table, coarse grid and certified bounds.

use rayon::prelude::*;
use sdf_core::Interval;
use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES, BrickSlices, NO_BRICK, Scale, Sparse};
use sdf_core::grid::{BlockBounds, Lattice, cell_slope, slope_bound_with_outside};

use super::brick::Brick;
use super::brick_bounds::{BoundedBricks, SampleBounds};
use super::brick_map::BrickMap;
use super::splat::{BLOCK, BrickRecord, Splatter, can_splat};
use super::{Quantize, SLOTS_AT_A_TIME, SparseBaker, SparseGrid};
use crate::MeshDistance;
use crate::error::node_bounds::{HaloBlock, inside_reaches_box, round_up};
use crate::nearest::PacketSearch;
use crate::rounding::COARSE_DIFFERENCE_ROUNDING;
use sdf_core::hilbert::hilbert_index;

/// The bricks so far, as a structure of arrays.
struct BrickColumns<C> {
    slots: Vec<[u32; 3]>,
    scales: Vec<Scale>,
    samples: Vec<C>,
    roundings: Vec<f64>,
    interpolations: Vec<f64>,
}

impl SparseBaker<'_> {
    /// Bakes the grid. In all cells that the band enters, it interpolates the samples, but for rounding, of a dense grid of the
    /// lattice, which is never allocated.
    ///
    /// Calls `on_slots_done` with the number of slots just finished, out of [`Self::slot_count`], from any thread. The
    /// result does not depend on the number of threads.
    pub fn bake<C: Quantize>(&self, on_slots_done: &(dyn Fn(usize) + Sync)) -> SparseGrid<C> {
        let Self { mesh, lattice, map, .. } = self;
        let columns = self.all_bricks(on_slots_done);
        let table = columns.table(map);
        let coarse = map.coarse_values(&table);
        let BrickColumns { slots, scales, samples, roundings, interpolations } = columns;
        // Placeholders: nothing reads bounds before they are computed.
        let no_bounds =
            vec![BlockBounds { range: Interval { lower: 0.0, upper: 0.0 }, slope_bound: 0.0 }; scales.len()];
        let slices =
            BrickSlices { table: &table, scales: &scales, samples: &samples, bounds: &no_bounds, coarse: &coarse };
        let Some(storage) = Sparse::new(lattice, slices) else { unreachable!("the table refers to bricks that exist") };
        let bricks = BoundedBricks { lattice, storage: &storage, roundings: &roundings };
        let brick_bounds = |(brick, slot): (usize, &[u32; 3])| {
            let SampleBounds { bounds, rounding, halo } = bricks.bound(mesh.tree().arch, *slot);
            let at_jump = if mesh.is_continuous() { 0.0 } else { self.largest_at_sign_change(&halo, rounding) };
            // The terms of `dense::error_bound`.
            (bounds, round_up(interpolations[brick] + rounding + 2.0 * at_jump))
        };
        let (bounds, errors): (Vec<BlockBounds>, Vec<f32>) = slots.par_iter().enumerate().map(brick_bounds).unzip();
        let slope_bound = slope_bound(lattice, &storage, map, &table, &bounds);
        let error_bound = errors.iter().copied().fold(0.0, f32::max).into();
        SparseGrid { table, slots, scales, samples, bounds, errors, coarse, slope_bound, error_bound }
    }

    /// Computes bricks near the surface, and then those that close an open mesh, both in Hilbert order.
    fn all_bricks<C: Quantize>(&self, on_slots_done: &(dyn Fn(usize) + Sync)) -> BrickColumns<C> {
        let Self { mesh, map, .. } = self;
        let mut near_surface: Vec<usize> = (0..map.slot_count()).filter(|index| map.may_need_brick(*index)).collect();
        near_surface.par_sort_by_cached_key(|index| hilbert_index(map.slot(*index)));
        on_slots_done(map.slot_count() - near_surface.len());
        let slots: Vec<[u32; 3]> = near_surface.into_iter().map(|index| map.slot(index)).collect();
        let mut columns = self.near_bricks(&slots, on_slots_done);
        let mut at_jumps: Vec<usize> = map.slots_at_sign_jumps(&columns.table(map)).into_iter().collect();
        at_jumps.sort_unstable_by_key(|index| hilbert_index(map.slot(*index)));
        for indices in at_jumps.chunks(SLOTS_AT_A_TIME) {
            columns.extend(mesh, indices, |search, index| {
                if mesh.is_cancelled() { None } else { self.brick(search, map.slot(index), f64::INFINITY) }
            });
        }
        columns.samples.shrink_to_fit();
        columns
    }

    /// Computes the bricks of slots in Hilbert order, block by block. Samples are written where they stay, and the gaps of
    /// slots without a brick are closed at the end.
    fn near_bricks<C: Quantize>(&self, slots: &[[u32; 3]], on_slots_done: &(dyn Fn(usize) + Sync)) -> BrickColumns<C> {
        let mut samples = vec![C::default(); slots.len() * BRICK_SAMPLES];
        let block = |slot: &[u32; 3]| slot.map(|n| n / BLOCK);
        let mut free = &mut samples[..];
        let blocks: Vec<(&[[u32; 3]], &mut [C])> = slots
            .chunk_by(|a, b| block(a) == block(b))
            .map(|slots| {
                let (own, rest) = std::mem::take(&mut free).split_at_mut(slots.len() * BRICK_SAMPLES);
                free = rest;
                (slots, own)
            })
            .collect();
        let can_splat = can_splat(self.mesh);
        let records: Vec<(usize, Vec<BrickRecord>)> = blocks
            .into_par_iter()
            .with_max_len(1)
            .map_init(
                || (Splatter::new(), None),
                |(splatter, search), (slots, codes)| {
                    if self.mesh.is_cancelled() {
                        return (slots.len(), vec![]);
                    }
                    let splatted = if can_splat { self.splat(splatter, slots, codes) } else { None };
                    let records = splatted.unwrap_or_else(|| {
                        let search = search.get_or_insert_with(|| PacketSearch::new(self.mesh.tree()));
                        self.search_bricks(search, slots, codes)
                    });
                    on_slots_done(slots.len());
                    (slots.len(), records)
                },
            )
            .collect();
        let mut columns = BrickColumns::with_capacity(records.iter().map(|(_, records)| records.len()).sum());
        let (mut from, mut to) = (0, 0);
        for (slots, records) in records {
            let length = records.len() * BRICK_SAMPLES;
            if from != to {
                samples.copy_within(from..from + length, to);
            }
            (from, to) = (from + slots * BRICK_SAMPLES, to + length);
            records.into_iter().for_each(|record| columns.push(record));
        }
        samples.truncate(to);
        columns.samples = samples;
        columns
    }

    /// Computes the bricks of some slots node by node, where they cannot be splatted.
    fn search_bricks<C: Quantize>(
        &self,
        search: &mut PacketSearch,
        slots: &[[u32; 3]],
        codes: &mut [C],
    ) -> Vec<BrickRecord> {
        let mut records = vec![];
        for brick in slots.iter().filter_map(|slot| self.brick::<C>(search, *slot, self.map.kept_within())) {
            codes[records.len() * BRICK_SAMPLES..][..BRICK_SAMPLES].copy_from_slice(&brick.samples);
            records.push(brick.record);
        }
        records
    }

    /// Largest magnitude at a corner of a cell of the slot that the band can enter and whose corners can have both
    /// signs. Samples are off by `rounding` at most.
    fn largest_at_sign_change(&self, halo: &HaloBlock, rounding: f64) -> f64 {
        let rounding = round_up(rounding);
        let exact_within = round_up(self.map.exact_within()) + rounding;
        halo.largest_at_sign_change(rounding, exact_within.next_up()).into()
    }
}

impl<C: Quantize> BrickColumns<C> {
    fn with_capacity(bricks: usize) -> Self {
        Self {
            slots: Vec::with_capacity(bricks),
            scales: Vec::with_capacity(bricks),
            samples: vec![],
            roundings: Vec::with_capacity(bricks),
            interpolations: Vec::with_capacity(bricks),
        }
    }

    fn push(&mut self, record: BrickRecord) {
        self.slots.push(record.slot);
        self.scales.push(record.scale);
        self.roundings.push(record.rounding);
        self.interpolations.push(record.interpolation);
    }

    fn extend(
        &mut self,
        mesh: &MeshDistance,
        indices: &[usize],
        brick: impl Fn(&mut PacketSearch, usize) -> Option<Brick<C>> + Sync,
    ) {
        let bricks =
            indices.par_iter().map_init(|| PacketSearch::new(mesh.tree()), |search, index| brick(search, *index));
        let bricks: Vec<Brick<C>> = bricks.flatten().collect();
        for brick in bricks {
            self.samples.extend(brick.samples);
            self.push(brick.record);
        }
    }

    /// Index of the brick in each slot.
    fn table(&self, map: &BrickMap) -> Vec<u32> {
        let mut table = vec![NO_BRICK; map.slot_count()];
        for (brick, slot) in (0..).zip(&self.slots) {
            table[map.index(*slot)] = brick;
        }
        table
    }
}

/// Lipschitz constant of the whole grid. A cell without a corner in a brick lies in one cell of the coarse grid. It is
/// at most as steep, up to the rounding of interpolation in f32.
fn slope_bound<C: Quantize>(
    lattice: &Lattice,
    storage: &Sparse<BrickSlices<C>>,
    map: &BrickMap,
    table: &[u32],
    bricks: &[BlockBounds],
) -> f64 {
    let coarse_slope = |index: usize| {
        let corners = storage.coarse_corners(map.slot(index));
        let max_magnitude = corners.iter().fold(0.0_f32, |max, corner| max.max(corner.abs()));
        let rounding = COARSE_DIFFERENCE_ROUNDING * f64::from(max_magnitude) / lattice.spacing();
        cell_slope(corners, lattice.spacing() * f64::from(BRICK)) + 3.0_f64.sqrt() * rounding
    };
    let without_brick = (0..table.len()).into_par_iter().filter(|index| table[*index] == NO_BRICK);
    let coarse = without_brick.map(coarse_slope).reduce(|| 0.0, f64::max);
    let inside = bricks.iter().map(|brick| f64::from(brick.slope_bound)).fold(coarse, f64::max);
    slope_bound_with_outside(inside, inside_reaches_box(lattice, |node| storage.node(node)))
}
