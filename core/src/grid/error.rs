//! Error bounds of a grid, derived in docs/error-bounds.md, from what its storage knows of some cells or the grid's header of all.

use super::{Grid, Lattice, Storage};
use crate::number::interval::Interval;
use crate::rounding::INTERPOLATION;
use crate::{Aabb, ErrorBound, Sdf};

/// √3, rounded up: the diagonal of a cell, in spacings.
const DIAGONAL: f64 = 1.732_051;

/// Rise from one side of the band to the other, in bands: less what codes of 8 bits round two samples by, of a brick that reaches from
/// there over its 8 voxels on either side, as a part of the band and of the spacing ([`ROUNDED`]).
const ACROSS: f64 = 1.99;

/// See [`ACROSS`].
const ROUNDED: f64 = 0.15;

/// How a sparse grid's samples were taken: what its error bounds follow from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Distance between neighbouring nodes.
    pub spacing: f64,
    /// See [`Grid::with_band`](super::Grid::with_band).
    pub band: f64,
    /// See [`Grid::with_deep_error`](super::Grid::with_deep_error).
    pub deep_error: f64,
}

/// Errors of some cells, as a storage has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellErrors {
    /// Bound of |φ − d| where d, the signed distance to the shape, is within the band, but in cells that `jump` counts.
    pub near: f32,
    /// Interval that holds all samples.
    pub range: Interval<f32>,
    /// Largest rise in a cell whose corners are beyond the band on both sides, as where the sign of an open mesh jumps. Zero where there
    /// is no such cell.
    pub jump: f32,
}

/// How steep a cell is in which the sign jumps beyond the band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JumpLimits {
    /// Lower bound of its slope.
    pub slope: f32,
    /// Lower bound of the rise from its lowest corner to its highest.
    pub rise: f32,
    /// Upper bound of the rise for a slope of 1.
    pub diagonal: f32,
}

/// As [`CellErrors`], in double precision.
struct Errors {
    near: f64,
    range: Interval<f64>,
    jump: f64,
}

impl From<CellErrors> for Errors {
    fn from(CellErrors { near, range, jump }: CellErrors) -> Self {
        // A difference of two samples is rounded.
        let jump = f64::from(jump) * (1.0 + f64::from(f32::EPSILON));
        Self { near: near.into(), range: Interval { lower: range.lower.into(), upper: range.upper.into() }, jump }
    }
}

impl Sampling {
    /// Error bound of a whole grid from what its header states: `near` of its band, `slope_bound` of its steepest cell. The band of a dense
    /// grid is infinite, and so is `near` where nothing is known.
    pub fn of_whole(&self, near: f64, slope_bound: f64, lattice: &Lattice) -> ErrorBound {
        if self.band == f64::INFINITY || near == f64::INFINITY {
            return ErrorBound::everywhere(near);
        }
        self.error_bound(self.errors_of_whole(near, slope_bound, lattice))
    }

    /// The box holds the shape, so that no sample is above the sum of its sides.
    fn errors_of_whole(&self, near: f64, slope_bound: f64, lattice: &Lattice) -> Errors {
        let limits = self.jump_limits();
        let may_jump = slope_bound >= f64::from(limits.slope);
        let jump = if may_jump { slope_bound * f64::from(limits.diagonal) } else { 0.0 };
        let largest = lattice.cells().map(f64::from).into_iter().sum::<f64>() * self.spacing;
        Errors { near, range: Interval { lower: -largest, upper: largest }, jump }
    }

    /// Error bound in the band and beyond, with h the spacing and B the band.
    ///
    /// Outside, the coarse grid is a lower bound of the distance, but for a rise between nodes: φ − d ≤ 3 h²/(8 B).
    /// Inside, if it interpolates distances at nodes 8 h apart, as a baker that sets `deep_error` does: |φ − d| ≤ 4.5 √3 h, by the
    /// Lipschitz bound 4 √3 h of a coarse cell and √3/2 h of one voxel.
    /// Where the sign jumps, φ is between the corners, and |d| at most the magnitude at one, the diagonal and what a depth can be off by.
    fn error_bound(&self, Errors { near, range, jump }: Errors) -> ErrorBound {
        let Self { spacing, band, deep_error } = *self;
        let rounding = INTERPOLATION * f64::from(f32::EPSILON) * range.upper.max(-range.lower);
        let near = if jump > 0.0 { near.max(jump + DIAGONAL * spacing + deep_error) } else { near };
        let rise = near.max(3.0 / 8.0 * spacing * spacing / band + rounding);
        // Samples are rounded to single precision.
        let sample_band = f64::from(band as f32);
        let is_deep = range.lower <= -sample_band;
        let error = if is_deep { rise.max(deep_error + rounding) } else { rise };
        let below = if range.upper < sample_band { error } else { f64::INFINITY };
        let levels = Interval { lower: -band, upper: band };
        ErrorBound { near, near_below: near, fails_outside: [false; 2], above: error, below, levels }
    }

    /// One edge of a cell across which the sign jumps rises by two bands. Both of its corners are beyond the band, and one is a cell's
    /// diagonal farther, or all are exact and the error in the band counts them.
    fn jump_limits(&self) -> JumpLimits {
        let Self { spacing, band, .. } = *self;
        JumpLimits {
            slope: (ACROSS * band / spacing) as f32,
            rise: (ACROSS * band + (DIAGONAL - ROUNDED) * spacing) as f32,
            diagonal: (DIAGONAL * spacing) as f32,
        }
    }
}

impl<S: Storage> Grid<S> {
    /// Error bound of the cells that a box meets, after it was clamped to the grid; of all cells where the storage does not know it.
    #[inline(always)]
    pub(super) fn error_of_cells(&self, region: &Aabb) -> ErrorBound {
        let (near, band) = (self.error_bound, self.band());
        // Where nothing is known of the whole, nothing is of its parts.
        if !S::HAS_CELL_ERRORS || band == f64::INFINITY || near == f64::INFINITY {
            let beyond = if band == f64::INFINITY { near } else { f64::INFINITY };
            let levels = Interval { lower: -band, upper: band };
            let fails_outside = [false; 2];
            return ErrorBound { near, near_below: near, fails_outside, above: beyond, below: beyond, levels };
        }
        let sampling = Sampling { spacing: self.lattice.spacing(), band, deep_error: self.deep_error };
        let errors = self
            .lattice
            .nodes_around(region)
            .and_then(|[first, last]| self.storage.cell_errors(first, last, sampling.jump_limits()));
        let of_whole = || sampling.errors_of_whole(near, self.slope_bound(), &self.lattice);
        sampling.error_bound(errors.map_or_else(of_whole, Errors::from))
    }
}
