use core::array::from_fn;

use super::search::Search;
use super::{Minimizer, Minimum};
use crate::number::{Mask, Real};
use crate::simplex::project_weights;
use crate::{EnclosedSdf, Simplex};

/// Projected gradient descent on the barycentric weights with a fixed step (§3.1 of the paper).
///
/// The paper's α has a unit, one over length, and with a bare number the method would depend on the scale. Here it is
/// `step / (longest edge · slope bound)`: no weight changes by more than `step` at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectedGradient {
    /// How many steps at most.
    pub iterations: u32,
    /// The most that a weight changes in a step. Of 0.03, 0.06, … 2 a half left the smallest errors after 32 steps on
    /// random triangles against a box and a horseshoe: larger ones jump over the minimum, smaller ones do not reach it.
    pub step: f64,
    /// Done when no weight changes by more than this.
    pub tolerance: f64,
}

impl Default for ProjectedGradient {
    fn default() -> Self {
        Self { iterations: 32, step: 0.5, tolerance: 1e-6 }
    }
}

impl<const N: usize> Minimizer<N> for ProjectedGradient {
    const LOCKSTEP: bool = true;

    /// Of one step: where a corner is the least, that tells.
    fn quick_pass(&self) -> Option<Self> {
        (self.iterations > 1).then_some(Self { iterations: 1, ..*self })
    }

    #[inline(always)]
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        let mut search = Search::from_corners(field, simplex);
        let steepest = simplex.longest_edge() * R::from_f64(field.slope_bound());
        let is_flat = steepest.is_zero();
        let rate = R::select(is_flat, R::zero(), R::from_f64(self.step) / R::select(is_flat, R::one(), steepest));

        let mut current = search.best();
        let mut active = !R::Mask::NONE;
        for _ in 0..self.iterations {
            let slopes = simplex.slopes(current.sample.gradient);
            let next = project_weights(from_fn(|i| current.weights[i] - slopes[i] * rate));
            let change = (0..N).fold(R::zero(), |most, i| most.max((next[i] - current.weights[i]).abs()));
            active = active & R::from_f64(self.tolerance).lt(change);
            if !active.any() {
                break;
            }
            current = search.visit(next, active);
        }
        search.finish(!active)
    }
}
