//! The cubes of a lattice over a region, visited in Morton order (Morton 1966, "A computer oriented geodetic data
//! base") from the whole down: a block of 2^level leaves along each side is split into its eight children only where
//! the caller asks.

use core::array::from_fn;

use crate::Aabb;

/// A block of leaves, as much of it as lies in the region.
#[derive(Clone, Copy)]
pub(super) struct MortonBlock {
    /// Index of its first leaf along each axis.
    pub first: [u32; 3],
    level: u32,
    pub region: Aabb,
}

impl MortonBlock {
    pub fn is_leaf(&self) -> bool {
        self.level == 0
    }
}

/// An iterator over blocks, and the stack of those to come.
///
/// The lattice is shifted by a fraction of an edge, lest a plane of symmetry of the region lie between two leaves: the
/// middle surface often lies on one, and would be in both leaves or in neither.
pub(super) struct Leaves {
    region: Aabb,
    origin: [f64; 3],
    pub edge: f64,
    counts: [u32; 3],
    stack: [([u32; 3], u32); MAX_STACK],
    stack_count: usize,
}

/// Largest level: indices fit 21 bits and Morton codes 63, and counts are exact in f32.
const MAX_LEVEL: u32 = 20;

/// Seven blocks of each level wait while the eighth is visited.
const MAX_STACK: usize = 7 * MAX_LEVEL as usize + 8;

/// Shift of the lattice in edges, 1 − 1/g of the golden ratio g: a fraction that no symmetric scene has.
const SHIFT: f64 = 0.381_966;

impl Leaves {
    /// Leaves with this edge. It is made longer if there were more than 2^20 leaves along a side, or if it is not
    /// finite.
    pub fn new(region: &Aabb, edge: f64) -> Self {
        let longest = region.longest_side();
        let min_edge = (longest / f64::from((1_u32 << MAX_LEVEL) - 2)).max(f64::MIN_POSITIVE);
        let edge = if edge.is_finite() { edge.max(min_edge) } else { longest.max(min_edge) };
        let origin = region.min.map(|x| x - SHIFT * edge);
        let counts = from_fn(|axis| (((region.max[axis] - origin[axis]) / edge) as u32).saturating_add(1));
        let max_count = counts.iter().fold(1, |max: u32, count| max.max(*count));
        let level = max_count.min(1 << MAX_LEVEL).next_power_of_two().trailing_zeros();
        let mut stack = [([0; 3], 0); MAX_STACK];
        stack[0].1 = level;
        Self { region: *region, origin, edge, counts, stack, stack_count: 1 }
    }

    pub fn next_block(&mut self) -> Option<MortonBlock> {
        loop {
            self.stack_count = self.stack_count.checked_sub(1)?;
            let (first, level) = self.stack.get(self.stack_count).copied()?;
            let block = MortonBlock { first, level, region: self.bounds(first, 1_u32.wrapping_shl(level)) };
            let is_inside = (0..3).all(|axis| first[axis] < self.counts[axis] && block.region.extents()[axis] >= 0.0);
            if is_inside {
                return Some(block);
            }
        }
    }

    /// Makes the eight children of a block the next to be visited.
    pub fn split(&mut self, block: &MortonBlock) {
        let Some(level) = block.level.checked_sub(1) else { return };
        for child in (0..8_u32).rev() {
            let step: [u32; 3] = from_fn(|axis| (child.wrapping_shr(axis as u32) & 1).wrapping_shl(level));
            let first = from_fn(|axis| block.first[axis].wrapping_add(step[axis]));
            if let Some(slot) = self.stack.get_mut(self.stack_count) {
                *slot = (first, level);
                self.stack_count = self.stack_count.wrapping_add(1);
            }
        }
    }

    pub fn leaf_center(&self, leaf: [u32; 3]) -> [f64; 3] {
        let bounds = self.bounds(leaf, 1);
        from_fn(|axis| 0.5 * (bounds.min[axis] + bounds.max[axis]))
    }

    /// The part in the region of `count` leaves along each side.
    fn bounds(&self, first: [u32; 3], count: u32) -> Aabb {
        let plane = |axis: usize, index: u32| self.origin[axis] + self.edge * f64::from(index);
        Aabb {
            min: from_fn(|axis| plane(axis, first[axis]).max(self.region.min[axis])),
            max: from_fn(|axis| plane(axis, first[axis].wrapping_add(count)).min(self.region.max[axis])),
        }
    }
}

/// Bits of an index along one axis.
const INDEX_BITS: u32 = 21;

/// The Morton code of a leaf: the bits of its x, y and z index in turn.
pub(super) fn morton_code(leaf: [u32; 3]) -> u64 {
    let mut code = 0;
    for (axis, index) in (0_u32..).zip(leaf) {
        for bit in 0..INDEX_BITS {
            let shift = bit.wrapping_mul(3).wrapping_add(axis);
            code |= u64::from(index.wrapping_shr(bit) & 1).wrapping_shl(shift);
        }
    }
    code
}

/// The leaf of a Morton code.
pub(super) fn morton_leaf(code: u64) -> [u32; 3] {
    from_fn(|axis| {
        let shifted = code.wrapping_shr(axis as u32);
        (0..INDEX_BITS).fold(0, |index, bit| {
            let digit = shifted.wrapping_shr(bit.wrapping_mul(3)) & 1;
            index | (digit as u32).wrapping_shl(bit)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_morton_code_gives_its_leaf_back_and_grows_with_it() {
        for leaf in [[0, 0, 0], [1, 2, 3], [1 << 20, 5, 77], [(1 << 21) - 1; 3]] {
            assert_eq!(morton_leaf(morton_code(leaf)), leaf);
        }
        assert!(morton_code([1, 0, 0]) < morton_code([0, 1, 0]) && morton_code([1, 1, 1]) < morton_code([2, 0, 0]));
    }
}
