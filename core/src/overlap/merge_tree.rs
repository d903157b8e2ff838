//! The merge tree of values on cubes, those that touch being neighbours (Edelsbrunner, Letscher and Zomorodian 2002,
//! "Topological Persistence and Simplification"): which basins are deeper than a barrier?
//!
//! Cubes are added by ascending value (heapsort, Williams 1964) to a union-find forest whose roots are the lowest cubes
//! of their basins. Where a cube joins two basins, the higher root is a minimum of persistence value − root value.

use super::leaves::{morton_code, morton_leaf};
use crate::number::Float;

/// A cube in which the bodies may touch: the element of [`Pair::minima`](super::Pair::minima)'s scratch buffer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MortonLeaf<R> {
    code: u64,
    value: R,
    /// Index of a lower leaf in the same basin, or of itself.
    parent: u32,
    /// Index of the leaf whose rank by value is this leaf's index.
    ranked: u32,
}

impl<R: Float> MortonLeaf<R> {
    /// Fills the scratch buffer.
    pub fn empty() -> Self {
        Self::new(0, R::zero())
    }

    pub(super) fn new(code: u64, value: R) -> Self {
        Self { code, value, parent: 0, ranked: 0 }
    }
}

/// Leaves in Morton order.
pub(super) struct MergeTree<'s, R> {
    leaves: &'s mut [MortonLeaf<R>],
}

impl<'s, R: Float> MergeTree<'s, R> {
    /// Ranks the leaves by value; each is a basin of its own.
    pub fn new(leaves: &'s mut [MortonLeaf<R>]) -> Self {
        let mut tree = Self { leaves };
        tree.rank();
        tree
    }

    /// Calls `on_minimum` with the code of the lowest leaf of each basin that is deeper than the barrier, and of each
    /// connected part.
    pub fn merge(&mut self, barrier: R, mut on_minimum: impl FnMut(u64)) {
        for rank in 0..self.leaves.len() {
            let index = self.ranked(rank);
            let leaf = self.leaf(index);
            for step in 0..27_u32 {
                let Some(neighbor) = self.neighbor(leaf.code, step).filter(|other| self.is_lower(*other, index)) else {
                    continue;
                };
                let (one, other) = (self.root(index), self.root(neighbor));
                let (low, high) = if self.is_lower(one, other) { (one, other) } else { (other, one) };
                if low == high {
                    continue;
                }
                self.update(high, |leaf| leaf.parent = low as u32);
                let bottom = self.leaf(high);
                if barrier < leaf.value - bottom.value {
                    on_minimum(bottom.code);
                }
            }
        }
        for index in 0..self.leaves.len() {
            let leaf = self.leaf(index);
            if leaf.parent as usize == index {
                on_minimum(leaf.code);
            }
        }
    }

    fn leaf(&self, index: usize) -> MortonLeaf<R> {
        self.leaves.get(index).copied().unwrap_or(MortonLeaf::empty())
    }

    fn ranked(&self, rank: usize) -> usize {
        self.leaf(rank).ranked as usize
    }

    /// Compares values, and indices where those are equal.
    fn is_lower(&self, a: usize, b: usize) -> bool {
        let (value_a, value_b) = (self.leaf(a).value, self.leaf(b).value);
        value_a < value_b || (value_a <= value_b && a < b)
    }

    fn rank(&mut self) {
        for (index, leaf) in self.leaves.iter_mut().enumerate() {
            (leaf.ranked, leaf.parent) = (index as u32, index as u32);
        }
        let count = self.leaves.len();
        for root in (0..count / 2).rev() {
            self.sift_down(root, count);
        }
        for end in (1..count).rev() {
            self.swap_ranks(0, end);
            self.sift_down(0, end);
        }
    }

    fn sift_down(&mut self, root: usize, end: usize) {
        let mut at = root;
        loop {
            let children = [1, 2].map(|side| at.saturating_mul(2).saturating_add(side)).into_iter();
            let higher = |a, b| if self.is_lower(self.ranked(a), self.ranked(b)) { b } else { a };
            let Some(child) = children.filter(|child| *child < end).reduce(higher) else { return };
            if !self.is_lower(self.ranked(at), self.ranked(child)) {
                return;
            }
            self.swap_ranks(at, child);
            at = child;
        }
    }

    fn swap_ranks(&mut self, a: usize, b: usize) {
        let (ranked_a, ranked_b) = (self.leaf(a).ranked, self.leaf(b).ranked);
        self.update(a, |leaf| leaf.ranked = ranked_b);
        self.update(b, |leaf| leaf.ranked = ranked_a);
    }

    fn update(&mut self, index: usize, change: impl FnOnce(&mut MortonLeaf<R>)) {
        if let Some(leaf) = self.leaves.get_mut(index) {
            change(leaf);
        }
    }

    /// The root of a leaf's basin, with path halving (Tarjan and van Leeuwen 1984).
    fn root(&mut self, index: usize) -> usize {
        let mut at = index;
        loop {
            let parent = self.leaf(at).parent as usize;
            if parent == at {
                return at;
            }
            let grandparent = self.leaf(parent).parent;
            self.update(at, |leaf| leaf.parent = grandparent);
            at = grandparent as usize;
        }
    }

    /// The leaf that is −1, 0 or 1 away along each axis: the digits of `step` in base 3, less one.
    fn neighbor(&self, code: u64, step: u32) -> Option<usize> {
        let leaf = morton_leaf(code);
        let digits = [step % 3, step / 3 % 3, step / 9];
        let mut index = [0; 3];
        for axis in 0..3 {
            index[axis] = leaf[axis].checked_add(digits[axis])?.checked_sub(1)?;
        }
        let code = morton_code(index);
        self.leaves.binary_search_by(|leaf| leaf.code.cmp(&code)).ok()
    }
}
