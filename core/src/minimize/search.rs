use nalgebra::Vector3;

use super::Minimum;
use crate::kernel::Kernel;
use crate::real::{Mask, Real};
use crate::simplex::LowerBound;
use crate::simplex::corner_weights;
use crate::vector::select;
use crate::{Sample, Sdf, Simplex, Status};

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
    #[cfg_attr(feature = "std", inline(always))]
    fn new<F: Sdf>(field: &F, simplex: &Simplex<R, N>, weights: [R; N]) -> Self {
        let point = R::apply(&AtWeights, (*simplex, weights));
        Self { weights, point, sample: field.evaluate(point) }
    }

    /// The first where the mask holds, else the second.
    #[inline(always)]
    pub fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        let mask_number = R::select(mask, R::one(), R::zero());
        let (weights, point, [value], gradient) = R::apply(&Choose, ([mask_number], yes.numbers(), no.numbers()));
        Self {
            weights,
            point,
            sample: Sample { value, gradient, status: Status::select(mask, yes.sample.status, no.sample.status) },
        }
    }

    #[inline(always)]
    fn numbers(&self) -> Numbers<R, N> {
        (self.weights, self.point, [self.sample.value], self.sample.gradient)
    }
}

type Numbers<R, const N: usize> = ([R; N], Vector3<R>, [R; 1], Vector3<R>);

/// The first numbers where the choice is 1, the second where it is 0.
struct Choose<const N: usize>;

impl<const N: usize> Kernel for Choose<N> {
    type From<R: Real> = ([R; 1], Numbers<R, N>, Numbers<R, N>);
    type To<R: Real> = Numbers<R, N>;

    #[inline(always)]
    fn apply<R: Real>(&self, ([choice], yes, no): Self::From<R>) -> Numbers<R, N> {
        let mask = R::zero().lt(choice);
        let mut weights = no.0;
        for k in 0..N {
            weights[k] = R::select(mask, yes.0[k], no.0[k]);
        }
        (weights, select(mask, yes.1, no.1), [R::select(mask, yes.2[0], no.2[0])], select(mask, yes.3, no.3))
    }
}

/// The point of barycentric weights.
struct AtWeights<const N: usize>;

impl<const N: usize> Kernel for AtWeights<N> {
    type From<R: Real> = (Simplex<R, N>, [R; N]);
    type To<R: Real> = Vector3<R>;

    #[inline(always)]
    fn apply<R: Real>(&self, (simplex, weights): Self::From<R>) -> Vector3<R> {
        simplex.point(weights)
    }
}

impl<'a, R: Real, F: Sdf, const N: usize> Search<'a, R, F, N> {
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
        let better = active & visit.sample.value.lt(self.best.sample.value);
        self.best = Visit::select(better, visit, self.best);
        self.evaluations += R::select(active, R::one(), R::zero());
        visit
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub fn finish(self, converged: R::Mask) -> Minimum<R, N> {
        let Visit { weights, point, sample } = self.best;
        let below = LowerBound { slope_bound: self.field.slope_bound() };
        let [lower_bound] = R::apply(&below, (*self.simplex, [R::lift(below.slope_bound)], point, [sample.value]));
        Minimum { weights, point, sample, lower_bound, evaluations: self.evaluations, converged }
    }
}
