//! The search of a union: min over the parts of their minima, each part searched by what it knows itself.
//!
//! min_x min_i φ_i(x) = min_i min_x φ_i(x). The lowest value so far is the level of the next search, and a part whose lower
//! bound is above the level is skipped. The bound of the whole is the lowest of all parts' bounds, searched or skipped. The part
//! that is lowest at the centroid comes first, so that most of the others are skipped, in whatever order they are listed.
//!
//! The parts share one budget, of so many evaluations of each: to evaluate all parts once is one evaluation of the field. A part may
//! take half of what is left, the last one all, and none more than a field of one part. The last evaluations are kept for the whole
//! field: one for the sample of the result, and one for each corner if a part was not searched to its end, because that part may be
//! lowest there.

use nalgebra::Vector3;

use super::Certified;
use super::branch_and_bound::BranchAndBound;
use crate::enclosure::PartVisitor;
use crate::minimize::Minimum;
use crate::number::{Float, Real};
use crate::rounding::{FieldScale, rounding};
use crate::simplex::corner_weights;
use crate::{EnclosedSdf, Simplex};

/// The minimum of a field, which may be a union.
#[cfg_attr(all(feature = "std", not(target_arch = "wasm32")), inline(always))]
pub(super) fn minimum_of_parts<R: Float, F: EnclosedSdf, const N: usize>(
    method: &Certified,
    field: &F,
    simplex: &Simplex<R, N>,
    level: R,
) -> Minimum<R, N> {
    let mut parts = PartCount(0);
    field.visit_parts(&mut parts);
    let kept = if parts.0 > 1 { evaluations_of_whole::<N>() } else { 0 };
    let min_budget = BranchAndBound::<R, F, N>::MIN_LOCAL_BUDGET;
    if parts.0 > 1 && method.evaluations < min_budget.saturating_add(kept) {
        return proven(method.lowest_corner(field, simplex));
    }
    let mut search = PartsSearch::new(method, simplex, level, method.evaluations.saturating_sub(kept), parts.0);
    if parts.0 > 1 {
        let mut lowest =
            LowestPart { point: simplex.centroid(), lowest: R::from_f64(f64::INFINITY), index: 0, next: 0 };
        field.visit_parts(&mut lowest);
        search.spend(parts.0);
        search.first = lowest.index;
    }
    // In a loop, so that the search of a part stands once in the program.
    for pass in 0..parts.0.min(2) {
        (search.has_first, search.next) = (pass > 0, 0);
        field.visit_parts(&mut search);
    }
    search.finish(field)
}

/// The minimum with −∞ as its bound where bound or value is NaN: then nothing is proven.
#[inline(always)]
fn proven<R: Float, const N: usize>(minimum: Minimum<R, N>) -> Minimum<R, N> {
    let is_proven = minimum.lower_bound <= minimum.sample.value;
    let lower_bound = if is_proven { minimum.lower_bound } else { R::from_f64(f64::NEG_INFINITY) };
    Minimum { lower_bound, ..minimum }
}

/// Evaluations of the whole field at the end: the corners, and the result.
const fn evaluations_of_whole<const N: usize>() -> u32 {
    (N as u32).saturating_add(1)
}

/// The number of parts.
struct PartCount(u32);

impl PartVisitor for PartCount {
    #[inline(always)]
    fn visit<F: EnclosedSdf>(&mut self, _part: &F) {
        self.0 = self.0.saturating_add(1);
    }
}

/// The part that is lowest at a point, the first of several.
struct LowestPart<R: Float> {
    point: Vector3<R>,
    lowest: R,
    index: u32,
    /// Index of the part that is visited next.
    next: u32,
}

impl<R: Float> PartVisitor for LowestPart<R> {
    #[inline(always)]
    fn visit<F: EnclosedSdf>(&mut self, part: &F) {
        let value = part.value(self.point);
        if value < self.lowest {
            (self.lowest, self.index) = (value, self.next);
        }
        self.next = self.next.saturating_add(1);
    }
}

/// The parts are visited twice where there are several: first one of them is searched, then the others.
struct PartsSearch<'a, R: Float, const N: usize> {
    method: &'a Certified,
    simplex: &'a Simplex<R, N>,
    level: R,
    /// Index of the part that is searched first, whether it was, and the index of the part that is visited next.
    first: u32,
    has_first: bool,
    next: u32,
    /// The part with the lowest value.
    best: Option<Minimum<R, N>>,
    /// Lower bound of all parts.
    lower_bound: R,
    /// Lower bound of the parts that were skipped or whose search did not converge.
    unconverged_bound: R,
    /// Evaluations of single parts that are left.
    evaluations_left: u32,
    /// Evaluations of single parts so far.
    part_evaluations: u32,
    /// Evaluations of the whole so far.
    evaluations: u32,
    parts: u32,
    /// Parts that were not searched or skipped yet.
    parts_left: u32,
    /// The budget ended the search of some part.
    is_spent: bool,
}

