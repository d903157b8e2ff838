//! The global minimum of a field on a simplex, with a proven lower bound, by branch and bound (Land and Doig 1960;
//! Hansen and Walster 2003, "Global Optimization Using Interval Analysis").
//!
//! | step | question | file |
//! |---|---|---|
//! | 1 | Is the field a union? Then each part is searched by itself, and the lowest minimum wins. | `parts` |
//! | 2 | Does the field know the minimum of this segment or triangle without a search? | `known_minimum` |
//! | 3 | If not: the node with the lowest bound is bisected, and each half bounded from one evaluation. | `branch_and_bound` |
//! | 4 | Does some in-plane direction descend on all of a half? Then its interior holds no minimum. | `descent_test` |
//!
//! With v the lowest value found and l the lower bound of all nodes, min(v, l) ≤ min φ ≤ v. A node whose bound is at
//! least v − gap is fathomed; gap = tolerance · slope bound · (longest edge, or size of the surface if that is shorter) + rounding. The
//! search has converged when no other is left.
//!
//! Every step asks first whether the budget of evaluations allows it, so that none is exceeded. A larger budget goes
//! the same way further.

mod branch_and_bound;
mod descent_test;
mod known_minimum;
mod parts;

use branch_and_bound::{BranchAndBound, SimplexNode};
use known_minimum::{SampledMinimum, minimum_on_edges, minimum_on_segment, minimum_on_triangle};
use parts::minimum_of_parts;

use super::descent_state::DescentState;
use super::sub_simplex::SubSimplex;
use super::{Minimizer, Minimum, Newton};
use crate::number::kernel::LaneBundle;
use crate::number::{Float, Real};
use crate::rounding::{FieldScale, NESTED_FIELDS, rounding};
use crate::simplex::corner_weights;
use crate::{EnclosedSdf, Goal, Simplex};

/// Branch and bound: finds the global minimum on the simplex, however many local ones there are, to within the gap
/// between value and lower bound.
///
/// It has converged if that gap is within the tolerance. Otherwise the budget ran out first, and the bound still holds.
///
/// A grid knows its minimum on a segment, and on a triangle in a box of up to some 56 cells along each axis
/// ([`EnclosedSdf::exact_minimum`]): these need no search, and a larger triangle is cut until its parts are of that
/// size. So do half-spaces, and in double precision balls, ellipsoids and capsules, but for slivers. On other fields the
/// search starts where a few steps of [`Newton`] end: the lower the value to beat, the fewer the nodes.
///
/// With a level ([`Minimizer::minimize_below`]), it stops once every value is proven above the level. Where the value found
/// without it is at most the level, the answer is the same to within the tolerance; of unions a part that ends at the level leaves more
/// of the budget to the others, and the answer may be lower. Where that is above the level, but by less than the tolerance
/// leaves open, a search in double precision is repeated with a smaller tolerance, until it decides that or the budget is spent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certified {
    /// Largest number of evaluations of an answer, local steps and all parts of a union included; 0 counts as 1. The
    /// exact minimum of a grid on a simplex or a part of it counts as one. A budget too small for a search takes the
    /// lowest of as many corners.
    pub evaluations: u32,
    /// Stops when the minimum is known to within this fraction of slope bound · l, where l is the longest edge, or the size of the
    /// surface if that is shorter ([`Sdf::extent`](crate::Sdf::extent)).
    pub tolerance: f64,
    /// Finds the first value to beat, and polishes the result. Newton needs fewer evaluations in all than Frank-Wolfe
    /// or no local search, on shapes and grids. Where the field is smooth it makes the point accurate, not only the
    /// value.
    pub local: Newton,
}

impl Default for Certified {
    fn default() -> Self {
        // A value known to 1e-8 is a point known to 1e-4 where the field is smooth: no jitter.
        let local = Newton { iterations: 8, tolerance: 1e-8 };
        Self { evaluations: 1024, tolerance: 1e-3, local }
    }
}

