use core::array::from_fn;

use super::search::{Search, Visit};
use super::{Minimizer, Minimum};
use crate::real::{Mask, Real};
use crate::simplex::corner_weights;
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
    /// share of longest edge · slope bound.
    pub tolerance: f64,
}

impl Default for FrankWolfe {
    fn default() -> Self {
        Self { iterations: 32, tolerance: 1e-6 }
    }
}

impl<const N: usize> Minimizer<N> for FrankWolfe {
    fn minimize<R: Real, F: Sdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        let mut search = Search::from_corners(field, simplex);
        let tolerance = simplex.longest_edge() * R::lift(field.slope_bound() * self.tolerance);
        let mut current = search.best();
        let mut active = !R::Mask::NONE;
        for i in 1..=self.iterations {
            let slopes = simplex.slopes(current.sample.gradient);
            let (mut least, mut target) = (slopes[0], corner_weights::<R, N>(0));
            for corner in 1..N {
                let lower = slopes[corner].lt(least);
                let weights = corner_weights::<R, N>(corner);
                target = from_fn(|k| R::select(lower, weights[k], target[k]));
                least = R::select(lower, slopes[corner], least);
            }
            let here = (0..N).fold(R::zero(), |sum, k| sum + current.weights[k] * slopes[k]);
            active = active & tolerance.lt(here - least);
            if !active.any() {
                break;
            }
            let rate = R::lift(2.0 / (f64::from(i) + 2.0));
            let next = from_fn(|k| current.weights[k] + (target[k] - current.weights[k]) * rate);
            current = Visit::select(active, search.visit(next, active), current);
        }
        search.finish(!active)
    }
}
