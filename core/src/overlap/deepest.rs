//! The minimum of f = max(φ_A, φ_B) over the region of a pair, proven by branch and bound (Land and Doig 1960), as
//! [`Certified`](crate::minimize::Certified) does it on an element.
//!
//! The box with the lowest bound (`bounds`) is bisected across its longest side. A box is fathomed if its bound is above the
//! best value less the gap, tolerance · longest side + rounding. A local descent improves each lower value found.
//!
//! Where there is no room for more open boxes, the one with the lowest bound is searched to its end depth first, which takes room for a box a
//! bisection. Else a child of that very box would be dropped, and the bound would stay where it was.

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
    /// Largest number of evaluations of both fields; a descent that has begun goes on, with up to 98 more.
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

/// Boxes that wait while one is searched depth first: a bisection each, and coordinates in f64 allow no more than some 160.
const MAX_DEPTH: usize = 192;

/// Steps of a local descent. Most come to rest after half as many.
pub(super) const DESCENT_STEPS: u32 = 48;

/// Most evaluations beyond its budget: both halves of a box, and a descent from each.
pub(super) const MAX_OVERRUN: u32 = 2 * (DESCENT_STEPS + 1);

impl<A: EnclosedSdf, B: EnclosedSdf> Pair<'_, A, B> {
    /// Finds the deepest point. `scratch` holds the open boxes: a few hundred are enough for smooth bodies. With fewer than
    /// it takes the search goes depth first and evaluates more; without room for a box a bisection the answer may not converge, and its
    /// bound holds nevertheless.
    pub fn deepest<R: Float>(&self, search: &DepthSearch, scratch: &mut [BoxNode]) -> DeepestPoint<R> {
        let depth = MAX_DEPTH.min(scratch.len() / 4);
        let (stack, open) = scratch.split_at_mut_checked(depth).unwrap_or_default();
        let query = PairQuery::<R, A, B>::new(self);
        let longest = self.region.longest_side();
        let gap = R::from_f64(longest * search.tolerance) + query.rounding;
        let mut run =
            BranchAndBound { query, best: None, evaluations: 0, gap: gap.to_f64(), queue: BestFirstQueue::new(open) };
        let whole = BoxNode { region: self.region, lower_bound: f64::NEG_INFINITY };
        if let Some(node) = run.bound_node(whole) {
            run.queue.push(node);
        }
        while let Some(node) = run.queue.pop() {
            // No open node has a lower bound than this one.
            if run.evaluations >= search.evaluations || !run.may_improve(&node) {
                run.queue.fathom(node.lower_bound);
                break;
            }
            if run.queue.room() < 2 {
                run.search_to_the_end(node, search.evaluations, stack);
                continue;
            }
            for half in run.halves(&node).into_iter().flatten() {
                run.queue.push(half);
            }
        }
        run.finish()
    }
}

struct BranchAndBound<'p, 's, R: Real, A, B> {
    query: PairQuery<'p, R, A, B>,
    best: Option<OverlapPoint<R>>,
    evaluations: u32,
    gap: f64,
    queue: BestFirstQueue<BoxNode, &'s mut [BoxNode]>,
}

impl<R: Float, A: EnclosedSdf, B: EnclosedSdf> BranchAndBound<'_, '_, R, A, B> {
    fn best_value(&self) -> f64 {
        self.best.map_or(f64::INFINITY, |best| best.value.to_f64())
    }

    fn may_improve(&self, node: &BoxNode) -> bool {
        node.lower_bound < self.best_value() - self.gap && node.lower_bound <= self.query.pair.margin
    }

    /// The halves of a node that may improve the best value.
    fn halves(&mut self, node: &BoxNode) -> [Option<BoxNode>; 2] {
        let Some(halves) = node.region.bisect() else {
            self.queue.fathom(node.lower_bound);
            return [None; 2];
        };
        halves.map(|region| self.bound_node(BoxNode { region, ..*node }))
    }

    /// Searches a node depth first, the half with the lower bound before the other, until nothing of it may improve the best value.
    fn search_to_the_end(&mut self, node: BoxNode, evaluations: u32, stack: &mut [BoxNode]) {
        let mut last = Some(node);
        let mut count = 0_usize;
        while let Some(node) = last.take() {
            let is_open = self.evaluations < evaluations && self.may_improve(&node);
            if is_open {
                let [a, b] = self.halves(&node);
                let is_ordered = match (&a, &b) {
                    (Some(a), Some(b)) => a.lower_bound <= b.lower_bound,
                    (a, _) => a.is_some(),
                };
                let (next, later) = if is_ordered { (a, b) } else { (b, a) };
                last = next;
                if let Some(later) = later {
                    match stack.get_mut(count) {
                        Some(place) => {
                            *place = later;
                            count = count.saturating_add(1);
                        }
                        None => self.queue.fathom(later.lower_bound),
                    }
                }
            } else {
                self.queue.fathom(node.lower_bound);
            }
            if last.is_none()
                && let Some(below) = count.checked_sub(1)
            {
                last = stack.get(below).copied();
                count = below;
            }
        }
    }

    /// Bounds a node, whose bound so far is that of its parent. `None` if it cannot improve the best value.
    fn bound_node(&mut self, node: BoxNode) -> Option<BoxNode> {
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
            return Some(node);
        }
        self.queue.fathom(node.lower_bound);
        None
    }

    fn finish(self) -> DeepestPoint<R> {
        let lowest = self.queue.lower_bound();
        let all = R::from_f64(lowest);
        let lower_bound = self.best.map_or(all, |best| Real::min(best.value, all));
        // Nothing that was left could improve the best value.
        let converged = !(lowest < self.best_value() - self.gap && lowest <= self.query.pair.margin);
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
