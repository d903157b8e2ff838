//! The cells along a line, in order (Amanatides and Woo 1987, "A Fast Voxel Traversal Algorithm for Ray Tracing").
//!
//! For each axis the walk keeps t at which the line leaves the cell through a face of that axis:
//!
//! ```text
//! t_axis = (cell + face_offset − start) / direction,      face_offset = 1 if direction ≥ 0, else 0
//! ```
//!
//! A step ends at the smallest of the three, and every axis that attains it moves on by one cell. Unlike in the paper
//! each t is computed anew and not by increments, so that rounding does not accumulate. That of the next cell is
//! computed one step ahead for all axes: a division has a long latency, and which axis crosses next is unpredictable
//! to a branch. Cells are counted, because a point on a face does not determine its cell.

use nalgebra::Vector3;

use crate::number::{Float, Real};

/// Longest walk. A longer segment is better searched in parts, most of which are culled at once.
const MAX_CELLS: u32 = 256;

type Axes<R> = [R; 3];

/// State of a walk. [`step`](Self::step) takes and returns it by value, so that it stays in registers.
#[derive(Clone, Copy)]
pub(super) struct VoxelWalk<R: Real> {
    start: Axes<R>,
    direction: Axes<R>,
    /// ±1: the direction of the walk along each axis.
    sign: Axes<R>,
    /// From a cell to its exit face: 0 or 1.
    face_offset: Axes<R>,
    /// Last cell inside the box in the direction of the walk. It is never left: only rounding leads through the box's face.
    last_cell: Axes<R>,
    cell: Axes<R>,
    axis_exit_t: Axes<R>,
    /// `axis_exit_t` after a crossing of that axis.
    next_axis_exit_t: Axes<R>,
    entry_t: R,
    steps: u32,
    pub is_done: bool,
}

/// The part of a line in one cell: `entry_t` ≤ t ≤ `exit_t`.
pub(super) struct Step<R: Real> {
    pub cell: Axes<R>,
    pub entry_t: R,
    pub exit_t: R,
    /// The line meets more than [`MAX_CELLS`] cells.
    pub hit_limit: bool,
}

impl<R: Float> VoxelWalk<R> {
    /// A finished walk.
    #[inline(always)]
    pub fn done() -> Self {
        let [start, direction, sign, face_offset, last_cell, cell, axis_exit_t, next_axis_exit_t] = [[R::zero(); 3]; 8];
        Self {
            start,
            direction,
            sign,
            face_offset,
            last_cell,
            cell,
            axis_exit_t,
            next_axis_exit_t,
            entry_t: R::zero(),
            steps: 0,
            is_done: true,
        }
    }

    /// A walk inside the box from cell 0 to `last_cell`.
    #[inline(always)]
    pub fn new(start: Vector3<R>, direction: Vector3<R>, last_cell: Vector3<R>) -> Self {
        let (start, direction, last): (Axes<R>, Axes<R>, Axes<R>) = (start.into(), direction.into(), last_cell.into());
        let (zero, one) = (R::zero(), R::one());
        let mut walk = Self { start, direction, is_done: false, ..Self::done() };
        for k in 0..3 {
            let is_backward = direction[k] < zero;
            walk.sign[k] = R::select(is_backward, -one, one);
            walk.face_offset[k] = R::select(is_backward, zero, one);
            let end = R::select(is_backward, zero, last[k]);
            walk.last_cell[k] = R::select(direction[k] == zero, R::from_f64(f64::NEG_INFINITY), end);
            // A start on a face belongs to either cell; the walk corrects it by a step of length zero.
            walk.cell[k] = Real::min(start[k].trunc(), last[k]);
        }
        walk.axis_exit_t = walk.exit_t_from(&walk.cell);
        walk.look_ahead();
        walk
    }

    /// t at which the line leaves `cell` through a face of each axis. ∞ in the last cell and along axes that it does
    /// not move along.
    #[cfg_attr(feature = "std", inline(always))]
    fn exit_t_from(&self, cell: &Axes<R>) -> Axes<R> {
        let axis_exit_t = |k: usize| {
            let is_last = R::zero() <= (cell[k] - self.last_cell[k]) * self.sign[k];
            let lower = R::select(is_last, R::from_f64(f64::INFINITY), R::from_f64(f64::NEG_INFINITY));
            // In this order: the quotient is NaN for 0 / 0, and `max` then returns `lower`.
            Real::max(lower, (cell[k] + self.face_offset[k] - self.start[k]) / self.direction[k])
        };
        [axis_exit_t(0), axis_exit_t(1), axis_exit_t(2)]
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn look_ahead(&mut self) {
        let next = |k: usize| self.cell[k] + self.sign[k];
        self.next_axis_exit_t = self.exit_t_from(&[next(0), next(1), next(2)]);
    }

    /// The piece in the current cell, and the rest of the walk. Call it until [`is_done`](Self::is_done).
    #[cfg_attr(feature = "std", inline(always))]
    pub fn step(mut self) -> (Step<R>, Self) {
        let (cell, entry_t) = (self.cell, self.entry_t);
        let axis_exit_t = |k: usize| Real::max(self.axis_exit_t[k], entry_t);
        let exit_t = Real::min(Real::min(axis_exit_t(0), axis_exit_t(1)), Real::min(axis_exit_t(2), R::one()));
        let step = Step { cell, entry_t, exit_t, hit_limit: MAX_CELLS <= self.steps };
        self.steps = self.steps.saturating_add(1);
        self.is_done = R::one() <= exit_t;
        for k in 0..3 {
            let crosses = self.axis_exit_t[k] <= exit_t;
            self.cell[k] = R::select(crosses, cell[k] + self.sign[k], cell[k]);
            self.axis_exit_t[k] = R::select(crosses, self.next_axis_exit_t[k], self.axis_exit_t[k]);
        }
        self.look_ahead();
        self.entry_t = exit_t;
        (step, self)
    }
}
