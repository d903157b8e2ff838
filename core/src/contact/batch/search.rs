use super::queue::{Queue, Waiting};
use super::{Margins, Survivor, simplices_in_lanes};
use crate::contact::classify::classify;
use crate::contact::{Element, Outcome};
use crate::minimize::{Minimizer, Minimum};
use crate::number::Float;
use crate::{EnclosedSdf, Lanes};

pub(super) struct Search<'a, R: Float, F, K, const N: usize> {
    pub field: &'a F,
    pub margin: K,
    pub elements: &'a [Element<R, N>],
}

impl<R: Float, F: EnclosedSdf, K: Margins<R>, const N: usize> Search<'_, R, F, K, N> {
    /// Minimizes on all elements of the queue, side by side where the method runs in lockstep.
    #[inline(always)]
    pub fn minimize<M: Minimizer<N>, const L: usize>(
        &self,
        minimizer: &M,
        waiting: &mut Queue<Waiting<R>, L>,
        mut visit: impl FnMut(&Waiting<R>, &Minimum<R, N>),
    ) {
        let (items, count) = waiting.drain();
        if count == 0 {
            return;
        }
        if M::LOCKSTEP {
            let simplices = simplices_in_lanes(self.elements, items.map(|(_, survivor)| survivor.index));
            let minimum = minimizer.minimize_below(
                self.field,
                &simplices,
                Lanes(items.map(|(_, survivor)| self.margin.margin(survivor.index))),
            );
            for (lane, item) in items.iter().enumerate().take(count) {
                visit(item, &minimum.lane(lane));
            }
        } else {
            for item in items.iter().take(count) {
                let Some(element) = self.elements.get(item.1.index) else { continue };
                visit(item, &minimizer.minimize_below(self.field, &element.simplex, self.margin.margin(item.1.index)));
            }
        }
    }

    #[inline(always)]
    pub fn emit(
        &self,
        index: usize,
        survivor: &Survivor<R>,
        minimum: &Minimum<R, N>,
        visit: &mut impl FnMut(usize, Outcome<R, N>),
    ) {
        if let Some(element) = self.elements.get(survivor.index) {
            visit(
                index,
                classify(self.field, self.margin.margin(survivor.index), element, minimum, survivor.lower_bound),
            );
        }
    }
}
