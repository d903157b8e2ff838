//! The state that all local methods share: the best point so far, and what it has cost.
//!
//! Steps that run in lanes are kernels over plain numbers ([`LaneKernel`]), which compilers make vectors of. The status
//! of a sample is a mask, which would prevent that: it is chosen outside, by the 1 or 0 that the kernel returns.

use nalgebra::Vector3;

use super::Minimum;
use crate::number::kernel::LaneKernel;
use crate::number::kernel::run;
use crate::number::{Mask, Real};
use crate::rounding::FieldScale;
use crate::simplex::{LongestEdge, LowerBound, corner_weights};
use crate::vector::select;
use crate::{EnclosedSdf, NearParts, Sample, Simplex, Status};

/// A local search in progress.
pub(super) struct DescentState<'a, R: Real, F, const N: usize> {
    field: &'a F,
    simplex: &'a Simplex<R, N>,
    pub longest_edge: R,
    /// Parts of a union that can be the minimum on the simplex.
    pub near: NearParts<R>,
    pub best: WeightedSample<R, N>,
    pub evaluations: R,
}

/// A point of a simplex, and the field's sample there.
#[derive(Clone, Copy)]
pub(super) struct WeightedSample<R: Real, const N: usize> {
    pub weights: [R; N],
    pub sample: Sample<R>,
}

/// Weights, value and gradient of a [`WeightedSample`], as a kernel takes them.
pub(super) type KernelSample<R, const N: usize> = ([R; N], [R; 1], Vector3<R>);

impl<R: Real, const N: usize> WeightedSample<R, N> {
    #[inline(always)]
    pub fn new((weights, [value], gradient): KernelSample<R, N>, status: Status<R::Mask>) -> Self {
        Self { weights, sample: Sample { value, gradient, status } }
    }

    #[inline(always)]
    pub fn kernel_sample(&self) -> KernelSample<R, N> {
        (self.weights, [self.sample.value], self.sample.gradient)
    }
}

/// The lower one of a candidate and the best so far, and 1 where that is the candidate, else 0. The candidate counts
/// only where `active` is 1. For use in a kernel.
#[inline(always)]
pub(super) fn lower<R: Real, const N: usize>(
    candidate: KernelSample<R, N>,
    best: KernelSample<R, N>,
    active: R,
) -> (KernelSample<R, N>, [R; 1]) {
    let is_lower = R::zero().lt(active) & candidate.1[0].lt(best.1[0]);
    let mut weights = best.0;
    for k in 0..N {
        weights[k] = R::select(is_lower, candidate.0[k], best.0[k]);
    }
    let value = R::select(is_lower, candidate.1[0], best.1[0]);
    let gradient = select(is_lower, candidate.2, best.2);
    ((weights, [value], gradient), [R::select(is_lower, R::one(), R::zero())])
}

/// The status of the lower one, where `is_candidate` comes from [`lower`].
#[inline(always)]
pub(super) fn lower_status<R: Real>(
    candidate: Status<R::Mask>,
    best: Status<R::Mask>,
    is_candidate: R,
) -> Status<R::Mask> {
    match best.merge(candidate).is_good() {
        true => best,
        false => Status::select(R::zero().lt(is_candidate), candidate, best),
    }
}

/// [`lower`] as a kernel: from the candidate, the best and `active`.
struct Lower<const N: usize>;

impl<const N: usize> LaneKernel for Lower<N> {
    type From<R: Real> = (KernelSample<R, N>, KernelSample<R, N>, [R; 1]);
    type To<R: Real> = (KernelSample<R, N>, [R; 1]);

    #[inline(always)]
    fn apply<R: Real>(&self, (candidate, best, [active]): Self::From<R>) -> Self::To<R> {
        lower(candidate, best, active)
    }
}

/// [`Simplex::point`] as a kernel.
struct PointOfWeights<const N: usize>;

impl<const N: usize> LaneKernel for PointOfWeights<N> {
    type From<R: Real> = (Simplex<R, N>, [R; N]);
    type To<R: Real> = Vector3<R>;

    #[inline(always)]
    fn apply<R: Real>(&self, (simplex, weights): Self::From<R>) -> Vector3<R> {
        simplex.point(weights)
    }
}

