//! Pieces of a line, one cell each, whose minima are computed in all lanes at once.
//!
//! Arrays are by lane, so that the loop over the lanes in [`Pieces::minima`] becomes one over vectors.

use nalgebra::Vector3;

use super::cubic::Cubic;
use super::voxel_walk::Step;
use super::{LANES, Line};
use crate::grid::Storage;
use crate::grid::exact::corners_of_thread;
use crate::number::{Float, Real};

/// Up to [`LANES`] pieces. Vectors are by axis, then by lane.
pub(super) struct Pieces<R: Real> {
    pub count: usize,
    /// Index of the cell, as a number.
    cell: [[R; LANES]; 3],
    start: [[R; LANES]; 3],
    direction: [[R; LANES]; 3],
    entry_t: [R; LANES],
    exit_t: [R; LANES],
}

/// The minimum of each piece.
pub(super) struct PieceMinima<R> {
    /// Parameter of the line, not of the piece.
    pub t: [R; LANES],
    pub value: [R; LANES],
    /// Lowest sample of the cell.
    pub lowest_corner: [R; LANES],
    /// Are all samples of the cell finite?
    pub is_finite: [bool; LANES],
    /// 1 if the value is lower than the limit or anything is not finite; else 0.
    pub may_be_lower: [u8; LANES],
}

impl<R: Float> Pieces<R> {
    #[inline(always)]
    pub fn new() -> Self {
        let zero = [[R::zero(); LANES]; 3];
        Self { count: 0, cell: zero, start: zero, direction: zero, entry_t: zero[0], exit_t: zero[0] }
    }

    #[inline(always)]
    pub fn push<S: Storage>(&mut self, storage: &S, line: &Line<R>, step: &Step<R>) {
        let lane = self.count.wrapping_sub(storage.first_lane());
        if lane < S::LANES_OF_THREAD {
            for axis in 0..3 {
                self.cell[axis][lane] = step.cell[axis];
                self.start[axis][lane] = line.start[axis];
                self.direction[axis][lane] = line.direction[axis];
            }
            (self.entry_t[lane], self.exit_t[lane]) = (step.entry_t, step.exit_t);
        }
        self.count = self.count.saturating_add(1);
    }

    /// Computes the lanes of this thread and compares them with `limit`. Lanes from `count` on repeat stale pieces.
    #[inline(always)]
    pub fn minima<S: Storage>(&self, storage: &S, limit: R) -> PieceMinima<R> {
        let samples = corners_of_thread(storage, self.cell);
        let zero = [R::zero(); LANES];
        let (is_finite, may_be_lower) = ([false; LANES], [0; LANES]);
        let mut minima = PieceMinima { t: zero, value: zero, lowest_corner: zero, is_finite, may_be_lower };
        for lane in 0..S::LANES_OF_THREAD {
            let component = |axis: &[R; LANES]| axis[lane % LANES];
            let [cell, start, direction] = [&self.cell, &self.start, &self.direction]
                .map(|axes| Vector3::new(component(&axes[0]), component(&axes[1]), component(&axes[2])));
            let (entry_t, span) = (self.entry_t[lane], self.exit_t[lane] - self.entry_t[lane]);
            let mut corners = [R::zero(); 8];
            // NaN if a corner is not finite, else 0.
            let (mut lowest, mut nan_check) = (R::from_f64(f64::INFINITY), R::zero());
            for corner in 0..8 {
                corners[corner] = samples[corner][lane];
                lowest = Real::min(lowest, corners[corner]);
                nan_check += corners[corner] * R::zero();
            }
            let (t, value) = Cubic::restrict(corners, start + direction * entry_t - cell, direction * span).minimum();
            minima.t[lane] = entry_t + span * t;
            minima.value[lane] = value;
            minima.lowest_corner[lane] = lowest;
            minima.is_finite[lane] = nan_check == R::zero();
            let is_not_lower = limit <= value;
            let is_not_finite = nan_check + value * R::zero() != R::zero();
            minima.may_be_lower[lane] = u8::from(!is_not_lower | is_not_finite);
        }
        minima
    }
}
