//! Numbers at the points of a box of which most are one and the same, kept in two levels.
//!
//! The box is cut into blocks of 8 × 8 × 8 points, fewer along an axis that has fewer. A block without a number of its own is not kept:
//! a directory has the place of each block's numbers, and the place 0, where all have the common value, for blocks without any. So a
//! look-up takes two loads and no branch, as in the tables of OpenVDB (Museth 2013). A table of 343 million slots, of which 5 million
//! near a surface have bricks, so takes a tenth of its 1.4 GB.

use alloc::vec::Vec;

/// Points along a block's side: 2³.
const SIDE_BITS: u32 = 3;

/// A number at each point of a box, x fastest.
#[derive(Clone, Debug)]
pub struct Blocks<T> {
    counts: [u32; 3],
    /// Bits of an index within a block, along each axis.
    bits: [u32; 3],
    block_counts: [usize; 3],
    /// For each block: its place among those that are kept.
    places: Vec<u32>,
    /// Numbers of one block after the other; the first block has the common value alone.
    numbers: Vec<T>,
}

impl<T: Copy + PartialEq> Blocks<T> {
    /// The same number at all points. `None` if there are more blocks than can be numbered.
    pub fn new(counts: [u32; 3], common: T) -> Option<Self> {
        let bits = counts.map(|count| (u32::BITS - count.saturating_sub(1).leading_zeros()).min(SIDE_BITS));
        let block_counts = core::array::from_fn(|axis| (counts[axis] as usize).div_ceil(1 << bits[axis]));
        let blocks = block_counts.iter().try_fold(1_usize, |count, along| count.checked_mul(*along));
        let blocks = blocks.filter(|blocks| u32::try_from(*blocks).is_ok())?;
        let mut places = Vec::new();
        places.try_reserve_exact(blocks).ok()?;
        places.resize(blocks, 0);
        Some(Self { counts, bits, block_counts, places, numbers: alloc::vec![common; 1 << bits.iter().sum::<u32>()] })
    }

    /// Blocks of numbers at all points, x fastest. `None` unless there are as many as points.
    pub fn from_dense(counts: [u32; 3], common: T, numbers: &[T]) -> Option<Self> {
        let count = counts.iter().try_fold(1_usize, |count, along| count.checked_mul(*along as usize));
        let mut blocks = Self::new(counts, common).filter(|_| count == Some(numbers.len()))?;
        let mut numbers = numbers.iter();
        for z in 0..counts[2] {
            for y in 0..counts[1] {
                for (x, number) in (0..counts[0]).zip(&mut numbers) {
                    blocks.set([x, y, z], *number);
                }
            }
        }
        Some(blocks)
    }

    /// Points along each axis.
    pub fn counts(&self) -> [u32; 3] {
        self.counts
    }

    /// The number that blocks without any of their own have.
    pub fn common(&self) -> Option<T> {
        self.numbers.first().copied()
    }

    /// The block of a point, and the point's index in it.
    #[inline(always)]
    fn block_and_index(&self, at: [u32; 3]) -> (usize, usize) {
        let [x, y, z] = at.map(|index| index as usize);
        let [bits_x, bits_y, bits_z] = self.bits;
        let [count_x, count_y, _] = self.block_counts;
        let row = (z >> bits_z).wrapping_mul(count_y).wrapping_add(y >> bits_y);
        let block = row.wrapping_mul(count_x).wrapping_add(x >> bits_x);
        let within = |index: usize, bits: u32| index & (1_usize << bits).wrapping_sub(1);
        let index = ((within(z, bits_z) << bits_y | within(y, bits_y)) << bits_x) | within(x, bits_x);
        (block, index)
    }

    /// Numbers in a block.
    #[inline(always)]
    fn block_bits(&self) -> u32 {
        let [x, y, z] = self.bits;
        x.wrapping_add(y).wrapping_add(z)
    }

    /// The number at a point; meaningless outside the box, and `None` far outside.
    #[inline(always)]
    pub fn get(&self, at: [u32; 3]) -> Option<T> {
        let (block, index) = self.block_and_index(at);
        let place = *self.places.get(block)? as usize;
        self.numbers.get(place << self.block_bits() | index).copied()
    }

    /// Sets the number at a point. Outside the box nothing is set.
    pub fn set(&mut self, at: [u32; 3], number: T) {
        let is_needed = self.common() != Some(number) || self.is_kept(at);
        if is_needed && let Some(kept) = self.get_mut(at) {
            *kept = number;
        }
    }

