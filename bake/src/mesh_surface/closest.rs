//! Which point of an element (a vertex, edge or face of another mesh) is nearest to the mesh?
//!
//! Branch and bound over the tree: a node is opened only if its box is nearer to the element's box than the nearest pair so far, a
//! triangle measured only if no plane across the way between that pair parts it from the element.

use sdf_core::nalgebra::Vector3;

use super::element::{Pair, nearest_pair};
use super::{MeshSurface, SurfacePoint};
use crate::bvh::{ARITY, Bvh, STACK};
use crate::rounding::{PARTING_SLACK, PRUNE_SLACK};

/// The nearest points of an element and the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoints {
    /// Barycentric weights of the element's point; zero beyond its corners.
    pub weights: [f64; 3],
    /// The point of the element.
    pub on_element: Vector3<f64>,
    /// The point of the mesh.
    pub on_mesh: Vector3<f64>,
    /// The distance between both; zero where element and mesh cross.
    pub distance: f64,
    /// The mesh's triangle, in the tree's order.
    pub slot: usize,
}

impl MeshSurface {
    /// The nearest points of an element with one to three corners and the mesh. `start` is the answer for a point of the element of
    /// these weights.
    pub fn closest(&self, element: &[Vector3<f64>], start: &SurfacePoint, weights: [f64; 3]) -> ClosestPoints {
        let distance = start.distance.abs();
        let pair =
            Pair { weights, on_element: start.query, on_triangle: start.point, distance_sq: distance * distance };
        let query = ClosestQuery { tree: &self.tree, element, pair, slot: start.slot };
        let (slot, pair) = self.tree.arch.dispatch(query);
        let Pair { weights, on_element, on_triangle, distance_sq } = pair;
        ClosestPoints { weights, on_element, on_mesh: on_triangle, distance: distance_sq.sqrt(), slot }
    }
}

/// The search, dispatched to the instruction set of the machine.
struct ClosestQuery<'a> {
    tree: &'a Bvh,
    element: &'a [Vector3<f64>],
    pair: Pair,
    slot: usize,
}

impl pulp::NullaryFnOnce for ClosestQuery<'_> {
    type Output = (usize, Pair);

    #[inline(always)]
    fn call(self) -> (usize, Pair) {
        let Self { tree, element, pair, slot } = self;
        let mut best = (slot, pair);
        let mut parting = Parting::new(element, &pair);
        let (min, max) = element.iter().skip(1).fold((element[0], element[0]), |(a, b), p| (a.inf(p), b.sup(p)));
        let mut stack = [(0.0, 0, 0); STACK];
        let mut depth = 1;
        stack[0] = (0.0, tree.height() - 1, 0);
        let is_beyond = |distance_sq: f64, best: &Pair| distance_sq >= best.distance_sq * (1.0 + PRUNE_SLACK);
        while depth > 0 {
            depth -= 1;
            let (distance_sq, level, node) = stack[depth];
            if is_beyond(distance_sq, &best.1) {
                continue;
            }
            let distances_sq = tree.box_distances_sq(level, node, min, max);
            let first = depth;
            for (child, distance_sq) in distances_sq.into_iter().enumerate() {
                if is_beyond(distance_sq, &best.1) {
                    continue;
                }
                let index = node * ARITY + child;
                if level > 0 {
                    // Insertion sort: the nearest child is on top.
                    let mut position = depth;
                    while position > first && stack[position - 1].0 < distance_sq {
                        stack[position] = stack[position - 1];
                        position -= 1;
                    }
                    stack[position] = (distance_sq, level - 1, index);
                    depth += 1;
                } else if !parting.parts(&tree.corners[index]) {
                    let pair = nearest_pair(element, tree.corners[index]);
                    if pair.distance_sq < best.1.distance_sq {
                        best = (index, pair);
                        parting = Parting::new(element, &pair);
                    }
                }
            }
        }
        best
    }
}

/// A plane across the way between the nearest pair, behind which the element lies.
struct Parting {
    direction: Vector3<f64>,
    /// The least of direction · x on the element, less the distance so far.
    least: f64,
}

impl Parting {
    fn new(element: &[Vector3<f64>], pair: &Pair) -> Self {
        let offset = pair.on_element - pair.on_triangle;
        let direction = offset.try_normalize(0.0).unwrap_or_default();
        let least = element.iter().map(|corner| direction.dot(corner)).fold(f64::INFINITY, f64::min);
        Self { direction, least: least - pair.distance_sq.sqrt() * (1.0 - PARTING_SLACK) }
    }

    /// Is no point of the triangle nearer to the element than the pair, up to rounding?
    fn parts(&self, triangle: &[Vector3<f64>; 3]) -> bool {
        triangle.iter().all(|corner| self.direction.dot(corner) < self.least)
    }
}
