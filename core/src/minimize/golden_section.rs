//! Golden-section search on a segment: a bracket of the minimum shrinks by 0.618 with each value.

use super::descent_state::{DescentState, WeightedSample};
use super::{Minimizer, Minimum};
use crate::number::{Mask, Real};
use crate::{EnclosedSdf, Simplex};

/// Golden-section search on a segment (Kiefer 1953, "Sequential minimax search for a maximum"; §4 of the paper). It
/// uses values alone, one evaluation per step.
///
/// With the golden ratio g, the bracket \[a, b\] has probes at p = a + (b − a)/g² and q = a + (b − a)/g. If φ(p) < φ(q)
/// then b ← q, else a ← p; the other probe is then one of the new bracket's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GoldenSection {
    /// Largest number of steps; each shrinks the bracket by 0.618.
    pub iterations: u32,
    /// Converged when the bracket is at most this fraction of the segment.
    pub tolerance: f64,
}

impl Default for GoldenSection {
    fn default() -> Self {
        Self { iterations: 32, tolerance: 1e-6 }
    }
}

/// 1/g of the golden ratio g.
const INV_GOLDEN: f64 = 0.618_033_988_749_894_9;

/// 1/g² = 1 − 1/g.
const INV_GOLDEN_SQ: f64 = 1.0 - INV_GOLDEN;

/// A position on the segment, 0 to 1, and the value there.
#[derive(Clone, Copy)]
struct Probe<R> {
    t: R,
    value: R,
}

impl<R: Real> Probe<R> {
    #[inline]
    fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        Self { t: R::select(mask, yes.t, no.t), value: R::select(mask, yes.value, no.value) }
    }
}

impl Minimizer<2> for GoldenSection {
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, 2>) -> Minimum<R, 2> {
        let mut state = DescentState::from_corners(field, simplex);
        let all = !R::Mask::NONE;
        let mut probe = |t: R, active| {
            let WeightedSample { sample, .. } = state.evaluate([R::one() - t, t], active);
            Probe { t, value: sample.value }
        };
        let (mut a, mut b) = (R::zero(), R::one());
        let (mut p, mut q) = (probe(R::from_f64(INV_GOLDEN_SQ), all), probe(R::from_f64(INV_GOLDEN), all));
        let mut active = all;
        for _ in 0..self.iterations {
            active = active & R::from_f64(self.tolerance).lt(b - a);
            if !active.any() {
                break;
            }
            let is_left = p.value.lt(q.value);
            let (moves_b, moves_a) = (active & is_left, active & !is_left);
            b = R::select(moves_b, q.t, b);
            a = R::select(moves_a, p.t, a);
            let width = b - a;
            let t = a + width * R::select(is_left, R::from_f64(INV_GOLDEN_SQ), R::from_f64(INV_GOLDEN));
            let new = probe(t, active);
            let (old_p, old_q) = (p, q);
            p = Probe::select(moves_b, new, Probe::select(moves_a, old_q, old_p));
            q = Probe::select(moves_a, new, Probe::select(moves_b, old_p, old_q));
        }
        state.finish(!active)
    }
}
