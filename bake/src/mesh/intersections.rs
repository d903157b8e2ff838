//! Triangle-triangle and segment-triangle intersections, decided by exact predicates (orient2d and orient3d of
//! Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast robust geometric predicates").
//!
//! | step | rejects a pair if | arithmetic |
//! |---|---|---|
//! | 1 | their boxes are apart ([`Bvh::visit_overlapping`], then each pair) | exact |
//! | 2 | all corners of one lie strictly on one side of the other's plane (Möller 1997, "A fast triangle-triangle intersection test") | f64 with an error bound |
//! | 3 | a plane midway between their centroids, as seen from a shared corner, or across the line of them separates them but for that corner; where they may be in contact, no corner may be in the other's plane | f64 with an error bound |
//! | 4 | they have an edge in common, and would lie on different sides of it in one plane | f64 with an error bound |
//! | 5 | step 2 again | exact |
//! | 6 | no edge of one crosses the other (Guigue and Devillers 2003, "Fast and robust triangle-triangle overlap test using orientation predicates"): for a segment pq that crosses abc, the volumes of pqab, pqbc, pqca have one sign | exact |
//!
//! Triangles in one plane are compared by separating lines through their edges. Triangles that only touch, at a corner
//! or along an edge, do not intersect; shared corners are recognized by their indices. But [`intersecting_pairs`] also counts triangles that
//! face away from each other and are nearer than rounding can tell ([`are_back_to_back`]): no step parts these.

mod corners_x8;
mod rays;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use robust::{Coord, Coord3D, orient2d, orient3d};
use sdf_core::Aabb;
use sdf_core::nalgebra::Vector3;

use crate::TriangleMesh;
use crate::bvh::Bvh;
use crate::mesh_surface::nearest_pair;
use crate::rounding::{
    BACK_TO_BACK_ROUNDING, DETERMINANT_ROUNDING, FOLD_SINE, MIN_VOLUME, is_far_from_origin, max_coordinate,
};
use crate::simd::LANES;
use crate::triangle::area_vector;
use corners_x8::{CornersX8, FindNotApart};
pub(in crate::mesh) use rays::{RAYS, crossing, ray_crossings, ray_end, winding_along};
pub(crate) use rays::{whole_winding_number, winding_change};

/// Triangles that are compared with one list of others: neighbours in the tree's order, and so in space.
const GROUP_SIZE: usize = 8;

/// Pairs that are compared at most, without those that planes separate, and more of large meshes: some ten seconds. Triangles of a surface
/// are near a dozen others, those of a heap near all.
const MAX_TESTS: usize = 1 << 25;

/// Pairs compared at most, for each triangle.
const MAX_TESTS_PER_TRIANGLE: usize = 256;

/// Number of pairs of triangles that cross, overlap in one plane, or are [back to back](are_back_to_back); `None` where so many are near each
/// other that counting them would take too long. Triangles with orientation 0 are ignored.
pub(crate) fn intersecting_pairs(mesh: &TriangleMesh, tree: &Bvh, orientations: &[f64]) -> Option<usize> {
    let bounds = mesh.bounds();
    // Pseudo-normals, for which the gap matters, are not used there, and most triangles might be within it.
    let is_far = is_far_from_origin(&bounds);
    let gap = if is_far { 0.0 } else { BACK_TO_BACK_ROUNDING * (max_coordinate(&bounds) + bounds.diagonal()) };
    count_pairs(mesh, tree, orientations, true, gap, |_, a, b, slots| {
        let are_apart = || are_apart_across_centroids(a, b) || are_apart_across_edge(a, b);
        let is_folded = !is_far && are_back_to_back(a, b, slots.map(|slot| orientations[slot]), gap);
        is_folded || !are_apart() && intersect(a, b)
    })
}

/// Why pairs in contact are not listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TooMany {
    /// There are more than the limit; each was told.
    Contacts,
    /// So many triangles are near each other that not all pairs were looked at.
    Tests,
}

