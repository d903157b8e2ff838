use nalgebra::Vector3;

use super::search::{Numbers, Search, Visit, lower};
use super::{Minimizer, Minimum};
use crate::number::kernel::LaneKernel;
use crate::number::kernel::run;
use crate::number::{Mask, Real};
use crate::simplex::{LongestEdge, corner_weights};
use crate::{EnclosedSdf, Simplex};

/// The Frank-Wolfe method (§3.2 of the paper): each step goes towards the corner that the gradient points away from.
///
/// The paper's first step, α = 2/(i + 2) with i from 0, goes the whole way and forgets the start. Here i counts from 1,
/// so α is 2/3, 2/4, 2/5, …
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrankWolfe {
    /// How many steps at most.
    pub iterations: u32,
    /// Done when the duality gap, which on a convex field bounds what is left to gain (Jaggi 2013), is at most this
    /// share of longest edge · slope bound. It is negative by rounding at most, so that −1 stops no search early.
    pub tolerance: f64,
}

impl Default for FrankWolfe {
    fn default() -> Self {
        Self { iterations: 32, tolerance: 1e-6 }
    }
}

impl<const N: usize> Minimizer<N> for FrankWolfe {
    const LOCKSTEP: bool = true;

    /// Of one step: where a corner is the least, that tells.
    fn quick_pass(&self) -> Option<Self> {
        (self.iterations > 1).then_some(Self { iterations: 1, ..*self })
    }

    #[inline(always)]
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        let mut search = Search::from_corners(field, simplex);
        let [longest_edge] = run(&LongestEdge, *simplex);
        let tolerance = longest_edge * R::from_f64(field.slope_bound() * self.tolerance);
        let (mut current, mut active) = (search.best(), R::one());
        for i in 1..=self.iterations {
            let step = Step { rate: 2.0 / (f64::from(i) + 2.0) };
            let (kept, next, point, [goes_on]) =
                run(&step, (*simplex, current.numbers(), search.best.numbers(), [active, tolerance]));
            search.take(kept, current.sample.status);
            active = goes_on;
            if !R::zero().lt(active).any() {
                break;
            }
            search.evaluations += active;
            current = Visit { weights: next, sample: field.evaluate(point) };
        }
        search.keep(current, active);
        search.finish(Real::is_zero(active))
    }
}

/// From the point that was asked last, the best so far, 1 where the search goes on and 0 where it has ended, and the gap at
/// which it ends, to the best of the two, the next weights and their point, and 1 or 0 again.
///
/// One kernel and not four: compilers unroll a short one, and what is unrolled becomes no vectors.
struct Step<const N: usize> {
    rate: f64,
}

impl<const N: usize> LaneKernel for Step<N> {
    type From<R: Real> = (Simplex<R, N>, Numbers<R, N>, Numbers<R, N>, [R; 2]);
    type To<R: Real> = ((Numbers<R, N>, [R; 1]), [R; N], Vector3<R>, [R; 1]);

    #[inline(always)]
    fn apply<R: Real>(&self, (simplex, current, best, [active, tolerance]): Self::From<R>) -> Self::To<R> {
        let kept = lower(current, best, active);
        let (weights, _, gradient) = current;
        let slopes = simplex.slopes(gradient);
        let (mut least, mut target) = (slopes[0], corner_weights::<R, N>(0));
        for corner in 1..N {
            let is_lower = slopes[corner].lt(least);
            for k in 0..N {
                let weight = if k == corner { R::one() } else { R::zero() };
                target[k] = R::select(is_lower, weight, target[k]);
            }
            least = R::select(is_lower, slopes[corner], least);
        }
        let (mut here, mut next) = (R::zero(), weights);
        for k in 0..N {
            here += weights[k] * slopes[k];
            next[k] += (target[k] - weights[k]) * R::from_f64(self.rate);
        }
        let gap = here - least;
        let goes_on = R::select(tolerance.lt(gap), active, R::zero());
        (kept, next, simplex.point(next), [goes_on])
    }
}
