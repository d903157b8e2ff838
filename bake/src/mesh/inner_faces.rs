//! Faces inside of the solid: which parts of faces are no part of its surface, because the solid goes on at both sides?
//!
//! | step | arithmetic | file |
//! |---|---|---|
//! | 1. remove whole shells that meet no other | exact predicates | `inner_shells` |
//! | 2. list pairs of triangles that cross, overlap in one plane or touch | exact predicates | `intersections` |
//! | 3. divide each of them by the others | exact | `pieces`, on `lines` |
//! | 4. ask both sides of each piece, and of one triangle for all that are connected without meeting others | exact predicates | `sides` |
//! | 5. remove what has the solid at both sides | – | – |
//!
//! Along a triangle that meets no other, and across edges to others like it, the winding numbers of both sides stay as
//! they are, and so they do along a piece. What is left is the surface of the solid. Its new corners are rounded, so it is
//! not closed bit for bit: distances are measured to it, but signs come from the winding numbers of the mesh as it was.

mod lines;
mod pieces;
mod sides;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use sdf_core::nalgebra::Vector3;

use super::has_area;
use super::inner_shells::has_known_shells;
use super::intersections::{contacts, intersecting_pairs};
use super::known::Known;
use super::topology::{OrientedMesh, orient, same_edge};
use crate::TriangleMesh;
use crate::bvh::Bvh;
use crate::rounding::{PIECE_ROUNDING, PIECE_TURN};
use crate::triangle::area_vector;
use crate::union_find::UnionFind;
use pieces::pieces;
use sides::{FUSED, Sides, Verdict};

/// Triangles are divided if the pairs of them that meet are no more than this for each triangle.
const MAX_PAIRS_PER_TRIANGLE: usize = 32;

/// Nor more than this in all: each costs up to a tenth of a millisecond.
const MAX_PAIRS: usize = 1 << 19;

/// Pieces at most for each triangle of the mesh, and some more for small ones.
const MAX_PIECES: [usize; 2] = [32, 4096];

/// Triangles asked for the sides of all that they are connected with, until one is certain.
const MAX_SAMPLES: usize = 8;

/// Triangles beside uncertain pieces at most, for each triangle of the mesh and some more for small ones. Beyond, no side counts as proven.
const MAX_BESIDE: [usize; 2] = [8, 4096];

/// Factor that scatters the order in which a triangle is divided: so the partition of many segments is not deep.
const SCATTER: u32 = 0x9e37_79b1;

/// The parts of a triangle, each with its corners.
struct Divided {
    triangle: usize,
    parts: Vec<(Vec<Vector3<f64>>, Verdict)>,
}

impl TriangleMesh {
    /// The surface of the solid: the mesh without the faces, and without the parts of faces, that have the solid at both
    /// sides. Signs remain those of the mesh as it was. [`report`](Self::report) has the counts.
    ///
    /// Unchanged unless all winding numbers are whole, as in closed meshes, or if too many triangles cross.
    pub fn without_inner_faces(self) -> Self {
        let (oriented, tree) = sdf_parallel::join(|| orient(&self), || Bvh::for_points(&self));
        if oriented.boundary().next().is_some() {
            return self.with_known(tree, oriented);
        }
        let max_pairs = MAX_PAIRS.min(MAX_PAIRS_PER_TRIANGLE * self.triangles.len());
        if has_known_shells(&oriented.topology) {
            let (mesh, pairs) = self.without_free_inner_shells(&oriented, &tree, max_pairs);
            return match (mesh.report.inner_shells, mesh.report.entangled_shells) {
                (0, 0) => mesh.with_known(tree, oriented),
                (0, _) => mesh.divided(oriented, tree, pairs),
                (_, 0) => mesh,
                _ => {
                    let (oriented, tree) = sdf_parallel::join(|| orient(&mesh), || Bvh::for_points(&mesh));
                    mesh.divided_alone(oriented, tree, max_pairs)
                }
            };
        }
        self.divided_alone(oriented, tree, max_pairs)
    }

