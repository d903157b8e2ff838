//! Triangles that can be nearest to some point of a part of an element.
//!
//! Let m be the middle of a part that lies within ρ of it, and D the distance to the mesh. A triangle nearest to a point x of the part is
//! at most D(x) + |x − m| ≤ D(m) + 2 ρ from m. The halves of a part take their lists from the part's own, so a face asks the tree once.
//! The distances of eight points to all triangles of a list are measured in one pass, in SIMD lanes.

use sdf_core::nalgebra::Vector3;

use super::MeshSurface;
use crate::bvh::Bvh;
use crate::rounding::PRUNE_SLACK;
use crate::simd::{LANES, Lanes, VectorX8};
use crate::triangle::is_sliver;
use crate::triangle::nearest::distances_sq;

/// Longest list. A part with more triangles around it has none, and is measured by the tree.
const MAX_TRIANGLES: usize = 192;

/// Squared distances of eight points to the triangles of a list.
pub(super) struct Distances {
    /// One entry per triangle.
    pub squared: Vec<Lanes<f64>>,
    least: Lanes<f64>,
    nearest: Lanes<u32>,
}

/// The triangle nearest to a point.
#[derive(Clone, Copy)]
pub(super) struct Nearest {
    pub slot: u32,
    pub distance: f64,
}

impl Distances {
    pub fn new() -> Self {
        Self { squared: vec![], least: [0.0; LANES], nearest: [0; LANES] }
    }

    /// Measures eight points.
    pub fn measure(&mut self, tree: &Bvh, slots: &[u32], points: &[Vector3<f64>; LANES]) {
        let points = [0, 1, 2].map(|axis| points.map(|point| point[axis]));
        tree.arch.dispatch(Pass { tree, slots, points: &points, to: self });
    }

    /// The triangle nearest to a point; among equally near ones that of the lowest slot.
    pub fn nearest(&self, lane: usize) -> Nearest {
        Nearest { slot: self.nearest[lane], distance: self.least[lane].sqrt() }
    }
}

/// The pass over a list, dispatched to the instruction set of the machine.
struct Pass<'a> {
    tree: &'a Bvh,
    slots: &'a [u32],
    points: &'a VectorX8<f64>,
    to: &'a mut Distances,
}

impl pulp::NullaryFnOnce for Pass<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { tree, slots, points, to } = self;
        to.squared.clear();
        let (mut least, mut nearest) = ([f64::INFINITY; LANES], [u32::MAX; LANES]);
        for slot in slots {
            let corners = &tree.corners[*slot as usize];
            let squared = distances_sq(points, corners, is_sliver(*corners));
            for lane in 0..LANES {
                let is_nearer =
                    (squared[lane] < least[lane]) | ((squared[lane] == least[lane]) & (*slot < nearest[lane]));
                least[lane] = if is_nearer { squared[lane] } else { least[lane] };
                nearest[lane] = if is_nearer { *slot } else { nearest[lane] };
            }
            to.squared.push(squared);
        }
        (to.least, to.nearest) = (least, nearest);
    }
}

impl MeshSurface {
    /// Appends the triangles that can be nearest to a point of a ball to a list. `distance` is that of its middle. Appends none and
    /// returns false where they are too many.
    pub(super) fn gather(&self, middle: Vector3<f64>, distance: f64, radius: f64, list: &mut Vec<u32>) -> bool {
        let start = list.len();
        let within = reach(middle, distance, radius);
        let is_complete =
            self.tree.visit_some_within(middle, within * within, MAX_TRIANGLES, |slot| list.push(slot as u32));
        if !is_complete {
            list.truncate(start);
        }
        is_complete
    }
}

/// The distance from the middle of a ball within which the triangles nearest to its points are.
pub(super) fn reach(middle: Vector3<f64>, distance: f64, radius: f64) -> f64 {
    (distance + 2.0 * radius + PRUNE_SLACK * middle.amax()) * (1.0 + PRUNE_SLACK)
}
