//! Candidates of a box of points: the nodes, and at last the triangles, that can hold the nearest to one of its points.
//!
//! Let p be a point of the mesh. Whatever is nearer to x than p lies in the ball around x through p. For a fixed t,
//!
//! ```text
//! f(x) = |x − t|² − |x − p|²   is linear in x,
//! ```
//!
//! so if f is positive at the corners of a box of points, t is nearest to none of them. The minimum over the points t
//! of a node's box splits into axes too:
//!
//! ```text
//! min f = Σ_axis min over both ends x of (max(t_min − x, x − t_max, 0)² − (x − p)²).
//! ```

use sdf_core::nalgebra::Vector3;

use super::{ARITY, Bvh, ChildBoxes};
use crate::rounding::{POINT_ON_MESH_ROUNDING, SINGLE_SLACK};
use crate::simd::{Lanes, max, min};

/// A box of points and a point of the mesh near all of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PruneBound {
    /// First and last point along each axis.
    ends: [[f64; 2]; 3],
    /// Squared offset of each end from the point of the mesh.
    offsets_sq: [[f64; 2]; 3],
    /// Exceeds the rounding of f, and of the exact distances that are compared later.
    slack: f64,
}

impl PruneBound {
    #[inline(always)]
    pub fn new(ends: [[f64; 2]; 3], on_mesh: Vector3<f64>) -> Self {
        let mut offsets_sq = [[0.0; 2]; 3];
        let (mut max_distance_sq, mut max_coordinate) = (0.0_f64, 0.0_f64);
        for axis in 0..3 {
            let [first, last] = ends[axis].map(f64::abs);
            max_coordinate = max_coordinate.max(first).max(last).max(on_mesh[axis].abs());
            offsets_sq[axis] = ends[axis].map(|end| (end - on_mesh[axis]) * (end - on_mesh[axis]));
            max_distance_sq += max(offsets_sq[axis][0], offsets_sq[axis][1]);
        }
        // Far from the origin, the point is off the mesh by some roundings of its coordinates.
        let rounding = POINT_ON_MESH_ROUNDING * max_coordinate * max_distance_sq.sqrt();
        Self { ends, offsets_sq, slack: SINGLE_SLACK * max_distance_sq + rounding }
    }
}

impl Bvh {
    /// Expands the root level by level while there are at most `max_nodes` candidates, down to height 1, the nodes
    /// directly above triangles. Leaves the candidates in `nodes` and returns their height.
    #[inline(always)]
    pub fn candidates_within(
        &self,
        bound: &PruneBound,
        max_nodes: usize,
        nodes: &mut Vec<u32>,
        scratch: &mut Vec<u32>,
    ) -> usize {
        let mut height = self.levels.len();
        nodes.clear();
        nodes.push(0);
        while height > 1 && nodes.len() <= max_nodes {
            self.expand(height, nodes, bound, scratch);
            std::mem::swap(nodes, scratch);
            height -= 1;
        }
        height
    }

    /// Replaces the contents of `children` by those children of some nodes of one height that can hold a nearest point:
    /// nodes, or slots of triangles if the height is 1.
    #[inline(always)]
    pub fn expand(&self, height: usize, nodes: &[u32], bound: &PruneBound, children: &mut Vec<u32>) {
        children.clear();
        children.resize(nodes.len() * ARITY, 0);
        let mut count = 0;
        let child_count = if height > 1 { self.levels[height - 2].len() } else { self.corners.len() };
        for node in nodes {
            let excess = self.levels[height - 1][*node as usize].min_excess(bound);
            for child in 0..ARITY {
                let index = *node as usize * ARITY + child;
                children[count] = index as u32;
                // NaN compares false, so a child with NaN bounds is kept.
                let is_beyond = excess[child] > bound.slack;
                count += usize::from(!is_beyond & (index < child_count));
            }
        }
        children.truncate(count);
    }
}

impl ChildBoxes {
    /// Minimum of f for each child's box. Infinite in unused lanes.
    #[inline(always)]
    fn min_excess(&self, bound: &PruneBound) -> Lanes<f64> {
        let mut excess = [0.0; ARITY];
        for axis in 0..3 {
            for child in 0..ARITY {
                let excess_at = |end: usize| {
                    let point = bound.ends[axis][end];
                    let outside = max(max(self.min[axis][child] - point, point - self.max[axis][child]), 0.0);
                    outside * outside - bound.offsets_sq[axis][end]
                };
                excess[child] += min(excess_at(0), excess_at(1));
            }
        }
        excess
    }
}
