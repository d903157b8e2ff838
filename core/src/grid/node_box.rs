//! The samples of a small box of nodes, copied out of a storage.
//!
//! A search on one triangle reads the same few nodes again and again. From a sparse grid each would be found anew in the table of
//! bricks and decoded; copied once, brick by brick, they lie side by side as in a dense grid.

use super::{Dense, Storage};
use crate::number::{Float, Real};

/// Most nodes in a box, those that are read beyond the last row included. Small processors have less memory for a stack.
pub(super) const ROOM: usize = if cfg!(feature = "std") { 1024 } else { 256 };

/// Nodes that [`Storage::copy_box`] may write beyond the end of the box.
pub(super) const SPILL: usize = 8;

/// A copy of the nodes of a box. Cells are counted as in the grid.
pub(super) struct NodeBox {
    samples: Dense<[f32; ROOM]>,
    first: [u32; 3],
    counts: [u32; 3],
}

impl NodeBox {
    /// A copy of so many nodes from `first` on. Their number is at most [`ROOM`] − [`SPILL`].
    #[inline(always)]
    pub fn new<S: Storage>(storage: &S, first: [u32; 3], counts: [u32; 3]) -> Self {
        let [x, y, _] = counts;
        let mut samples = [0.0; ROOM];
        storage.copy_box(first, counts, &mut samples);
        let row = x as usize;
        Self { samples: Dense::with_rows(samples, row, row.wrapping_mul(y as usize)), first, counts }
    }

    /// Is every sample finite?
    #[inline(always)]
    pub fn is_finite(&self) -> bool {
        let mut largest = [0; SPILL];
        let count = self.counts.iter().fold(1, |count: usize, along| count.wrapping_mul(*along as usize));
        for samples in self.samples.samples().as_chunks::<SPILL>().0.iter().take(count.div_ceil(SPILL)) {
            for lane in 0..SPILL {
                largest[lane] = largest[lane].max(samples[lane].abs().to_bits());
            }
        }
        largest.into_iter().all(|bits| f32::from_bits(bits).is_finite())
    }

    /// The lowest sample of each of the first eight cells of a row along x; meaningless beyond the box.
    #[inline(always)]
    pub fn lowest_in_row(&self, y: u32, z: u32) -> Option<[f32; SPILL]> {
        let [row, rows, _] = self.counts.map(|count| count as usize);
        let layer = row.wrapping_mul(rows);
        let first = (z as usize).wrapping_mul(layer).wrapping_add((y as usize).wrapping_mul(row));
        let samples = |start: usize| self.samples.samples().get(start..)?.first_chunk::<{ SPILL + 1 }>();
        let [a, b] = [samples(first)?, samples(first.wrapping_add(row))?];
        let [c, d] = [samples(first.wrapping_add(layer))?, samples(first.wrapping_add(layer).wrapping_add(row))?];
        let mut lowest = [0.0; SPILL];
        for lane in 0..SPILL {
            let near = Real::min(Real::min(a[lane], b[lane]), Real::min(c[lane], d[lane]));
            let next = lane + 1;
            let far = Real::min(Real::min(a[next], b[next]), Real::min(c[next], d[next]));
            lowest[lane] = Real::min(near, far);
        }
        Some(lowest)
    }
}

impl Storage for NodeBox {
    #[inline(always)]
    fn corners(&self, [x, y, z]: [u32; 3]) -> [f32; 8] {
        let [x0, y0, z0] = self.first;
        self.samples.corners([x.wrapping_sub(x0), y.wrapping_sub(y0), z.wrapping_sub(z0)])
    }

    #[inline(always)]
    fn corners_in_lanes<R: Float, const N: usize>(&self, mut cells: [[R; N]; 3]) -> [[R; N]; 8] {
        for axis in 0..3 {
            let first = R::from_f64(f64::from(self.first[axis]));
            for cell in 0..N {
                cells[axis][cell] -= first;
            }
        }
        self.samples.corners_in_lanes(cells)
    }
}
