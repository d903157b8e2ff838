//! The state of the search: the lowest value so far, and what is proven of parts of the simplex. Parts that may hold a lower one wait in
//! a queue, which most searches do without: where they start, the whole simplex is proven.
//!
//! A part is bounded by the exact minimum on it, where the field knows that. Else by the higher of two bounds: that of
//! its parent, and the enclosure of φ on the part ([`EnclosedSdf::enclosure`], one evaluation at its centroid).

use super::Certified;
use super::descent_test::DescentTest;
use super::known_minimum::{EDGE_EVALUATIONS, EdgeMinimum, SampledMinimum, minimum_on_triangle};
use crate::best_first::{BestFirstQueue, Node};
use crate::minimize::sub_simplex::{SubSimplex, WeightedValue};
use crate::minimize::{Minimum, Newton};
use crate::number::{Float, Real};
use crate::rounding::{FieldScale, rounding};
use crate::{EnclosedSdf, Goal, Simplex};

/// Room for open nodes: 5 KB for triangles in f64.
const MAX_NODES: usize = 64;

/// With fewer slots free than this, the deepest node is bisected and not the one with the lowest bound. Depth first
/// needs one slot per cut; after this many cuts, two for each halving of a triangle's size, a part is 2⁻²⁰ of the
/// simplex.
const MIN_FREE_SLOTS: usize = 40;

/// A part of the simplex that is to be cut or fathomed.
#[derive(Clone, Copy)]
pub(super) struct SimplexNode<R, const N: usize> {
    pub part: SubSimplex<R, N>,
    pub lower_bound: R,
    /// Number of cuts that made it.
    pub depth: u32,
}

impl<R: Float, const N: usize> SimplexNode<R, N> {
    /// The whole simplex, of which nothing is known.
    pub fn root() -> Self {
        Self { part: SubSimplex::whole(), lower_bound: R::from_f64(f64::NEG_INFINITY), depth: 0 }
    }
}

impl<R: Float, const N: usize> Node for SimplexNode<R, N> {
    type Bound = R;
    fn lower_bound(&self) -> R {
        self.lower_bound
    }
}

/// Open nodes.
type Queue<R, const N: usize> = BestFirstQueue<SimplexNode<R, N>, [SimplexNode<R, N>; MAX_NODES]>;

fn next_node<R: Float, const N: usize>(queue: &mut Queue<R, N>) -> Option<SimplexNode<R, N>> {
    if queue.count() > MAX_NODES - MIN_FREE_SLOTS { queue.pop_deepest(|node| node.depth) } else { queue.pop() }
}

pub(super) struct BranchAndBound<'a, R: Float, F, const N: usize> {
    field: &'a F,
    simplex: &'a Simplex<R, N>,
    /// The lowest value so far.
    pub best: WeightedValue<R, N>,
    /// The best point is the centroid of some part, not the end of a local search.
    pub needs_polish: bool,
    /// Lower bound of all parts that are done with.
    fathomed_bound: R,
    pub evaluations: u32,
    /// Largest number of evaluations, that of [`finish`](Self::finish) included.
    budget: u32,
    /// Present if the minimum on the boundary is known, so that only interior minima are searched.
    descent_test: Option<DescentTest<R>>,
}

impl<'a, R: Float, F: EnclosedSdf, const N: usize> BranchAndBound<'a, R, F, N> {
    /// Least budget of [`from_local`](Self::from_local): all corners, the first bound, and the sample of the result.
    pub const MIN_LOCAL_BUDGET: u32 = (N as u32).saturating_add(2);
    /// Least budget of [`from_exact`](Self::from_exact): that minimum, a bound, and the sample of the result.
    pub const MIN_EXACT_BUDGET: u32 = 3;
    /// Least budget of [`from_edges`](Self::from_edges): the edges, their value, the first bound, and the sample of the
    /// result.
    pub const MIN_EDGE_BUDGET: u32 = EDGE_EVALUATIONS.saturating_add(3);

