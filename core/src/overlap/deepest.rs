//! The minimum of f = max(φ_A, φ_B) over the region of a pair, proven by branch and bound (Land and Doig 1960), as
//! [`Certified`](crate::minimize::Certified) does it on an element.
//!
//! The box with the lowest bound (`bounds`) is bisected across its longest side. A box is fathomed if its bound is above the
//! best value less the gap, tolerance · longest side + rounding. A local descent improves each lower value found.

use core::array::from_fn;

use nalgebra::Vector3;

use super::bounds::PairQuery;
use super::{OverlapPoint, Pair};
use crate::best_first::{BestFirstQueue, Node};
use crate::number::{Float, Real};
use crate::{Aabb, EnclosedSdf};

/// Budget and tolerance of [`Pair::deepest`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthSearch {
    /// Largest number of evaluations of both fields, up to a few at the start.
    pub evaluations: u32,
    /// Stops when the minimum is known to within this fraction of the longest side of the region.
    pub tolerance: f64,
}

impl Default for DepthSearch {
    fn default() -> Self {
        Self { evaluations: 1 << 16, tolerance: 1e-3 }
    }
}

/// The minimum of f = max(φ_A, φ_B).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeepestPoint<R: Real> {
    /// The lowest point found. `None` if no evaluated point is finite, or if the fields' bounds alone prove that the
    /// bodies do not touch.
    pub point: Option<OverlapPoint<R>>,
    /// Lower bound of f in the pair's region. Outside of the region f is above the margin, except in what
    /// [`Pair::restrict`](super::Pair::restrict) cut off. So if this is above the margin, the bodies do not touch.
    pub lower_bound: R,
    /// The minimum is known to within the tolerance, or proven to be above the margin.
    pub converged: bool,
    /// Number of evaluations of both fields.
    pub evaluations: u32,
}

/// An open box of the search: the element of [`Pair::deepest`]'s scratch buffer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxNode {
    region: Aabb,
    lower_bound: f64,
}

impl BoxNode {
    /// Fills the scratch buffer.
    pub const EMPTY: Self = Self { region: Aabb { min: [0.0; 3], max: [0.0; 3] }, lower_bound: 0.0 };
}

impl Node for BoxNode {
    type Bound = f64;
    fn lower_bound(&self) -> f64 {
        self.lower_bound
    }
}

/// Steps of a local descent. Most come to rest after half as many.
const DESCENT_STEPS: u32 = 48;

impl<A: EnclosedSdf, B: EnclosedSdf> Pair<'_, A, B> {
    /// Finds the deepest point. `scratch` holds the open boxes: a few hundred are enough for smooth bodies. If it is
    /// too small, the answer has not converged, and its bound holds nevertheless.
    pub fn deepest<R: Float>(&self, search: &DepthSearch, scratch: &mut [BoxNode]) -> DeepestPoint<R> {
        let query = PairQuery::<R, A, B>::new(self);
        let longest = self.region.longest_side();
        let gap = R::from_f64(longest * search.tolerance) + query.rounding;
        let mut run = BranchAndBound {
            query,
            best: None,
            evaluations: 0,
            gap: gap.to_f64(),
            converged: true,
            queue: BestFirstQueue::new(scratch),
        };
        run.bound_node(BoxNode { region: self.region, lower_bound: f64::NEG_INFINITY });
        while let Some(node) = run.queue.pop() {
            let halves =
                node.region.bisect().filter(|_| run.evaluations < search.evaluations && run.may_improve(&node));
            let Some(halves) = halves else {
                // No open node has a lower bound than this one.
                run.queue.fathom(node.lower_bound);
                if run.may_improve(&node) {
                    run.converged = false;
                }
                if run.evaluations >= search.evaluations || !run.may_improve(&node) {
                    break;
                }
                continue;
            };
            halves.into_iter().for_each(|region| run.bound_node(BoxNode { region, ..node }));
        }
        run.finish()
    }
}

struct BranchAndBound<'p, 's, R: Real, A, B> {
    query: PairQuery<'p, R, A, B>,
    best: Option<OverlapPoint<R>>,
    evaluations: u32,
    gap: f64,
    converged: bool,
    queue: BestFirstQueue<BoxNode, &'s mut [BoxNode]>,
}

impl<R: Float, A: EnclosedSdf, B: EnclosedSdf> BranchAndBound<'_, '_, R, A, B> {
    fn best_value(&self) -> f64 {
        self.best.map_or(f64::INFINITY, |best| best.value.to_f64())
    }

