use nalgebra::Vector3;

use super::Minimum;
use crate::real::{Mask, Real};
use crate::simplex::corner_weights;
use crate::{Sample, Sdf, Simplex};

/// A search under way: the best point so far and what it has cost.
pub(super) struct Search<'a, R: Real, F, const N: usize> {
    field: &'a F,
    simplex: &'a Simplex<R, N>,
    best: Visit<R, N>,
    evaluations: R,
}

/// A point that was asked.
#[derive(Clone, Copy)]
pub(super) struct Visit<R: Real, const N: usize> {
    pub weights: [R; N],
    pub point: Vector3<R>,
    pub sample: Sample<R>,
}

impl<R: Real, const N: usize> Visit<R, N> {
    fn new<F: Sdf>(field: &F, simplex: &Simplex<R, N>, weights: [R; N]) -> Self {
        let point = simplex.point(weights);
        Self { weights, point, sample: field.evaluate(point) }
    }

    #[inline]
    pub fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        Self {
            weights: core::array::from_fn(|i| R::select(mask, yes.weights[i], no.weights[i])),
            point: yes.point.zip_map(&no.point, |yes, no| R::select(mask, yes, no)),
            sample: Sample::select(mask, yes.sample, no.sample),
        }
    }
}

impl<'a, R: Real, F: Sdf, const N: usize> Search<'a, R, F, N> {
    /// Asks at the given weights.
    pub fn from(field: &'a F, simplex: &'a Simplex<R, N>, weights: [R; N]) -> Self {
        Self { field, simplex, best: Visit::new(field, simplex, weights), evaluations: R::one() }
    }

    /// Asks at every corner: the start iterate of §3.3.
    pub fn from_corners(field: &'a F, simplex: &'a Simplex<R, N>) -> Self {
        let mut search = Self::from(field, simplex, corner_weights(0));
        for corner in 1..N {
            search.visit(corner_weights(corner), !R::Mask::NONE);
        }
        search
    }

    pub fn best(&self) -> Visit<R, N> {
        self.best
    }

    /// Asks at the given weights, in the lanes that are still `active`.
    #[inline]
    pub fn visit(&mut self, weights: [R; N], active: R::Mask) -> Visit<R, N> {
        let visit = Visit::new(self.field, self.simplex, weights);
        let better = active & visit.sample.value.lt(self.best.sample.value);
        self.best = Visit::select(better, visit, self.best);
        self.evaluations += R::select(active, R::one(), R::zero());
        visit
    }

    pub fn finish(self, converged: R::Mask) -> Minimum<R, N> {
        let Visit { weights, point, sample } = self.best;
        let lower_bound = self.simplex.lower_bound(self.field, self.field.slope_bound(), point, sample.value);
        Minimum { weights, point, sample, lower_bound, evaluations: self.evaluations, converged }
    }
}
