//! Exact minimum of a trilinear grid on a straight line.
//!
//! On a line φ is a cubic in each cell.
//!
//! 1. `voxel_walk` splits the line into pieces of one cell each (Amanatides and Woo 1987).
//! 2. `pieces` collects pieces until all lanes are full, and gathers their corner samples.
//! 3. `cubic` restricts φ to each piece and minimizes it in closed form.
//!
//! A piece is skipped if no corner of its cell is below the lowest value so far.

mod cubic;
mod pieces;
mod voxel_walk;

pub(super) use cubic::Cubic;
use nalgebra::Vector3;
use pieces::Pieces;
use voxel_walk::VoxelWalk;

use super::LANES;
use crate::grid::{Grid, Storage};
use crate::number::{Float, Real};
use crate::vector::from_f64;
use crate::{Aabb, ExactMinimum, Sdf};

/// A line `start` + t · `direction`, 0 ≤ t ≤ 1, in cell coordinates.
#[derive(Clone, Copy)]
struct Line<R: Real> {
    start: Vector3<R>,
    direction: Vector3<R>,
}

impl<S: Storage> Grid<S> {
    /// `None` if the segment leaves the box or meets too many cells, or a sample is not finite.
    #[inline(always)]
    pub(in crate::grid) fn minimum_on_segment<R: Float>(&self, ends: [Vector3<R>; 2]) -> Option<ExactMinimum<R, 2>> {
        let is_steep = R::from_f64(R::MAX_COORDINATE) < self.slope_bound_in_cells::<R>();
        if is_steep || !self.lattice.bounds().encloses(&Aabb::from_corners(&ends)) {
            return None;
        }
        let last_cell = from_f64::<R>(self.lattice.cells().map(f64::from)).map(|cells| cells - R::one());
        let line = Line {
            start: self.cell_coordinates(ends[0]),
            direction: (ends[1] - ends[0]) * R::from_f64(self.lattice.inv_spacing()),
        };
        let mut walk = VoxelWalk::new(line.start, line.direction, last_cell);
        let mut pieces = Pieces::new();
        let (mut lowest_t, mut lowest, mut evaluations) = (R::zero(), R::from_f64(f64::INFINITY), 0_u32);
        loop {
            while pieces.count < LANES && !walk.is_done {
                let step;
                (step, walk) = walk.step();
                if step.hit_limit {
                    return None;
                }
                pieces.push(&self.storage, &line, &step);
            }
            if pieces.count == 0 {
                break;
            }
            let (minima, storage) = (pieces.minima(&self.storage, lowest), &self.storage);
            for k in 0..pieces.count.min(LANES) {
                evaluations = evaluations.saturating_add(1);
                if storage.of_lane(&minima.may_be_lower, k) == 0 {
                    continue;
                }
                // Finite corners bound the interpolant from below.
                if storage.of_lane(&minima.is_finite, k) && lowest <= storage.of_lane(&minima.lowest_corner, k) {
                    continue;
                }
                let value = storage.of_lane(&minima.value, k);
                if !value.is_finite() {
                    return None;
                }
                if value < lowest {
                    (lowest_t, lowest) = (storage.of_lane(&minima.t, k), value);
                }
            }
            pieces.count = 0;
        }
        Some(ExactMinimum { weights: [R::one() - lowest_t, lowest_t], value: lowest, lower_bound: lowest, evaluations })
    }

    /// The slope bound in cell coordinates.
    #[inline(always)]
    pub(super) fn slope_bound_in_cells<R: Float>(&self) -> R {
        let (_, spacing, _) = self.lattice.in_numbers::<R>();
        self.slope_bound_as::<R>() * spacing
    }

    #[inline(always)]
    pub(super) fn cell_coordinates<R: Float>(&self, point: Vector3<R>) -> Vector3<R> {
        (point - from_f64(self.lattice.origin())) * R::from_f64(self.lattice.inv_spacing())
    }
}
