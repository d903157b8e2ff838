//! Errors of the cells of a sparse grid: by brick near the surface, by the coarse grid beyond the band, and where the sign
//! of an open mesh jumps there.

use super::{BrickData, Sparse, merge_slots, range_of};
use crate::grid::{BlockBounds, CellErrors, JumpLimits, Storage};
use crate::number::interval::Interval;

/// Most cells that are searched for a jump: as many as a brick has.
const MAX_CELLS: u32 = 512;

/// Errors and bounds of the slots that hold nodes of some cells.
struct SlotErrors {
    near: f32,
    bounds: BlockBounds,
}

impl SlotErrors {
    const NONE: Self = Self { near: 0.0, bounds: BlockBounds::EMPTY };

    fn union(self, other: Self) -> Self {
        Self { near: self.near.max(other.near), bounds: self.bounds.union(other.bounds) }
    }
}

impl<B: BrickData> Sparse<B> {
    /// See [`Storage::cell_errors`].
    #[inline(always)]
    pub(super) fn errors_between(&self, first: [u32; 3], last: [u32; 3], limits: JumpLimits) -> Option<CellErrors> {
        let slots = merge_slots(first, last, SlotErrors::NONE, |slot| self.slot_errors(slot), SlotErrors::union)?;
        let BlockBounds { range, slope_bound } = slots.bounds;
        let jump = if slope_bound < limits.slope { 0.0 } else { self.largest_jump(first, last, slope_bound, limits) };
        Some(CellErrors { near: slots.near, range, jump })
    }

    /// `None` where no error of the slot's brick is stored. The sign jumps in bricks alone.
    #[inline(always)]
    fn slot_errors(&self, slot: [u32; 3]) -> Option<SlotErrors> {
        let Some(brick) = self.brick_in_slot(slot) else {
            let bounds = BlockBounds { range: range_of(self.coarse_corners(slot)), slope_bound: 0.0 };
            return Some(SlotErrors { near: 0.0, bounds });
        };
        Some(SlotErrors { near: self.bricks.error_of_brick(brick)?, bounds: self.bricks.bounds_of_brick(brick)? })
    }

    /// Largest rise in one of the cells between two nodes whose corners are beyond the band on both sides; what their slope allows where
    /// these are many.
    fn largest_jump(&self, first: [u32; 3], last: [u32; 3], slope_bound: f32, limits: JumpLimits) -> f32 {
        let counts: [u32; 3] = core::array::from_fn(|axis| last[axis].wrapping_sub(first[axis]));
        if counts.into_iter().fold(1, u32::saturating_mul) > MAX_CELLS {
            return slope_bound * limits.diagonal;
        }
        let mut largest = 0.0;
        for z in first[2]..last[2] {
            for y in first[1]..last[1] {
                for x in first[0]..last[0] {
                    let Interval { lower, upper } = range_of(self.corners([x, y, z]));
                    let rise = upper - lower;
                    if lower < 0.0 && upper >= 0.0 && rise >= limits.rise && rise > largest {
                        largest = rise;
                    }
                }
            }
        }
        largest
    }
}
