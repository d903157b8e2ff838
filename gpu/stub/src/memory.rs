//! The card's memory: is a copy within one list, and did a kernel write past the end of one?
//!
//! An address of the card is one of the CPU. New memory is full of a byte that makes neither a small number nor a valid index, and
//! behind each list stand guards.

use std::alloc::{Layout, alloc, dealloc};
use std::collections::BTreeMap;

/// In memory that nobody wrote yet.
const UNWRITTEN: u8 = 0xa5;

/// Bytes behind each list, which nobody may write.
const GUARD: usize = 64;

/// All lists by their addresses, with their lengths.
pub struct Memory {
    pub lists: BTreeMap<u64, usize>,
}

fn layout(bytes: usize) -> Layout {
    Layout::from_size_align(bytes + GUARD, 256).expect("a size that fits into memory")
}

impl Memory {
    pub fn allocate(&mut self, bytes: usize) -> u64 {
        // SAFETY: the size is not zero, and the bytes are written before anybody reads them.
        let address = unsafe {
            let start = alloc(layout(bytes));
            start.write_bytes(UNWRITTEN, bytes + GUARD);
            start as u64
        };
        self.lists.insert(address, bytes);
        address
    }

    /// Bytes of all lists.
    pub fn bytes(&self) -> usize {
        self.lists.values().sum()
    }

    /// False if nothing starts there.
    pub fn free(&mut self, address: u64) -> bool {
        let Some(bytes) = self.lists.remove(&address) else { return false };
        // SAFETY: it was allocated with this layout.
        unsafe { dealloc(address as *mut u8, layout(bytes)) };
        true
    }

    /// Do these bytes lie within one list?
    pub fn holds(&self, address: u64, bytes: usize) -> bool {
        self.list_at(address).is_some_and(|(start, length)| bytes <= length - (address - start) as usize)
    }

    /// Start and length of the list that this address lies in.
    pub fn list_at(&self, address: u64) -> Option<(u64, usize)> {
        let (start, length) = self.lists.range(..=address).next_back()?;
        // A copy of nothing may stand at the end.
        (address - start <= *length as u64).then_some((*start, *length))
    }

    /// Are all guards as they were?
    pub fn is_intact(&self) -> bool {
        self.lists.iter().all(|(start, length)| {
            // SAFETY: the guard stands behind the list.
            let guard = unsafe { std::slice::from_raw_parts((*start as *const u8).add(*length), GUARD) };
            guard.iter().all(|byte| *byte == UNWRITTEN)
        })
    }
}