    /// Starts from the end of a local search, which leaves room for the first bound.
    pub fn from_local(field: &'a F, simplex: &'a Simplex<R, N>, method: &Certified, budget: u32) -> Self {
        let iterations = method.local.iterations.min(budget.saturating_sub(Self::MIN_LOCAL_BUDGET));
        let gap = method.tolerance_on(field, simplex.longest_edge());
        let minimum = Newton { iterations, ..method.local }.minimize_to_gap(field, simplex, gap);
        let best = WeightedValue { weights: minimum.weights, value: minimum.sample.value };
        Self::new(field, simplex, best, [minimum.evaluations.to_f64() as u32, budget], None)
    }

    /// Starts from what the field knows of the whole triangle.
    pub fn from_exact(field: &'a F, simplex: &'a Simplex<R, N>, exact: &SampledMinimum<R, N>, budget: u32) -> Self {
        let best = WeightedValue { weights: exact.weights, value: exact.sample.value };
        Self::new(field, simplex, best, [1, budget], None)
    }

    /// Starts from the minimum on the boundary of a triangle.
    pub fn from_edges(field: &'a F, simplex: &'a Simplex<R, N>, on_edges: EdgeMinimum<R, N>, budget: u32) -> Self {
        let best = WeightedValue { weights: on_edges.weights, value: field.value(simplex.point(on_edges.weights)) };
        let evaluations = EDGE_EVALUATIONS.saturating_add(1);
        Self::new(field, simplex, best, [evaluations, budget], Some(DescentTest::new(simplex)))
    }

    fn new(
        field: &'a F,
        simplex: &'a Simplex<R, N>,
        best: WeightedValue<R, N>,
        [evaluations, budget]: [u32; 2],
        descent_test: Option<DescentTest<R>>,
    ) -> Self {
        let fathomed_bound = R::from_f64(f64::INFINITY);
        Self { field, simplex, best, needs_polish: false, fathomed_bound, evaluations, budget, descent_test }
    }

    /// Evaluations that are left before the one of [`finish`](Self::finish).
    pub fn evaluations_left(&self) -> u32 {
        self.budget.saturating_sub(self.evaluations).saturating_sub(1)
    }

    /// Runs a local search on a part, with as many steps as the budget allows, and keeps its end if that is lower than
    /// the best. `false` if the budget does not allow its corners.
    pub fn descend(&mut self, method: &Certified, part: &SubSimplex<R, N>) -> bool {
        // The corners, and the value in the whole simplex.
        let fixed = (N as u32).saturating_add(1);
        let Some(steps) = self.evaluations_left().checked_sub(fixed) else { return false };
        let local = Newton { iterations: method.local.iterations.min(steps), ..method.local };
        let simplex = part.embed(self.simplex);
        let gap = method.tolerance_on(self.field, simplex.longest_edge());
        let minimum = local.minimize_to_gap(self.field, &simplex, gap);
        self.evaluations = self.evaluations.saturating_add(minimum.evaluations.to_f64() as u32);
        // The answer is the value at the point of the weights in the whole simplex: rounding may make that another one.
        let weights = part.weights(minimum.weights);
        let value = self.field.value(self.simplex.point(weights));
        self.evaluations = self.evaluations.saturating_add(1);
        if value < self.best.value {
            self.best = WeightedValue { weights, value };
        }
        self.needs_polish = false;
        true
    }

    /// Bounds a node from an evaluation at the point of `weights` in it, and returns it unless that fathoms it. Its
    /// bound so far is that of its parent. One evaluation.
    pub fn bound_node(&mut self, node: SimplexNode<R, N>, weights: [R; N], gap: R) -> Option<SimplexNode<R, N>> {
        let part = node.part.embed(self.simplex);
        self.evaluations = self.evaluations.saturating_add(1);
        if let Some(exact) = minimum_on_triangle(self.field, &part, Goal { level: self.best.value - gap, gap }) {
            return self.bound_by_exact(node, &exact, gap);
        }
        let enclosure = self.field.enclosure(self.simplex.point(weights), &part.corners);
        if enclosure.value < self.best.value {
            (self.best, self.needs_polish) = (WeightedValue { weights, value: enclosure.value }, true);
        }
        if self.descent_test.is_some_and(|test| test.excludes(&enclosure.gradients, self.field.slope_bound())) {
            return None;
        }
        // False where the value is NaN: then nothing is proven.
        let is_proven = enclosure.range.lower <= enclosure.value;
        let lower_bound =
            if is_proven { Real::max(enclosure.range.lower, node.lower_bound) } else { R::from_f64(f64::NEG_INFINITY) };
        self.open(SimplexNode { lower_bound, ..node }, gap)
    }

