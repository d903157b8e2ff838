//! The Frank-Wolfe method with a fixed rule for the step size, one kernel per step, so that it runs in lanes.

use nalgebra::Vector3;

use super::descent_state::{DescentState, KernelSample, WeightedSample, lower, lower_status};
use super::{Minimizer, Minimum};
use crate::number::kernel::{LaneKernel, run_into};
use crate::number::{Mask, Parameter, Real};
use crate::simplex::corner_weights;
use crate::{EnclosedSdf, Simplex};

/// The Frank-Wolfe method (Frank and Wolfe 1956, "An algorithm for quadratic programming"; §3.2 of the paper): each
/// step moves towards the corner s with the lowest slope, x ← x + α (s − x), s = argmin_k ∇φ(x)·x_k, α = 2/(i + 2).
///
/// i counts from 1, so α is 2/3, 2/4, 2/5, …. In the paper i counts from 0: then α = 1, and the start is forgotten.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrankWolfe {
    /// Largest number of steps.
    pub iterations: u32,
    /// Converged when the duality gap ∇φ(x)·(x − s) is at most this fraction of longest edge · slope bound. On a convex
    /// field φ(x) − min φ is at most that gap (Jaggi 2013, "Revisiting Frank-Wolfe", §2). The gap is negative by
    /// rounding at most, so −1 never stops early.
    pub tolerance: f64,
}

impl Default for FrankWolfe {
    fn default() -> Self {
        Self { iterations: 32, tolerance: 1e-6 }
    }
}

impl<const N: usize> Minimizer<N> for FrankWolfe {
    const LOCKSTEP: bool = true;

    /// A single step, which settles simplices whose minimum is a corner.
    fn quick_pass(&self) -> Option<Self> {
        (self.iterations > 1).then_some(Self { iterations: 1, ..*self })
    }

    #[inline(always)]
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        self.descend(field, simplex, DescentState::from_corners(field, simplex))
    }

    #[inline(always)]
    fn minimize_from<R: Real, F: EnclosedSdf>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
        _level: R,
        start: [R; N],
    ) -> Minimum<R, N> {
        self.descend(field, simplex, DescentState::from_corners_and(field, simplex, start))
    }
}

impl FrankWolfe {
    #[inline(always)]
    fn descend<R: Real, F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
        mut state: DescentState<R, F, N>,
    ) -> Minimum<R, N> {
        let tolerance = state.longest_edge * (field.slope_bound_as::<R>() * R::from_f64(self.tolerance));
        let (best, mut current, mut status) = (state.best.kernel_sample(), state.best.sample, state.best.sample.status);
        let mut after = ((best, [R::zero()]), best.0, Vector3::zeros(), [R::one()]);
        let mut rate = rate(0);
        for taken in 0..self.iterations {
            let ((best, _), weights, _, [active]) = after;
            let before = (*simplex, (weights, [current.value], current.gradient), best, [active, tolerance]);
            run_into(&Step { rate }, before, &mut after);
            let ((_, [is_current]), _, point, [active]) = &mut after;
            status = lower_status(current.status, status, *is_current);
            if !R::zero().lt(*active).any() {
                break;
            }
            if R::LANES == 1 {
                // As it is, but compilers do not see it, and keep it in a register.
                *active = R::one();
            }
            state.evaluations += *active;
            // Before the evaluation, which takes as long as a card needs to read it.
            rate = next_rate(taken + 1);
            current = field.evaluate_near(*point, &state.near);
        }
        let ((best, _), weights, _, [active]) = after;
        state.best = WeightedSample::new(best, status);
        state.keep_lower(WeightedSample { weights, sample: current }, active);
        state.finish(Real::is_zero(active))
    }
}

/// α = 2/(i + 2), i = taken + 1, in steps of which so many were taken before.
///
/// Inlined, so that a search in f32 divides no doubles.
#[inline(always)]
const fn rate(taken: u32) -> Parameter {
    // Exact for fewer than 2²⁴ steps; and the quotient in f32 is that of f64 rounded.
    let divisor = taken as f32 + 3.0;
    Parameter { double: 2.0 / divisor as f64, single: 2.0 / divisor }
}

/// [`rate`] from a table, as far as it goes.
#[inline(always)]
fn next_rate(taken: u32) -> Parameter {
    RATES.get(taken as usize).copied().unwrap_or_else(|| rate(taken))
}

/// The first of these: a search divides only after as many steps as it takes by default.
const RATES: [Parameter; 32] = {
    let mut rates = [Parameter { double: 0.0, single: 0.0 }; 32];
    let mut taken = 0;
    while taken < 32 {
        rates[taken as usize] = rate(taken);
        taken += 1;
    }
    rates
};

/// One step. It takes the current sample, the best one, `active` (1 where the search goes on, else 0) and the
/// tolerance. It returns the lower of both samples, the next weights, their point, and `active`.
///
/// One kernel and not four: short loops over the lanes are unrolled, and what is unrolled is not vectorized.
struct Step<const N: usize> {
    rate: Parameter,
}

impl<const N: usize> LaneKernel for Step<N> {
    type From<R: Real> = (Simplex<R, N>, KernelSample<R, N>, KernelSample<R, N>, [R; 2]);
    type To<R: Real> = ((KernelSample<R, N>, [R; 1]), [R; N], Vector3<R>, [R; 1]);

    #[inline(always)]
    fn apply<R: Real>(&self, (simplex, current, best, [active, tolerance]): Self::From<R>) -> Self::To<R> {
        let kept = lower(current, best, active);
        let (weights, _, gradient) = current;
        let slopes = simplex.slopes(gradient);
        let (mut min_slope, mut target) = (slopes[0], corner_weights::<R, N>(0));
        for corner in 1..N {
            let is_lower = slopes[corner].lt(min_slope);
            for k in 0..N {
                let weight = if k == corner { R::one() } else { R::zero() };
                target[k] = R::select(is_lower, weight, target[k]);
            }
            min_slope = R::select(is_lower, slopes[corner], min_slope);
        }
        let (mut mean_slope, mut next) = (R::zero(), weights);
        for k in 0..N {
            // The first is zero.
            if k > 0 {
                mean_slope += weights[k] * slopes[k];
            }
            next[k] += (target[k] - weights[k]) * R::from_parameter(self.rate);
        }
        let duality_gap = mean_slope - min_slope;
        let goes_on = R::select(tolerance.lt(duality_gap), active, R::zero());
        (kept, next, simplex.point(next), [goes_on])
    }
}
