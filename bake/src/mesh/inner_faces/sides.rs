//! Is a piece of a face inside of the solid at both its sides? By the winding number at two points beside it.
//!
//! The points p and q lie on the normal through a point of the piece. The answer is certain if, by exact predicates,
//!
//! 1. both lie on the piece's own side of all planes through its edges, and on different sides of the face: so the
//!    segment pq passes through the piece;
//! 2. it meets no other triangle, except in the face's plane: so p and q are in the two regions that the piece separates;
//! 3. the winding number at p is the sum of the crossings of a ray, which touches no edge.
//!
//! Near another face p and q come closer, down to where rounding takes their meaning. For a piece still nearer to another face, or
//! still narrower, p and q are [`FUSED`] away from it, and the answer is not certain. Both sides are unknown if another triangle passes at
//! that distance, as where the side of a box ends on the piece, unless the piece itself is narrower than that distance.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use sdf_core::nalgebra::Vector3;

use super::pieces::{Piece, side_of};
use crate::TriangleMesh;
use crate::bvh::Bvh;
use crate::mesh::intersections::{RAYS, crossing, have_common_point, ray_end, winding_along};
use crate::triangle::area_vector;

/// Distances of p and q from the piece, as fractions of the way from its middle to its edges.
const STEPS: [f64; 4] = [0.25, 4e-3, 1.5e-5, 6e-8];

/// The least of them, relative to the largest coordinate: its direction still has four bits.
const LEAST_STEP: f64 = 16.0 * f64::EPSILON;

/// Distance of p and q where no answer is certain, relative to the largest coordinate.
pub(super) const FUSED: f64 = 16384.0 * f64::EPSILON;

/// Relative shrinkage of a piece before it is compared with triangles beside it: those that end at its edges do not count.
const SHRUNK: f64 = 1e-9;

/// Triangles at most that are compared with a piece.
const MAX_NEAR: usize = 4096;

/// Triangles that a ray may come near to without being counted, if it touches no edge: in a mesh of a surface there are some dozens.
const USUAL_TESTS: usize = 256;

/// Triangles beyond that, of all rays together: so many for each of the mesh, and some more for small ones. Only where most of a mesh lies
/// within the rounding of a far corner are there more, and each takes long.
const MAX_TESTS: [usize; 2] = [64, 1 << 18];

/// Corners that no triangle of a mesh has.
const NO_CORNERS: [u32; 3] = [u32::MAX; 3];

/// Which side of a piece is inside of the solid?
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Verdict {
    /// In front of it, where its normal points, and behind it.
    pub inside: [bool; 2],
    /// Is it proven?
    pub is_certain: bool,
}

impl Verdict {
    pub const UNKNOWN: Self = Self { inside: [false; 2], is_certain: false };

    /// 1 if the outside is proven to be in front and the inside behind, −1 the other way round, else 0.
    pub fn outward(self) -> i8 {
        match (self.is_certain, self.inside) {
            (true, [false, true]) => 1,
            (true, [true, false]) => -1,
            _ => 0,
        }
    }

    /// Verdict of the triangle that is turned if its orientation is −1: front and back change places.
    pub fn as_wound(self, orientation: f64) -> Self {
        let [front, back] = self.inside;
        Self { inside: if orientation < 0.0 { [back, front] } else { [front, back] }, ..self }
    }

    /// Is the piece no part of the surface?
    pub fn is_inner(self) -> bool {
        self.inside == [true; 2]
    }
}

/// A mesh whose winding numbers are whole.
pub(super) struct Sides<'a> {
    pub mesh: &'a TriangleMesh,
    pub tree: &'a Bvh,
    /// Orientation of each triangle of the mesh.
    pub orientations: &'a [f64],
    /// Triangles that rays came near to so far, beyond the usual.
    tests: AtomicUsize,
}

impl<'a> Sides<'a> {
    pub fn new(mesh: &'a TriangleMesh, tree: &'a Bvh, orientations: &'a [f64]) -> Self {
        Self { mesh, tree, orientations, tests: AtomicUsize::new(0) }
    }

    /// Have rays come near to more triangles than they do in meshes of surfaces? Then verdicts mean nothing. It does not depend on the
    /// order of threads once all of them are done.
    pub fn is_spent(&self) -> bool {
        MAX_TESTS[0] * self.mesh.triangles.len() + MAX_TESTS[1] < self.tests.load(Ordering::Relaxed)
    }

    pub fn verdict(&self, face: [Vector3<f64>; 3], piece: &Piece) -> Verdict {
        let middle = piece.corners.iter().sum::<Vector3<f64>>() / piece.corners.len() as f64;
        let Some(normal) = area_vector(face).try_normalize(0.0) else { return Verdict::UNKNOWN };
        let coordinates = middle.amax().max(face[0].amax());
        let least = LEAST_STEP * coordinates;
        let width =
            piece.planes.iter().map(|(plane, _)| distance_to_plane(*plane, middle)).fold(f64::INFINITY, f64::min);
        let steps = STEPS.map(|step| step * width).into_iter().filter(|step| *step > least).chain([least]);
        let certain = steps
            .into_iter()
            .find_map(|step| self.certain(face, piece, [1.0, -1.0].map(|s| middle + normal * (s * step))));
        let step = FUSED * coordinates;
        // What is narrower leaves no hole that matters, whatever passes there.
        let fused = || self.beside(piece, middle, normal * step, width_of(&piece.corners) < step);
        certain.or_else(fused).unwrap_or(Verdict::UNKNOWN)
    }

