//! Which tetrahedra are near a box? A tree of boxes with eight children each, in lent slices, over the tetrahedra along a Hilbert
//! curve.
//!
//! The order is that of the cage at rest, made once: neighbours stay neighbours where the cage is deformed. Where it moves, boxes are
//! fitted again from the tetrahedra up, and nothing is sorted. Boxes stand level by level, those of eight tetrahedra first, the root
//! last; the children of the node i of a level are 8 i … 8 i + 7 of the one below. So the way through the tree needs no stack: after
//! a node comes its next sibling, and after the last of them its parent's.

use super::{tet_bounds, tet_corners};
use crate::Aabb;
use crate::contact::{ClusterKey, sort_along_curve};

/// Children of a node, and tetrahedra of a leaf.
const FANOUT: usize = 8;

/// Levels of a tree over 2³² tetrahedra.
const MAX_LEVELS: usize = 11;

/// An empty box: around nothing yet.
const NOTHING: Aabb = Aabb { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

/// Sorts the tetrahedra of a cage at rest along a Hilbert curve: once, as the order holds for all deformed shapes. `scratch` and
/// `order` have one entry for each, and are overwritten. `false` if a length is another one, or a point is not there.
pub fn sort_tets(points: &[[f64; 3]], tets: &[[u32; 4]], scratch: &mut [ClusterKey], order: &mut [u32]) -> bool {
    sort_along_curve(points, tets, scratch, order).is_some()
}

/// Boxes of a tree over so many tetrahedra.
pub const fn tet_tree_size(tet_count: usize) -> usize {
    let (mut count, mut size) = (tet_count.div_ceil(FANOUT), 0_usize);
    while count > 1 {
        size = size.saturating_add(count);
        count = count.div_ceil(FANOUT);
    }
    size.saturating_add(count)
}

/// The boxes of a mesh of tetrahedra in one shape.
#[derive(Clone, Copy, Debug)]
pub(super) struct TetTree<'a> {
    order: &'a [u32],
    /// The levels' boxes, the leaves' first.
    levels: [&'a [Aabb]; MAX_LEVELS],
    /// The level of the root.
    top: usize,
}

impl<'a> TetTree<'a> {
    /// Fits the boxes. Tetrahedra with points that are not finite or not there are in none of them. `None` if `boxes` has another
    /// length than [`tet_tree_size`].
    pub fn fit(points: &[[f64; 3]], tets: &[[u32; 4]], order: &'a [u32], boxes: &'a mut [Aabb]) -> Option<Self> {
        if boxes.len() != tet_tree_size(order.len()) {
            return None;
        }
        let (mut levels, mut top) = ([[].as_slice(); MAX_LEVELS], 0);
        let (leaves, mut left) = boxes.split_at_mut_checked(order.len().div_ceil(FANOUT))?;
        for (bounds, members) in leaves.iter_mut().zip(order.chunks(FANOUT)) {
            let corners = members.iter().filter_map(|tet| tet_corners(points, tets.get(*tet as usize)?));
            *bounds = corners.fold(NOTHING, |around, corners| around.union(&tet_bounds(&corners)));
        }
        let mut below: &'a [Aabb] = leaves;
        for (index, level) in levels.iter_mut().enumerate() {
            (*level, top) = (below, index);
            if below.len() <= 1 {
                break;
            }
            let (nodes, rest) = left.split_at_mut_checked(below.len().div_ceil(FANOUT))?;
            for (bounds, children) in nodes.iter_mut().zip(below.chunks(FANOUT)) {
                *bounds = children.iter().fold(NOTHING, |around, child| around.union(child));
            }
            (below, left) = (nodes, rest);
        }
        Some(Self { order, levels, top })
    }

    /// The box around all; inverted without any tetrahedron.
    pub fn bounds(&self) -> Aabb {
        self.levels.get(self.top).and_then(|root| root.first()).copied().unwrap_or(NOTHING)
    }

    /// Visits the tetrahedra of each leaf whose box meets the region.
    pub fn visit_near(&self, region: &Aabb, mut visit: impl FnMut(u32)) {
        let (mut level, mut index) = (self.top, 0_usize);
        while let Some(bounds) = self.levels.get(level).and_then(|boxes| boxes.get(index)) {
            if meet(bounds, region) {
                if level > 0 {
                    (level, index) = (level.saturating_sub(1), index.saturating_mul(FANOUT));
                    continue;
                }
                self.order.chunks(FANOUT).nth(index).unwrap_or(&[]).iter().for_each(|tet| visit(*tet));
            }
            // The next sibling, or that of the nearest ancestor that has one.
            index = index.saturating_add(1);
            while level < self.top
                && (index.is_multiple_of(FANOUT) || self.levels.get(level).is_none_or(|boxes| index >= boxes.len()))
            {
                (level, index) = (level.saturating_add(1), index.div_ceil(FANOUT));
            }
        }
    }
}

/// Do two boxes have a point in common?
pub(super) fn meet(a: &Aabb, b: &Aabb) -> bool {
    // Without branches: six comparisons cost less than one wrong guess.
    (0..3).fold(true, |meet, k| meet & (a.min[k] <= b.max[k]) & (b.min[k] <= a.max[k]))
}
