//! Which point of a simplex is reached by steps against the gradient? Projected gradient descent on barycentric weights, each step as long
//! as the two gradients before it say. One kernel per step, so that it runs in lanes.

use nalgebra::Vector3;

use super::descent_state::{DescentState, KernelSample, WeightedSample, lower, lower_status};
use super::{Minimizer, Minimum};
use crate::number::kernel::{LaneKernel, run, run_into};
use crate::number::{Mask, Real};
use crate::simplex::{corner_weights, project_weights};
use crate::vector::select;
use crate::{EnclosedSdf, Simplex};

/// Projected gradient descent on the barycentric weights (Goldstein 1964, "Convex programming in Hilbert space"; §3.1
/// of the paper): w ← ℙ(w − α ∂φ/∂w), with ℙ the projection to barycentric weights
/// ([`project_weights`](crate::project_weights)).
///
/// The paper's α is a constant, on which the answers depend. Here
/// - α = s·s / s·y, with s the step before and y the change of ∂φ/∂w along it (Barzilai and Borwein 1988, "Two-point step size
///   gradient methods"; projected: Birgin, Martínez and Raydan 2000, "Nonmonotone spectral projected gradient methods on convex
///   sets").
/// - A step that ends no lower is taken back. The next one starts where the tangents at its two ends meet, at the crease of φ
///   between them, if there is one, and goes along it: against the gradient between theirs that has no slope along the step.
/// - The first step goes from the lowest corner to the one to which its tangent falls most. It ends no lower, and costs nothing.
///
/// It is the fastest local method: a third of the evaluations of [`FrankWolfe`](super::FrankWolfe), and smaller errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectedGradient {
    /// Largest number of steps, of one evaluation each.
    pub iterations: u32,
    /// Converged when the next step falls by at most this fraction of longest edge · slope bound, by the tangents before it. Nothing
    /// is proven by that.
    pub tolerance: f64,
}

impl Default for ProjectedGradient {
    fn default() -> Self {
        Self { iterations: 32, tolerance: 1e-6 }
    }
}

/// Largest α, as a multiple of the one with which no weight changes by more than 1.
const MAX_RATE: f64 = 64.0;

/// Largest growth of α in a step.
const MAX_GROWTH: f64 = 4.0;

/// Smallest part that is left of a step that is taken back; 1 minus this is the largest.
const MIN_FRACTION: f64 = 0.1;

impl<const N: usize> Minimizer<N> for ProjectedGradient {
    const LOCKSTEP: bool = true;

    /// A single step, which settles simplices whose minimum is a corner.
    fn quick_pass(&self) -> Option<Self> {
        (self.iterations > 1).then_some(Self { iterations: 1, ..*self })
    }

    #[inline(always)]
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        let (state, corners) = DescentState::at_corners(field, simplex);
        self.descend(field, simplex, state, &corners)
    }

    #[inline(always)]
    fn minimize_from<R: Real, F: EnclosedSdf>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
        _level: R,
        start: [R; N],
    ) -> Minimum<R, N> {
        let (mut state, corners) = DescentState::at_corners(field, simplex);
        state.evaluate(start, !R::Mask::NONE);
        self.descend(field, simplex, state, &corners)
    }
}

impl ProjectedGradient {
    #[inline(always)]
    fn descend<R: Real, F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
        mut state: DescentState<R, F, N>,
        corners: &[WeightedSample<R, N>; N],
    ) -> Minimum<R, N> {
        let max_slope = state.longest_edge * field.slope_bound_as::<R>();
        let tolerance = max_slope * R::from_f64(self.tolerance);
        let is_flat = max_slope.is_zero();
        let unit = R::select(is_flat, R::zero(), R::one() / R::select(is_flat, R::one(), max_slope));
        let max_rate = unit * R::from_f64(MAX_RATE);

        let (best, mut status) = (state.best.kernel_sample(), state.best.sample.status);
        let (values, gradients) = (corners.map(|c| c.sample.value), corners.map(|c| c.sample.gradient));
        let mut trial = run(&SteepestCorner, (*simplex, best.2, values, gradients));
        let mut trial_status = status;
        let mut after = ((best, [R::zero()]), best.0, Vector3::zeros(), [unit, R::one()]);
        for _ in 0..self.iterations {
            let ((best, _), _, _, [rate, active]) = after;
            run_into(&Step, (*simplex, best, trial, [rate, active, tolerance, max_rate]), &mut after);
            let ((_, [is_trial]), weights, point, [_, active]) = after;
            status = lower_status(trial_status, status, is_trial);
            if !R::zero().lt(active).any() {
                break;
            }
            state.evaluations += active;
            let sample = field.evaluate_near(point, &state.near);
            trial = (weights, [sample.value], sample.gradient);
            trial_status = sample.status;
        }
        let ((best, _), _, _, [_, active]) = after;
        state.best = WeightedSample::new(best, status);
        state.keep_lower(WeightedSample::new(trial, trial_status), active);
        state.finish(Real::is_zero(active))
    }
}

