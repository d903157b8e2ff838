//! Parts of a bake: the bricks of a stretch of the Hilbert curve, measured by themselves, their samples given away as they come.
//!
//! A brick depends on the mesh and on its slot alone, so parts can be baked on different machines, or one after the other into a file.
//! Bounds of a brick need the samples around it, which may lie in other parts: they are computed when all parts are joined
//! ([`UnboundedGrid`](super::UnboundedGrid)), and no part bakes a border of others.
//!
//! The slots near the surface, in Hilbert order, are cut into stretches of whole blocks, as a block is measured at once. Which bricks
//! close an open mesh depends on which slots have none, in all parts. So a part bakes every slot of its stretch that may be such a
//! brick, whatever the other parts have; few are in vain, at the ends of the stretch.

use sdf_core::grid::sparse::{NO_BRICK, Scale};
use sdf_core::hilbert::hilbert_index;

use super::splat::{BLOCK, BrickRecord};
use super::{Quantize, SLOTS_AT_A_TIME, SparseBaker};
use crate::curve_order::curve_order;

/// A part of the bricks of a grid: the `index`-th of `count` parts, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BrickShard {
    /// Index, less than the count.
    pub index: u32,
    /// Number of parts.
    pub count: u32,
}

impl BrickShard {
    /// All bricks.
    pub const WHOLE: Self = Self { index: 0, count: 1 };
}

/// Facts of bricks beside their samples, as a structure of arrays.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BrickColumns {
    /// Slot of each brick.
    pub slots: Vec<[u32; 3]>,
    /// Decoding of each brick's codes.
    pub scales: Vec<Scale>,
    /// Largest difference of a decoded sample from the value it stands for.
    pub roundings: Vec<f64>,
    /// Error of interpolating exact distances within the band, jumps of the sign not included.
    pub interpolations: Vec<f64>,
}

/// The bricks of one part, without their samples.
#[derive(Clone, Debug, PartialEq)]
pub struct BakedPart {
    /// Bricks near the surface, in Hilbert order.
    pub near: BrickColumns,
    /// Bricks that may close an open mesh, in Hilbert order; their samples come after the others.
    pub closing: BrickColumns,
}

impl BrickColumns {
    pub(super) fn push(&mut self, record: BrickRecord) {
        self.slots.push(record.slot);
        self.scales.push(record.scale);
        self.roundings.push(record.rounding);
        self.interpolations.push(record.interpolation);
    }

    /// Appends other bricks.
    pub fn append(&mut self, other: Self) {
        self.slots.extend(other.slots);
        self.scales.extend(other.scales);
        self.roundings.extend(other.roundings);
        self.interpolations.extend(other.interpolations);
    }

    /// Appends one brick of others.
    pub(super) fn append_one(&mut self, other: &Self, brick: usize) {
        self.slots.push(other.slots[brick]);
        self.scales.push(other.scales[brick]);
        self.roundings.push(other.roundings[brick]);
        self.interpolations.push(other.interpolations[brick]);
    }
}

impl SparseBaker<'_> {
    /// Bakes a part of the bricks. `take` receives the codes of bricks in their order, those of about `slots_at_a_time` slots at once.
    ///
    /// Calls `on_slots_done` with the number of slots just finished, out of [`Self::slot_count`], from any thread. The result depends
    /// neither on the number of threads nor on `slots_at_a_time`.
    pub fn bake_part<C: Quantize, E>(
        &self,
        shard: BrickShard,
        slots_at_a_time: usize,
        take: &mut dyn FnMut(Vec<C>) -> Result<(), E>,
        on_slots_done: &(dyn Fn(usize) + Sync),
    ) -> Result<BakedPart, E> {
        let map = &self.map;
        let all = self.near_slots();
        let stretch = Stretch::new(&all, shard);
        let slots = &all[stretch.first..stretch.end];
        on_slots_done(map.slot_count() - slots.len());
        let mut near = BrickColumns::default();
        for slots in whole_blocks(slots, slots_at_a_time) {
            let (columns, samples) = self.near_bricks(slots, on_slots_done);
            near.append(columns);
            take(samples)?;
        }
        let coarse = map.coarse();
        let table = coarse.table(&near.slots);
        let is_own = |slot: [u32; 3]| stretch.is_whole() || stretch.contains(hilbert_index(slot));
        let may_be_empty = |slot: [u32; 3]| {
            let index = map.index(slot);
            let is_known = is_own(slot) || !map.may_need_brick(index);
            table.get(slot) == Some(NO_BRICK) && (is_known || map.may_have_no_brick(index))
        };
        let at_jumps = coarse.slots_at_sign_jumps(may_be_empty).into_iter().filter(|index| is_own(map.slot(*index)));
        let mut at_jumps: Vec<usize> = at_jumps.collect();
        at_jumps.sort_unstable_by_key(|index| hilbert_index(map.slot(*index)));
        let mut closing = BrickColumns::default();
        for indices in at_jumps.chunks(SLOTS_AT_A_TIME) {
            let slots: Vec<[u32; 3]> = indices.iter().map(|index| map.slot(*index)).collect();
            let (columns, samples) = self.closing_bricks(&slots);
            closing.append(columns);
            take(samples)?;
        }
        Ok(BakedPart { near, closing })
    }

    /// Slots that may need a brick, in Hilbert order.
    fn near_slots(&self) -> Vec<[u32; 3]> {
        let map = &self.map;
        let near = sdf_parallel::filter(map.slot_count(), |index| map.may_need_brick(index));
        let slot = |at: usize| map.slot(near[at]);
        curve_order(near.len(), slot).into_iter().map(|at| slot(at as usize)).collect()
    }
}

