//! A queue of as many elements as there are lanes: full lanes are worked off, the last of a batch may be part full.

use core::array::from_fn;

use super::Survivor;
use crate::number::Float;

/// Items that wait until they fill all lanes.
pub(super) struct Queue<T, const L: usize> {
    items: [T; L],
    pub count: usize,
}

impl<T: Copy, const L: usize> Queue<T, L> {
    /// An empty queue. `filler` stands in the places that are not taken.
    pub fn new(filler: T) -> Self {
        Self { items: [filler; L], count: 0 }
    }

    /// Appends an item, and returns whether the queue is full now.
    #[inline(always)]
    pub fn push(&mut self, item: T) -> bool {
        if let Some(slot) = self.items.get_mut(self.count) {
            *slot = item;
            self.count = self.count.saturating_add(1);
        }
        self.count == L
    }

    /// Moves items from the end of another queue until this one is full or the other is empty.
    #[inline(always)]
    pub fn fill_from(&mut self, other: &mut Self) {
        while self.count < L {
            let Some(last) = other.count.checked_sub(1) else { return };
            other.count = last;
            if let Some(item) = other.items.get(last) {
                self.push(*item);
            }
        }
    }

    /// All items and their count, leaving none. The lanes beyond the count hold the first item.
    #[inline(always)]
    pub fn drain(&mut self) -> ([T; L], usize) {
        let count = core::mem::take(&mut self.count);
        (from_fn(|lane| self.items[if lane < count { lane } else { 0 }]), count)
    }
}

/// An index to report, and what is to be searched.
pub(super) type Waiting<R> = (usize, Survivor<R>);

impl<R: Float, const L: usize> Queue<Waiting<R>, L> {
    #[inline(always)]
    pub fn empty() -> Self {
        Self::new((0, Survivor { index: 0, lower_bound: R::zero() }))
    }

    #[inline(always)]
    pub fn from_items(items: impl Iterator<Item = Waiting<R>>) -> Self {
        let mut queue = Self::empty();
        for item in items {
            queue.push(item);
        }
        queue
    }
}
