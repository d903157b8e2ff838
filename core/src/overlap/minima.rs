//! Every isolated minimum of f = max(φ_A, φ_B).
//!
//! 1. `gather_leaves`: visit the cubes in which the bodies may touch (`leaves`), and evaluate both fields at their
//!    centres.
//! 2. The merge tree of these values (`merge_tree`) gives the lowest cube of each basin deeper than the barrier.
//! 3. `bottom`: from there descend, and search a box around the end by branch and bound (`deepest`).

use super::bounds::PairQuery;
use super::deepest::{DESCENT_STEPS, MAX_OVERRUN};
use super::leaves::{Leaves, morton_code, morton_leaf};
use super::merge_tree::{MergeTree, MortonLeaf};
use super::{BoxNode, DepthSearch, OverlapPoint, Pair};
use crate::number::Float;
use crate::vector::from_f64;
use crate::{Aabb, EnclosedSdf};

/// Result of [`Pair::minima`] beside the minima themselves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalMinima {
    /// Number of minima found; those written are the deepest.
    pub count: usize,
    /// Number of cubes in which the bodies may touch: the room that the scratch buffer needs.
    pub leaf_count: usize,
    /// Number of cubes left out because a field is not finite at their centre.
    pub undefined_count: usize,
    /// Height that every path from cube to cube climbs between two minima. Between their centres it can be twice as
    /// much.
    pub barrier: f64,
    /// Number of evaluations of both fields, at most as many as were allowed.
    pub evaluations: u32,
    /// False if the budget or the scratch buffer ran out: there may be more minima.
    pub is_complete: bool,
}

impl<A: EnclosedSdf, B: EnclosedSdf> Pair<'_, A, B> {
    /// Finds every isolated minimum of f = max(φ_A, φ_B), at least one in each connected part of the region in which
    /// the bodies touch.
    ///
    /// f is compared on cubes with an edge of `resolution`. Let `barrier` be the largest change of f along a cube's
    /// diagonal. A minimum is reported if every path to a lower point climbs by more than twice the barrier. It is not
    /// reported if one climbs by less than half of it. So flat or curved valleys are one minimum, and neither the
    /// lattice nor finer noise makes another. Parts less than about 1 + √3 · slope bound cubes apart may
    /// count as one, and so may parts far from each other with a gap between the bodies from one to the other that is nowhere wider
    /// than the barrier.
    ///
    /// `minima` is filled with the lowest in ascending order. `scratch` needs room for all cubes in which the bodies
    /// may touch.
    pub fn minima<R: Float>(
        &self,
        resolution: f64,
        evaluations: u32,
        scratch: &mut [MortonLeaf<R>],
        minima: &mut [Option<OverlapPoint<R>>],
    ) -> LocalMinima {
        let query = PairQuery::<R, A, B>::new(self);
        let leaves = Leaves::new(&self.region, resolution);
        let edge = leaves.edge;
        let slope_bound = self.a.slope_bound().max(self.b.slope_bound());
        let barrier = edge * libm::sqrt(3.0) * slope_bound;
        let mut summary =
            LocalMinima { count: 0, leaf_count: 0, undefined_count: 0, barrier, evaluations: 0, is_complete: true };
        query.gather_leaves(leaves, evaluations, scratch, &mut summary);
        let stored = summary.leaf_count.min(scratch.len());
        let mut tree = MergeTree::new(scratch.get_mut(..stored).unwrap_or_default());
        let leaves = Leaves::new(&self.region, resolution);
        tree.merge(R::from_f64(barrier), |code| {
            let budget = evaluations.saturating_sub(summary.evaluations);
            let Some((bottom, spent)) = query.bottom(leaves.leaf_center(morton_leaf(code)), edge, budget) else {
                summary.is_complete = false;
                return;
            };
            summary.evaluations = summary.evaluations.saturating_add(spent);
            // A cube in which the bodies may touch can have a bottom at which they do not.
            if bottom.value <= query.margin + query.rounding {
                summary.count = summary.count.saturating_add(1);
                insert(minima, bottom);
            }
        });
        summary
    }
}

/// Largest number of boxes to search around a minimum, each around the lowest point of the one before.
const MAX_BOXES: u32 = 8;

/// The search of a box of three cubes along each side.
const BOX_SEARCH: DepthSearch = DepthSearch { evaluations: 512, tolerance: 1e-3 };

impl<R: Float, A: EnclosedSdf, B: EnclosedSdf> PairQuery<'_, R, A, B> {
    /// The bottom of the basin of a point, and the number of evaluations; `None` if the budget is too small for a descent. Where several
    /// faces of a body meet, descents come to rest above the bottom; the search of a box around does not.
    fn bottom(&self, start: [f64; 3], edge: f64, budget: u32) -> Option<(OverlapPoint<R>, u32)> {
        if budget <= DESCENT_STEPS {
            return None;
        }
        let (mut lowest, steps) = self.descend(self.evaluate(from_f64(start)), R::from_f64(0.5 * edge));
        let mut evaluations = steps.saturating_add(1);
        for _ in 0..MAX_BOXES {
            let left = budget.saturating_sub(evaluations).saturating_sub(MAX_OVERRUN);
            if left == 0 {
                break;
            }
            let center: [f64; 3] = lowest.point.map(R::to_f64).into();
            let neighbourhood = Aabb { min: center, max: center }.inflate(1.5 * edge);
            let Some(region) = self.pair.region.intersection(&neighbourhood) else { break };
            let nearby = Pair { a: self.pair.a, b: self.pair.b, margin: self.pair.margin, region };
            let search = DepthSearch { evaluations: BOX_SEARCH.evaluations.min(left), ..BOX_SEARCH };
            let deepest = nearby.deepest::<R>(&search, &mut [BoxNode::EMPTY; 64]);
            evaluations = evaluations.saturating_add(deepest.evaluations);
            let Some(lower) = deepest.point.filter(|lower| lower.value < lowest.value) else { break };
            let is_much = R::from_f64(BOX_SEARCH.tolerance * 3.0 * edge) < lowest.value - lower.value;
            lowest = lower;
            if !is_much {
                break;
            }
        }
        Some((lowest, evaluations))
    }

    fn gather_leaves(&self, mut leaves: Leaves, budget: u32, scratch: &mut [MortonLeaf<R>], summary: &mut LocalMinima) {
        while let Some(block) = leaves.next_block() {
            if summary.evaluations >= budget {
                summary.is_complete = false;
                return;
            }
            let bound = self.bound(&block.region);
            summary.evaluations = summary.evaluations.saturating_add(u32::from(bound.center.is_some()));
            let Some(center) = bound.center.filter(|_| bound.may_touch()) else { continue };
            if !block.is_leaf() {
                leaves.split(&block);
            } else if !center.is_finite() {
                summary.undefined_count = summary.undefined_count.saturating_add(1);
            } else {
                match scratch.get_mut(summary.leaf_count) {
                    Some(slot) => *slot = MortonLeaf::new(morton_code(block.first), center.value),
                    None => summary.is_complete = false,
                }
                summary.leaf_count = summary.leaf_count.saturating_add(1);
            }
        }
    }
}

/// Inserts a point in ascending order; the highest drops out of a full buffer.
fn insert<R: Float>(minima: &mut [Option<OverlapPoint<R>>], point: OverlapPoint<R>) {
    let mut carried = Some(point);
    for slot in minima {
        let is_lower = match (&carried, &slot) {
            (Some(carried), Some(present)) => carried.value < present.value,
            (carried, None) => carried.is_some(),
            (None, _) => false,
        };
        if is_lower {
            core::mem::swap(slot, &mut carried);
        }
    }
}