/// Pairs of triangles that have more in common than corners and edges of the mesh, if there are no more than `max_count`, and no more
/// than can be looked at.
/// Some pairs that only come near in the plane of one are among them.
///
/// Calls `on_meeting` with the triangles of each pair that intersects, or has a point in common although they are not of one
/// shell. Some coplanar pairs that only come near are among them.
pub(super) fn contacts(
    mesh: &TriangleMesh,
    tree: &Bvh,
    max_count: usize,
    are_one_shell: impl Fn(u32, u32) -> bool + Sync,
    on_meeting: impl Fn(u32, u32) + Sync,
) -> Result<Vec<[u32; 2]>, TooMany> {
    let all = vec![1.0; tree.triangles.len()];
    let (found, count) = (Mutex::new(vec![]), AtomicUsize::new(0));
    let counted = count_pairs(mesh, tree, &all, false, 0.0, |plane_of_a, a, b, slots| {
        let plane_of_b = Plane::new(b.1, 0.0);
        if are_apart_across_edge(a, b) || are_apart_off_planes([plane_of_a, &plane_of_b], a, b) {
            return false;
        }
        let [first, second] = slots.map(|slot| tree.triangles[slot]);
        let is_contact = are_in_contact(a, b);
        let do_meet =
            if are_one_shell(first, second) { is_contact && intersect(a, b) } else { have_common_point(a, b) };
        if do_meet {
            on_meeting(first, second);
        }
        // Beyond the limit, what is found is not wanted.
        if is_contact && count.fetch_add(1, Ordering::Relaxed) < max_count {
            found.lock().unwrap_or_else(PoisonError::into_inner).push([first, second]);
        }
        is_contact
    });
    let found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
    counted.ok_or(TooMany::Tests)?;
    if count.into_inner() <= max_count { Ok(found) } else { Err(TooMany::Contacts) }
}

/// Number of pairs of triangles with overlapping boxes, and not parted by the plane of either, that pass a test, which gets
/// the first one's plane, both, and their slots. Boxes and planes part none that are within the gap. Triangles with orientation 0 are
/// ignored, and with `ignores_apart` pairs [apart around a corner](CornersX8::apart_around_corner), which are many in a fan. `None` after
/// too many tests.
fn count_pairs(
    mesh: &TriangleMesh,
    tree: &Bvh,
    orientations: &[f64],
    ignores_apart: bool,
    gap: f64,
    test: impl Fn(&Plane, Corners, Corners, [usize; 2]) -> bool + Sync,
) -> Option<usize> {
    let (tests, max_tests) = (AtomicUsize::new(0), MAX_TESTS.max(MAX_TESTS_PER_TRIANGLE * tree.corners.len()));
    let is_over = || tests.load(Ordering::Relaxed) > max_tests;
    let corners = |slot: usize| (&mesh.triangles[tree.triangles[slot] as usize], &tree.corners[slot]);
    let is_counted = |slot: &usize| orientations[*slot] != 0.0;
    let count_in_group = |(near, packed, found): &mut (Vec<usize>, Vec<CornersX8>, Vec<usize>), first: usize| {
        let group = first..tree.corners.len().min(first + GROUP_SIZE);
        let group_box =
            tree.corners[group.clone()].iter().map(|corners| box_around(corners, gap)).reduce(|a, b| a.union(&b));
        let Some(group_box) = group_box else { return 0 };
        near.clear();
        tree.visit_overlapping(group_box.min.into(), group_box.max.into(), |slot| {
            near.extend(Some(slot).filter(|slot| *slot > first && is_counted(slot)));
            ControlFlow::Continue(())
        });
        packed.clear();
        packed.extend(near.chunks(LANES).map(|slots| CornersX8::new(slots, corners)));
        let mut count_with = |slot: usize| {
            let (triangle, plane) = (corners(slot), Plane::new(&tree.corners[slot], gap));
            found.clear();
            tree.arch.dispatch(FindNotApart {
                triangles: packed,
                slots: near,
                bounds: &box_around(&tree.corners[slot], gap),
                plane: &plane,
                triangle,
                slot,
                ignores_apart,
                gap,
                found,
            });
            tests.fetch_add(found.len(), Ordering::Relaxed);
            found.iter().filter(|other| test(&plane, triangle, corners(**other), [slot, **other])).count()
        };
        group.filter(is_counted).map(&mut count_with).sum()
    };
    let counts = sdf_parallel::map_chunks(tree.corners.len().div_ceil(GROUP_SIZE), |groups| {
        let mut buffers = Default::default();
        groups.take_while(|_| !is_over()).map(|group| count_in_group(&mut buffers, group * GROUP_SIZE)).sum::<usize>()
    });
    (!is_over()).then(|| counts.into_iter().sum())
}

