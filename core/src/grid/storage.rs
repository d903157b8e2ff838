//! How are a grid's samples read? One cell at a time, in lanes, or a box of them copied; with bounds of blocks, where a storage has them.

use super::{BlockBounds, CellErrors, JumpLimits};
use crate::number::Float;

/// Lanes of a loop that a team of threads shares: see [`Storage::LANES_OF_THREAD`].
pub const TEAM_LANES: usize = 8;

/// Access to a grid's samples.
pub trait Storage {
    /// Samples at the eight corners of a cell, x fastest: 000, 100, 010, 110, 001, 101, 011, 111. The cell's indices
    /// are below [`Lattice::cells`](super::Lattice::cells).
    fn corners(&self, cell: [u32; 3]) -> [f32; 8];

    /// [`corners`](Self::corners) of `N` cells. Indices are given axis by axis as whole numbers; the result is by
    /// corner, then by cell.
    #[inline(always)]
    fn corners_in_lanes<R: Float, const N: usize>(&self, [x, y, z]: [[R; N]; 3]) -> [[R; N]; 8] {
        let mut corners = [[R::zero(); N]; 8];
        for cell in 0..N {
            let samples = self.corners([x[cell].to_index(), y[cell].to_index(), z[cell].to_index()]);
            for corner in 0..8 {
                corners[corner][cell] = R::from_stored(samples[corner]);
            }
        }
        corners
    }

    /// Is it dear to read a node? A search that reads the same nodes often then copies them first, by
    /// [`copy_box`](Self::copy_box).
    const IS_COPIED: bool = false;

    /// Copies `count` samples along x from the node `first` on, and may write up to eight more. `row` has room for them; where it
    /// has not, fewer are copied.
    fn copy_row(&self, [x, y, z]: [u32; 3], count: u32, row: &mut [f32]) {
        for (node, sample) in (x..x.saturating_add(count)).zip(row) {
            // The last node along an axis is the far corner of the cell before.
            let back = |index: u32| index.saturating_sub(1);
            let corner = usize::from(node > 0) | usize::from(y > 0) << 1 | usize::from(z > 0) << 2;
            *sample = self.corners([back(node), back(y), back(z)])[corner % 8];
        }
    }

    /// Copies the samples of a box of so many nodes from the node `first` on, x fastest, and may write up to eight more. `samples`
    /// has room for them; where it has not, fewer are copied.
    #[inline(always)]
    fn copy_box(&self, first: [u32; 3], counts: [u32; 3], samples: &mut [f32]) {
        copy_rows(self, first, counts, samples);
    }

    /// How many of eight lanes does this thread compute? The exact minimum on a segment or triangle takes eight cells or lines at a
    /// time. One thread computes all of them. On a card eight threads run the same search and compute a lane each, at index 0 of their arrays;
    /// then every thread reads from the others what it needs, by [`of_lane`](Self::of_lane). So all of them go the same way.
    const LANES_OF_THREAD: usize = TEAM_LANES;

    /// The first of the lanes that this thread computes.
    #[inline(always)]
    fn first_lane(&self) -> usize {
        0
    }

    /// The value of one of the eight lanes, of those that each thread computed. All threads of the team ask at once, each for any lane.
    #[inline(always)]
    fn of_lane<T: Copy>(&self, computed: &[T; TEAM_LANES], lane: usize) -> T {
        computed[lane % TEAM_LANES]
    }

    /// Bit k: is that of lane k not zero?
    #[inline(always)]
    fn lanes_where(&self, computed: &[u8; TEAM_LANES]) -> u32 {
        (0..TEAM_LANES).fold(0, |bits, lane| bits | u32::from(computed[lane] != 0).wrapping_shl(lane as u32))
    }

    /// See [`EnclosedSdf::SLOPES_TAKE_LONG`](crate::EnclosedSdf::SLOPES_TAKE_LONG).
    const SLOPES_TAKE_LONG: bool = false;

    /// Does [`lowest`](Self::lowest) take less time than [`block_bounds`](Self::block_bounds)? If not, no cull calls it.
    const HAS_LOWEST: bool = false;

