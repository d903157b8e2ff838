use core::array::from_fn;

use nalgebra::Vector3;

use super::Minimum;
use crate::number::kernel::LaneKernel;
use crate::number::kernel::run;
use crate::number::{Mask, Real};
use crate::simplex::{LowerBound, corner_weights};
use crate::vector::select;
use crate::{EnclosedSdf, Sample, Simplex, Status};

/// A search under way: the best point so far and what it has cost.
pub(super) struct Search<'a, R: Real, F, const N: usize> {
    field: &'a F,
    simplex: &'a Simplex<R, N>,
    pub best: Visit<R, N>,
    pub evaluations: R,
}

/// A point that was asked.
#[derive(Clone, Copy)]
pub(super) struct Visit<R: Real, const N: usize> {
    pub weights: [R; N],
    pub sample: Sample<R>,
}

/// Of a [`Visit`] the weights, the value and the gradient: what a kernel can take. Masks would keep it from becoming vectors.
pub(super) type Numbers<R, const N: usize> = ([R; N], [R; 1], Vector3<R>);

impl<R: Real, const N: usize> Visit<R, N> {
    #[inline(always)]
    fn new<F: EnclosedSdf>(field: &F, simplex: &Simplex<R, N>, weights: [R; N]) -> Self {
        let point = run(&AtWeights, (*simplex, weights));
        Self { weights, sample: field.evaluate(point) }
    }

    #[inline(always)]
    pub fn numbers(&self) -> Numbers<R, N> {
        (self.weights, [self.sample.value], self.sample.gradient)
    }

    /// The first where the mask holds, else the second.
    #[inline(always)]
    pub fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        let weights = from_fn(|k| R::select(mask, yes.weights[k], no.weights[k]));
        Self { weights, sample: Sample::select(mask, yes.sample, no.sample) }
    }
}

/// The numbers of a visit where it is lower than the best so far and `active`, which is 1 or 0, else those of the best; and 1
/// where it is. For use in a kernel.
#[inline(always)]
pub(super) fn lower<R: Real, const N: usize>(
    visit: Numbers<R, N>,
    best: Numbers<R, N>,
    active: R,
) -> (Numbers<R, N>, [R; 1]) {
    let is_lower = R::zero().lt(active) & visit.1[0].lt(best.1[0]);
    let mut weights = best.0;
    for k in 0..N {
        weights[k] = R::select(is_lower, visit.0[k], best.0[k]);
    }
    let value = R::select(is_lower, visit.1[0], best.1[0]);
    let gradient = select(is_lower, visit.2, best.2);
    ((weights, [value], gradient), [R::select(is_lower, R::one(), R::zero())])
}

/// [`lower`] of a visit, the best so far and what is active.
struct Lower<const N: usize>;

impl<const N: usize> LaneKernel for Lower<N> {
    type From<R: Real> = (Numbers<R, N>, Numbers<R, N>, [R; 1]);
    type To<R: Real> = (Numbers<R, N>, [R; 1]);

    #[inline(always)]
    fn apply<R: Real>(&self, (visit, best, [active]): Self::From<R>) -> Self::To<R> {
        lower(visit, best, active)
    }
}

/// The point of barycentric weights.
struct AtWeights<const N: usize>;

impl<const N: usize> LaneKernel for AtWeights<N> {
    type From<R: Real> = (Simplex<R, N>, [R; N]);
    type To<R: Real> = Vector3<R>;

    #[inline(always)]
    fn apply<R: Real>(&self, (simplex, weights): Self::From<R>) -> Vector3<R> {
        simplex.point(weights)
    }
}

impl<'a, R: Real, F: EnclosedSdf, const N: usize> Search<'a, R, F, N> {
    /// Asks at the given weights.
    #[inline(always)]
    pub fn from(field: &'a F, simplex: &'a Simplex<R, N>, weights: [R; N]) -> Self {
        Self { field, simplex, best: Visit::new(field, simplex, weights), evaluations: R::one() }
    }

    /// Asks at every corner: the start iterate of §3.3.
    #[inline(always)]
    pub fn from_corners(field: &'a F, simplex: &'a Simplex<R, N>) -> Self {
        let mut search = Self::from(field, simplex, corner_weights(0));
        for corner in 1..N {
            search.visit(corner_weights(corner), !R::Mask::NONE);
        }
        search
    }

    #[inline(always)]
    pub fn best(&self) -> Visit<R, N> {
        self.best
    }

    /// Asks at the given weights, in the lanes that are still `active`.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn visit(&mut self, weights: [R; N], active: R::Mask) -> Visit<R, N> {
        let visit = Visit::new(self.field, self.simplex, weights);
        let active = R::select(active, R::one(), R::zero());
        self.keep(visit, active);
        self.evaluations += active;
        visit
    }

    /// Takes a point that was asked for the best where it is lower and `active` above zero.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn keep(&mut self, visit: Visit<R, N>, active: R) {
        let kept = run(&Lower, (visit.numbers(), self.best.numbers(), [active]));
        self.take(kept, visit.sample.status);
    }

    /// What [`lower`] says of the best and a visit with this status.
    #[inline(always)]
    pub fn take(
        &mut self,
        ((weights, [value], gradient), [is_visit]): (Numbers<R, N>, [R; 1]),
        status: Status<R::Mask>,
    ) {
        let status = match self.best.sample.status {
            best if best.merge(status).is_good() => best,
            best => Status::select(R::zero().lt(is_visit), status, best),
        };
        self.best = Visit { weights, sample: Sample { value, gradient, status } };
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub fn finish(self, converged: R::Mask) -> Minimum<R, N> {
        let Visit { weights, sample } = self.best;
        let point = run(&AtWeights, (*self.simplex, weights));
        let below = LowerBound { slope_bound: self.field.slope_bound() };
        let [lower_bound] = run(&below, (*self.simplex, [R::from_f64(below.slope_bound)], point, [sample.value]));
        Minimum { weights, point, sample, lower_bound, evaluations: self.evaluations, converged }
    }
}
