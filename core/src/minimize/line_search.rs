use core::array::from_fn;

use super::search::{Search, Visit};
use super::{Minimizer, Minimum};
use crate::number::{Mask, Real};
use crate::simplex::corner_weights;
use crate::{EnclosedSdf, Simplex};

/// Pairwise Frank-Wolfe with a line search (Lacoste-Julien and Jaggi 2015, "On the Global Linear Convergence of
/// Frank-Wolfe Optimization Variants", alg. 2): weight moves from the corner that costs most to the one that promises
/// most, as far as the value falls.
///
/// How far is told by where the slope along the way changes its sign: tried at the end, then between by regula falsi with
/// the Illinois rule (Dowell and Jarratt 1971). At a crease, where the slope jumps, that closes in on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineSearch {
    /// How many ways are searched at most.
    pub iterations: u32,
    /// How many times the field is asked on one way at most, its end included.
    pub probes: u32,
    /// Done when the duality gap is at most this share of longest edge · slope bound, as [`FrankWolfe`](super::FrankWolfe).
    pub tolerance: f64,
}

impl Default for LineSearch {
    fn default() -> Self {
        Self { iterations: 8, probes: 4, tolerance: 1e-6 }
    }
}

impl<const N: usize> Minimizer<N> for LineSearch {
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        let mut search = Search::from_corners(field, simplex);
        let tolerance = simplex.longest_edge() * R::from_f64(field.slope_bound() * self.tolerance);
        let mut current = search.best();
        let mut active = !R::Mask::NONE;
        for _ in 0..self.iterations {
            let slopes = simplex.slopes(current.sample.gradient);
            let way = Way::steepest(current.weights, slopes);
            active = active & tolerance.lt(way.duality_gap);
            if !active.any() {
                break;
            }
            let slope_at = |visit: &Visit<R, N>| way.slope(simplex.slopes(visit.sample.gradient));
            // Shares of the way, and the slopes there: falling at `from`, rising at `to` once that is known.
            let (mut from, mut to) = ((R::zero(), slope_at(&current)), (R::one(), R::zero()));
            let mut lowest = current;
            let mut searching = active;
            let mut share = R::one();
            for probe in 0..self.probes {
                if !searching.any() {
                    break;
                }
                let visit = search.visit(way.weights(share), searching);
                let lower = searching & visit.sample.value.lt(lowest.sample.value);
                lowest = Visit::select(lower, visit, lowest);
                let slope = slope_at(&visit);
                let falls = slope.lt(R::zero());
                if probe == 0 {
                    to.1 = slope;
                    // Falling to the end: there is nothing to search.
                    searching = searching & !falls;
                } else {
                    let (moves_from, moves_to) = (searching & falls, searching & !falls);
                    // The end that stays counts half, so that both move in time.
                    let half = R::from_f64(0.5);
                    to = (
                        R::select(moves_to, share, to.0),
                        R::select(moves_to, slope, R::select(moves_from, to.1 * half, to.1)),
                    );
                    from = (
                        R::select(moves_from, share, from.0),
                        R::select(moves_from, slope, R::select(moves_to, from.1 * half, from.1)),
                    );
                }
                let rise = to.1 - from.1;
                let is_flat = !R::zero().lt(rise);
                let zero_at = from.0 - from.1 * (to.0 - from.0) / R::select(is_flat, R::one(), rise);
                share = R::select(is_flat, (from.0 + to.0) * R::from_f64(0.5), zero_at.clamp(from.0, to.0));
            }
            let moved = lowest.sample.value.lt(current.sample.value);
            current = Visit::select(active, lowest, current);
            // Nowhere on the way lower: another way will not be found, for the slopes are the same.
            active = active & moved;
        }
        let slopes = simplex.slopes(current.sample.gradient);
        let converged = Way::steepest(current.weights, slopes).duality_gap.le(tolerance);
        search.finish(converged)
    }
}

/// A straight way through the weights.
struct Way<R, const N: usize> {
    start: [R; N],
    /// From start to end.
    change: [R; N],
    /// What the linear function of these slopes could still fall by in the simplex.
    duality_gap: R,
}

impl<R: Real, const N: usize> Way<R, N> {
    /// From the dearest corner that has weight to the cheapest.
    fn steepest(weights: [R; N], slopes: [R; N]) -> Self {
        let (mut cheapest, mut dearest, mut moved) = (slopes[0], R::from_f64(-R::MAX_COORDINATE), R::zero());
        let (mut to, mut from) = ([R::zero(); N], [R::zero(); N]);
        to[0] = R::one();
        for corner in 0..N {
            let here: [R; N] = corner_weights(corner);
            let cheaper = slopes[corner].lt(cheapest);
            cheapest = R::select(cheaper, slopes[corner], cheapest);
            to = from_fn(|k| R::select(cheaper, here[k], to[k]));
            let dearer = R::zero().lt(weights[corner]) & dearest.lt(slopes[corner]);
            dearest = R::select(dearer, slopes[corner], dearest);
            moved = R::select(dearer, weights[corner], moved);
            from = from_fn(|k| R::select(dearer, here[k], from[k]));
        }
        let here = (0..N).fold(R::zero(), |sum, k| sum + weights[k] * slopes[k]);
        Self { start: weights, change: from_fn(|k| (to[k] - from[k]) * moved), duality_gap: here - cheapest }
    }

    fn weights(&self, share: R) -> [R; N] {
        from_fn(|k| (self.start[k] + self.change[k] * share).max(R::zero()))
    }

    /// How fast the value changes over the whole way.
    fn slope(&self, slopes: [R; N]) -> R {
        (0..N).fold(R::zero(), |sum, k| sum + slopes[k] * self.change[k])
    }
}
