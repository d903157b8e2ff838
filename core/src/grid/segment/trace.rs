use nalgebra::Vector3;

use crate::real::{Float, Real};

/// A segment through more cells is not followed: asked piece by piece, most of it is dropped at once.
const MOST_CELLS: u32 = 256;

/// A straight way through cells.
pub(super) struct Trace<R: Real> {
    from: Vector3<R>,
    way: Vector3<R>,
    /// The last cell along each axis.
    last: Vector3<R>,
    cell: Vector3<R>,
    /// Where it leaves the cell through a face across each axis, in shares of the way.
    leaves: Vector3<R>,
    entry: R,
    steps: u32,
    pub is_done: bool,
}

/// The part of the way in a cell.
pub(super) struct Step<R: Real> {
    pub cell: Vector3<R>,
    pub entry: R,
    pub exit: R,
    pub is_first: bool,
    /// The way meets too many cells.
    pub is_lost: bool,
}

impl<R: Float> Trace<R> {
    /// One that is done.
    #[inline(always)]
    pub fn none() -> Self {
        let nowhere = Vector3::zeros();
        let [from, way, last, cell, leaves] = [nowhere; 5];
        Self { from, way, last, cell, leaves, entry: R::zero(), steps: 0, is_done: true }
    }

    /// Within the box whose last cell that is.
    #[inline(always)]
    pub fn new(from: Vector3<R>, way: Vector3<R>, last: Vector3<R>) -> Self {
        // Where it enters a cell through a face, the point itself cannot tell on which side of it the cell lies.
        let cell = from.zip_map(&last, |x, last| Real::min(x.trunc(), last));
        let mut trace =
            Self { from, way, last, cell, leaves: Vector3::zeros(), entry: R::zero(), steps: 0, is_done: false };
        trace.leaves = Vector3::new(trace.leaves_at(0), trace.leaves_at(1), trace.leaves_at(2));
        trace
    }

    #[inline(always)]
    fn leaves_at(&self, axis: usize) -> R {
        let (cell, last, from, way) =
            (self.cell[axis % 3], self.last[axis % 3], self.from[axis % 3], self.way[axis % 3]);
        // The face of the box is never left through: rounding alone leads there.
        let is_at_box = if way < R::zero() { cell <= R::zero() } else { last <= cell };
        let face = if way < R::zero() { cell } else { cell + R::one() };
        if way == R::zero() || is_at_box { R::lift(f64::INFINITY) } else { (face - from) / way }
    }

    /// To be asked until it is done.
    #[inline(always)]
    pub fn next(&mut self) -> Step<R> {
        let entry = self.entry;
        let exit = self.leaves.iter().fold(R::one(), |exit, leaves| Real::min(exit, Real::max(*leaves, entry)));
        let step = Step { cell: self.cell, entry, exit, is_first: self.steps == 0, is_lost: MOST_CELLS <= self.steps };
        self.steps = self.steps.saturating_add(1);
        self.is_done = R::one() <= exit;
        if !self.is_done {
            for axis in 0..3 {
                if self.leaves[axis % 3] <= exit {
                    self.cell[axis % 3] += self.way[axis % 3].sign();
                    self.leaves[axis % 3] = self.leaves_at(axis);
                }
            }
            self.entry = exit;
        }
        step
    }
}