    /// [`Self::divided`] by all pairs in contact, once they are found. Unchanged if the mesh bounds one solid.
    fn divided_alone(mut self, oriented: OrientedMesh, tree: Bvh, max_pairs: usize) -> Self {
        if oriented.topology.is_one_closed_shell() {
            let in_tree = |triangle: &u32| oriented.orientations[*triangle as usize];
            let orientations: Vec<f64> = tree.triangles.iter().map(in_tree).collect();
            let count = intersecting_pairs(&self, &tree, &orientations);
            self.intersecting_pairs = Some(count);
            match count {
                Some(0) => return self.with_known(tree, oriented),
                // Those in contact are no fewer.
                None => return self.divided(oriented, tree, None),
                Some(_) => (),
            }
        }
        let pairs = contacts(&self, &tree, max_pairs, |_, _| true, |_, _| ());
        self.divided(oriented, tree, pairs.ok())
    }

    /// Divides triangles by those with which they are in contact, and removes what is inside of the solid. `pairs` is `None` if they
    /// were too many.
    fn divided(mut self, oriented: OrientedMesh, tree: Bvh, pairs: Option<Vec<[u32; 2]>>) -> Self {
        let Some(pairs) = pairs else {
            self.report.has_too_many_crossings = true;
            return self.with_known(tree, oriented);
        };
        let keyed =
            |triangle: u32, other: u32| (u64::from(triangle) << 32 | u64::from(other.wrapping_mul(SCATTER)), other);
        let mut pairs: Vec<(u64, u32)> = pairs.into_iter().flat_map(|[a, b]| [keyed(a, b), keyed(b, a)]).collect();
        sdf_parallel::sort(&mut pairs);
        let pairs: Vec<[u32; 2]> = pairs.into_iter().map(|(key, other)| [(key >> 32) as u32, other]).collect();
        let groups: Vec<&[[u32; 2]]> = pairs.chunk_by(|a, b| a[0] == b[0]).collect();
        let sides = Sides::new(&self, &tree, &oriented.orientations);
        let corners = |triangle: u32| self.corner_points(self.triangles[triangle as usize]);
        let (piece_count, max_pieces) = (AtomicUsize::new(0), MAX_PIECES[0] * self.triangles.len() + MAX_PIECES[1]);
        let divide = |group: &[[u32; 2]]| {
            if piece_count.load(Ordering::Relaxed) > max_pieces || sides.is_spent() {
                return None;
            }
            let others: Vec<_> = group.iter().map(|[_, other]| corners(*other)).collect();
            let face = corners(group[0][0]);
            let with_verdict = |piece: pieces::Piece| {
                let verdict = sides.verdict(face, &piece);
                (piece.corners, verdict)
            };
            let pieces = pieces(face, &others)?;
            let count = pieces.len() + piece_count.fetch_add(pieces.len(), Ordering::Relaxed);
            if count > max_pieces {
                return None;
            }
            let parts = pieces.into_iter().map(with_verdict).collect();
            Some(Divided { triangle: group[0][0] as usize, parts })
        };
        // Whether they are too many does not depend on the order of threads.
        let divided = sdf_parallel::map(groups.len(), |group| divide(groups[group]));
        let divided = divided.into_iter().collect::<Option<Vec<Divided>>>();
        let known = divided.map(|divided| (self.verdicts_apart(&oriented, &sides, &divided), divided));
        match known {
            Some((apart, divided)) if !sides.is_spent() => self.assembled(oriented, tree, &apart, &divided),
            _ => {
                self.report.has_too_many_crossings = true;
                self.with_known(tree, oriented)
            }
        }
    }

