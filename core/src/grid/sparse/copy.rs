//! Copies of rows and boxes of nodes out of bricks and coarse cells, for searches that read the same nodes often.
//!
//! A row is cut where it leaves a slot. Eight samples of a slot are written at once, whatever the number that is wanted: what follows in
//! the copy is written later.

use nalgebra::Vector3;

use super::{BRICK, BRICK_SAMPLES, BrickData, Code, Sparse};
use crate::grid::brick::brick_slot;
use crate::grid::storage::copy_rows;
use crate::grid::trilinear;

/// Most slots along a row of a box that is copied slot by slot.
const ROW_SLOTS: usize = 8;

/// Source of the samples of one slot.
#[derive(Clone, Copy)]
enum SlotSamples {
    Brick(usize),
    /// An empty slot: the corners of its coarse cell.
    Coarse([f32; 8]),
}

impl<B: BrickData> Sparse<B> {
    /// Source of the samples of a slot.
    #[inline(always)]
    fn slot_samples(&self, slot: [u32; 3]) -> SlotSamples {
        self.brick_in_slot(slot).map_or_else(|| SlotSamples::Coarse(self.coarse_corners(slot)), SlotSamples::Brick)
    }

    /// Samples of a slot along x from a node on: as many as wanted, and whatever follows them.
    #[inline(always)]
    fn copy_from_slot(&self, source: &SlotSamples, [x, y, z]: [u32; 3], count: u32, samples: &mut [f32; 8]) {
        match source {
            SlotSamples::Brick(brick) => self.copy_codes(*brick, [x, y, z], count, samples),
            SlotSamples::Coarse(corners) => {
                let fraction = |index: u32| (index % BRICK) as f32 / BRICK as f32;
                let (y, z) = (fraction(y), fraction(z));
                // All eight, though the coarse cell ends before: the rest is overwritten.
                for (index, sample) in (0..8_u16).zip(samples) {
                    let x = ((x % BRICK) as f32 + f32::from(index)) / BRICK as f32;
                    *sample = trilinear::interpolate(*corners, Vector3::new(x, y, z)).0;
                }
            }
        }
    }

    /// Samples of a brick along x from a node on: as many as wanted, and whatever follows them.
    #[inline(always)]
    fn copy_codes(&self, brick: usize, [x, y, z]: [u32; 3], count: u32, samples: &mut [f32; 8]) {
        let first = (((z % BRICK) * BRICK + y % BRICK) * BRICK + x % BRICK) as usize;
        let first = brick.wrapping_mul(BRICK_SAMPLES).wrapping_add(first);
        let (Some(codes), Some(scale)) = (self.bricks.codes().get(first..), self.bricks.scale(brick)) else { return };
        match codes.first_chunk::<8>() {
            Some(codes) => samples.iter_mut().zip(codes).for_each(|(sample, code)| *sample = code.decode(scale)),
            None => {
                let wanted = samples.iter_mut().take(count as usize);
                wanted.zip(codes).for_each(|(sample, code)| *sample = code.decode(scale));
            }
        }
    }

    /// Implements [`copy_row`](crate::grid::Storage::copy_row).
    pub(super) fn copy_slots_along_row(&self, [x, y, z]: [u32; 3], count: u32, row: &mut [f32]) {
        let end = x.saturating_add(count);
        let mut node = x;
        while node < end {
            let slot = brick_slot([node, y, z]);
            let next = slot[0].wrapping_add(1).wrapping_mul(BRICK).min(end);
            let rest = row.get_mut(node.wrapping_sub(x) as usize..).unwrap_or(&mut []);
            let rest = rest.get_mut(..BRICK as usize).and_then(|rest| rest.first_chunk_mut::<8>());
            let Some(rest) = rest else { return };
            self.copy_from_slot(&self.slot_samples(slot), [node, y, z], next.wrapping_sub(node), rest);
            node = next;
        }
    }

    /// Implements [`copy_box`](crate::grid::Storage::copy_box). Each slot is found once for all of its rows in a layer.
    pub(super) fn copy_slots_of_box(&self, [x, y, z]: [u32; 3], [nx, ny, nz]: [u32; 3], samples: &mut [f32]) {
        let [end_x, end_y, end_z] = [x.saturating_add(nx), y.saturating_add(ny), z.saturating_add(nz)];
        let first_slot = x / BRICK;
        let slot_count = (end_x.saturating_sub(1) / BRICK).saturating_sub(first_slot).saturating_add(1) as usize;
        let mut sources = [SlotSamples::Brick(0); ROW_SLOTS];
        // Small processors have less room for a stack.
        let sources = if cfg!(feature = "std") { sources.get_mut(..slot_count) } else { None };
        let Some(sources) = sources else {
            return copy_rows(self, [x, y, z], [nx, ny, nz], samples);
        };
        let mut at = 0_usize;
        for k in z..end_z {
            for j in y..end_y {
                if j == y || j % BRICK == 0 {
                    for (slot, source) in sources.iter_mut().enumerate() {
                        let x = first_slot.wrapping_add(slot as u32);
                        *source = self.slot_samples([x, j / BRICK, k / BRICK]);
                    }
                }
                let mut node = x;
                for source in sources.iter() {
                    let next = (node / BRICK).wrapping_add(1).wrapping_mul(BRICK).min(end_x);
                    let rest = samples.get_mut(at..).and_then(|rest| rest.first_chunk_mut::<8>());
                    let Some(rest) = rest else { return };
                    self.copy_from_slot(source, [node, j, k], next.wrapping_sub(node), rest);
                    at = at.wrapping_add(next.wrapping_sub(node) as usize);
                    node = next;
                }
            }
        }
    }
}
