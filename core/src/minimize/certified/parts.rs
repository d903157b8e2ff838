//! The search of a union: min over the parts of their minima, each part searched by what it knows itself.
//!
//! min_x min_i φ_i(x) = min_i min_x φ_i(x). The lowest value so far is the level of the next search, and a part whose lower
//! bound is above the level is skipped. The bound of the whole is the lowest of all parts' bounds, searched or skipped.

use super::Certified;
use crate::enclosure::PartVisitor;
use crate::minimize::Minimum;
use crate::number::{Float, Real};
use crate::rounding::rounding;
use crate::{EnclosedSdf, Simplex};

pub(super) struct PartsSearch<'a, R: Float, const N: usize> {
    method: &'a Certified,
    simplex: &'a Simplex<R, N>,
    level: R,
    /// The part with the lowest value, and the evaluations of all parts.
    best: Option<Minimum<R, N>>,
    /// Lower bound of all parts.
    lower_bound: R,
    /// Lower bound of the parts that were skipped or whose search did not converge.
    unconverged_bound: R,
    has_several: bool,
}

impl<'a, R: Float, const N: usize> PartsSearch<'a, R, N> {
    pub fn new(method: &'a Certified, simplex: &'a Simplex<R, N>, level: R) -> Self {
        let infinity = R::from_f64(f64::INFINITY);
        Self {
            method,
            simplex,
            level,
            best: None,
            lower_bound: infinity,
            unconverged_bound: infinity,
            has_several: false,
        }
    }

    fn include(&mut self, lower_bound: R, converged: bool) {
        self.lower_bound = Real::min(self.lower_bound, lower_bound);
        if !converged {
            self.unconverged_bound = Real::min(self.unconverged_bound, lower_bound);
        }
    }

    fn include_minimum(&mut self, minimum: &Minimum<R, N>) {
        // False where a value is NaN: then nothing is proven.
        let is_proven = minimum.lower_bound <= minimum.sample.value;
        let lower_bound = if is_proven { minimum.lower_bound } else { R::from_f64(f64::NEG_INFINITY) };
        self.include(lower_bound, minimum.converged);
    }

    /// The sample at the minimum is that of the whole field, which has a kink where two parts meet.
    #[inline(always)]
    pub fn finish<F: EnclosedSdf>(self, field: &F) -> Minimum<R, N> {
        let Some(best) = self.best else { return Minimum::default() };
        if !self.has_several {
            return best;
        }
        let sample = field.evaluate(best.point);
        Minimum {
            sample,
            lower_bound: Real::min(self.lower_bound, sample.value),
            evaluations: best.evaluations + R::one(),
            converged: sample.value <= self.unconverged_bound,
            ..best
        }
    }
}

impl<R: Float, const N: usize> PartVisitor for PartsSearch<'_, R, N> {
    #[cfg_attr(feature = "std", inline(always))]
    fn visit<F: EnclosedSdf>(&mut self, part: &F) {
        let Some(best) = self.best else {
            let minimum = self.method.minimum(part, self.simplex, self.level);
            self.include_minimum(&minimum);
            self.best = Some(minimum);
            return;
        };
        self.has_several = true;
        let level = Real::min(self.level, best.sample.value);
        let enclosure = part.enclose_box(&self.simplex.bounds());
        let by_box = R::from_f64(enclosure.range.lower);
        let by_box =
            by_box - rounding(part.slope_bound(), self.simplex.corners[0], self.simplex.longest_edge(), by_box);
        if level < by_box {
            return self.include(by_box, false);
        }
        let (centroid, slope_bound) = (self.simplex.centroid(), R::from_f64(enclosure.slope_bound));
        let by_slope = self.simplex.lower_bound(part.slope_bound(), slope_bound, centroid, part.value(centroid));
        let evaluations = best.evaluations + R::one();
        if level < by_slope {
            self.best = Some(Minimum { evaluations, ..best });
            return self.include(by_slope, false);
        }
        let minimum = self.method.minimum(part, self.simplex, level);
        self.include_minimum(&minimum);
        let lowest = if minimum.sample.value < best.sample.value { minimum } else { best };
        self.best = Some(Minimum { evaluations: evaluations + minimum.evaluations, ..lowest });
    }
}
