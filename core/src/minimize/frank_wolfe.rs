use nalgebra::Vector3;

use super::search::{Search, Visit};
use super::{Minimizer, Minimum};
use crate::kernel::Kernel;
use crate::real::{Mask, Real};
use crate::simplex::{LongestEdge, corner_weights};
use crate::{Sdf, Simplex};

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
    const PAYS_IN_LANES: bool = true;

    #[inline(always)]
    fn minimize<R: Real, F: Sdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        let mut search = Search::from_corners(field, simplex);
        let [longest_edge] = R::apply(&LongestEdge, *simplex);
        let tolerance = longest_edge * R::lift(field.slope_bound() * self.tolerance);
        let mut current = search.best();
        let mut active = !R::Mask::NONE;
        for i in 1..=self.iterations {
            let rate = 2.0 / (f64::from(i) + 2.0);
            let (next, [gap]) = R::apply(&Step { rate }, (*simplex, current.sample.gradient, current.weights));
            active = active & tolerance.lt(gap);
            if !active.any() {
                break;
            }
            let visit = search.visit(next, active);
            current = Visit::select(active, visit, current);
        }
        search.finish(!active)
    }
}

/// From weights and the gradient there to the next weights, and the duality gap.
struct Step<const N: usize> {
    rate: f64,
}

impl<const N: usize> Kernel for Step<N> {
    type From<R: Real> = (Simplex<R, N>, Vector3<R>, [R; N]);
    type To<R: Real> = ([R; N], [R; 1]);

    #[inline(always)]
    fn apply<R: Real>(&self, (simplex, gradient, current): Self::From<R>) -> Self::To<R> {
        let slopes = simplex.slopes(gradient);
        let (mut least, mut target) = (slopes[0], corner_weights::<R, N>(0));
        for corner in 1..N {
            let lower = slopes[corner].lt(least);
            for k in 0..N {
                let weight = if k == corner { R::one() } else { R::zero() };
                target[k] = R::select(lower, weight, target[k]);
            }
            least = R::select(lower, slopes[corner], least);
        }
        let (mut here, mut next) = (R::zero(), current);
        for k in 0..N {
            here += current[k] * slopes[k];
            next[k] += (target[k] - current[k]) * R::lift(self.rate);
        }
        (next, [here - least])
    }
}