impl<'a, R: Float, const N: usize> PartsSearch<'a, R, N> {
    fn new(method: &'a Certified, simplex: &'a Simplex<R, N>, level: R, evaluations: u32, parts: u32) -> Self {
        let infinity = R::from_f64(f64::INFINITY);
        Self {
            method,
            simplex,
            level,
            first: 0,
            has_first: false,
            next: 0,
            best: None,
            lower_bound: infinity,
            unconverged_bound: infinity,
            evaluations_left: evaluations.saturating_mul(parts),
            part_evaluations: 0,
            evaluations: 0,
            parts,
            parts_left: parts,
            is_spent: false,
        }
    }

    /// Counts evaluations of single parts.
    fn spend(&mut self, evaluations: u32) {
        self.part_evaluations = self.part_evaluations.saturating_add(evaluations);
        self.evaluations_left = self.evaluations_left.saturating_sub(evaluations);
    }

    fn include(&mut self, lower_bound: R, converged: bool) {
        self.lower_bound = Real::min(self.lower_bound, lower_bound);
        if !converged {
            self.unconverged_bound = Real::min(self.unconverged_bound, lower_bound);
        }
    }

    /// The budget of the current part.
    fn share<F: EnclosedSdf>(&self) -> u32 {
        let share = if self.parts_left == 0 { self.evaluations_left } else { self.evaluations_left / 2 };
        let most = self.method.evaluations.min(self.evaluations_left);
        share.max(BranchAndBound::<R, F, N>::MIN_LOCAL_BUDGET).min(most)
    }

    /// Searches a part within its share of the budget.
    #[cfg_attr(all(feature = "std", not(target_arch = "wasm32")), inline(always))]
    fn search<F: EnclosedSdf>(&mut self, part: &F, level: R) -> Minimum<R, N> {
        let method = Certified { evaluations: self.share::<F>(), ..*self.method };
        let minimum = proven(method.minimum(part, self.simplex, level));
        self.include(minimum.lower_bound, minimum.converged);
        self.is_spent |= !(minimum.converged || level < minimum.lower_bound);
        self.spend(minimum.evaluations.to_f64() as u32);
        minimum
    }

    /// Bounds a part that the budget does not allow to search.
    fn leave_out(&mut self, lower_bound: R) {
        self.include(lower_bound, false);
        self.is_spent = true;
    }

    /// The sample at the minimum is that of the whole field, which has a kink where two parts meet.
    #[inline(always)]
    fn finish<F: EnclosedSdf>(mut self, field: &F) -> Minimum<R, N> {
        let Some(mut best) = self.best else { return Minimum::default() };
        if self.parts == 1 {
            return best;
        }
        if self.is_spent {
            self.lower_to_corners(field, &mut best);
        }
        let sample = field.evaluate(best.point);
        let evaluations = self.evaluations.saturating_add(1).saturating_add(self.part_evaluations.div_ceil(self.parts));
        Minimum {
            sample,
            lower_bound: Real::min(self.lower_bound, sample.value),
            evaluations: R::from_f64(f64::from(evaluations)),
            converged: sample.value <= self.unconverged_bound,
            ..best
        }
    }

    /// Moves the best point to a corner where the whole field is lower.
    fn lower_to_corners<F: EnclosedSdf>(&mut self, field: &F, best: &mut Minimum<R, N>) {
        let mut lowest = best.sample.value;
        for weights in (0..N).map(corner_weights) {
            let point = self.simplex.point(weights);
            let value = field.value(point);
            if value < lowest {
                (lowest, *best) = (value, Minimum { weights, point, ..*best });
            }
        }
        self.evaluations = self.evaluations.saturating_add(N as u32);
    }
}

impl<R: Float, const N: usize> PartVisitor for PartsSearch<'_, R, N> {
    #[cfg_attr(all(feature = "std", not(target_arch = "wasm32")), inline(always))]
    fn visit<F: EnclosedSdf>(&mut self, part: &F) {
        let is_first = self.next == self.first;
        self.next = self.next.saturating_add(1);
        // One of them in each of the two visits.
        if is_first == self.has_first {
            return;
        }
        self.parts_left = self.parts_left.saturating_sub(1);
        let Some(best) = self.best else {
            self.best = Some(self.search(part, self.level));
            return;
        };
        let level = Real::min(self.level, best.sample.value);
        let enclosure = part.enclose_box(&self.simplex.bounds());
        let by_box = R::from_f64(enclosure.range.lower);
        let by_box =
            by_box - rounding(FieldScale::new(part), self.simplex.corners[0], self.simplex.longest_edge(), by_box);
        if level < by_box {
            return self.include(by_box, false);
        }
        if self.evaluations_left == 0 {
            return self.leave_out(by_box);
        }
        let (centroid, slope_bound) = (self.simplex.centroid(), R::from_f64(enclosure.slope_bound));
        let by_slope = self.simplex.lower_bound(FieldScale::new(part), slope_bound, centroid, part.value(centroid));
        self.spend(1);
        if level < by_slope {
            return self.include(by_slope, false);
        }
        if self.evaluations_left < BranchAndBound::<R, F, N>::MIN_LOCAL_BUDGET {
            // A NaN proves nothing.
            let is_proven = by_slope.is_finite();
            return self.leave_out(if is_proven {
                Real::max(by_box, by_slope)
            } else {
                R::from_f64(f64::NEG_INFINITY)
            });
        }
        let minimum = self.search(part, level);
        if minimum.sample.value < best.sample.value {
            self.best = Some(minimum);
        }
    }
}
