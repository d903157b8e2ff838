//! Exact minimum of a trilinear grid on straight lines.
//!
//! On a line φ is a cubic in each cell.
//!
//! 1. `voxel_walk` splits a line into pieces of one cell each (Amanatides and Woo 1987).
//! 2. `pieces` collects pieces of several lines until all lanes are full, and gathers their corner samples.
//! 3. `cubic` restricts φ to each piece and minimizes it in closed form.
//!
//! Two tests skip work: a line is dropped if its lower bound is not below the lowest value so far, a piece if no
//! corner of its cell is.

mod cubic;
mod pieces;
mod voxel_walk;

use core::array::from_fn;

pub(super) use cubic::Cubic;
use nalgebra::Vector3;
use pieces::Pieces;
use voxel_walk::VoxelWalk;

use super::LANES;
use crate::grid::{Grid, Storage};
use crate::number::{Float, Real};
use crate::simplex::corner_weights;
use crate::vector::from_f64;
use crate::{Aabb, ExactMinimum};

/// A line `start` + t · `direction`, 0 ≤ t ≤ 1, in cell coordinates.
#[derive(Clone, Copy)]
pub(super) struct Line<R: Real> {
    pub start: Vector3<R>,
    pub direction: Vector3<R>,
    /// Barycentric weights of its two ends in the element.
    pub end_weights: [[R; 3]; 2],
    /// Lower bound of φ on the line. Lines with an infinite bound are skipped.
    pub lower_bound: R,
}

/// The lowest point of an element so far.
#[derive(Clone, Copy)]
pub(super) struct LowestPoint<R> {
    pub weights: [R; 3],
    pub value: R,
    /// Points evaluated and pieces or cells searched so far.
    pub evaluations: u32,
}

impl<S: Storage> Grid<S> {
    /// `None` if the segment leaves the box or meets too many cells, or a sample is not finite.
    #[inline(always)]
    pub(in crate::grid) fn minimum_on_segment<R: Float>(&self, ends: [Vector3<R>; 2]) -> Option<ExactMinimum<R, 2>> {
        if !self.lattice.bounds().encloses(&Aabb::from_corners(&ends)) {
            return None;
        }
        let line = Line {
            start: self.cell_coordinates(ends[0]),
            direction: (ends[1] - ends[0]) * R::from_f64(self.lattice.inv_spacing()),
            end_weights: [0, 1].map(corner_weights),
            lower_bound: R::from_f64(f64::NEG_INFINITY),
        };
        let mut lowest = LowestPoint { weights: corner_weights(0), value: R::from_f64(f64::INFINITY), evaluations: 0 };
        self.minimize_on_lines([line], &mut core::iter::empty(), &mut lowest)?;
        let (t, value) = (lowest.weights[1], lowest.value);
        Some(ExactMinimum { weights: [R::one() - t, t], value, lower_bound: value, evaluations: lowest.evaluations })
    }

    #[inline(always)]
    pub(super) fn cell_coordinates<R: Float>(&self, point: Vector3<R>) -> Vector3<R> {
        (point - from_f64(self.lattice.origin())) * R::from_f64(self.lattice.inv_spacing())
    }

    /// Lowers `lowest` to the minimum of `lines` and `more_lines`, all inside the box. `None` if a line meets too
    /// many cells or a sample is not finite.
    #[inline(always)]
    pub(super) fn minimize_on_lines<R: Float, const N: usize>(
        &self,
        lines: [Line<R>; N],
        more_lines: &mut impl Iterator<Item = Line<R>>,
        lowest: &mut LowestPoint<R>,
    ) -> Option<()> {
        let last_cell = from_f64::<R>(self.lattice.cells().map(f64::from)).map(|cells| cells - R::one());
        let (mut line, mut next, mut walk) = (lines[0], 0_usize, VoxelWalk::done());
        let mut pieces = Pieces::new();
        let mut is_line_skipped = false;
        loop {
            while pieces.count < LANES {
                if walk.is_done {
                    let following = match lines.get(next) {
                        Some(line) => Some(*line),
                        None => more_lines.next(),
                    };
                    let Some(following) = following else { break };
                    (line, next) = (following, next.saturating_add(1));
                    if line.lower_bound < R::from_f64(f64::INFINITY) {
                        walk = VoxelWalk::new(line.start, line.direction, last_cell);
                    }
                    continue;
                }
                let step;
                (step, walk) = walk.step();
                if step.hit_limit {
                    return None;
                }
                pieces.push(&line, &step);
            }
            if pieces.count == 0 {
                return Some(());
            }
            let minima = pieces.minima(&self.storage, lowest.value);
            for k in 0..pieces.count.min(LANES) {
                if pieces.is_first_of_line[k] {
                    is_line_skipped = lowest.value <= pieces.line_bound[k];
                }
                if is_line_skipped {
                    continue;
                }
                lowest.evaluations = lowest.evaluations.saturating_add(1);
                if minima.may_be_lower[k] == 0 {
                    continue;
                }
                // Finite corners bound the interpolant from below.
                if minima.is_finite[k] && lowest.value <= minima.lowest_corner[k] {
                    continue;
                }
                if !minima.value[k].is_finite() {
                    return None;
                }
                if minima.value[k] < lowest.value {
                    let t = minima.t[k];
                    let [start, end] = pieces.end_weights[k];
                    lowest.weights = from_fn(|k| start[k % 3] * (R::one() - t) + end[k % 3] * t);
                    lowest.value = minima.value[k];
                }
            }
            pieces.count = 0;
        }
    }
}