/// Size of the part around the best point that is polished at the end, as a fraction of the simplex.
const POLISH_FRACTION: f64 = 0.125;

impl<const N: usize> Minimizer<N> for Certified {
    const USES_SIMD: bool = true;

    /// Lane by lane: each has nodes of its own.
    #[cfg_attr(feature = "std", inline(always))]
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        self.minimize_below(field, simplex, R::from_f64(f64::INFINITY))
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn minimize_below<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>, level: R) -> Minimum<R, N> {
        let mut minimum = Minimum::default();
        for lane in 0..R::LANES {
            let (simplex, level) = (simplex.lane(lane), level.lane(lane));
            let (mut method, mut known) = (*self, None);
            loop {
                // By reference, as a field visits itself as its only part: so both are of one type, compiled once.
                let found = minimum_of_parts(&method, &field, &simplex, level);
                let all = known.map_or(found, |known| join(&known, &found));
                // A search that did not converge has nothing left, or cannot go further.
                match self.finer(field, &simplex, level, &all).filter(|_| found.converged) {
                    Some(finer) => (method, known) = (finer, Some(all)),
                    None => {
                        minimum.set_lane(lane, all);
                        break;
                    }
                }
            }
        }
        minimum
    }
}

/// How far below the best value the search still looks, and how far that value is off by rounding.
#[derive(Clone, Copy)]
struct Slack<R> {
    gap: R,
    rounding: R,
}

/// The lower value and the higher bound of two searches. What has converged at the tolerance of one is known as well with a lower value.
#[inline(never)]
fn join<R: Float, const N: usize>(a: &Minimum<R, N>, b: &Minimum<R, N>) -> Minimum<R, N> {
    let lowest = if b.sample.value < a.sample.value { *b } else { *a };
    Minimum {
        lower_bound: Real::max(a.lower_bound, b.lower_bound),
        converged: a.converged || b.converged,
        evaluations: a.evaluations + b.evaluations,
        ..lowest
    }
}

/// The length that tolerances are fractions of: the longest edge, or the size of the surface if that is shorter.
#[inline(always)]
pub(crate) fn reference_length<R: Real, F: EnclosedSdf>(field: &F, longest_edge: R) -> R {
    longest_edge.min(field.extent())
}