    /// Lower end of the range of `block_bounds`.
    fn lowest(&self, first: [u32; 3], last: [u32; 3]) -> Option<f32> {
        self.block_bounds(first, last).map(|bounds| bounds.range.lower)
    }

    /// Can [`block_bounds`](Self::block_bounds) return `Some`? If not, it is never called.
    const HAS_BLOCK_BOUNDS: bool = false;

    /// Can [`cell_errors`](Self::cell_errors) return `Some`? If not, it is never called.
    const HAS_CELL_ERRORS: bool = false;

    /// Errors of the cells between the nodes `first` and `last`, if the storage has them.
    fn cell_errors(&self, _first: [u32; 3], _last: [u32; 3], _limits: JumpLimits) -> Option<CellErrors> {
        None
    }

    /// Bounds of the nodes from `first` to `last`, if the storage has them without visiting each node.
    fn block_bounds(&self, _first: [u32; 3], _last: [u32; 3]) -> Option<BlockBounds> {
        None
    }
}

/// [`Storage::copy_box`] row by row.
#[inline(always)]
pub(super) fn copy_rows<S: Storage + ?Sized>(
    storage: &S,
    [x, y, z]: [u32; 3],
    [nx, ny, nz]: [u32; 3],
    samples: &mut [f32],
) {
    let mut at = 0_usize;
    for k in 0..nz {
        for j in 0..ny {
            let node = [x, y.wrapping_add(j), z.wrapping_add(k)];
            // In this order: what is written beyond a row's end is overwritten by the next.
            storage.copy_row(node, nx, samples.get_mut(at..).unwrap_or(&mut []));
            at = at.wrapping_add(nx as usize);
        }
    }
}

impl<S: Storage> Storage for &S {
    #[inline(always)]
    fn corners(&self, cell: [u32; 3]) -> [f32; 8] {
        (**self).corners(cell)
    }

    #[inline(always)]
    fn corners_in_lanes<R: Float, const N: usize>(&self, cells: [[R; N]; 3]) -> [[R; N]; 8] {
        (**self).corners_in_lanes(cells)
    }

    const IS_COPIED: bool = S::IS_COPIED;

    #[inline(always)]
    fn copy_row(&self, first: [u32; 3], count: u32, row: &mut [f32]) {
        (**self).copy_row(first, count, row);
    }

    #[inline(always)]
    fn copy_box(&self, first: [u32; 3], counts: [u32; 3], samples: &mut [f32]) {
        (**self).copy_box(first, counts, samples);
    }

    const LANES_OF_THREAD: usize = S::LANES_OF_THREAD;

    #[inline(always)]
    fn first_lane(&self) -> usize {
        (**self).first_lane()
    }

    #[inline(always)]
    fn of_lane<T: Copy>(&self, computed: &[T; TEAM_LANES], lane: usize) -> T {
        (**self).of_lane(computed, lane)
    }

    #[inline(always)]
    fn lanes_where(&self, computed: &[u8; TEAM_LANES]) -> u32 {
        (**self).lanes_where(computed)
    }

    const SLOPES_TAKE_LONG: bool = S::SLOPES_TAKE_LONG;
    const HAS_LOWEST: bool = S::HAS_LOWEST;

    #[inline(always)]
    fn lowest(&self, first: [u32; 3], last: [u32; 3]) -> Option<f32> {
        (**self).lowest(first, last)
    }

    const HAS_BLOCK_BOUNDS: bool = S::HAS_BLOCK_BOUNDS;

    const HAS_CELL_ERRORS: bool = S::HAS_CELL_ERRORS;

    fn cell_errors(&self, first: [u32; 3], last: [u32; 3], limits: JumpLimits) -> Option<CellErrors> {
        (**self).cell_errors(first, last, limits)
    }

    #[inline(always)]
    fn block_bounds(&self, first: [u32; 3], last: [u32; 3]) -> Option<BlockBounds> {
        (**self).block_bounds(first, last)
    }
}
