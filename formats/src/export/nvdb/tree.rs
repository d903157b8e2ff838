//! Which nodes has the tree over a grid's brick slots? Sorted as NanoVDB stores them: breadth first, each node's children by x, y, z.
//!
//! A lower node spans 16³ leaves, an upper node 32³ lower nodes. A block that has no leaf and lies inside is a tile of the node above.

/// Contents of a brick slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slot {
    /// Samples.
    Leaf,
    /// No samples; the block is inside the solid.
    Inside,
    /// No samples; outside.
    Outside,
}

/// A lower or an upper node: its place, counted in nodes of its kind, and what it holds.
#[derive(Debug, Default)]
pub(super) struct Node {
    pub place: [u32; 3],
    /// Children: the index in this node, and the child's index in its level.
    pub children: Vec<(usize, usize)>,
    /// Indices in this node of tiles that lie inside.
    pub inside: Vec<usize>,
}

/// The nodes of each level, from the root's children down.
#[derive(Debug, Default)]
pub(super) struct Tree {
    pub uppers: Vec<Node>,
    pub lowers: Vec<Node>,
    /// Slot of each leaf.
    pub leaves: Vec<[u32; 3]>,
}

/// Binary logarithm of the children along a side.
const LOWER_LOG: u32 = 4;
const UPPER_LOG: u32 = 5;

impl Tree {
    /// The tree over `counts` slots along each axis.
    pub fn new(counts: [u32; 3], slot: impl Fn([u32; 3]) -> Slot) -> Self {
        let mut tree = Self::default();
        let uppers = counts.map(|count| count.div_ceil(1 << (LOWER_LOG + UPPER_LOG)));
        for upper in places([0; 3], uppers) {
            let mut node = Node { place: upper, ..Node::default() };
            let first = upper.map(|index| index << UPPER_LOG);
            let end =
                std::array::from_fn(|axis| (first[axis] + (1 << UPPER_LOG)).min(counts[axis].div_ceil(1 << LOWER_LOG)));
            for lower in places(first, end) {
                let index = index_in_parent(lower, UPPER_LOG);
                match tree.lower(lower, counts, &slot) {
                    Slot::Leaf => node.children.push((index, tree.lowers.len() - 1)),
                    Slot::Inside => node.inside.push(index),
                    Slot::Outside => {}
                }
            }
            if !node.children.is_empty() || !node.inside.is_empty() {
                tree.uppers.push(node);
            }
        }
        tree
    }

    /// Adds a lower node, and returns [`Slot::Leaf`], unless a tile of its parent says the same.
    fn lower(&mut self, place: [u32; 3], counts: [u32; 3], slot: &impl Fn([u32; 3]) -> Slot) -> Slot {
        let mut node = Node { place, ..Node::default() };
        let first = place.map(|index| index << LOWER_LOG);
        let end = std::array::from_fn(|axis| (first[axis] + (1 << LOWER_LOG)).min(counts[axis]));
        for leaf in places(first, end) {
            let index = index_in_parent(leaf, LOWER_LOG);
            match slot(leaf) {
                Slot::Leaf => {
                    node.children.push((index, self.leaves.len()));
                    self.leaves.push(leaf);
                }
                Slot::Inside => node.inside.push(index),
                Slot::Outside => {}
            }
        }
        if node.children.is_empty() && node.inside.len() == 1 << (3 * LOWER_LOG) {
            return Slot::Inside;
        }
        if node.children.is_empty() && node.inside.is_empty() {
            return Slot::Outside;
        }
        self.lowers.push(node);
        Slot::Leaf
    }
}

/// All places from `first` to before `end`, z fastest.
fn places(first: [u32; 3], end: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    let [xs, ys, zs]: [_; 3] = std::array::from_fn(|axis| first[axis]..end[axis]);
    xs.flat_map(move |x| {
        let zs = zs.clone();
        ys.clone().flat_map(move |y| zs.clone().map(move |z| [x, y, z]))
    })
}

fn index_in_parent(place: [u32; 3], log: u32) -> usize {
    let [x, y, z] = place.map(|index| (index & ((1 << log) - 1)) as usize);
    (x << (2 * log)) | (y << log) | z
}
