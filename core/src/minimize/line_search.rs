//! Pairwise Frank-Wolfe with an exact line search: weight moves from the worst corner to the best one.

use core::array::from_fn;

use super::descent_state::{DescentState, WeightedSample};
use super::{Minimizer, Minimum};
use crate::number::{Mask, Real};
use crate::simplex::corner_weights;
use crate::{EnclosedSdf, Simplex};

/// Pairwise Frank-Wolfe with a line search (Lacoste-Julien and Jaggi 2015, "On the Global Linear Convergence of
/// Frank-Wolfe Optimization Variants", alg. 2): with the slopes s_k = ∂φ/∂w_k, w ← w + t w_a (e_b − e_a), a = argmax
/// {s_k : w_k > 0}, b = argmin s_k, 0 ≤ t ≤ 1.
///
/// t is where the slope along the line changes sign: 1 if φ descends to the end, else by regula falsi with the Illinois
/// rule (Dowell and Jarratt 1971, "A modified regula falsi method"). At a crease, where the slope jumps, that closes in
/// on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineSearch {
    /// Largest number of lines.
    pub iterations: u32,
    /// Largest number of evaluations on one line, its end included.
    pub probes: u32,
    /// Converged when the duality gap is at most this fraction of longest edge · slope bound, as in
    /// [`FrankWolfe`](super::FrankWolfe).
    pub tolerance: f64,
}

impl Default for LineSearch {
    fn default() -> Self {
        Self { iterations: 8, probes: 4, tolerance: 1e-6 }
    }
}

impl<const N: usize> Minimizer<N> for LineSearch {
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        let mut state = DescentState::from_corners(field, simplex);
        let tolerance = simplex.longest_edge() * (field.slope_bound_as::<R>() * R::from_f64(self.tolerance));
        let mut current = state.best;
        let mut active = !R::Mask::NONE;
        for _ in 0..self.iterations {
            let slopes = simplex.slopes(current.sample.gradient);
            let line = PairwiseLine::new(current.weights, slopes);
            active = active & tolerance.lt(line.duality_gap);
            if !active.any() {
                break;
            }
            let slope_of = |at: &WeightedSample<R, N>| line.slope(simplex.slopes(at.sample.gradient));
            // A bracket of t with the slopes at its ends: descending at `from`, ascending at `to` once that is known.
            let (mut from, mut to) = ((R::zero(), slope_of(&current)), (R::one(), R::zero()));
            let mut lowest = current;
            let mut searching = active;
            let mut t = R::one();
            for probe in 0..self.probes {
                if !searching.any() {
                    break;
                }
                let candidate = state.evaluate(line.weights(t), searching);
                let is_lower = searching & candidate.sample.value.lt(lowest.sample.value);
                lowest = WeightedSample::select(is_lower, candidate, lowest);
                let slope = slope_of(&candidate);
                let descends = slope.lt(R::zero());
                if probe == 0 {
                    to.1 = slope;
                    // Descending to the end: nothing to search.
                    searching = searching & !descends;
                } else {
                    let (moves_from, moves_to) = (searching & descends, searching & !descends);
                    // The Illinois rule: the slope at the end that stays is halved, so that both ends move in time.
                    let half = R::from_f64(0.5);
                    to = (
                        R::select(moves_to, t, to.0),
                        R::select(moves_to, slope, R::select(moves_from, to.1 * half, to.1)),
                    );
                    from = (
                        R::select(moves_from, t, from.0),
                        R::select(moves_from, slope, R::select(moves_to, from.1 * half, from.1)),
                    );
                }
                let rise = to.1 - from.1;
                let is_flat = !R::zero().lt(rise);
                let zero = from.0 - from.1 * (to.0 - from.0) / R::select(is_flat, R::one(), rise);
                t = R::select(is_flat, (from.0 + to.0) * R::from_f64(0.5), zero.clamp(from.0, to.0));
            }
            let is_lower = lowest.sample.value.lt(current.sample.value);
            current = WeightedSample::select(active, lowest, current);
            // Without progress the slopes stay, and so would the next line.
            active = active & is_lower;
        }
        let slopes = simplex.slopes(current.sample.gradient);
        let converged = PairwiseLine::new(current.weights, slopes).duality_gap.le(tolerance);
        state.finish(converged)
    }
}

/// The weights w + t w_a (e_b − e_a), 0 ≤ t ≤ 1.
struct PairwiseLine<R, const N: usize> {
    start: [R; N],
    /// From t = 0 to t = 1.
    change: [R; N],
    /// Largest decrease in the simplex of the linear function with these slopes.
    duality_gap: R,
}

impl<R: Real, const N: usize> PairwiseLine<R, N> {
    fn new(weights: [R; N], slopes: [R; N]) -> Self {
        let (mut min_slope, mut max_slope, mut moved) = (slopes[0], R::from_f64(-R::MAX_COORDINATE), R::zero());
        let (mut to, mut from) = ([R::zero(); N], [R::zero(); N]);
        to[0] = R::one();
        for corner in 0..N {
            let here: [R; N] = corner_weights(corner);
            let is_lower = slopes[corner].lt(min_slope);
            min_slope = R::select(is_lower, slopes[corner], min_slope);
            to = from_fn(|k| R::select(is_lower, here[k], to[k]));
            let is_higher = R::zero().lt(weights[corner]) & max_slope.lt(slopes[corner]);
            max_slope = R::select(is_higher, slopes[corner], max_slope);
            moved = R::select(is_higher, weights[corner], moved);
            from = from_fn(|k| R::select(is_higher, here[k], from[k]));
        }
        let mean_slope = (0..N).fold(R::zero(), |sum, k| sum + weights[k] * slopes[k]);
        Self { start: weights, change: from_fn(|k| (to[k] - from[k]) * moved), duality_gap: mean_slope - min_slope }
    }

    fn weights(&self, t: R) -> [R; N] {
        from_fn(|k| (self.start[k] + self.change[k] * t).max(R::zero()))
    }

    /// dφ/dt from the slopes at a point.
    fn slope(&self, slopes: [R; N]) -> R {
        (0..N).fold(R::zero(), |sum, k| sum + slopes[k] * self.change[k])
    }
}
