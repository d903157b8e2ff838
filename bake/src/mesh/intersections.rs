use std::ops::ControlFlow;

use rayon::prelude::*;
use robust::{Coord, Coord3D, orient2d, orient3d};
use sdf_core::Aabb;
use sdf_core::nalgebra::Vector3;

use crate::TriangleMesh;
use crate::bvh::Bvh;
use crate::rounding::{DETERMINANT_ROUNDING, MIN_VOLUME};
use crate::triangle::area_vector;

/// How many pairs of triangles pass through each other, or lie on each other in one plane. Exact predicates decide;
/// triangles that only touch, with a corner or along an edge, are not counted.
pub(crate) fn intersecting_pairs(mesh: &TriangleMesh, tree: &Bvh, orientations: &[f64]) -> usize {
    let boxes: Vec<Aabb> = tree.corners.par_iter().map(box_around).collect();
    let of_group = |first: usize| {
        let counting = |slot: &usize| orientations[*slot] != 0.0;
        let group = first..boxes.len().min(first + TOGETHER);
        let around = boxes[group.clone()].iter().copied().reduce(|a, b| a.union(&b));
        let mut near = vec![];
        let Some(around) = around else { return 0 };
        tree.overlapping(around.min.into(), around.max.into(), |slot| {
            near.extend(Some(slot).filter(counting));
            ControlFlow::Continue(())
        });
        let corners = |slot: usize| (&mesh.triangles[tree.triangles[slot] as usize], &tree.corners[slot]);
        let of_slot = |slot: usize| {
            let (of_slot, plane) = (corners(slot), Plane::new(&tree.corners[slot]));
            let others = near.iter().filter(|other| slot < **other && meet(&boxes[slot], &boxes[**other]));
            others
                .filter(|other| may_meet(&plane, of_slot, corners(**other)) && intersect(of_slot, corners(**other)))
                .count()
        };
        group.filter(counting).map(of_slot).sum()
    };
    (0..boxes.len()).into_par_iter().step_by(TOGETHER).map(of_group).sum()
}

/// Triangles that follow on each other in the tree and so lie together: what is near to them is looked for once.
const TOGETHER: usize = 8;

fn box_around([a, b, c]: &[Vector3<f64>; 3]) -> Aabb {
    Aabb { min: a.inf(b).inf(c).into(), max: a.sup(b).sup(c).into() }
}

fn meet(a: &Aabb, b: &Aabb) -> bool {
    (0..3).all(|axis| (a.min[axis] <= b.max[axis]) & (b.min[axis] <= a.max[axis]))
}

type Corners<'a> = (&'a [u32; 3], &'a [Vector3<f64>; 3]);

/// The plane of a triangle, reckoned with rounding.
struct Plane {
    through: Vector3<f64>,
    normal: Vector3<f64>,
    /// By how much a point along each axis may seem to be off it, in shares of the way to the point.
    rounding: Vector3<f64>,
}

impl Plane {
    fn new([a, b, c]: &[Vector3<f64>; 3]) -> Self {
        let (u, v) = (b - a, c - a);
        let forth = Vector3::new(u.y * v.z, u.z * v.x, u.x * v.y);
        let back = Vector3::new(u.z * v.y, u.x * v.z, u.y * v.x);
        Self { through: *a, normal: forth - back, rounding: (forth.abs() + back.abs()) * DETERMINANT_ROUNDING }
    }

    /// Positive on one side of the plane, negative on the other, zero where rounding may hide which.
    fn sure_side(&self, point: &Vector3<f64>) -> f64 {
        let way = point - self.through;
        let side = self.normal.dot(&way);
        if side.abs() > self.rounding.dot(&way.abs()) + MIN_VOLUME { side } else { 0.0 }
    }

    /// All corners that are not `others` too, of which there is one, surely lie on one side.
    fn parts(&self, (points, corners): Corners, others: &[u32; 3]) -> bool {
        let own = || points.iter().zip(corners).filter(|(point, _)| !others.contains(point));
        let sides = || own().map(|(_, corner)| self.sure_side(corner));
        own().next().is_some() && (sides().all(|side| side > 0.0) || sides().all(|side| side < 0.0))
    }
}