/// A stretch of the Hilbert curve.
struct Stretch {
    /// The slots near the surface in it: from this one on.
    first: usize,
    /// To before this one.
    end: usize,
    /// Hilbert indices of all slots in it.
    indices: std::ops::Range<u64>,
}

impl Stretch {
    /// A shard of slots in Hilbert order, in whole blocks.
    fn new(slots: &[[u32; 3]], BrickShard { index, count }: BrickShard) -> Self {
        let cut = |part: u32| {
            let near = (slots.len() as u128 * u128::from(part) / u128::from(count.max(1))) as usize;
            (near..slots.len()).find(|at| is_block_start(slots, *at)).unwrap_or(slots.len())
        };
        let index_at = |at: usize| slots.get(at).map_or(u64::MAX, |slot| hilbert_index(*slot));
        let (first, end) = (cut(index), cut(index + 1));
        // The first and the last reach to the ends of the curve.
        let start = if index == 0 { 0 } else { index_at(first) };
        let stop = if index + 1 == count { u64::MAX } else { index_at(end) };
        Self { first, end, indices: start..stop }
    }

    /// Does it hold all slots?
    fn is_whole(&self) -> bool {
        self.indices == (0..u64::MAX)
    }

    fn contains(&self, index: u64) -> bool {
        self.indices.contains(&index)
    }
}

fn is_block_start(slots: &[[u32; 3]], at: usize) -> bool {
    let block = |slot: [u32; 3]| slot.map(|n| n / BLOCK);
    at == 0 || block(slots[at - 1]) != block(slots[at])
}

/// Pieces of at most `slots_at_a_time` slots, and one block more.
fn whole_blocks(slots: &[[u32; 3]], slots_at_a_time: usize) -> impl Iterator<Item = &[[u32; 3]]> {
    let mut first = 0;
    std::iter::from_fn(move || {
        let rest = &slots[first..];
        if rest.is_empty() {
            return None;
        }
        let least = slots_at_a_time.max(1).min(rest.len());
        let end = (least..rest.len()).find(|at| is_block_start(rest, *at)).unwrap_or(rest.len());
        first += end;
        Some(&rest[..end])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every slot is in exactly one shard, by its place and by its Hilbert index, and no block is cut; with more shards than blocks
    /// too.
    #[test]
    fn shards_are_whole_blocks_and_share_out_all_slots() {
        let mut slots: Vec<[u32; 3]> =
            (0..1000_u32).map(|n| [n % 10, n / 10 % 10, n / 100]).filter(|[x, y, z]| (x + y + z) % 3 > 0).collect();
        slots.sort_unstable_by_key(|slot| hilbert_index(*slot));
        for count in [1, 2, 3, 7, 27, 28, 100] {
            let stretches: Vec<Stretch> =
                (0..count).map(|index| Stretch::new(&slots, BrickShard { index, count })).collect();
            assert_eq!((stretches[0].first, stretches[count as usize - 1].end), (0, slots.len()));
            for pair in stretches.windows(2) {
                assert_eq!(pair[0].end, pair[1].first);
                assert!(pair[0].end == slots.len() || is_block_start(&slots, pair[0].end));
            }
            for (at, slot) in slots.iter().enumerate() {
                let holders = |stretch: &&Stretch| stretch.contains(hilbert_index(*slot));
                assert_eq!(stretches.iter().filter(holders).count(), 1, "{slot:?} of {count}");
                let holder = stretches.iter().find(holders).unwrap();
                assert!((holder.first..holder.end).contains(&at));
            }
        }
        assert_eq!(whole_blocks(&slots, 70).flatten().copied().collect::<Vec<_>>(), slots);
        assert!(whole_blocks(&slots, 70).all(|piece| piece.len() < 70 + 64));
    }
}