impl<'a, R: Real, F: EnclosedSdf, const N: usize> DescentState<'a, R, F, N> {
    /// Starts from the point of the given weights.
    #[inline(always)]
    pub fn new(field: &'a F, simplex: &'a Simplex<R, N>, weights: [R; N]) -> Self {
        let ([longest_edge], point) = (run(&LongestEdge, *simplex), run(&PointOfWeights, (*simplex, weights)));
        let mut near = NearParts::default();
        let best = WeightedSample { weights, sample: field.narrow(point, longest_edge, &mut near) };
        Self { field, simplex, longest_edge, near, best, evaluations: R::one() }
    }

    /// Starts from the lowest corner, as §3.3 of the paper does.
    #[inline(always)]
    pub fn from_corners(field: &'a F, simplex: &'a Simplex<R, N>) -> Self {
        let mut state = Self::before_corners(field, simplex);
        for corner in 0..N {
            state.evaluate_corner(corner);
        }
        state
    }

    /// [`from_corners`](Self::from_corners), with the samples of all corners.
    #[inline(always)]
    pub fn at_corners(field: &'a F, simplex: &'a Simplex<R, N>) -> (Self, [WeightedSample<R, N>; N]) {
        let mut state = Self::before_corners(field, simplex);
        let mut corners = [state.best; N];
        for (corner, sample) in corners.iter_mut().enumerate() {
            *sample = state.evaluate_corner(corner);
        }
        (state, corners)
    }

    /// A search that has evaluated nothing yet.
    #[inline(always)]
    fn before_corners(field: &'a F, simplex: &'a Simplex<R, N>) -> Self {
        let [longest_edge] = run(&LongestEdge, *simplex);
        let sample = Sample::new(R::zero(), Vector3::zeros());
        let best = WeightedSample { weights: corner_weights(0), sample };
        Self { field, simplex, longest_edge, near: NearParts::default(), best, evaluations: R::zero() }
    }

    /// Starts from the lowest corner, or from other weights if they are lower.
    #[inline(always)]
    pub fn from_corners_and(field: &'a F, simplex: &'a Simplex<R, N>, start: [R; N]) -> Self {
        let mut state = Self::from_corners(field, simplex);
        state.evaluate(start, !R::Mask::NONE);
        state
    }

    /// Evaluates the field at a corner, the first one first, and learns there which parts of a union can be the minimum.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn evaluate_corner(&mut self, corner: usize) -> WeightedSample<R, N> {
        let weights = corner_weights(corner);
        let point = run(&PointOfWeights, (*self.simplex, weights));
        let candidate = WeightedSample { weights, sample: self.field.narrow(point, self.longest_edge, &mut self.near) };
        match corner {
            0 => self.best = candidate,
            _ => self.keep_lower(candidate, R::one()),
        }
        self.evaluations += R::one();
        candidate
    }

    /// Evaluates the field at the given weights. Lanes that are not `active` neither count nor keep it.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn evaluate(&mut self, weights: [R; N], active: R::Mask) -> WeightedSample<R, N> {
        let point = run(&PointOfWeights, (*self.simplex, weights));
        let candidate = WeightedSample { weights, sample: self.field.evaluate_near(point, &self.near) };
        let active = R::select(active, R::one(), R::zero());
        self.keep_lower(candidate, active);
        self.evaluations += active;
        candidate
    }

    /// Replaces the best where the candidate is lower and `active` is 1.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn keep_lower(&mut self, candidate: WeightedSample<R, N>, active: R) {
        let kept = run(&Lower, (candidate.kernel_sample(), self.best.kernel_sample(), [active]));
        let (best, [is_candidate]) = kept;
        let status = lower_status(candidate.sample.status, self.best.sample.status, is_candidate);
        self.best = WeightedSample::new(best, status);
    }

    /// Makes the result from the best point. Inlined, as each method calls it once.
    #[inline(always)]
    pub fn finish(self, converged: R::Mask) -> Minimum<R, N> {
        let WeightedSample { weights, sample } = self.best;
        let point = run(&PointOfWeights, (*self.simplex, weights));
        let FieldScale { slope_bound, magnitude } = FieldScale::new(self.field);
        let scale = [slope_bound, magnitude, slope_bound];
        let [lower_bound] = run(&LowerBound, (*self.simplex, scale, point, [sample.value]));
        Minimum { weights, point, sample, lower_bound, evaluations: self.evaluations, converged }
    }
}
