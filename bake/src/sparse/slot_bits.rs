//! Sets of slots: a bit for each, set from any thread.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

const WORD: usize = u64::BITS as usize;

/// A set of slots by their indices, x fastest.
pub(super) struct SlotBits {
    len: usize,
    words: Vec<AtomicU64>,
}

impl SlotBits {
    /// Empty set of so many slots.
    pub fn new(len: usize) -> Self {
        Self { len, words: (0..len.div_ceil(WORD)).map(|_| AtomicU64::new(0)).collect() }
    }

    /// The slots of which a test is true.
    pub fn of(len: usize, test: impl Fn(usize) -> bool) -> Self {
        let bits = Self::new(len);
        (0..len).filter(|slot| test(*slot)).for_each(|slot| bits.insert(slot));
        bits
    }

    /// Number of slots, in the set or not.
    pub fn len(&self) -> usize {
        self.len
    }

    fn word(&self, word: usize) -> u64 {
        self.words.get(word).map_or(0, |word| word.load(Ordering::Relaxed))
    }

    #[inline]
    pub fn contains(&self, slot: usize) -> bool {
        self.word(slot / WORD) >> (slot % WORD) & 1 != 0
    }

    #[inline]
    pub fn insert(&self, slot: usize) {
        let bit = 1 << (slot % WORD);
        // Most slots are marked again and again.
        if self.word(slot / WORD) & bit == 0 {
            self.words[slot / WORD].fetch_or(bit, Ordering::Relaxed);
        }
    }

    pub fn insert_range(&self, slots: Range<usize>) {
        slots.for_each(|slot| self.insert(slot));
    }

    /// Number of slots in the set.
    pub fn count(&self) -> usize {
        (0..self.words.len()).map(|word| self.word(word).count_ones() as usize).sum()
    }

    /// 64 slots from one on, the first in the lowest bit; none beyond the last slot.
    pub fn from(&self, slot: usize) -> u64 {
        let (word, shift) = (slot / WORD, slot % WORD);
        let low = self.word(word) >> shift;
        if shift == 0 { low } else { low | self.word(word + 1) << (WORD - shift) }
    }

    /// For each word, the number of slots of the set before it.
    pub fn ranks(&self) -> Vec<u32> {
        let mut sum = 0;
        let before = |word: usize| {
            let before = sum;
            sum += self.word(word).count_ones();
            before
        };
        (0..self.words.len()).map(before).collect()
    }

    /// Number of slots of the set before one. `ranks` are the set's.
    #[inline]
    pub fn rank(&self, ranks: &[u32], slot: usize) -> usize {
        let below = self.word(slot / WORD) & ((1 << (slot % WORD)) - 1);
        ranks[slot / WORD] as usize + below.count_ones() as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random;

    #[test]
    fn bits_are_those_of_a_list() {
        let mut state = 3;
        for len in [0, 1, 63, 64, 65, 1000] {
            let list: Vec<bool> = (0..len).map(|_| random(&mut state) > 0.2).collect();
            let bits = SlotBits::of(len, |slot| list[slot]);
            let ranks = bits.ranks();
            for slot in 0..len {
                assert_eq!(bits.contains(slot), list[slot]);
                assert_eq!(bits.rank(&ranks, slot), list[..slot].iter().filter(|is_set| **is_set).count());
                let from = (0..64).filter(|n| list.get(slot + n) == Some(&true)).map(|n| 1 << n).sum::<u64>();
                assert_eq!(bits.from(slot), from);
            }
            assert_eq!((bits.len(), bits.count()), (len, list.iter().filter(|is_set| **is_set).count()));
            bits.insert_range(0..len);
            assert_eq!(bits.count(), len);
        }
    }
}
