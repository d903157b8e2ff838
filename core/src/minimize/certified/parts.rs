//! The search of a union: min over the parts of their minima, each part searched by what it knows itself.
//!
//! min_x min_i φ_i(x) = min_i min_x φ_i(x). The value found so far is the level of the next search, and a part whose
//! box bound lies above it is skipped.

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
    best: Option<Minimum<R, N>>,
    /// Lower bound of the parts whose search did not converge.
    unconverged_bound: R,
    has_several: bool,
}

impl<'a, R: Float, const N: usize> PartsSearch<'a, R, N> {
    pub fn new(method: &'a Certified, simplex: &'a Simplex<R, N>, level: R) -> Self {
        let unconverged_bound = R::from_f64(f64::INFINITY);
        Self { method, simplex, level, best: None, unconverged_bound, has_several: false }
    }

    #[inline(always)]
    fn include(&mut self, minimum: &Minimum<R, N>) {
        if !minimum.converged {
            self.unconverged_bound = Real::min(self.unconverged_bound, minimum.lower_bound);
        }
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
            lower_bound: Real::min(best.lower_bound, sample.value),
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
            self.include(&minimum);
            self.best = Some(minimum);
            return;
        };
        self.has_several = true;
        let level = Real::min(self.level, best.sample.value);
        let longest = self.simplex.longest_edge();
        let rounding = rounding(part.slope_bound(), self.simplex.corners[0], longest, level);
        if level < R::from_f64(part.enclose_box(&self.simplex.bounds()).range.lower) - rounding {
            return;
        }
        let minimum = self.method.minimum(part, self.simplex, level);
        self.include(&minimum);
        let lowest = if minimum.sample.value < best.sample.value { minimum } else { best };
        self.best = Some(Minimum {
            lower_bound: Real::min(best.lower_bound, minimum.lower_bound),
            evaluations: best.evaluations + minimum.evaluations,
            ..lowest
        });
    }
}
