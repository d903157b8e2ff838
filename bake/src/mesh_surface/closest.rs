//! Which point of an element (a vertex, edge or face of another mesh) is nearest to the mesh?
//!
//! Branch and bound over the tree, from the triangle to which the nearest boxes lead. A node is opened, and a triangle measured, only
//! if its box is nearer to the element's box than the nearest pair so far, and no plane parts it that far from the element: neither
//! the plane across the way between that pair nor the element's own. Boxes of large nodes are too thick for planes.

use sdf_core::nalgebra::Vector3;

use super::element::{Pair, nearest_pair};
use super::{MeshSurface, SurfacePoint};
use crate::bvh::{ARITY, Bvh, STACK};
use crate::rounding::{PARTING_SLACK, PRUNE_SLACK};
use crate::triangle::nearest_on_triangle;

/// Levels of the tree, from the lowest, whose boxes are held against planes.
const PLANE_LEVELS: usize = 2;

/// The nearest points of an element and the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoints {
    /// Barycentric weights of the element's point; zero beyond its corners.
    pub weights: [f64; 3],
    /// The distance between element and mesh; zero where they cross.
    pub distance: f64,
    /// The element's point, and the mesh's nearest to it. Its distance has no sign: it is that of a point outside.
    pub at: SurfacePoint,
}

impl MeshSurface {
    /// The nearest points of an element with one to three corners and the mesh; `None` where they are farther apart than `limit`, and
    /// of other elements. `guess` is a slot, if one is known to be near: it saves time and changes nothing.
    pub fn closest(&self, element: &[Vector3<f64>], guess: Option<usize>, limit: f64) -> Option<ClosestPoints> {
        if !(1..=3).contains(&element.len()) {
            return None;
        }
        let query = ClosestQuery { tree: &self.tree, element, guess, limit_sq: limit * limit };
        let (slot, Pair { weights, on_element: query, distance_sq, .. }) = self.tree.arch.dispatch(query)?;
        let at = SurfacePoint::new(query, slot, nearest_on_triangle(query, self.tree.corners[slot]));
        Some(ClosestPoints { weights, distance: distance_sq.sqrt(), at })
    }
}

/// The search, dispatched to the instruction set of the machine.
struct ClosestQuery<'a> {
    tree: &'a Bvh,
    element: &'a [Vector3<f64>],
    guess: Option<usize>,
    limit_sq: f64,
}

impl pulp::NullaryFnOnce for ClosestQuery<'_> {
    type Output = Option<(usize, Pair)>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Self { tree, element, guess, limit_sq } = self;
        let middle = || element.iter().sum::<Vector3<f64>>() / element.len() as f64;
        let first = guess.unwrap_or_else(|| tree.near_slot(middle()));
        let pair = nearest_pair(element, tree.corners[first]);
        let mut parting = Parting::new(element, &pair, limit_sq);
        let slab = Slab::new(element);
        let mut best = (pair.distance_sq <= limit_sq).then_some((first, pair));
        let mut best_sq = pair.distance_sq.min(limit_sq);
        let (min, max) = element.iter().skip(1).fold((element[0], element[0]), |(a, b), p| (a.inf(p), b.sup(p)));
        // Triangles stand one level below the lowest.
        let mut stack = [(0.0, 0, 0); STACK];
        let mut depth = 1;
        stack[0] = (0.0, tree.height(), 0);
        while depth > 0 {
            depth -= 1;
            let (distance_sq, height, node) = stack[depth];
            if distance_sq > best_sq * (1.0 + PRUNE_SLACK) {
                continue;
            }
            let Some(level) = height.checked_sub(1) else {
                let triangle = &tree.corners[node];
                if node != first
                    && !parting.parts(triangle)
                    && !slab.parts(extents(slab.normal, triangle), best_sq.sqrt())
                {
                    let pair = nearest_pair(element, tree.corners[node]);
                    if pair.distance_sq < best_sq {
                        (best, best_sq) = (Some((node, pair)), pair.distance_sq);
                        parting = Parting::new(element, &pair, limit_sq);
                    }
                }
                continue;
            };
            let distances_sq = tree.box_distances_sq(level, node, min, max);
            // One bit for each child that is near.
            let mut near = 0_u32;
            for (child, distance_sq) in distances_sq.iter().enumerate() {
                near |= u32::from(*distance_sq <= best_sq * (1.0 + PRUNE_SLACK)) << child;
            }
            if near == 0 {
                continue;
            }
            if level < PLANE_LEVELS {
                let [_, highest] = tree.box_extents(level, node, parting.direction);
                let [bottom, top] = tree.box_extents(level, node, slab.normal);
                let distance = best_sq.sqrt();
                for child in 0..ARITY {
                    let is_parted =
                        (highest[child] < parting.least) | slab.parts([bottom[child], top[child]], distance);
                    near &= !(u32::from(is_parted) << child);
                }
            }
            let first = depth;
            while near != 0 {
                let child = near.trailing_zeros() as usize;
                near &= near - 1;
                let distance_sq = distances_sq[child];
                // Insertion sort: the nearest child is on top.
                let mut position = depth;
                while position > first && stack[position - 1].0 < distance_sq {
                    stack[position] = stack[position - 1];
                    position -= 1;
                }
                stack[position] = (distance_sq, level, node * ARITY + child);
                depth += 1;
            }
        }
        best
    }
}

/// A plane across the way between a pair, behind which the element lies.
struct Parting {
    direction: Vector3<f64>,
    /// The least of direction · x on the element, less the distance so far.
    least: f64,
}

impl Parting {
    fn new(element: &[Vector3<f64>], pair: &Pair, limit_sq: f64) -> Self {
        let offset = pair.on_element - pair.on_triangle;
        let direction = offset.try_normalize(0.0).unwrap_or_default();
        let least = element.iter().map(|corner| direction.dot(corner)).fold(f64::INFINITY, f64::min);
        Self { direction, least: least - pair.distance_sq.min(limit_sq).sqrt() * (1.0 - PARTING_SLACK) }
    }

    /// Is no point of the triangle nearer to the element than the pair, up to rounding?
    fn parts(&self, triangle: &[Vector3<f64>; 3]) -> bool {
        triangle.iter().all(|corner| self.direction.dot(corner) < self.least)
    }
}

/// Space between two planes that enclose a face; for other elements, all of it.
struct Slab {
    /// Unit vector, or zero.
    normal: Vector3<f64>,
    /// The least and the largest normal · x on the element.
    heights: [f64; 2],
}

impl Slab {
    fn new(element: &[Vector3<f64>]) -> Self {
        let normal = match element {
            [a, b, c] => (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default(),
            _ => Vector3::zeros(),
        };
        Self { normal, heights: extents(normal, element) }
    }

    /// Is what lies between two heights farther from the element than so much, up to rounding?
    #[inline(always)]
    fn parts(&self, [bottom, top]: [f64; 2], distance: f64) -> bool {
        let distance = distance * (1.0 + PARTING_SLACK);
        (bottom - self.heights[1] > distance) | (self.heights[0] - top > distance)
    }
}

/// The least and the largest direction · x of some points.
#[inline(always)]
fn extents(direction: Vector3<f64>, points: &[Vector3<f64>]) -> [f64; 2] {
    points
        .iter()
        .map(|point| direction.dot(point))
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[least, largest], height| {
            [f64::min(least, height), f64::max(largest, height)]
        })
}