fn box_around([a, b, c]: &[Vector3<f64>; 3], gap: f64) -> Aabb {
    Aabb { min: a.inf(b).inf(c).into(), max: a.sup(b).sup(c).into() }.inflate(gap)
}

/// A triangle as the indices and positions of its corners.
type Corners<'a> = (&'a [u32; 3], &'a [Vector3<f64>; 3]);

/// Plane of a triangle in f64, with a bound of its rounding.
struct Plane {
    origin: Vector3<f64>,
    normal: Vector3<f64>,
    /// Error of normal · offset per unit of |offset| along each axis: 8 ε Σ |products of the normal|.
    rounding: Vector3<f64>,
    /// Bound of normal · offset at a point as far from the plane as a gap.
    slack: f64,
}

impl Plane {
    fn new([a, b, c]: &[Vector3<f64>; 3], gap: f64) -> Self {
        let (u, v) = (b - a, c - a);
        let positive = Vector3::new(u.y * v.z, u.z * v.x, u.x * v.y);
        let negative = Vector3::new(u.z * v.y, u.x * v.z, u.y * v.x);
        let rounding = (positive.abs() + negative.abs()) * DETERMINANT_ROUNDING;
        let normal = positive - negative;
        Self { origin: *a, normal, rounding, slack: MIN_VOLUME + gap * normal.lp_norm(1) }
    }

    /// Positive on one side of the plane, negative on the other, zero if rounding may hide which.
    fn certain_side(&self, point: &Vector3<f64>) -> f64 {
        let offset = point - self.origin;
        let side = self.normal.dot(&offset);
        if side.abs() > self.rounding.dot(&offset.abs()) + self.slack { side } else { 0.0 }
    }
}

/// Is a plane certain to have the triangles on either side but for the corner that both share: through that corner, midway between the
/// directions of the centroids, or else across the line of the centroids? So it is for most pairs around one corner.
fn are_apart_across_centroids(a: Corners, b: Corners) -> bool {
    let mut shared = a.0.iter().zip(a.1).filter(|(point, _)| b.0.contains(point)).map(|(_, corner)| *corner);
    let (corner, is_more) = (shared.next(), shared.next().is_some());
    let [a_sum, b_sum] = [a, b].map(|(_, [p, q, r])| p + q + r);
    let origin = corner.unwrap_or_else(|| (a_sum + b_sum) / 6.0);
    let normal = corner.map_or(b_sum - a_sum, |corner| midway(corner, a_sum, b_sum));
    let plane = Plane { origin, normal, rounding: normal.abs() * DETERMINANT_ROUNDING, slack: MIN_VOLUME };
    let all = |own: Corners, other: Corners, is_side: fn(f64) -> bool| {
        let mut own = own.0.iter().zip(own.1).filter(|(point, _)| !other.0.contains(point));
        own.all(|(_, corner)| is_side(plane.certain_side(corner)))
    };
    !is_more && all(a, b, |side| side < 0.0) && all(b, a, |side| side > 0.0)
}

/// Normal of the plane through a corner of two triangles, midway between the directions of their centroids, which are given as sums of
/// corners.
fn midway(corner: Vector3<f64>, a_sum: Vector3<f64>, b_sum: Vector3<f64>) -> Vector3<f64> {
    let [a, b] = [a_sum, b_sum].map(|sum| sum - corner * 3.0);
    b * a.norm() - a * b.norm()
}

/// Have two triangles a common edge, and would certainly lie on different sides of it if they were in one plane? Then they have no
/// more in common: so it is for the halves of a quadrangle, which rounding may leave in one plane.
fn are_apart_across_edge(a: Corners, b: Corners) -> bool {
    let corners = |own: Corners, other: Corners, is_shared: bool| {
        let corners = own.0.iter().zip(own.1).filter(|(point, _)| other.0.contains(point) == is_shared);
        let mut corners = corners.map(|(_, corner)| *corner);
        [0, 1].map(|_| corners.next())
    };
    let ([Some(from), Some(to)], [Some(c), None], [Some(d), None]) =
        (corners(a, b, true), corners(a, b, false), corners(b, a, false))
    else {
        return false;
    };
    let [c, d] = [c, d].map(|corner| Plane::new(&[from, to, corner], 0.0));
    let rounding = c.normal.abs().dot(&d.rounding) + d.normal.abs().dot(&c.rounding) + c.rounding.dot(&d.rounding);
    c.normal.dot(&d.normal) + 2.0 * rounding + MIN_VOLUME < 0.0
}