    /// The sides a little beside a piece, if it is narrow or they are the same all along it: no triangle meets the piece where it is moved
    /// there.
    fn beside(&self, piece: &Piece, middle: Vector3<f64>, step: Vector3<f64>, is_narrow: bool) -> Option<Verdict> {
        let side = |step: Vector3<f64>| {
            let moved = |corner: &Vector3<f64>| middle + (corner - middle) * (1.0 - SHRUNK) + step;
            let polygon: Vec<Vector3<f64>> = piece.corners.iter().map(moved).collect();
            let mut fan = polygon[1..].windows(2).map(|ends| [polygon[0], ends[0], ends[1]]);
            let is_clear = is_narrow || fan.all(|corners| self.is_clear(&corners));
            is_clear.then(|| self.winding_number(middle + step)).flatten()
        };
        let (front, back) = (side(step)?, side(-step)?);
        Some(Verdict { inside: [front, back].map(|winding| winding != 0), is_certain: false })
    }

    /// Has no triangle of the mesh a point in common with another one? False as well where too many come near it.
    fn is_clear(&self, corners: &[Vector3<f64>; 3]) -> bool {
        let [a, b, c] = corners;
        let (mut is_clear, mut left) = (true, MAX_NEAR);
        self.tree.visit_overlapping(a.inf(b).inf(c), a.sup(b).sup(c), |slot| {
            let triangle = self.tree.triangles[slot] as usize;
            let is_counted = self.orientations[triangle] != 0.0;
            let other = (&self.mesh.triangles[triangle], &self.tree.corners[slot]);
            left -= 1;
            is_clear = left > 0 && !(is_counted && have_common_point((&NO_CORNERS, corners), other));
            if is_clear { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        is_clear
    }

    fn certain(&self, face: [Vector3<f64>; 3], piece: &Piece, points: [Vector3<f64>; 2]) -> Option<Verdict> {
        let is_beside = |(plane, side): &(_, i32)| points.iter().all(|point| side_of(*plane, *point) == *side);
        if points.map(|point| side_of(face, point)) != [1, -1] || !piece.planes.iter().all(is_beside) {
            return None;
        }
        let [from, to] = points;
        let mut change = Some(0);
        self.tree.visit_overlapping(from.inf(&to), from.sup(&to), |slot| {
            let orientation = self.orientations[self.tree.triangles[slot] as usize];
            let corners = self.tree.corners[slot];
            let is_in_plane = || corners.iter().all(|corner| side_of(face, *corner) == 0);
            let step = match crossing(points, corners) {
                _ if orientation == 0.0 => Some(0),
                Some(0.0) => Some(0),
                Some(crossing) if is_in_plane() => Some((crossing * orientation) as i32),
                _ => None,
            };
            change = change.zip(step).map(|(change, step)| change + step);
            if change.is_some() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        let change = change?;
        let front = self.winding_number(from)?;
        Some(Verdict { inside: [front, front + change].map(|winding| winding != 0), is_certain: true })
    }

    /// `None` also once rays are spent.
    fn winding_number(&self, from: Vector3<f64>) -> Option<i32> {
        let orientation = |slot: usize| self.orientations[self.tree.triangles[slot] as usize];
        (0..RAYS).take_while(|_| !self.is_spent()).find_map(|ray| {
            let mut tests = 0_usize;
            let is_counted = |slot| {
                tests += 1;
                orientation(slot) != 0.0
            };
            let winding =
                winding_along(self.tree, from, ray_end(from, &self.mesh.bounds, ray), is_counted, orientation);
            let usual = if winding.is_some() { USUAL_TESTS } else { 0 };
            self.tests.fetch_add(tests.saturating_sub(usual), Ordering::Relaxed);
            winding
        })
    }
}

/// Least width of a convex polygon, up to a factor of two: its area over its length.
fn width_of(corners: &[Vector3<f64>]) -> f64 {
    let fan = corners[1..].windows(2).map(|ends| area_vector([corners[0], ends[0], ends[1]]));
    let length = corners.iter().map(|corner| (corner - corners[0]).norm()).fold(0.0, f64::max);
    if length > 0.0 { fan.sum::<Vector3<f64>>().norm() / length } else { 0.0 }
}

fn distance_to_plane(plane: [Vector3<f64>; 3], point: Vector3<f64>) -> f64 {
    let normal = area_vector(plane).try_normalize(0.0).unwrap_or_default();
    normal.dot(&(point - plane[0])).abs()
}
