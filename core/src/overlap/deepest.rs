use nalgebra::Vector3;

use super::bounds::Asked;
use super::{OverlapPoint, Pair};
use crate::best_first::{BestFirstQueue, Node};
use crate::number::{Float, Real};
use crate::{Aabb, EnclosedSdf};

/// Branch and bound for the least of max(φ_A, φ_B) (as [`Certified`](crate::minimize::Certified) on an element): boxes are
/// cut in two across their longest side, always the one that may hold the lowest value, until none can hold one much below
/// the best that was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// How many times both fields are asked at most, but for a few at the beginning.
    pub evaluations: u32,
    /// Done when the least value is known to within this share of the longest side of the region.
    pub tolerance: f64,
}

impl Default for Search {
    fn default() -> Self {
        Self { evaluations: 1 << 16, tolerance: 1e-3 }
    }
}

/// The least of max(φ_A, φ_B).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deepest<R: Real> {
    /// Where the least value was seen. `None` where no point that was asked had a number, or where the bodies are apart by
    /// what the fields know without being asked.
    pub at: Option<OverlapPoint<R>>,
    /// Nowhere in the pair's region is max(φ_A, φ_B) below this; outside of it, it is above the margin (but for what
    /// [`Pair::within`](super::Pair::within) cut off). So if this is
    /// above the margin, the bodies are apart for certain.
    pub lower_bound: R,
    /// The least value is known to within the tolerance, or it is certain that it is above the margin.
    pub converged: bool,
    /// How often both fields were asked.
    pub evaluations: u32,
}

/// A box that waits to be cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    region: Aabb,
    /// No value in it is below this.
    least: f64,
}

impl Piece {
    /// What to fill the scratch with.
    pub const EMPTY: Self = Self { region: Aabb { min: [0.0; 3], max: [0.0; 3] }, least: 0.0 };
}

impl Node for Piece {
    type Bound = f64;
    fn lower_bound(&self) -> f64 {
        self.least
    }
}

/// Steps of a local search. Most come to rest after half as many.
const LOCAL_STEPS: u32 = 48;

impl<A: EnclosedSdf, B: EnclosedSdf> Pair<'_, A, B> {
    /// `scratch` holds the boxes that wait: a few hundred do for smooth bodies. Where it is too small the answer is not
    /// converged, and its bounds still hold.
    pub fn deepest<R: Float>(&self, search: &Search, scratch: &mut [Piece]) -> Deepest<R> {
        let asked = Asked::<R, A, B>::of(self);
        let longest = self.region.longest_side();
        let gap = R::from_f64(longest * search.tolerance) + asked.rounding;
        let mut run = Run {
            asked,
            best: None,
            evaluations: 0,
            gap: gap.to_f64(),
            converged: true,
            queue: BestFirstQueue::new(scratch),
        };
        run.look_at(Piece { region: self.region, least: f64::NEG_INFINITY });
        while let Some(piece) = run.queue.pop() {
            let halves =
                piece.region.halves().filter(|_| run.evaluations < search.evaluations && run.may_improve(&piece));
            let Some(halves) = halves else {
                // None that waits has a lower bound.
                run.queue.fathom(piece.least);
                if run.may_improve(&piece) {
                    run.converged = false;
                }
                if run.evaluations >= search.evaluations || !run.may_improve(&piece) {
                    break;
                }
                continue;
            };
            halves.into_iter().for_each(|region| run.look_at(Piece { region, least: piece.least }));
        }
        run.finish()
    }
}

struct Run<'p, 's, R: Real, A, B> {
    asked: Asked<'p, R, A, B>,
    best: Option<OverlapPoint<R>>,
    evaluations: u32,
    gap: f64,
    converged: bool,
    queue: BestFirstQueue<Piece, &'s mut [Piece]>,
}

impl<R: Float, A: EnclosedSdf, B: EnclosedSdf> Run<'_, '_, R, A, B> {
    fn may_improve(&self, piece: &Piece) -> bool {
        let best = self.best.map_or(f64::INFINITY, |best| best.value.to_f64());
        piece.least < best - self.gap && piece.least <= self.asked.pair.margin
    }

