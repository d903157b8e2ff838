//! Triangles that can be nearest to some point of a part of an element.
//!
//! Let m be the middle of a part that lies within ρ of it, and D the distance to the mesh. A triangle nearest to a point x of the part is
//! at most D(x) + |x − m| ≤ D(m) + 2 ρ from m. The halves of a part take their lists from the part's own, so a face asks the tree once.
//! The distances of eight points to all triangles of a list are measured in one pass, in SIMD lanes.

use sdf_core::nalgebra::Vector3;

use super::MeshSurface;
use crate::bvh::Bvh;
use crate::rounding::{NORMAL_SLACK, PRUNE_SLACK};
use crate::simd::{LANES, Lanes};
use crate::triangle::is_sliver;
use crate::triangle::nearest::for_each_point;

/// Longest list. A part with more triangles around it has none, and is measured by the tree.
pub(super) const MAX_TRIANGLES: usize = 192;

/// The first point whose nearest points are kept.
pub(super) const FIRST_FOOT: usize = 3;

/// Squared distances of eight points to the triangles of a list.
pub(super) struct Distances {
    /// One entry per triangle.
    pub squared: Vec<Lanes<f64>>,
    /// The triangle's points that are nearest to the last of the eight, from [`FIRST_FOOT`] on; not numbers where it is a sliver.
    pub feet: Vec<[[f64; LANES - FIRST_FOOT]; 3]>,
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
        Self { squared: vec![], feet: vec![], least: [0.0; LANES], nearest: [0; LANES] }
    }

    /// Measures up to eight points; those of further lanes are unknown.
    pub fn measure<const L: usize>(&mut self, tree: &Bvh, slots: &[u32], points: &[Vector3<f64>; L]) {
        let points = [0, 1, 2].map(|axis| points.map(|point| point[axis]));
        tree.arch.dispatch(Pass { tree, slots, points: &points, to: self });
    }

    /// The triangle nearest to a point; among equally near ones that of the lowest slot.
    pub fn nearest(&self, lane: usize) -> Nearest {
        Nearest { slot: self.nearest[lane], distance: self.least[lane].sqrt() }
    }
}

/// The pass over a list, dispatched to the instruction set of the machine.
struct Pass<'a, const L: usize> {
    tree: &'a Bvh,
    slots: &'a [u32],
    points: &'a [[f64; L]; 3],
    to: &'a mut Distances,
}

impl<const L: usize> pulp::NullaryFnOnce for Pass<'_, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { tree, slots, points, to } = self;
        to.squared.clear();
        to.feet.clear();
        let (mut least, mut nearest) = ([f64::INFINITY; LANES], [u32::MAX; LANES]);
        for slot in slots {
            let corners = &tree.corners[*slot as usize];
            let is_sliver = is_sliver(*corners);
            let (mut squared, mut nearest_points) = (Lanes::default(), [[f64::NAN; L]; 3]);
            for_each_point(points, corners, is_sliver, |lane, point, distance_sq| {
                squared[lane] = distance_sq;
                (0..3).for_each(|axis| nearest_points[axis][lane] = if is_sliver { f64::NAN } else { point[axis] });
            });
            let feet = nearest_points.map(|axis| {
                std::array::from_fn(|foot| if FIRST_FOOT + foot < L { axis[FIRST_FOOT + foot] } else { f64::NAN })
            });
            for lane in 0..L {
                let is_nearer =
                    (squared[lane] < least[lane]) | ((squared[lane] == least[lane]) & (*slot < nearest[lane]));
                least[lane] = if is_nearer { squared[lane] } else { least[lane] };
                nearest[lane] = if is_nearer { *slot } else { nearest[lane] };
            }
            to.squared.push(squared);
            to.feet.push(feet);
        }
        (to.least, to.nearest) = (least, nearest);
    }
}

/// The search for a list, dispatched to the instruction set of the machine.
struct Gathering<'a> {
    tree: &'a Bvh,
    middle: Vector3<f64>,
    within_sq: f64,
    list: &'a mut Vec<u32>,
}

impl pulp::NullaryFnOnce for Gathering<'_> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        let Self { tree, middle, within_sq, list } = self;
        tree.visit_some_within(middle, within_sq, MAX_TRIANGLES, |slot| list.push(slot as u32))
    }
}

impl MeshSurface {
    /// Appends the triangles that can be nearest to a point of a ball to a list. `distance` is that of its middle. Appends none and
    /// returns false where they are too many.
    pub(super) fn gather(&self, middle: Vector3<f64>, distance: f64, radius: f64, list: &mut Vec<u32>) -> bool {
        let start = list.len();
        let within = reach(middle, distance, radius);
        let gathering = Gathering { tree: &self.tree, middle, within_sq: within * within, list };
        let is_complete = self.tree.arch.dispatch(gathering);
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

/// A ball around the middle of a part that holds the part, and the middle's distance to the mesh.
#[derive(Clone, Copy)]
pub(super) struct Ball {
    pub middle: Vector3<f64>,
    pub distance: f64,
    pub radius: f64,
}

/// Sieve of the triangles that can be nearest to a point of a part.
///
/// Let p be the point of a triangle t nearest to the middle m, and g the unit vector from p to m. The triangle lies on one side of the
/// plane across g at p, so d_t(x) ≥ g · (x − p). The distance to another triangle s is convex, so on the part at most the interpolant
/// of its values at the corners. Both are linear: where the first is above the second at each corner, t is nowhere nearest.
pub(super) struct Sieve<'a> {
    ball: Ball,
    reach_sq: f64,
    /// Corners of the part, and their distances to the triangle nearest to its middle.
    corners: &'a [(Vector3<f64>, f64)],
    /// Allowance for the rounding of g · (x − p), and of it times the distance.
    slack: f64,
    rounding: f64,
}

impl<'a> Sieve<'a> {
    pub fn new(ball: Ball, corners: &'a [(Vector3<f64>, f64)]) -> Self {
        let Ball { middle, distance, radius } = ball;
        let reach = reach(middle, distance, radius);
        let extent = reach + radius;
        Self {
            ball,
            reach_sq: reach * reach,
            corners,
            slack: NORMAL_SLACK * extent,
            rounding: PRUNE_SLACK * middle.amax() * extent,
        }
    }

    /// Is a triangle kept? `foot` is its point nearest to the middle.
    #[inline(always)]
    pub fn keeps(&self, foot: Vector3<f64>, distance_sq: f64) -> bool {
        let (offset, distance) = (self.ball.middle - foot, distance_sq.sqrt());
        let is_farther = |(corner, nearest): &(Vector3<f64>, f64)| {
            offset.dot(&(corner - foot)) > distance * (nearest + self.slack) + self.rounding
        };
        distance_sq <= self.reach_sq && !self.corners.iter().all(is_farther)
    }
}
