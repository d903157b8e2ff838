//! Bricks of some slots, computed on all threads: splatted, or node by node, each group of slots by one thread. Samples are written
//! where they stay.

use sdf_core::grid::sparse::BRICK_SAMPLES;

use super::part::BrickColumns;
use super::splat::{BLOCK, BrickRecord, Splatter};
use super::{Certify, CodesMut, Quantize, SparseBaker};
use crate::nearest::PacketSearch;

impl SparseBaker<'_> {
    /// Computes the bricks of slots near the surface, in Hilbert order, block by block.
    pub(super) fn near_bricks<C: Quantize>(
        &self,
        slots: &[[u32; 3]],
        on_slots_done: &(dyn Fn(usize) + Sync),
    ) -> (BrickColumns, Vec<C>) {
        let block = |slot: &[u32; 3]| slot.map(|n| n / BLOCK);
        if self.frames.is_none() || self.certify == Certify::Tight {
            self.mesh.tree().prepare_packets();
        }
        self.collect(slots.chunk_by(|a, b| block(a) == block(b)), slots.len(), &|workspace, slots, codes| {
            let splatted = self.splat(&mut workspace.splatter, slots, codes);
            let records =
                splatted.unwrap_or_else(|| self.search_bricks(workspace, slots, self.map.kept_within(), codes));
            on_slots_done(slots.len());
            records
        })
    }

    /// Computes the bricks of slots that hold exact distances throughout, to close an open mesh.
    pub(super) fn closing_bricks<C: Quantize>(&self, slots: &[[u32; 3]]) -> (BrickColumns, Vec<C>) {
        if !slots.is_empty() {
            self.mesh.tree().prepare_packets();
        }
        self.collect(slots.chunks(1), slots.len(), &|workspace, slots, codes| {
            self.search_bricks(workspace, slots, f64::INFINITY, codes)
        })
    }

    /// The bricks of groups of slots, each computed by `compute`. Samples are written where they stay, and the gaps of slots without
    /// a brick are closed at the end.
    fn collect<'b, C: Quantize>(
        &'b self,
        groups: impl Iterator<Item = &'b [[u32; 3]]>,
        slot_count: usize,
        compute: &ComputeBricks<'b>,
    ) -> (BrickColumns, Vec<C>) {
        let mut samples = vec![C::default(); slot_count * BRICK_SAMPLES];
        let mut free = &mut samples[..];
        let groups = groups.map(|slots| {
            let (own, rest) = std::mem::take(&mut free).split_at_mut(slots.len() * BRICK_SAMPLES);
            free = rest;
            (slots, C::codes_mut(own))
        });
        let records = self.records(groups.collect(), compute);
        let mut columns = BrickColumns::default();
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
        (columns, samples)
    }

    /// The number of slots of each group, and the records of its bricks.
    fn records<'b>(
        &'b self,
        groups: Vec<(&[[u32; 3]], CodesMut)>,
        compute: &ComputeBricks<'b>,
    ) -> Vec<(usize, Vec<BrickRecord>)> {
        let workspace = || Workspace { splatter: Splatter::new(), search: None };
        sdf_parallel::map_items(groups, workspace, |workspace, (slots, mut codes)| {
            let records = if self.mesh.is_cancelled() { vec![] } else { compute(workspace, slots, &mut codes) };
            (slots.len(), records)
        })
    }

    /// Computes the bricks of some slots node by node, where they cannot be splatted.
    fn search_bricks<'b>(
        &'b self,
        workspace: &mut Workspace<'b>,
        slots: &[[u32; 3]],
        required: f64,
        codes: &mut CodesMut,
    ) -> Vec<BrickRecord> {
        let search = workspace.search.get_or_insert_with(|| PacketSearch::new(self.mesh.tree()));
        let mut records = vec![];
        for slot in slots {
            let start = records.len() * BRICK_SAMPLES;
            records.extend(self.brick(search, *slot, required, codes.range(start, start + BRICK_SAMPLES)));
        }
        records
    }
}

/// Computes the bricks of some slots and writes their codes, one after the other.
type ComputeBricks<'b> = dyn Fn(&mut Workspace<'b>, &[[u32; 3]], &mut CodesMut) -> Vec<BrickRecord> + Sync + 'b;

/// Scratch buffers of one thread.
struct Workspace<'b> {
    splatter: Splatter,
    search: Option<PacketSearch<'b>>,
}
