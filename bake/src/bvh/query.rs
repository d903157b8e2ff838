//! Queries of the tree, depth first with a fixed stack.
//!
//! The nearest triangle is found by branch and bound. Children wait by their squared box distance, the nearest on top.
//! They are discarded if that exceeds the best squared distance so far by more than rounding, or with a tolerance, if they
//! could improve it by no more than that.

use std::ops::ControlFlow;

use sdf_core::nalgebra::Vector3;

use super::{ARITY, Bvh, ChildBoxes, STACK};
use crate::rounding::{NODE_POSITION_ROUNDING, PRUNE_SLACK};
use crate::simd::{Lanes, VectorX8, bits_of, max};
use crate::triangle::{NearestOnTriangle, nearest_on_triangle};

/// A triangle of the tree and its nearest point to a query point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearestTriangle {
    pub slot: usize,
    pub on_triangle: NearestOnTriangle,
}

/// [`Bvh::nearest_within`], dispatched to the instruction set of the machine.
struct NearestQuery<'a> {
    tree: &'a Bvh,
    point: Vector3<f64>,
    guess: usize,
    tolerance: f64,
}

impl pulp::NullaryFnOnce for NearestQuery<'_> {
    type Output = NearestTriangle;

    #[inline(always)]
    fn call(self) -> NearestTriangle {
        self.tree.find_nearest(self.point, self.guess, self.tolerance)
    }
}

/// [`Bvh::visit_overlapping`], dispatched to the instruction set of the machine.
struct OverlapQuery<'a, V> {
    tree: &'a Bvh,
    min: Vector3<f64>,
    max: Vector3<f64>,
    visit: V,
}

impl<V: FnMut(usize) -> ControlFlow<()>> pulp::NullaryFnOnce for OverlapQuery<'_, V> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { tree, min, max, visit } = self;
        let meets = |boxes: &ChildBoxes| {
            let mut meets = [true; ARITY];
            for axis in 0..3 {
                for child in 0..ARITY {
                    meets[child] &= (min[axis] <= boxes.max[axis][child]) & (boxes.min[axis][child] <= max[axis]);
                }
            }
            meets
        };
        tree.traverse(meets, visit);
    }
}

/// [`Bvh::visit_along`], dispatched to the instruction set of the machine.
struct SegmentQuery<'a, V> {
    tree: &'a Bvh,
    segment: [Vector3<f64>; 2],
    visit: V,
}

impl<V: FnMut(usize) -> ControlFlow<()>> pulp::NullaryFnOnce for SegmentQuery<'_, V> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { tree, segment: [from, to], visit } = self;
        let half = (to - from) * 0.5;
        let middle = from + half;
        let reach = middle.amax() + half.amax();
        tree.traverse(|boxes| boxes.meet_segment(middle, half, reach), visit);
    }
}

impl Bvh {
    /// Triangle nearest to `point`; among equally near ones that of the lowest slot. `guess` is any slot: the nearer
    /// its triangle, the shorter the search. The result does not depend on it.
    pub fn nearest(&self, point: Vector3<f64>, guess: usize) -> NearestTriangle {
        self.nearest_within(point, guess, 0.0)
    }

    /// A triangle that is farther than the nearest by no more than `tolerance`: the greater that is, the shorter the search.
    pub fn nearest_within(&self, point: Vector3<f64>, guess: usize, tolerance: f64) -> NearestTriangle {
        self.arch.dispatch(NearestQuery { tree: self, point, guess, tolerance })
    }