impl Certified {
    /// The search, with what is left of the budget, that can tell whether a value is at most the level, where the tolerance left that
    /// open.
    #[inline(always)]
    fn finer<R: Float, F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
        level: R,
        found: &Minimum<R, N>,
    ) -> Option<Self> {
        let value = found.sample.value;
        // A GPU has no registers left for a second search, and answers in single precision are the same everywhere.
        let is_single = R::EPSILON > 1e-10;
        if is_single || !found.converged || value <= level || level < found.lower_bound {
            return None;
        }
        // What rounding decides, no tolerance tells.
        let rounding = rounding(FieldScale::new(field), simplex.corners[0], simplex.longest_edge(), value);
        if value - level <= rounding * R::from_f64(NESTED_FIELDS) {
            return None;
        }
        let fraction = (value - level) / self.tolerance_on(field, simplex.longest_edge());
        // NaN where the tolerance is zero.
        let tolerance =
            if fraction < R::one() { self.tolerance * 0.5 * fraction.to_f64() } else { self.tolerance * 0.5 };
        let evaluations = self.evaluations.saturating_sub(found.evaluations.to_count());
        (evaluations > 0).then_some(Self { evaluations, tolerance, ..*self })
    }

    /// The minimum of one field that is not a union.
    #[cfg_attr(feature = "std", inline(always))]
    fn minimum<R: Float, F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
        level: R,
    ) -> Minimum<R, N> {
        if let Some(minimum) = minimum_on_segment(field, simplex) {
            return minimum;
        }
        let longest_edge = simplex.longest_edge();
        // What is proven above the level must be so beyond the rounding that its bound is widened by.
        let rounding = rounding(FieldScale::new(field), simplex.corners[0], longest_edge, level);
        let above_level = level + rounding * R::from_f64(2.0);
        let goal = Goal { level: above_level, gap: self.tolerance_on(field, longest_edge) };
        let exact = minimum_on_triangle(field, simplex, goal);
        if let Some(exact) = exact {
            let minimum = exact.with_bound(self.slack(field, simplex, longest_edge, exact.sample.value));
            let is_spent = self.evaluations < BranchAndBound::<R, F, N>::MIN_EXACT_BUDGET;
            if minimum.converged || level < minimum.lower_bound || is_spent {
                return minimum;
            }
        } else if self.evaluations < BranchAndBound::<R, F, N>::MIN_LOCAL_BUDGET {
            return self.lowest_corner(field, simplex);
        }
        self.search(field, simplex, level, exact)
    }

    /// The lowest of as many corners as there are evaluations, for budgets that allow no search.
    #[inline(never)]
    fn lowest_corner<R: Float, F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
    ) -> Minimum<R, N> {
        let mut state = DescentState::new(field, simplex, corner_weights(0));
        for corner in 1..N.min(self.evaluations as usize) {
            state.evaluate(corner_weights(corner), true);
        }
        let minimum = state.finish(false);
        let Slack { gap, .. } = self.slack(field, simplex, simplex.longest_edge(), minimum.sample.value);
        Minimum { converged: minimum.sample.value - gap <= minimum.lower_bound, ..minimum }
    }

    #[inline(always)]
    fn tolerance_on<R: Float, F: EnclosedSdf>(&self, field: &F, longest_edge: R) -> R {
        reference_length(field, longest_edge) * R::from_f64(field.slope_bound() * self.tolerance)
    }

    #[inline(always)]
    fn slack<R: Float, F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
        longest_edge: R,
        value: R,
    ) -> Slack<R> {
        let rounding = rounding(FieldScale::new(field), simplex.corners[0], longest_edge, value);
        Slack { gap: self.tolerance_on(field, longest_edge) + rounding * R::from_f64(NESTED_FIELDS), rounding }
    }

    /// `exact` is what the field knows of the whole triangle, if that was not enough.
    #[inline(never)]
    fn search<R: Float, F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
        level: R,
        exact: Option<SampledMinimum<R, N>>,
    ) -> Minimum<R, N> {
        let budget = self.evaluations;
        let has_budget_for_edges = BranchAndBound::<R, F, N>::MIN_EDGE_BUDGET <= budget;
        let on_edges = match exact {
            None if has_budget_for_edges => minimum_on_edges(field, simplex),
            _ => None,
        };
        let mut search = match (exact, on_edges) {
            (Some(exact), _) => BranchAndBound::from_exact(field, simplex, &exact, budget),
            (None, Some(on_edges)) => BranchAndBound::from_edges(field, simplex, on_edges, budget),
            (None, None) => BranchAndBound::from_local(field, simplex, self, budget),
        };
        let Slack { gap, rounding } = self.slack(field, simplex, simplex.longest_edge(), search.best.value);
        if let Some(on_edges) = on_edges {
            search.fathom(Real::min(on_edges.value, search.best.value) - rounding);
        }
        let root = SimplexNode::root();
        let root = match exact {
            Some(exact) => search.open(SimplexNode { lower_bound: exact.lower_bound - rounding, ..root }, gap),
            None => search.bound_node(root, search.best.weights, gap),
        };
        let converged = match root {
            // Not of a NaN.
            None => search.best.value - gap <= R::from_f64(f64::INFINITY),
            Some(root) if on_edges.is_some() && !search.descend(self, &SubSimplex::whole()) => {
                search.fathom(root.lower_bound);
                false
            }
            Some(root) => search.bisect(root, gap, level),
        };
        // A search that was stopped is not polished: it might end lower than one that went on.
        if converged && search.needs_polish {
            let part = SubSimplex::shrunk(search.best.weights, R::from_f64(POLISH_FRACTION));
            search.descend(self, &part);
        }
        search.finish(converged)
    }
}