    /// Verdict of each triangle that meets no other, as it is wound. Meaningless for the others.
    fn verdicts_apart(&self, oriented: &OrientedMesh, sides: &Sides, divided: &[Divided]) -> Vec<Verdict> {
        let count = self.triangles.len();
        let mut is_apart = vec![true; count + self.stitches.len()];
        divided.iter().for_each(|divided| is_apart[divided.triangle] = false);
        let mut sets = UnionFind::new(is_apart.len());
        for edge in oriented.half_edges.chunk_by(same_edge) {
            if let [a, b] = edge
                && is_apart[a.triangle as usize]
                && is_apart[b.triangle as usize]
            {
                sets.join(a.triangle, b.triangle);
            }
        }
        let mut part_of_root = vec![usize::MAX; count];
        let mut samples: Vec<Vec<usize>> = vec![];
        let mut part = |triangle: usize| {
            let part = &mut part_of_root[sets.root(triangle as u32) as usize];
            if *part == usize::MAX {
                *part = samples.len();
                samples.push(vec![]);
            }
            let samples = &mut samples[*part];
            samples.extend((samples.len() < MAX_SAMPLES).then_some(triangle));
            *part
        };
        let parts: Vec<Option<usize>> = (0..count).map(|triangle| is_apart[triangle].then(|| part(triangle))).collect();
        let verdict = |samples: &Vec<usize>| {
            let verdicts = samples.iter().flat_map(|triangle| {
                let face = self.corner_points(self.triangles[*triangle]);
                let piece = pieces(face, &[]).and_then(|mut pieces| pieces.pop());
                piece.map(|piece| sides.verdict(face, &piece).as_wound(oriented.orientations[*triangle]))
            });
            // What is not certain stays.
            verdicts.into_iter().find(|verdict| verdict.is_certain).unwrap_or(Verdict::UNKNOWN)
        };
        let by_part: Vec<Verdict> = sdf_parallel::map(samples.len(), |part| verdict(&samples[part]));
        let of_triangle = |(part, orientation): (Option<usize>, &f64)| {
            part.map_or(Verdict::UNKNOWN, |part| by_part[part].as_wound(*orientation))
        };
        parts.into_iter().zip(&oriented.orientations).map(of_triangle).collect()
    }

    fn assembled(mut self, oriented: OrientedMesh, tree: Bvh, apart: &[Verdict], divided: &[Divided]) -> Self {
        self.report.entangled_shells = 0;
        let mut report = self.report;
        let (mut points, mut triangles, mut outward) = (self.points.clone(), vec![], vec![]);
        let max_coordinate = self.bounds.min.iter().chain(&self.bounds.max).fold(0.0_f64, |max, x| max.max(x.abs()));
        let is_doubtful = beside_uncertain(&tree, divided, FUSED * max_coordinate, self.triangles.len());
        let mut divided = divided.iter().peekable();
        let rounding = PIECE_ROUNDING * max_coordinate;
        let mut has_new_points = false;
        for (triangle, corners) in self.triangles.iter().enumerate() {
            let orientation = oriented.orientations[triangle];
            let own = divided.next_if(|divided| divided.triangle == triangle);
            let known = |verdict: Verdict| if is_doubtful[triangle] { 0 } else { verdict.outward() };
            let parts = own.map_or(&[][..], |own| &own.parts);
            report.uncertain_pieces += parts.iter().filter(|(_, verdict)| !verdict.is_certain).count();
            let inner = parts.iter().filter(|(_, verdict)| verdict.is_inner()).count();
            if parts.len() > 1 {
                report.crossing_triangles += 1;
                report.kept_pieces += parts.len() - inner;
                report.dropped_pieces += inner;
            }
            let is_whole = inner == 0 || inner == parts.len();
            if is_whole {
                let verdict = parts.first().map_or(apart[triangle], |(_, verdict)| *verdict);
                if verdict.is_inner() {
                    report.inner_triangles += 1;
                } else {
                    triangles.push(wound_outward(*corners, verdict, orientation));
                    let is_same = parts.iter().all(|(_, other)| *other == verdict);
                    outward.push(if is_same { known(verdict) } else { 0 });
                }
                continue;
            }
            has_new_points = true;
            for (polygon, verdict) in parts.iter().filter(|(_, verdict)| !verdict.is_inner()) {
                for fan in polygon[1..].windows(2) {
                    let first = points.len() as u32;
                    let corners = with_area([polygon[0], fan[0], fan[1]], f64::EPSILON * max_coordinate);
                    points.extend(corners);
                    triangles.push(wound_outward([first, first + 1, first + 2], *verdict, orientation));
                    outward.push(if has_known_plane(corners, rounding) { known(*verdict) } else { 0 });
                }
            }
        }
        if triangles.is_empty() || triangles.len() == self.triangles.len() && !has_new_points {
            self.outward = (!triangles.is_empty()).then_some(outward);
            return self.with_known(tree, oriented);
        }
        let rounding = if has_new_points { rounding } else { 0.0 };
        // All that are known were wound outward.
        let outward = Some(outward.into_iter().map(i8::abs).collect());
        let (bounds, stitches) = (self.bounds, vec![]);
        Self {
            points,
            triangles,
            stitches,
            bounds,
            report,
            rounding,
            intersecting_pairs: None,
            order: None,
            tree: Known::default(),
            orientation: Known::default(),
            solid: Some(Arc::new(self.with_known(tree, oriented))),
            outward,
        }
    }
}