    #[inline(always)]
    fn find_nearest(&self, point: Vector3<f64>, guess: usize, tolerance: f64) -> NearestTriangle {
        let mut best = NearestTriangle { slot: guess, on_triangle: nearest_on_triangle(point, self.corners[guess]) };
        let limit_sq = |best_sq: f64| {
            let limit = if tolerance > 0.0 { max(best_sq.sqrt() - tolerance, 0.0) } else { 0.0 };
            (if tolerance > 0.0 { limit * limit } else { best_sq }) * (1.0 + PRUNE_SLACK)
        };
        let mut max_distance_sq = limit_sq(best.on_triangle.distance_sq);
        let mut stack = [(0.0, 0_u32, 0_u32); STACK];
        let mut depth = 1;
        stack[0] = (0.0, self.levels.len() as u32 - 1, 0);
        while depth > 0 {
            depth -= 1;
            let (distance_sq, level, node) = stack[depth];
            if distance_sq > max_distance_sq {
                continue;
            }
            let (level, node) = (level as usize, node as usize);
            let distances_sq = self.levels[level][node].distances_sq(point);
            let first = depth;
            // One branch for each child that is near, none for the others.
            let mut near = 0_u32;
            for child in 0..ARITY {
                near |= u32::from(distances_sq[child] <= max_distance_sq) << child;
            }
            while near != 0 {
                let child = near.trailing_zeros() as usize;
                near &= near - 1;
                let (distance_sq, index) = (distances_sq[child], node * ARITY + child);
                if level == 0 {
                    if distance_sq > max_distance_sq {
                        continue;
                    }
                    let on_triangle = nearest_on_triangle(point, self.corners[index]);
                    if (on_triangle.distance_sq, index) < (best.on_triangle.distance_sq, best.slot) {
                        best = NearestTriangle { slot: index, on_triangle };
                        max_distance_sq = limit_sq(on_triangle.distance_sq);
                    }
                    continue;
                }
                // Insertion sort: the nearest child is on top.
                let mut position = depth;
                while position > first && stack[position - 1].0 < distance_sq {
                    stack[position] = stack[position - 1];
                    position -= 1;
                }
                stack[position] = (distance_sq, level as u32 - 1, index as u32);
                depth += 1;
            }
        }
        best
    }

    /// A triangle near a point: the one to which the nearest box of each level leads.
    #[inline(always)]
    pub fn near_slot(&self, point: Vector3<f64>) -> usize {
        (0..self.levels.len()).rev().fold(0, |node, level| {
            let distances_sq = self.levels[level][node].distances_sq(point);
            let nearest =
                (1..ARITY).fold(0, |best, child| if distances_sq[child] < distances_sq[best] { child } else { best });
            node * ARITY + nearest
        })
    }

    /// Number of levels of nodes.
    pub fn height(&self) -> usize {
        self.levels.len()
    }

    /// Squared distances of a box to the boxes of a node's children.
    #[inline(always)]
    pub fn box_distances_sq(&self, level: usize, node: usize, min: Vector3<f64>, max: Vector3<f64>) -> Lanes<f64> {
        self.levels[level][node].box_distances_sq(min, max)
    }

    /// The least and the largest direction · x in the boxes of a node's children.
    #[inline(always)]
    pub fn box_extents(&self, level: usize, node: usize, direction: Vector3<f64>) -> [Lanes<f64>; 2] {
        let boxes = &self.levels[level][node];
        let mut extents = [[0.0; ARITY]; 2];
        for axis in 0..3 {
            let (near, far) = (&boxes.min[axis], &boxes.max[axis]);
            let [near, far] = if direction[axis] > 0.0 { [near, far] } else { [far, near] };
            for child in 0..ARITY {
                extents[0][child] += direction[axis] * near[child];
                extents[1][child] += direction[axis] * far[child];
            }
        }
        extents
    }

    /// Calls `visit` with the slot of every triangle whose box is within √`distance_sq` of `point`, and perhaps of a
    /// few more. Their order does not depend on the point.
    pub fn visit_within(&self, point: Vector3<f64>, distance_sq: f64, mut visit: impl FnMut(usize)) {
        let is_near = |boxes: &ChildBoxes| {
            boxes.distances_sq(point).map(|box_distance_sq| box_distance_sq <= distance_sq * (1.0 + PRUNE_SLACK))
        };
        self.traverse(is_near, |slot| {
            visit(slot);
            ControlFlow::Continue(())
        });
    }

    /// Does what [`Self::visit_within`] does for at most `limit` triangles. Returns false where there are more.
    #[inline(always)]
    pub fn visit_some_within(
        &self,
        point: Vector3<f64>,
        distance_sq: f64,
        limit: usize,
        mut visit: impl FnMut(usize),
    ) -> bool {
        let is_near = |boxes: &ChildBoxes| {
            boxes.distances_sq(point).map(|box_distance_sq| box_distance_sq <= distance_sq * (1.0 + PRUNE_SLACK))
        };
        let mut left = limit;
        self.traverse(is_near, |slot| {
            left = left.wrapping_sub(1);
            if left == usize::MAX {
                return ControlFlow::Break(());
            }
            visit(slot);
            ControlFlow::Continue(())
        });
        left != usize::MAX
    }