    fn may_improve(&self, node: &BoxNode) -> bool {
        node.lower_bound < self.best_value() - self.gap && node.lower_bound <= self.query.pair.margin
    }

    /// Bounds a node, whose bound so far is that of its parent, and opens it if it may improve the best value.
    fn bound_node(&mut self, node: BoxNode) {
        let bound = self.query.bound(&node.region);
        self.evaluations = self.evaluations.saturating_add(u32::from(bound.center.is_some()));
        if let Some(center) = bound.center.filter(OverlapPoint::is_finite) {
            let is_lower = center.value.to_f64() < self.best_value();
            if center.value.to_f64() < self.best_value() - self.gap || (is_lower && self.best.is_none()) {
                let step = R::from_f64(0.25 * node.region.longest_side());
                let (lowest, evaluations) = self.query.descend(center, step);
                self.evaluations = self.evaluations.saturating_add(evaluations);
                self.best = Some(lowest);
            } else if is_lower {
                self.best = Some(center);
            }
        }
        // Where a value is NaN nothing is proven, not even the bound of the parent.
        let is_proven = bound.center.is_none_or(|center| center.is_finite());
        let lower_bound = if is_proven { bound.lower_bound.to_f64().max(node.lower_bound) } else { f64::NEG_INFINITY };
        let node = BoxNode { lower_bound, ..node };
        if self.may_improve(&node) {
            self.queue.push(node);
        } else {
            self.queue.fathom(node.lower_bound);
        }
    }

    fn finish(self) -> DeepestPoint<R> {
        let all = R::from_f64(self.queue.lower_bound());
        let lower_bound = self.best.map_or(all, |best| Real::min(best.value, all));
        let converged = self.converged && self.queue.overflow_bound() == f64::INFINITY;
        DeepestPoint { point: self.best, lower_bound, converged, evaluations: self.evaluations }
    }
}

impl<R: Float, A: EnclosedSdf, B: EnclosedSdf> PairQuery<'_, R, A, B> {
    /// Descends until no step leads lower: proximal steps x ← argmin_y max(l_A(y), l_B(y)) + |y − x|² / (2 `step`) with
    /// the tangents l of both fields (Rockafellar 1976, "Monotone operators and the proximal point algorithm"). The
    /// step doubles after a success and shrinks to a quarter after a failure. Returns the number of evaluations as
    /// well.
    pub(super) fn descend(&self, start: OverlapPoint<R>, first_step: R) -> (OverlapPoint<R>, u32) {
        let (mut lowest, mut step) = (start, first_step);
        for _ in 0..DESCENT_STEPS {
            let next = self.evaluate(lowest.point - lowest.proximal_gradient(step) * step);
            let is_lower = next.is_finite() && next.value < lowest.value;
            step *= R::from_f64(if is_lower { 2.0 } else { 0.25 });
            lowest = if is_lower { next } else { lowest };
        }
        (lowest, DESCENT_STEPS)
    }
}

impl<R: Float> OverlapPoint<R> {
    /// The gradient t g_A + (1 − t) g_B of the proximal step x − step · gradient: t = ((φ_A − φ_B)/step − g_B·d) / d·d
    /// with d = g_A − g_B, clamped to \[0, 1\].
    fn proximal_gradient(&self, step: R) -> Vector3<R> {
        let difference = self.a.gradient - self.b.gradient;
        let length_sq = difference.dot(&difference);
        let value_difference = (self.a.value - self.b.value) / step;
        if length_sq.sqrt().is_negligible() {
            return (self.a.gradient + self.b.gradient) * R::from_f64(0.5);
        }
        let clamped = |numerator: R| Real::clamp(numerator / length_sq, R::zero(), R::one());
        let t_a = clamped(value_difference - self.b.gradient.dot(&difference));
        let t_b = clamped(self.a.gradient.dot(&difference) - value_difference);
        self.a.gradient * t_a + self.b.gradient * t_b
    }
}

impl Aabb {
    /// Two halves, cut across the longest side; `None` if that is no longer than rounding.
    fn bisect(&self) -> Option<[Self; 2]> {
        let [x, y, z] = self.extents();
        let longest = if x >= y && x >= z { 0 } else { 1 + usize::from(y < z) };
        let middle: [f64; 3] = from_fn(|axis| 0.5 * (self.min[axis] + self.max[axis]));
        let cut = |axis: usize, side: f64| if axis == longest { middle[axis] } else { side };
        let below = Self { max: from_fn(|axis| cut(axis, self.max[axis])), ..*self };
        let above = Self { min: from_fn(|axis| cut(axis, self.min[axis])), ..*self };
        (below != *self && above != *self).then_some([below, above])
    }
}
