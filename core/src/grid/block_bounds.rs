//! Bounds of the values and slopes in blocks of 8 × 8 × 8 nodes, one per brick slot.
//!
//! With them a cull uses the slope near an element; without them it has only the slope of the steepest cell of the
//! grid.

use super::brick::{brick_counts, brick_slot};
use super::storage::TEAM_LANES;
use super::{BlockBounds, CellErrors, JumpLimits, Lattice, Storage};
use crate::number::Float;

/// Largest number of blocks merged per query. Larger elements gain little from local bounds.
const MAX_BLOCKS: u32 = 64;

/// A storage together with [`BlockBounds`] of each brick slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WithBlockBounds<S, B> {
    storage: S,
    bounds: B,
    /// Blocks along each axis.
    block_counts: [u32; 3],
}

impl<S: Storage, B: AsRef<[BlockBounds]>> WithBlockBounds<S, B> {
    /// `bounds` holds one entry per brick slot, x fastest. `None` unless their number is the product of
    /// [`brick_counts`](super::sparse::brick_counts).
    pub fn new(lattice: &Lattice, storage: S, bounds: B) -> Option<Self> {
        let block_counts = brick_counts(lattice);
        let count = block_counts.iter().try_fold(1, |n: usize, along| n.checked_mul(*along as usize));
        (count == Some(bounds.as_ref().len())).then_some(Self { storage, bounds, block_counts })
    }

    /// The storage of the samples.
    pub fn storage(&self) -> &S {
        &self.storage
    }

    /// Bounds by brick slot, x fastest.
    pub fn bounds(&self) -> &[BlockBounds] {
        self.bounds.as_ref()
    }

    /// The bounds of a slot.
    #[inline(always)]
    fn at(&self, slot: [u32; 3]) -> Option<&BlockBounds> {
        let (count_x, count_y) = (self.block_counts[0] as usize, self.block_counts[1] as usize);
        let (x, y, z) = (slot[0] as usize, slot[1] as usize, slot[2] as usize);
        self.bounds.as_ref().get((z * count_y + y) * count_x + x)
    }
}

impl<S: Storage, B: AsRef<[BlockBounds]>> Storage for WithBlockBounds<S, B> {
    #[inline(always)]
    fn corners(&self, cell: [u32; 3]) -> [f32; 8] {
        self.storage.corners(cell)
    }

    #[inline(always)]
    fn corners_in_lanes<R: Float, const N: usize>(&self, cells: [[R; N]; 3]) -> [[R; N]; 8] {
        self.storage.corners_in_lanes(cells)
    }

    const IS_COPIED: bool = S::IS_COPIED;

    #[inline(always)]
    fn copy_row(&self, first: [u32; 3], count: u32, row: &mut [f32]) {
        self.storage.copy_row(first, count, row);
    }

    #[inline(always)]
    fn copy_box(&self, first: [u32; 3], counts: [u32; 3], samples: &mut [f32]) {
        self.storage.copy_box(first, counts, samples);
    }

    const LANES_OF_THREAD: usize = S::LANES_OF_THREAD;

    #[inline(always)]
    fn first_lane(&self) -> usize {
        self.storage.first_lane()
    }

    #[inline(always)]
    fn of_lane<T: Copy>(&self, computed: &[T; TEAM_LANES], lane: usize) -> T {
        self.storage.of_lane(computed, lane)
    }

    #[inline(always)]
    fn lanes_where(&self, computed: &[u8; TEAM_LANES]) -> u32 {
        self.storage.lanes_where(computed)
    }

    const HAS_CELL_ERRORS: bool = S::HAS_CELL_ERRORS;

    fn cell_errors(&self, first: [u32; 3], last: [u32; 3], limits: JumpLimits) -> Option<CellErrors> {
        self.storage.cell_errors(first, last, limits)
    }

    const HAS_LOWEST: bool = true;

    #[inline(always)]
    fn lowest(&self, first: [u32; 3], last: [u32; 3]) -> Option<f32> {
        merge_slots(first, last, f32::INFINITY, |slot| Some(self.at(slot)?.range.lower), f32::min)
    }

    const HAS_BLOCK_BOUNDS: bool = true;

    #[inline(always)]
    fn block_bounds(&self, first: [u32; 3], last: [u32; 3]) -> Option<BlockBounds> {
        merge_blocks(first, last, |slot| self.at(slot).copied())
    }
}

/// Union of the bounds of all blocks that hold a node from `first` to `last`. `None` if there are more than
/// [`MAX_BLOCKS`], or where `slot_bounds` is.
#[inline(always)]
pub(super) fn merge_blocks(
    first: [u32; 3],
    last: [u32; 3],
    slot_bounds: impl Fn([u32; 3]) -> Option<BlockBounds>,
) -> Option<BlockBounds> {
    merge_slots(first, last, BlockBounds::EMPTY, slot_bounds, BlockBounds::union)
}

/// Union, from `empty` on, of the results of `get` for all slots that hold a node from `first` to `last`. `None` if there are
/// more than [`MAX_BLOCKS`], or where `get` returns it.
#[inline(always)]
pub(super) fn merge_slots<T>(
    first: [u32; 3],
    last: [u32; 3],
    empty: T,
    get: impl Fn([u32; 3]) -> Option<T>,
    union: impl Fn(T, T) -> T,
) -> Option<T> {
    let (first, last) = (brick_slot(first), brick_slot(last));
    // The common case: most elements are smaller than a block.
    if first == last {
        return Some(union(empty, get(first)?));
    }
    let mut count = 1_u32;
    for axis in 0..3 {
        count = count.saturating_mul(last[axis].checked_sub(first[axis])?.saturating_add(1));
    }
    if count > MAX_BLOCKS {
        return None;
    }
    let mut merged = empty;
    for z in first[2]..=last[2] {
        for y in first[1]..=last[1] {
            for x in first[0]..=last[0] {
                merged = union(merged, get([x, y, z])?);
            }
        }
    }
    Some(merged)
}