    /// Calls `visit` with the slot of every triangle whose box meets the box from `min` to `max`, until it breaks.
    pub fn visit_overlapping(&self, min: Vector3<f64>, max: Vector3<f64>, visit: impl FnMut(usize) -> ControlFlow<()>) {
        self.arch.dispatch(OverlapQuery { tree: self, min, max, visit });
    }

    /// Calls `visit` with the slot of every triangle whose box meets a segment, and perhaps of a few more, until it breaks.
    pub fn visit_along(&self, segment: [Vector3<f64>; 2], visit: impl FnMut(usize) -> ControlFlow<()>) {
        self.arch.dispatch(SegmentQuery { tree: self, segment, visit });
    }

    /// Calls `visit` with the slots below all children that `enters` selects, until it breaks.
    #[inline(always)]
    fn traverse(&self, enters: impl Fn(&ChildBoxes) -> Lanes<bool>, mut visit: impl FnMut(usize) -> ControlFlow<()>) {
        let mut stack = [(0, 0); STACK];
        let mut depth = 1;
        stack[0] = (self.levels.len() - 1, 0);
        while depth > 0 {
            depth -= 1;
            let (level, node) = stack[depth];
            let mut entered = bits_of(&enters(&self.levels[level][node]));
            while entered != 0 {
                let index = node * ARITY + entered.trailing_zeros() as usize;
                entered &= entered - 1;
                if level == 0 {
                    if visit(index).is_break() {
                        return;
                    }
                } else {
                    stack[depth] = (level - 1, index);
                    depth += 1;
                }
            }
        }
    }
}

impl ChildBoxes {
    /// Squared distance of a point to each child's box: Σ max(min − p, p − max, 0)² over the axes.
    #[inline(always)]
    fn distances_sq(&self, point: Vector3<f64>) -> Lanes<f64> {
        self.box_distances_sq(point, point)
    }

    /// Squared distance of a box to each child's box.
    #[inline(always)]
    fn box_distances_sq(&self, low: Vector3<f64>, high: Vector3<f64>) -> Lanes<f64> {
        let mut distances_sq = [0.0; ARITY];
        for axis in 0..3 {
            for child in 0..ARITY {
                let below = self.min[axis][child] - high[axis];
                let above = low[axis] - self.max[axis][child];
                let outside = max(max(below, above), 0.0);
                distances_sq[child] += outside * outside;
            }
        }
        distances_sq
    }

    /// Does each child's box meet a segment, its middle ± `half`? It does unless an axis, or the cross product of one with the segment,
    /// separates them (Ericson 2005, "Real-Time Collision Detection", §5.3.3). `reach` is the segment's largest coordinate.
    #[inline(always)]
    fn meet_segment(&self, middle: Vector3<f64>, half: Vector3<f64>, reach: f64) -> Lanes<bool> {
        let (mut offset, mut extent): (VectorX8<f64>, VectorX8<f64>) = Default::default();
        for axis in 0..3 {
            for child in 0..ARITY {
                let (low, high) = (self.min[axis][child], self.max[axis][child]);
                offset[axis][child] = 0.5 * (low + high) - middle[axis];
                let rounding = (low.abs() + high.abs() + reach) * NODE_POSITION_ROUNDING;
                extent[axis][child] = 0.5 * (high - low) + rounding;
            }
        }
        let mut meet = [true; ARITY];
        for axis in 0..3 {
            let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
            for child in 0..ARITY {
                let across = offset[next][child] * half[last] - offset[last][child] * half[next];
                let limit = extent[next][child] * half[last].abs() + extent[last][child] * half[next].abs();
                let is_along = offset[axis][child].abs() <= extent[axis][child] + half[axis].abs();
                meet[child] &= is_along & (across.abs() <= limit);
            }
        }
        meet
    }
}