    fn bound_by_exact(
        &mut self,
        node: SimplexNode<R, N>,
        exact: &SampledMinimum<R, N>,
        gap: R,
    ) -> Option<SimplexNode<R, N>> {
        let weights = node.part.weights(exact.weights);
        let point = self.simplex.point(weights);
        let value = self.field.value(point);
        let rounding = rounding(FieldScale::new(self.field), point, self.simplex.longest_edge(), value);
        let lower_bound = Real::max(exact.lower_bound - rounding, node.lower_bound);
        if value < self.best.value {
            (self.best, self.needs_polish) = (WeightedValue { weights, value }, lower_bound < value - gap);
        }
        self.open(SimplexNode { lower_bound, ..node }, gap)
    }

    /// The node, if it may hold a value below the best by more than the gap.
    pub fn open(&mut self, node: SimplexNode<R, N>, gap: R) -> Option<SimplexNode<R, N>> {
        if node.lower_bound < self.best.value - gap {
            return Some(node);
        }
        self.fathom(node.lower_bound);
        None
    }

    /// Counts a part with this bound as done with.
    pub fn fathom(&mut self, lower_bound: R) {
        self.fathomed_bound = Real::min(self.fathomed_bound, lower_bound);
    }

    /// Bisects the root and its parts until all are fathomed, every value is proven above the level, or the budget is spent. Whether
    /// the first of these is so.
    // Small processors have no stack for a frame of its own.
    #[cfg_attr(any(feature = "std", target_arch = "nvptx64"), inline(never))]
    pub fn bisect(&mut self, root: SimplexNode<R, N>, gap: R, level: R) -> bool {
        let mut queue = Queue::new([SimplexNode::root(); MAX_NODES]);
        queue.push(root);
        let (mut is_spent, mut converged) = (false, true);
        while !is_spent && let Some(node) = next_node(&mut queue) {
            if self.best.value - gap <= node.lower_bound {
                self.fathom(node.lower_bound);
                continue;
            }
            if level < Real::min(node.lower_bound, Real::min(self.lower_bound(), queue.lower_bound())) {
                self.fathom(node.lower_bound);
                converged = false;
                break;
            }
            let Some(halves) = node.part.bisect(self.simplex) else {
                // The part is no larger than rounding, and so is the error of its bound, if it has one.
                converged &= node.lower_bound.is_finite();
                self.fathom(node.lower_bound);
                continue;
            };
            let depth = node.depth.saturating_add(1);
            for part in halves {
                if self.evaluations_left() > 0 {
                    if let Some(open) = self.bound_node(SimplexNode { part, depth, ..node }, part.centroid(), gap) {
                        queue.push_evicting(open);
                    }
                } else {
                    is_spent = true;
                    self.fathom(node.lower_bound);
                }
            }
        }
        self.fathom(queue.lower_bound());
        converged && !is_spent && self.best.value - gap <= queue.overflow_bound()
    }

    /// Lower bound of φ on all parts that are done with.
    pub fn lower_bound(&self) -> R {
        Real::min(self.best.value, self.fathomed_bound)
    }

    pub fn finish(self, converged: bool) -> Minimum<R, N> {
        let weights = self.best.weights;
        let point = self.simplex.point(weights);
        Minimum {
            weights,
            point,
            sample: self.field.evaluate(point),
            lower_bound: self.lower_bound(),
            evaluations: R::from_f64(f64::from(self.evaluations.saturating_add(1))),
            converged,
        }
    }
}