/// The corner to which a tangent falls most, with its sample: from the tangent's gradient, and the values and gradients of all corners.
struct SteepestCorner<const N: usize>;

impl<const N: usize> LaneKernel for SteepestCorner<N> {
    type From<R: Real> = (Simplex<R, N>, Vector3<R>, [R; N], [Vector3<R>; N]);
    type To<R: Real> = KernelSample<R, N>;

    #[inline(always)]
    fn apply<R: Real>(&self, (simplex, gradient, values, gradients): Self::From<R>) -> Self::To<R> {
        let slopes = simplex.slopes(gradient);
        let mut steepest = (corner_weights::<R, N>(0), [values[0]], gradients[0]);
        let mut min_slope = slopes[0];
        for corner in 1..N {
            // A corner whose value is NaN is no trial.
            let is_lower = slopes[corner].lt(min_slope) & values[corner].le(values[corner]);
            for k in 0..N {
                let weight = if k == corner { R::one() } else { R::zero() };
                steepest.0[k] = R::select(is_lower, weight, steepest.0[k]);
            }
            steepest.1[0] = R::select(is_lower, values[corner], steepest.1[0]);
            steepest.2 = select(is_lower, gradients[corner], steepest.2);
            min_slope = R::select(is_lower, slopes[corner], min_slope);
        }
        steepest
    }
}

/// One step. It takes the best sample, that of the trial, and α, `active` (1 where the search goes on, else 0), the tolerance and
/// the largest α. It returns the lower of both samples, the next trial's weights, their point, α and `active`.
struct Step<const N: usize>;

impl<const N: usize> LaneKernel for Step<N> {
    type From<R: Real> = (Simplex<R, N>, KernelSample<R, N>, KernelSample<R, N>, [R; 4]);
    type To<R: Real> = ((KernelSample<R, N>, [R; 1]), [R; N], Vector3<R>, [R; 2]);

    #[inline(always)]
    fn apply<R: Real>(
        &self,
        (simplex, best, trial, [rate, active, tolerance, max_rate]): Self::From<R>,
    ) -> Self::To<R> {
        let kept = lower(trial, best, active);
        let is_kept = R::zero().lt(kept.1[0]);
        let (slopes, trial_slopes) = (simplex.slopes(best.2), simplex.slopes(trial.2));
        let (mut step, mut square, mut slope, mut trial_slope) = (best.0, R::zero(), R::zero(), R::zero());
        for k in 0..N {
            step[k] = trial.0[k] - best.0[k];
            square += step[k] * step[k];
            slope += step[k] * slopes[k];
            trial_slope += step[k] * trial_slopes[k];
        }

        let curvature = trial_slope - slope;
        let is_curved = square.lt(curvature * max_rate);
        let inverse = R::one() / R::select(is_curved, curvature, R::one());
        let max_rate = R::select(is_kept, max_rate.min(rate * R::from_f64(MAX_GROWTH)), rate * R::from_f64(0.5));
        let is_known = is_curved & (square * inverse).lt(max_rate);
        let rate = R::select(is_known, square * inverse, max_rate);

        // How much of the step is kept, and how much of the gradient's change: of a step that is taken back, up to the crease, and
        // so much that the step has no slope left.
        let half = R::from_f64(0.5);
        let crease = R::select(is_curved, (trial_slope - (trial.1[0] - best.1[0])) * inverse, half);
        // In this order, in which NaN, which an infinite slope gives, is no fraction.
        let crease = R::from_f64(MIN_FRACTION).max(crease).min(R::from_f64(1.0 - MIN_FRACTION));
        let level = R::zero().max(R::select(is_curved, R::zero() - slope * inverse, half)).min(R::one());
        let (of_step, of_slopes) = (R::select(is_kept, R::one(), crease), R::select(is_kept, R::one(), level));

        let (mut from, mut from_slopes) = (best.0, slopes);
        for k in 0..N {
            from[k] += step[k] * of_step;
            from_slopes[k] += (trial_slopes[k] - slopes[k]) * of_slopes;
        }
        let mut next = from;
        for k in 0..N {
            next[k] -= from_slopes[k] * rate;
        }
        let next = project_weights(next);

        let (mut to_next, mut mean_slope, mut min_slope) = (R::zero(), R::zero(), from_slopes[0]);
        for k in 0..N {
            to_next += (from[k] - next[k]) * from_slopes[k];
            mean_slope += from[k] * from_slopes[k];
            min_slope = min_slope.min(from_slopes[k]);
        }
        // While α grows, the next step is no measure: the simplex is.
        let of_kept = R::select(is_known, to_next, mean_slope - min_slope);
        let fall = R::select(is_kept, of_kept, to_next - slope * crease);
        let goes_on = R::select(tolerance.lt(fall), active, R::zero());
        (kept, next, simplex.point(next), [rate, goes_on])
    }
}