    /// Bounds a piece, whose bound so far is that of the one it was cut from, and lets it wait if it is worth a cut.
    fn look_at(&mut self, piece: Piece) {
        let look = self.asked.look(&piece.region);
        self.evaluations = self.evaluations.saturating_add(u32::from(look.seen.is_some()));
        if let Some(seen) = look.seen.filter(OverlapPoint::is_known) {
            let best = self.best.map_or(f64::INFINITY, |best| best.value.to_f64());
            let is_lower = seen.value.to_f64() < best;
            if seen.value.to_f64() < best - self.gap || (is_lower && self.best.is_none()) {
                let step = R::from_f64(0.25 * piece.region.longest_side());
                let (low, looks) = self.asked.descend(seen, step);
                self.evaluations = self.evaluations.saturating_add(looks);
                self.best = Some(low);
            } else if is_lower {
                self.best = Some(seen);
            }
        }
        // Where a field is no number, nothing is certain, whatever was of the whole.
        let is_known = look.seen.is_none_or(|seen| seen.is_known());
        let least = if is_known { look.least.to_f64().max(piece.least) } else { f64::NEG_INFINITY };
        let piece = Piece { least, ..piece };
        if self.may_improve(&piece) {
            self.queue.push(piece);
        } else {
            self.queue.fathom(piece.least);
        }
    }

    fn finish(self) -> Deepest<R> {
        let least = self.queue.lower_bound();
        let value = self.best.map(|best| best.value);
        let lower_bound = value.map_or(R::from_f64(least), |value| Real::min(value, R::from_f64(least)));
        let converged = self.converged && self.queue.overflow_bound() == f64::INFINITY;
        Deepest { at: self.best, lower_bound, converged, evaluations: self.evaluations }
    }
}

impl<R: Float, A: EnclosedSdf, B: EnclosedSdf> Asked<'_, R, A, B> {
    /// Downhill from a point to where no step leads lower: each is to the least of the higher of both linear parts and of
    /// the squared way over twice the step size (a proximal step: Rockafellar 1976, "Monotone operators and the proximal
    /// point algorithm"), which doubles after one that succeeds. With how often both fields were asked.
    pub(super) fn descend(&self, from: OverlapPoint<R>, first_step: R) -> (OverlapPoint<R>, u32) {
        let (mut at, mut step) = (from, first_step);
        for _ in 0..LOCAL_STEPS {
            let next = self.see(at.point - at.steepest(step) * step);
            let is_lower = next.is_known() && next.value < at.value;
            step *= R::from_f64(if is_lower { 2.0 } else { 0.25 });
            at = if is_lower { next } else { at };
        }
        (at, LOCAL_STEPS)
    }
}

impl<R: Float> OverlapPoint<R> {
    /// The mean of both gradients by which the linear parts are least after a step of this size against it.
    fn steepest(&self, step: R) -> Vector3<R> {
        let apart = self.a.gradient - self.b.gradient;
        let length_sq = apart.dot(&apart);
        let higher = (self.a.value - self.b.value) / step;
        if length_sq.sqrt().is_negligible() {
            return (self.a.gradient + self.b.gradient) * R::from_f64(0.5);
        }
        let share = |of_other: R| Real::clamp(of_other / length_sq, R::zero(), R::one());
        let of_a = share(higher - self.b.gradient.dot(&apart));
        let of_b = share(self.a.gradient.dot(&apart) - higher);
        self.a.gradient * of_a + self.b.gradient * of_b
    }
}

impl Aabb {
    /// In two across the longest side; `None` if that is no longer than rounding.
    fn halves(&self) -> Option<[Self; 2]> {
        let [x, y, z] = self.extents();
        let longest = if x >= y && x >= z { 0 } else { 1 + usize::from(y < z) };
        let middle: [f64; 3] = core::array::from_fn(|axis| 0.5 * (self.min[axis] + self.max[axis]));
        let cut = |axis: usize, side: f64| if axis == longest { middle[axis] } else { side };
        let below = Self { max: core::array::from_fn(|axis| cut(axis, self.max[axis])), ..*self };
        let above = Self { min: core::array::from_fn(|axis| cut(axis, self.min[axis])), ..*self };
        (below != *self && above != *self).then_some([below, above])
    }
}
