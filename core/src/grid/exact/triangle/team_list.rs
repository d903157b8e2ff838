//! A list that a team of threads shares out: entry i is held by the thread that computes lane i mod 8. A thread by itself holds all
//! entries, in their order. So a card's threads keep an eighth of the memory each.

use super::LANES;
use crate::grid::Storage;

/// `ROOM` entries in one thread: the whole list, or an eighth of it.
pub(super) struct TeamList<T, const ROOM: usize>([T; ROOM]);

impl<T: Copy, const ROOM: usize> TeamList<T, ROOM> {
    #[inline(always)]
    pub fn new(entry: T) -> Self {
        Self([entry; ROOM])
    }

    /// Sets an entry. All threads set the same one.
    #[inline(always)]
    pub fn set<S: Storage>(&mut self, storage: &S, index: usize, entry: T) {
        if S::LANES_OF_THREAD < LANES {
            let is_held = index % LANES == storage.first_lane();
            let slot = self.slot(index);
            *slot = if is_held { entry } else { *slot };
        } else if let Some(slot) = self.0.get_mut(index) {
            *slot = entry;
        }
    }

    /// Where a thread of a team holds one of eight entries, the one with this index among them. Not `get_mut`: what a thread decides by
    /// itself parts it from the others.
    #[inline(always)]
    fn slot(&mut self, index: usize) -> &mut T {
        &mut self.0[index / LANES % ROOM]
    }

    /// Sets the entries from `count` on to those of the lanes that are kept, in their order. Returns the index after the last. What follows
    /// that, up to eight entries, is lost: without a branch on unpredictable data others are written, too, and then overwritten.
    #[inline(always)]
    pub fn append<S: Storage>(
        &mut self,
        storage: &S,
        mut count: usize,
        entries: &[T; LANES],
        is_kept: &[u8; LANES],
    ) -> usize {
        if S::LANES_OF_THREAD == LANES {
            for lane in 0..LANES {
                self.set(storage, count, entries[lane]);
                count = count.wrapping_add(usize::from(is_kept[lane]));
            }
            return count;
        }
        let kept = storage.lanes_where(is_kept);
        // This thread holds one of the next eight entries: that of the kept lane before which so many others are kept.
        let before = (storage.first_lane() as u32).wrapping_sub(count as u32) % LANES as u32;
        let mut lanes = kept;
        for skipped in 0..LANES as u32 - 1 {
            lanes &= if skipped < before { lanes.wrapping_sub(1) } else { u32::MAX };
        }
        let entry = storage.of_lane(entries, lanes.trailing_zeros() as usize % LANES);
        *self.slot(count.wrapping_add(before as usize)) = entry;
        count.wrapping_add(kept.count_ones() as usize)
    }

    /// Sets the eight entries from `first` on to the same value.
    #[inline(always)]
    pub fn fill<S: Storage>(&mut self, storage: &S, first: usize, entry: T) {
        if S::LANES_OF_THREAD < LANES {
            self.set(storage, Self::held(storage, first), entry);
        } else if let Some(slots) = self.0.get_mut(first..).and_then(<[T]>::first_chunk_mut::<LANES>) {
            *slots = [entry; LANES];
        }
    }

    /// Index of the one entry, of the eight from `first` on, that a thread of a team holds.
    #[inline(always)]
    fn held<S: Storage>(storage: &S, first: usize) -> usize {
        first.wrapping_add(storage.first_lane().wrapping_sub(first) % LANES)
    }

    /// The eight entries from `first` on, by lane: those of the lanes that this thread computes.
    #[inline(always)]
    pub fn lanes<S: Storage>(&self, storage: &S, first: usize) -> Option<[T; LANES]> {
        if S::LANES_OF_THREAD == LANES {
            return self.0.get(first..)?.first_chunk::<LANES>().copied();
        }
        if ROOM.wrapping_mul(LANES) < first.wrapping_add(LANES) {
            return None;
        }
        let held = *self.0.get(Self::held(storage, first) / LANES)?;
        let lane = first.wrapping_add(storage.first_lane()) % LANES;
        Some([storage.of_lane(&[held; LANES], lane); LANES])
    }

    /// [`lanes`](Self::lanes) from a multiple of eight on: those that this thread holds.
    #[inline(always)]
    pub fn own_lanes<S: Storage>(&self, first: usize) -> Option<[T; LANES]> {
        if S::LANES_OF_THREAD == LANES {
            return self.0.get(first..)?.first_chunk::<LANES>().copied();
        }
        self.0.get(first / LANES).map(|entry| [*entry; LANES])
    }

    /// Sets the entries that [`own_lanes`](Self::own_lanes) gives.
    #[inline(always)]
    pub fn set_own_lanes<S: Storage>(&mut self, first: usize, entries: [T; LANES]) {
        if S::LANES_OF_THREAD < LANES {
            if let Some(slot) = self.0.get_mut(first / LANES) {
                *slot = entries[0];
            }
        } else if let Some(slots) = self.0.get_mut(first..).and_then(<[T]>::first_chunk_mut::<LANES>) {
            *slots = entries;
        }
    }
}