/// The triangle wound so that its front is outside of the solid, or else as it is oriented.
fn wound_outward([a, b, c]: [u32; 3], verdict: Verdict, orientation: f64) -> [u32; 3] {
    let is_turned = match verdict.inside {
        [front, back] if front != back => front,
        _ => orientation < 0.0,
    };
    if is_turned { [a, c, b] } else { [a, b, c] }
}

/// For each triangle: is it so near to a piece with an uncertain side that what is in front of it can be a gap that was closed?
fn beside_uncertain(tree: &Bvh, divided: &[Divided], distance: f64, triangle_count: usize) -> Vec<bool> {
    let parts = divided.iter().flat_map(|divided| &divided.parts);
    let uncertain: Vec<_> = parts.filter(|(_, verdict)| !verdict.is_certain).map(|(polygon, _)| polygon).collect();
    let mut is_doubtful = vec![false; triangle_count];
    let mut left = MAX_BESIDE[0] * triangle_count + MAX_BESIDE[1];
    for polygon in uncertain {
        let low = polygon.iter().fold(polygon[0], |low, corner| low.inf(corner)).add_scalar(-distance);
        let high = polygon.iter().fold(polygon[0], |high, corner| high.sup(corner)).add_scalar(distance);
        tree.visit_overlapping(low, high, |slot| {
            is_doubtful[tree.triangles[slot] as usize] = true;
            left -= 1;
            if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        if left == 0 {
            return vec![true; triangle_count];
        }
    }
    is_doubtful
}

/// Is a piece's plane hardly turned by the rounding of its corners? Then heights over it are as certain as distances in f32.
fn has_known_plane(corners: [Vector3<f64>; 3], rounding: f64) -> bool {
    let [a, b, c] = corners;
    let longest = [b - a, c - b, a - c].into_iter().map(|edge| edge.norm()).fold(0.0, f64::max);
    rounding * longest < PIECE_TURN * area_vector(corners).norm()
}

/// A triangle that rounding left without area gets one: a corner moves by `step` along an axis, or two where all are one.
fn with_area(corners: [Vector3<f64>; 3], step: f64) -> [Vector3<f64>; 3] {
    let moved = |(corner, axis): (usize, usize)| {
        let mut moved = corners;
        moved[corner][axis] += step;
        moved
    };
    let all_moves = (0..9).map(|index| moved((index / 3, index % 3)));
    let [a, b, c] = corners;
    let apart = [a, b + Vector3::x() * step, c + Vector3::y() * step];
    [corners].into_iter().chain(all_moves).find(|corners| has_area(*corners)).unwrap_or(apart)
}