/// Are two triangles [apart](are_apart_across_centroids), and is no corner of one but a shared one in the plane of the other?
/// Then an edge that meets the other triangle by exact predicates has a point in common with it, which none has.
fn are_apart_off_planes([plane_of_a, plane_of_b]: [&Plane; 2], a: Corners, b: Corners) -> bool {
    let are_off = |plane: &Plane, (points, corners): Corners, other: &[u32; 3]| {
        let mut all = points.iter().zip(corners);
        all.all(|(point, corner)| other.contains(point) || plane.certain_side(corner) != 0.0)
    };
    are_apart_across_centroids(a, b) && are_off(plane_of_a, b, a.0) && are_off(plane_of_b, a, b.0)
}

/// Do two triangles face away from each other, and come nearer than rounding can tell, or, where they share a corner, than
/// [`FOLD_SINE`] of their size across from it? Then rounding decides which of them is nearest to a point, and on which side it is.
fn are_back_to_back(a: Corners, b: Corners, orientations: [f64; 2], gap: f64) -> bool {
    let shared = a.0.iter().filter(|point| b.0.contains(point)).count();
    // Folded edges are found by their pseudo-normals.
    if shared > 1 {
        return false;
    }
    let normals = [area_vector(*a.1) * orientations[0], area_vector(*b.1) * orientations[1]];
    let dot = normals[0].dot(&normals[1]);
    if shared == 0 {
        return dot < 0.0 && are_within(gap, a.1, b.1);
    }
    // Folded onto each other around a corner they face almost opposite ways.
    if dot >= -0.5 * normals[0].norm() * normals[1].norm() {
        return false;
    }
    let across = |own: Corners, other: Corners| {
        let mut corners = own.0.iter().zip(own.1).filter(|(point, _)| !other.0.contains(point));
        let mut next = || corners.next().map_or_else(Vector3::zeros, |(_, corner)| *corner);
        [next(), next()]
    };
    let sides = [across(a, b), across(b, a)];
    let longest = sides.iter().map(|[from, to]| (to - from).norm()).fold(0.0, f64::max);
    let within = gap.max(FOLD_SINE * longest);
    sides.iter().zip([b, a]).any(|(side, other)| are_within(within, side, other.1))
}

/// Not inlined: one copy of a long function that is called for few pairs.
#[inline(never)]
fn are_within(distance: f64, element: &[Vector3<f64>], triangle: &[Vector3<f64>; 3]) -> bool {
    nearest_pair(element, *triangle).distance_sq <= distance * distance
}

fn intersect(a: Corners, b: Corners) -> bool {
    let b_sides = sides(a, b);
    if b_sides == [0.0; 3] {
        return overlap_in_plane(*a.1, *b.1);
    }
    let shared = a.0.iter().filter(|point| b.0.contains(point)).count();
    if shared >= 2 || are_on_one_side(b_sides, shared) || are_on_one_side(sides(b, a), shared) {
        return false;
    }
    an_edge_crosses(a, b) || an_edge_crosses(b, a)
}

/// Does an edge of one triangle meet the other? True for an edge in the other's plane, wherever it is.
pub(super) fn have_common_point(a: Corners, b: Corners) -> bool {
    let meets = |segment: [Vector3<f64>; 2], triangle| crossing(segment, triangle) != Some(0.0);
    (0..3).any(|corner| {
        let edge = |corners: &[Vector3<f64>; 3]| [corners[corner], corners[(corner + 1) % 3]];
        meets(edge(a.1), *b.1) || meets(edge(b.1), *a.1)
    })
}

