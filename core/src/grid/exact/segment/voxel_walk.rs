use nalgebra::Vector3;

use crate::number::{Float, Real};

/// A segment through more cells is not followed: asked piece by piece, most of it is dropped at once.
const MAX_CELLS: u32 = 256;

type Axes<R> = [R; 3];

/// A straight way through cells. It is passed on by value, so that it stays in registers.
#[derive(Clone, Copy)]
pub(super) struct Trace<R: Real> {
    from: Axes<R>,
    way: Axes<R>,
    sign: Axes<R>,
    /// From a cell to its face through which the way goes.
    to_face: Axes<R>,
    /// The cell that is never left: through the face of the box rounding alone leads.
    end: Axes<R>,
    cell: Axes<R>,
    /// Where it leaves the cell through a face across each axis, in shares of the way, and where the next one of that axis.
    leaves: Axes<R>,
    leaves_next: Axes<R>,
    entry: R,
    steps: u32,
    pub is_done: bool,
}

/// The part of the way in a cell.
pub(super) struct Step<R: Real> {
    pub cell: Axes<R>,
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
        let [from, way, sign, to_face, end, cell, leaves, leaves_next] = [[R::zero(); 3]; 8];
        Self { from, way, sign, to_face, end, cell, leaves, leaves_next, entry: R::zero(), steps: 0, is_done: true }
    }

    /// Within the box whose last cell that is.
    #[inline(always)]
    pub fn new(from: Vector3<R>, way: Vector3<R>, last: Vector3<R>) -> Self {
        let (from, way, last): (Axes<R>, Axes<R>, Axes<R>) = (from.into(), way.into(), last.into());
        let (zero, one) = (R::zero(), R::one());
        let mut trace = Self { from, way, is_done: false, ..Self::none() };
        for k in 0..3 {
            let is_backward = way[k] < zero;
            trace.sign[k] = R::select(is_backward, -one, one);
            trace.to_face[k] = R::select(is_backward, zero, one);
            let end = R::select(is_backward, zero, last[k]);
            trace.end[k] = R::select(way[k] == zero, R::from_f64(f64::NEG_INFINITY), end);
            // Where it enters a cell through a face, the point itself cannot tell on which side of it the cell lies.
            trace.cell[k] = Real::min(from[k].trunc(), last[k]);
        }
        trace.leaves = trace.leaves_at(&trace.cell);
        trace.look_ahead();
        trace
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn leaves_at(&self, cell: &Axes<R>) -> Axes<R> {
        let along = |k: usize| {
            let is_at_end = R::zero() <= (cell[k] - self.end[k]) * self.sign[k];
            let at_least = R::select(is_at_end, R::from_f64(f64::INFINITY), R::from_f64(f64::NEG_INFINITY));
            // In this order: where the way does not go along the axis, the quotient may be no number.
            Real::max(at_least, (cell[k] + self.to_face[k] - self.from[k]) / self.way[k])
        };
        [along(0), along(1), along(2)]
    }

    /// Of all axes, whichever will be crossed: a division takes long, and a branch by what cannot be foreseen longer.
    #[cfg_attr(feature = "std", inline(always))]
    fn look_ahead(&mut self) {
        let next = |k: usize| self.cell[k] + self.sign[k];
        self.leaves_next = self.leaves_at(&[next(0), next(1), next(2)]);
    }

    /// The step in this cell, and what is left of the way. To be asked until it is done.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn step(mut self) -> (Step<R>, Self) {
        let (cell, entry) = (self.cell, self.entry);
        let leaves = |k: usize| Real::max(self.leaves[k], entry);
        let exit = Real::min(Real::min(leaves(0), leaves(1)), Real::min(leaves(2), R::one()));
        let step = Step { cell, entry, exit, is_first: self.steps == 0, is_lost: MAX_CELLS <= self.steps };
        self.steps = self.steps.saturating_add(1);
        self.is_done = R::one() <= exit;
        for k in 0..3 {
            let crosses = self.leaves[k] <= exit;
            self.cell[k] = R::select(crosses, cell[k] + self.sign[k], cell[k]);
            self.leaves[k] = R::select(crosses, self.leaves_next[k], self.leaves[k]);
        }
        self.look_ahead();
        self.entry = exit;
        (step, self)
    }
}
