use super::search::Search;
use super::{Minimizer, Minimum};
use crate::number::{Mask, Real};
use crate::{EnclosedSdf, Simplex};

/// Golden-section search on a segment (§4 of the paper; Kiefer 1953). It asks for values alone, one a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GoldenSection {
    /// How many times the bracket shrinks at most, by 0.618 each.
    pub iterations: u32,
    /// Done when the bracket is at most this share of the segment.
    pub tolerance: f64,
}

impl Default for GoldenSection {
    fn default() -> Self {
        Self { iterations: 32, tolerance: 1e-6 }
    }
}

/// 1/φ and 1/φ² of the golden ratio: they sum to one.
const LONG: f64 = 0.618_033_988_749_894_9;
const SHORT: f64 = 1.0 - LONG;

/// A share of the way along the segment and the value there.
#[derive(Clone, Copy)]
struct Probe<R> {
    share: R,
    value: R,
}

impl<R: Real> Probe<R> {
    #[inline]
    fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        Self { share: R::select(mask, yes.share, no.share), value: R::select(mask, yes.value, no.value) }
    }
}

impl Minimizer<2> for GoldenSection {
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, 2>) -> Minimum<R, 2> {
        let mut search = Search::from_corners(field, simplex);
        let all = !R::Mask::NONE;
        let mut ask = |share: R, active| {
            let visit = search.visit([R::one() - share, share], active);
            Probe { share, value: visit.sample.value }
        };
        let (mut from, mut to) = (R::zero(), R::one());
        let (mut low, mut high) = (ask(R::from_f64(SHORT), all), ask(R::from_f64(LONG), all));
        let mut active = all;
        for _ in 0..self.iterations {
            active = active & R::from_f64(self.tolerance).lt(to - from);
            if !active.any() {
                break;
            }
            let go_low = low.value.lt(high.value);
            let (shrink_to, shrink_from) = (active & go_low, active & !go_low);
            to = R::select(shrink_to, high.share, to);
            from = R::select(shrink_from, low.share, from);
            let width = to - from;
            let share = from + width * R::select(go_low, R::from_f64(SHORT), R::from_f64(LONG));
            let probe = ask(share, active);
            let (old_low, old_high) = (low, high);
            low = Probe::select(shrink_to, probe, Probe::select(shrink_from, old_high, old_low));
            high = Probe::select(shrink_from, probe, Probe::select(shrink_to, old_low, old_high));
        }
        search.finish(!active)
    }
}