/// Do two triangles cross, overlap in one plane or touch, other than where the mesh connects them?
fn are_in_contact(a: Corners, b: Corners) -> bool {
    let shared = a.0.iter().filter(|point| b.0.contains(point)).count();
    let b_sides = sides(a, b);
    if shared == 3 {
        return true;
    }
    if b_sides == [0.0; 3] {
        return overlap_in_plane(*a.1, *b.1);
    }
    if shared == 2 || are_on_one_side(b_sides, shared) || are_on_one_side(sides(b, a), shared) {
        return false;
    }
    let an_edge_meets = |a: Corners, b: Corners| {
        (0..3).any(|corner| {
            let next = (corner + 1) % 3;
            let is_shared = b.0.contains(&a.0[corner]) || b.0.contains(&a.0[next]);
            !is_shared && crossing([a.1[corner], a.1[next]], *b.1) != Some(0.0)
        })
    };
    an_edge_meets(a, b) || an_edge_meets(b, a)
}

/// Side of the plane of `a` for each corner of `b`; zero for shared corners.
fn sides(a: Corners, b: Corners) -> [f64; 3] {
    std::array::from_fn(|corner| if a.0.contains(&b.0[corner]) { 0.0 } else { side_of_plane(*a.1, b.1[corner]) })
}

/// Are all corners but the shared ones strictly on one side? Then the triangles have no more than those in common.
fn are_on_one_side(sides: [f64; 3], shared: usize) -> bool {
    let count = |is_counted: fn(f64) -> bool| sides.iter().filter(|side| is_counted(**side)).count();
    let (above, below) = (count(|side| side > 0.0), count(|side| side < 0.0));
    above.max(below) + shared == 3
}

/// Do two triangles of one plane share an area? They do if the line through no edge of either separates them.
fn overlap_in_plane(a: [Vector3<f64>; 3], b: [Vector3<f64>; 3]) -> bool {
    let dropped_axis = area_vector(a).iamax();
    let project = |corners: [Vector3<f64>; 3]| {
        let [a, b, c] = corners.map(|p| Coord { x: p[(dropped_axis + 1) % 3], y: p[(dropped_axis + 2) % 3] });
        if orient2d(a, b, c) < 0.0 { [a, c, b] } else { [a, b, c] }
    };
    let (a, b) = (project(a), project(b));
    let an_edge_separates = |a: [Coord<f64>; 3], b: [Coord<f64>; 3]| {
        (0..3).any(|corner| b.iter().all(|point| orient2d(a[corner], a[(corner + 1) % 3], *point) <= 0.0))
    };
    !an_edge_separates(a, b) && !an_edge_separates(b, a)
}

/// Does an edge of `a` without a shared corner cross `b`?
fn an_edge_crosses(a: Corners, b: Corners) -> bool {
    (0..3).any(|corner| {
        let next = (corner + 1) % 3;
        let is_shared = b.0.contains(&a.0[corner]) || b.0.contains(&a.0[next]);
        !is_shared && crosses([a.1[corner], a.1[next]], *b.1)
    })
}

fn crosses(segment: [Vector3<f64>; 2], triangle: [Vector3<f64>; 3]) -> bool {
    let [from_side, to_side] = segment.map(|end| side_of_plane(triangle, end));
    let are_separated = (from_side < 0.0 && to_side > 0.0) || (from_side > 0.0 && to_side < 0.0);
    if !are_separated {
        return false;
    }
    let volumes = edge_volumes(segment, triangle);
    volumes.iter().all(|volume| *volume >= 0.0) || volumes.iter().all(|volume| *volume <= 0.0)
}

/// Signed volumes of the tetrahedra pqab, pqbc, pqca of a segment pq and a triangle abc. They have one sign if the line
/// passes through the triangle.
fn edge_volumes([p, q]: [Vector3<f64>; 2], [a, b, c]: [Vector3<f64>; 3]) -> [f64; 3] {
    [side_of_plane([p, q, a], b), side_of_plane([p, q, b], c), side_of_plane([p, q, c], a)]
}

/// Exactly zero for a point in the triangle's plane, positive behind the triangle, negative in front of it.
fn side_of_plane([a, b, c]: [Vector3<f64>; 3], point: Vector3<f64>) -> f64 {
    let [a, b, c, point] = [a, b, c, point].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    orient3d(a, b, c, point)
}

#[cfg(test)]
mod tests;