/// Not so where the plane of `a`, or that of `b`, surely parts the triangles. For most pairs this is all there is to do.
fn may_meet(plane_of_a: &Plane, a: Corners, b: Corners) -> bool {
    !plane_of_a.parts(b, a.0) && !Plane::new(b.1).parts(a, b.0)
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

/// Of which side of the plane of `a` the corners of `b` are.
fn sides(a: Corners, b: Corners) -> [f64; 3] {
    std::array::from_fn(|corner| if a.0.contains(&b.0[corner]) { 0.0 } else { side_of_plane(*a.1, b.1[corner]) })
}

/// All but the corners that both triangles have. Then they have no more than those in common.
fn are_on_one_side(sides: [f64; 3], shared: usize) -> bool {
    let count = |of: fn(f64) -> bool| sides.iter().filter(|side| of(**side)).count();
    let (above, below) = (count(|side| side > 0.0), count(|side| side < 0.0));
    above.max(below) + shared == 3
}

/// Two triangles in one plane have some area in common: no side of either parts them.
fn overlap_in_plane(a: [Vector3<f64>; 3], b: [Vector3<f64>; 3]) -> bool {
    let upright = area_vector(a).iamax();
    let flat = |corners: [Vector3<f64>; 3]| {
        let [a, b, c] = corners.map(|p| Coord { x: p[(upright + 1) % 3], y: p[(upright + 2) % 3] });
        if orient2d(a, b, c) < 0.0 { [a, c, b] } else { [a, b, c] }
    };
    let (a, b) = (flat(a), flat(b));
    let a_side_parts = |a: [Coord<f64>; 3], b: [Coord<f64>; 3]| {
        (0..3).any(|corner| b.iter().all(|point| orient2d(a[corner], a[(corner + 1) % 3], *point) <= 0.0))
    };
    !a_side_parts(a, b) && !a_side_parts(b, a)
}

/// An edge of `a` that has no corner in common with `b` passes through it.
fn an_edge_crosses(a: Corners, b: Corners) -> bool {
    (0..3).any(|corner| {
        let next = (corner + 1) % 3;
        let touches = b.0.contains(&a.0[corner]) || b.0.contains(&a.0[next]);
        !touches && crosses([a.1[corner], a.1[next]], *b.1)
    })
}

fn crosses([from, to]: [Vector3<f64>; 2], triangle: [Vector3<f64>; 3]) -> bool {
    let (from_side, to_side) = (side_of_plane(triangle, from), side_of_plane(triangle, to));
    let are_parted = (from_side < 0.0 && to_side > 0.0) || (from_side > 0.0 && to_side < 0.0);
    if !are_parted {
        return false;
    }
    let [a, b, c] = triangle;
    let around = [[from, to, a], [from, to, b], [from, to, c]];
    let around = [side_of_plane(around[0], b), side_of_plane(around[1], c), side_of_plane(around[2], a)];
    around.iter().all(|side| *side >= 0.0) || around.iter().all(|side| *side <= 0.0)
}

/// Exactly zero for a point in the triangle's plane, else of a sign that tells the side.
fn side_of_plane([a, b, c]: [Vector3<f64>; 3], point: Vector3<f64>) -> f64 {
    let [a, b, c, point] = [a, b, c, point].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    orient3d(a, b, c, point)
}

/// By how much the winding number is more at the segment's end than at its start for the triangles that it passes through.
/// Exact predicates decide. `None` where it touches the edge of a triangle, or an end lies in one's plane; or where there are
/// many triangles around it, which would take longer than the winding number itself.
pub(crate) fn winding_step(tree: &Bvh, orientations: &[f64], [from, to]: [Vector3<f64>; 2]) -> Option<f64> {
    const MAX_TRIANGLES: usize = 256;
    let (mut step, mut triangles) = (Some(0.0), 0);
    tree.overlapping(from.inf(&to), from.sup(&to), |slot| {
        triangles += 1;
        let of_triangle = if orientations[slot] == 0.0 { Some(0.0) } else { passes([from, to], tree.corners[slot]) };
        let of_triangle = of_triangle.filter(|_| triangles <= MAX_TRIANGLES);
        step = step.zip(of_triangle).map(|(step, turns)| step + turns * orientations[slot]);
        if step.is_none() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    step
}

/// 1 where the segment passes through a triangle from its front, −1 from its back, 0 where it passes by.
fn passes([from, to]: [Vector3<f64>; 2], triangle: [Vector3<f64>; 3]) -> Option<f64> {
    let [from_side, to_side] = [from, to].map(|point| side_of_plane(triangle, point));
    if (from_side > 0.0 && to_side > 0.0) || (from_side < 0.0 && to_side < 0.0) {
        return Some(0.0);
    }
    let [a, b, c] = triangle;
    let around = [side_of_plane([from, to, a], b), side_of_plane([from, to, b], c), side_of_plane([from, to, c], a)];
    let turns = [around.iter().any(|side| *side > 0.0), around.iter().any(|side| *side < 0.0)];
    if turns == [true, true] {
        return Some(0.0);
    }
    let is_clear = from_side != 0.0 && to_side != 0.0 && around.iter().all(|side| *side != 0.0);
    // Behind a triangle the predicate is positive.
    is_clear.then_some(if to_side > 0.0 { 1.0 } else { -1.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{random, random_vector};
    use crate::{MeshDistance, SignMethod};

    /// Points on a small grid of whole numbers: triangles touch, lie in one plane and have no area more often than not.
    fn coarse_triangles(state: &mut u64) -> [([u32; 3], [Vector3<f64>; 3]); 2] {
        let points: Vec<Vector3<f64>> = (0..6).map(|_| random_vector(state).map(|x| (1.6 * x).round())).collect();
        let first_at = |point: usize| points.iter().position(|other| *other == points[point]).unwrap();
        [[0, 1, 2], [3, 4, 5]].map(|corners| (corners.map(|c| first_at(c) as u32), corners.map(|c| points[c])))
    }

    #[test]
    fn a_pair_that_is_passed_over_early_does_not_intersect() {
        let mut state = 23;
        let (mut found, mut passed_over) = (0, 0);
        for _ in 0..200_000 {
            let triangles = coarse_triangles(&mut state);
            if triangles.iter().any(|(_, corners)| area_vector(*corners) == Vector3::zeros()) {
                continue;
            }
            let [a, b]: [Corners; 2] = triangles.each_ref().map(|(points, corners)| (points, corners));
            let shared = a.0.iter().filter(|point| b.0.contains(point)).count();
            let is_flat = b.1.iter().all(|corner| side_of_plane(*a.1, *corner) == 0.0);
            let crosses = shared < 2 && (an_edge_crosses(a, b) || an_edge_crosses(b, a));
            let wanted = if is_flat { overlap_in_plane(*a.1, *b.1) } else { crosses };
            found += usize::from(wanted);
            assert_eq!(intersect(a, b), wanted, "{a:?} {b:?}");
            let may_meet = may_meet(&Plane::new(a.1), a, b);
            assert!(may_meet || !wanted, "{a:?} {b:?}");
            passed_over += usize::from(!may_meet);
        }
        assert!(found > 1000 && passed_over > 1000);
    }

    #[test]
    fn a_side_that_is_sure_is_that_of_the_exact_predicate() {
        let mut state = 41;
        println!("seed {state}");
        let (mut sure, mut hidden) = (0, 0);
        for round in 0..300_000 {
            let size = [1.0, 1e30, 1e-30, 1e-90][round % 4];
            let far_off = random_vector(&mut state) * [0.0, 0.1, 1e3][round / 4 % 3];
            let triangle = [0, 1, 2].map(|_| (random_vector(&mut state) + far_off) * (1e-4 * size));
            let [a, b, c] = triangle;
            // As near to the plane as coordinates allow.
            let point = a + (b - a) * random(&mut state) + (c - a) * random(&mut state);
            let side = Plane::new(&triangle).sure_side(&point);
            let exact = -side_of_plane(triangle, point);
            assert!(side == 0.0 || side * exact > 0.0, "{triangle:?} {point:?} {side:e} {exact:e}");
            (sure, hidden) = (sure + usize::from(side != 0.0), hidden + usize::from(side == 0.0 && exact != 0.0));
        }
        assert!(hidden > 1000, "{sure} {hidden}");
    }

    #[test]
    fn between_two_points_the_winding_number_changes_by_the_triangles_between() {
        let mut state = 29;
        let points: Vec<[f64; 3]> = (0..60).map(|_| random_vector(&mut state).into()).collect();
        let tetrahedra = (0..60).step_by(4).flat_map(|a: u32| {
            [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|corners: [u32; 3]| corners.map(|corner| a + corner))
        });
        let mesh = TriangleMesh::new(&points, &tetrahedra.collect::<Vec<_>>()).unwrap();
        let distance = MeshDistance::new(&mesh, Some(SignMethod::Winding));
        for _ in 0..2000 {
            let from = random_vector(&mut state);
            let to = from + random_vector(&mut state) * random(&mut state).abs();
            let [before, after] = [from, to].map(|point| distance.winding_number(point.into()));
            let step = distance.winding_step([from, to]).unwrap();
            assert!((after - before - step).abs() < 0.2, "{before} to {after}, {step}");
        }
        // Through a corner, and from one.
        let corner = Vector3::from(points[0]);
        assert_eq!(distance.winding_step([corner * 2.0, Vector3::zeros()]).filter(|_| corner * 2.0 != corner), None);
        assert_eq!(distance.winding_step([corner, corner + Vector3::x()]), None);
    }
}