    /// Does the block of a point have numbers of its own?
    pub fn is_kept(&self, at: [u32; 3]) -> bool {
        let (block, _) = self.block_and_index(at);
        self.places.get(block).is_some_and(|place| *place > 0)
    }

    /// The number at a point, to change it: its block is kept from now on. `None` outside the box.
    pub fn get_mut(&mut self, at: [u32; 3]) -> Option<&mut T> {
        let is_inside = (0..3).all(|axis| at[axis] < self.counts[axis]);
        let common = self.common().filter(|_| is_inside)?;
        let (block, index) = self.block_and_index(at);
        let bits = self.block_bits();
        let place = self.places.get_mut(block)?;
        if *place == 0 {
            *place = u32::try_from(self.numbers.len() >> bits).ok()?;
            self.numbers.resize(self.numbers.len().saturating_add(1 << bits), common);
        }
        self.numbers.get_mut((*place as usize) << bits | index)
    }

    /// All numbers that are kept, to change those that differ from the common one, in no order; points outside the box have the
    /// common one.
    pub fn kept_mut(&mut self) -> &mut [T] {
        let block = 1 << self.block_bits();
        self.numbers.get_mut(block..).unwrap_or(&mut [])
    }

    /// All numbers that are kept: as [`kept_mut`](Self::kept_mut).
    pub fn kept(&self) -> &[T] {
        self.numbers.get(1 << self.block_bits()..).unwrap_or(&[])
    }

    /// The numbers at all points, x fastest.
    pub fn iter(&self) -> impl Iterator<Item = T> {
        let [x, y, z] = self.counts;
        let rows = (0..z).flat_map(move |z| (0..y).map(move |y| [y, z]));
        rows.flat_map(move |[y, z]| (0..x).filter_map(move |x| self.get([x, y, z])))
    }

    /// [`iter`](Self::iter), as a list.
    pub fn to_vec(&self) -> Vec<T> {
        self.iter().collect()
    }
}

/// Equality of the numbers at all points, whichever blocks are kept.
impl<T: Copy + PartialEq> PartialEq for Blocks<T> {
    fn eq(&self, other: &Self) -> bool {
        self.counts == other.counts && self.iter().eq(other.iter())
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use super::*;

    /// Against a dense list, at thin boxes too, with numbers set in any order and to the common one again.
    #[test]
    fn blocks_have_the_numbers_that_were_set_and_keep_no_other_block() {
        let mut state = 1_u32;
        let mut random = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % below
        };
        for counts in [[1, 1, 1], [9, 1, 2], [8, 8, 8], [17, 23, 9], [3, 100, 1]] {
            let count = counts.iter().product::<u32>();
            let (mut blocks, mut dense) = (Blocks::new(counts, 7).unwrap(), vec![7; count as usize]);
            for _ in 0..count / 5 {
                let at = counts.map(&mut random);
                let number = random(3) + 6;
                blocks.set(at, number);
                dense[((at[2] * counts[1] + at[1]) * counts[0] + at[0]) as usize] = number;
            }
            assert!(blocks.iter().eq(dense.iter().copied()), "{counts:?}");
            assert_eq!(blocks.to_vec(), dense);
            let other = Blocks::from_dense(counts, 7, &dense).unwrap();
            assert!(other == blocks);
            assert!(other.kept().len() <= blocks.kept().len());
            let sum = |numbers: &[u32]| numbers.iter().map(|number| i64::from(*number) - 7).sum::<i64>();
            assert_eq!(sum(blocks.kept()), sum(&dense), "points beyond the box have the common number");
            blocks.set([counts[0], 0, 0], 1);
            assert_eq!(blocks.to_vec(), dense, "nothing is set outside");
        }
        let mut one = Blocks::new([1 << 10, 1 << 10, 1 << 9], 0_u8).unwrap();
        one.set([1000, 3, 500], 1);
        assert_eq!((one.kept().len(), one.get([1000, 3, 500]), one.get([1001, 3, 500])), (512, Some(1), Some(0)));
        one.set([1, 1, 1], 0);
        assert_eq!(one.kept().len(), 512);
        assert!(Blocks::from_dense([2, 2, 2], 0, &[0; 7]).is_none());
        assert!(Blocks::new([u32::MAX; 3], 0).is_none());
    }
}
