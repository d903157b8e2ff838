//! The least value of a trilinear interpolant on straight lines, without a search.
//!
//! On a straight line the interpolant is a cubic in each cell. Lines are followed cell by cell (`trace`); the pieces of several
//! are gathered until they fill all lanes, and their least values found side by side (`pieces`, `cubic`).

mod cubic;
mod pieces;
mod voxel_walk;

use core::array::from_fn;

use nalgebra::Vector3;
use pieces::{LANES, Pieces};
use voxel_walk::Trace;

use crate::grid::{Grid, Storage};
use crate::number::{Float, Real};
use crate::simplex::corner_weights;
use crate::vector::from_f64;
use crate::{Aabb, ExactMinimum};

/// A line to follow, counted in cells from the first node.
#[derive(Clone, Copy)]
pub(super) struct Line<R: Real> {
    pub from: Vector3<R>,
    pub way: Vector3<R>,
    /// The weights of its ends.
    pub ends: [[R; 3]; 2],
    /// It holds no value below this. Where that is infinite, it is not followed.
    pub bound: R,
}

/// The least value of several lines.
#[derive(Clone, Copy)]
pub(super) struct Lowest<R> {
    pub weights: [R; 3],
    pub value: R,
    /// How many cells were looked at.
    pub looks: u32,
}

impl<S: Storage> Grid<S> {
    /// `None` where the segment leaves the box or meets many cells.
    #[inline(always)]
    pub(in crate::grid) fn minimum_on_segment<R: Float>(&self, ends: [Vector3<R>; 2]) -> Option<ExactMinimum<R, 2>> {
        if !self.lattice.bounds().encloses(&Aabb::around_corners(&ends)) {
            return None;
        }
        let line = Line {
            from: self.in_cells(ends[0]),
            way: (ends[1] - ends[0]) * R::from_f64(self.lattice.inv_spacing()),
            ends: [0, 1].map(corner_weights),
            bound: R::from_f64(f64::NEG_INFINITY),
        };
        let mut lowest = Lowest { weights: corner_weights(0), value: R::from_f64(f64::INFINITY), looks: 0 };
        self.follow([line], &mut core::iter::empty(), &mut lowest)?;
        let (fraction, value) = (lowest.weights[1], lowest.value);
        Some(ExactMinimum {
            weights: [R::one() - fraction, fraction],
            value,
            lower_bound: value,
            evaluations: lowest.looks,
        })
    }

    /// Counted in cells from the first node.
    #[inline(always)]
    pub(super) fn in_cells<R: Float>(&self, point: Vector3<R>) -> Vector3<R> {
        (point - from_f64(self.lattice.origin())) * R::from_f64(self.lattice.inv_spacing())
    }

    /// Along lines within the box, one after another, to a value below the lowest so far. `None` where a line meets many cells or
    /// a sample is no number.
    #[inline(always)]
    pub(super) fn follow<R: Float, const N: usize>(
        &self,
        lines: [Line<R>; N],
        more: &mut impl Iterator<Item = Line<R>>,
        lowest: &mut Lowest<R>,
    ) -> Option<()> {
        let last = from_f64::<R>(self.lattice.cells().map(f64::from)).map(|cells| cells - R::one());
        let (mut line, mut next, mut trace) = (lines[0], 0_usize, Trace::none());
        let mut pieces = Pieces::new();
        let mut is_above = false;
        loop {
            while pieces.count < LANES {
                if trace.is_done {
                    let following = match lines.get(next) {
                        Some(line) => Some(*line),
                        None => more.next(),
                    };
                    let Some(following) = following else { break };
                    (line, next) = (following, next.saturating_add(1));
                    if line.bound < R::from_f64(f64::INFINITY) {
                        trace = Trace::new(line.from, line.way, last);
                    }
                    continue;
                }
                let step;
                (step, trace) = trace.step();
                if step.is_lost {
                    return None;
                }
                pieces.push(&line, &step);
            }
            if pieces.count == 0 {
                return Some(());
            }
            let least = pieces.least(&self.storage, lowest.value);
            for k in 0..pieces.count.min(LANES) {
                if pieces.is_first[k] {
                    is_above = lowest.value <= pieces.bound[k];
                }
                if is_above {
                    continue;
                }
                lowest.looks = lowest.looks.saturating_add(1);
                if least.may_be_less[k] == 0 {
                    continue;
                }
                // The interpolant is never below all of its corners, if they are numbers.
                if least.is_finite[k] && lowest.value <= least.corner[k] {
                    continue;
                }
                // Where a sample is no number, nothing is certain.
                if !least.value[k].is_finite() {
                    return None;
                }
                if least.value[k] < lowest.value {
                    let share = least.share[k];
                    let [from, to] = pieces.ends[k];
                    lowest.weights = from_fn(|k| from[k % 3] * (R::one() - share) + to[k % 3] * share);
                    lowest.value = least.value[k];
                }
            }
            pieces.count = 0;
        }
    }
}
