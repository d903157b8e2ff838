//! The bounded best-first queue of branch and bound (Land and Doig 1960, "An automatic method of solving discrete
//! programming problems"): which subregion is searched next, and what is proven of all the others?
//!
//! Open nodes are kept in a binary heap (Williams 1964) with the lowest bound on top. Its storage is fixed: a node that
//! finds no room is dropped, and its bound is remembered. So at any time min(value found,
//! [`BestFirstQueue::lower_bound`]) is a lower bound of the whole region.

use crate::number::{Float, Real};

/// A subregion with a lower bound of the objective on it.
pub(crate) trait Node: Copy {
    type Bound: Float;
    fn lower_bound(&self) -> Self::Bound;
}

/// Open nodes in a heap. `S` holds or lends the array of them: `[N; 64]`, `&mut [N]`.
pub(crate) struct BestFirstQueue<N: Node, S> {
    storage: S,
    count: usize,
    /// Lower bound of all nodes that are done with.
    fathomed_bound: N::Bound,
    /// Lower bound of the nodes among them that a full queue dropped.
    overflow_bound: N::Bound,
}

impl<N: Node, S: AsRef<[N]> + AsMut<[N]>> BestFirstQueue<N, S> {
    pub fn new(storage: S) -> Self {
        let infinity = N::Bound::from_f64(f64::INFINITY);
        Self { storage, count: 0, fathomed_bound: infinity, overflow_bound: infinity }
    }

    pub fn count(&self) -> usize {
        self.count
    }

    /// Lower bound of all nodes, open or done with; infinite before the first.
    pub fn lower_bound(&self) -> N::Bound {
        let open = self.get(0).map_or(N::Bound::from_f64(f64::INFINITY), Node::lower_bound);
        Real::min(self.fathomed_bound, open)
    }

    /// Lower bound of the nodes that a full queue dropped; infinite if there are none.
    pub fn overflow_bound(&self) -> N::Bound {
        self.overflow_bound
    }

    /// How many more nodes fit.
    pub fn room(&self) -> usize {
        self.storage.as_ref().len().saturating_sub(self.count)
    }

    /// Counts a node with this bound as done with.
    pub fn fathom(&mut self, lower_bound: N::Bound) {
        self.fathomed_bound = Real::min(self.fathomed_bound, lower_bound);
    }

    /// Adds a node, or drops it if the queue is full.
    pub fn push(&mut self, node: N) {
        if self.count < self.storage.as_ref().len() {
            let last = self.count;
            self.count = self.count.saturating_add(1);
            self.sift_up(last, node);
        } else {
            self.overflow(node.lower_bound());
        }
    }

    /// Adds a node. If the queue is full, the node with the highest bound is dropped instead, found in one pass over
    /// the leaves of the heap.
    pub fn push_evicting(&mut self, node: N) {
        let nodes = self.storage.as_ref();
        if self.count < nodes.len() {
            return self.push(node);
        }
        let leaves = nodes.iter().map(Node::lower_bound).enumerate().skip(nodes.len() / 2);
        let (worst, upper) =
            leaves.fold(
                (None, node.lower_bound()),
                |(worst, upper), (index, bound)| {
                    if upper < bound { (Some(index), bound) } else { (worst, upper) }
                },
            );
        if let Some(index) = worst {
            self.sift_up(index, node);
        }
        self.overflow(upper);
    }

    /// Removes the node with the lowest bound.
    pub fn pop(&mut self) -> Option<N> {
        self.remove(0)
    }

    /// Removes the first node of the greatest depth.
    pub fn pop_deepest(&mut self, depth: impl Fn(&N) -> u32) -> Option<N> {
        let depths = self.storage.as_ref().iter().take(self.count).map(depth);
        let (deepest, _) = depths.enumerate().reduce(|a, b| if a.1 < b.1 { b } else { a })?;
        self.remove(deepest)
    }

    fn overflow(&mut self, lower_bound: N::Bound) {
        self.overflow_bound = Real::min(self.overflow_bound, lower_bound);
        self.fathom(lower_bound);
    }

    fn remove(&mut self, index: usize) -> Option<N> {
        let removed = *self.get(index)?;
        let last_index = self.count.checked_sub(1)?;
        let last = *self.get(last_index)?;
        self.count = last_index;
        let mut hole = index;
        loop {
            let children = [1, 2].map(|side| hole.saturating_mul(2).saturating_add(side));
            let children = children.into_iter().filter_map(|child| self.get(child).map(|node| (child, *node)));
            let lower = |a: (usize, N), b: (usize, N)| if b.1.lower_bound() < a.1.lower_bound() { b } else { a };
            let lowest = children.reduce(lower).filter(|(_, node)| node.lower_bound() < last.lower_bound());
            let Some((child, node)) = lowest else { break };
            self.set(hole, node);
            hole = child;
        }
        self.sift_up(hole, last);
        Some(removed)
    }

    /// Places a node at a free index, or above it as far as its bound is the lower one.
    fn sift_up(&mut self, free: usize, node: N) {
        let mut hole = free;
        while let Some(above) = hole.checked_sub(1).map(|index| index / 2) {
            let Some(parent) = self.get(above).filter(|parent| node.lower_bound() < parent.lower_bound()) else {
                break;
            };
            let parent = *parent;
            self.set(hole, parent);
            hole = above;
        }
        self.set(hole, node);
    }

    /// The open node at an index of the heap.
    fn get(&self, index: usize) -> Option<&N> {
        self.storage.as_ref().get(index).filter(|_| index < self.count)
    }

    fn set(&mut self, index: usize, node: N) {
        if let Some(slot) = self.storage.as_mut().get_mut(index) {
            *slot = node;
        }
    }
}

#[cfg(test)]
mod tests;
