//! Triangles that the cull drops are farther from each octant than it claims.

use sdf_core::Aabb;
use sdf_core::nalgebra::Vector3;

use super::*;
use crate::testing::random_vector;
use crate::triangle::approx::{ApproxTriangle, UnitFrame};
use crate::triangle::nearest_on_triangle;

/// Is a corner of a cube nearer to some triangle than to a point, by at least half of the rounding?
fn is_nearer(
    triangles: &[[Vector3<f64>; 3]],
    center: Vector3<f64>,
    half_side: f64,
    point: Vector3<f64>,
    rounding: f64,
) -> bool {
    (0..8_u32).any(|corner| {
        let side = |axis: usize, _| if corner >> axis & 1 == 0 { -half_side } else { half_side };
        let corner = center + Vector3::from_fn(side);
        let distance = |triangle: &[Vector3<f64>; 3]| nearest_on_triangle(corner, *triangle).distance_sq.sqrt();
        triangles.iter().map(distance).fold(f64::INFINITY, f64::min) < (corner - point).norm() + 0.5 * rounding
    })
}

/// A triangle, a disc of triangles with it, and a cube.
struct Case {
    triangle: ApproxTriangle,
    disc: BoundingDisc,
    center: Vector3<f64>,
    half_side: f64,
    rounding: f32,
}

const KINDS: usize = 2;

impl Case {
    /// Does the cull keep the triangle (kind 0) or the disc (kind 1) against a point of the mesh?
    fn keeps(&self, kind: usize, point: Vector3<f64>) -> bool {
        let [centers, points] = [self.center, point].map(|at| [0, 1, 2].map(|axis: usize| [at[axis] as f32; LANES]));
        let cull = OctantCull::new(centers, self.half_side as f32, points, self.rounding);
        let keeps_triangle = || cull.keeps_triangle(&self.triangle.corners(), self.triangle.radius_sq());
        let keeps = if kind == 0 { keeps_triangle() } else { cull.keeps_disc(&self.disc) };
        assert!(keeps.iter().all(|one| *one == keeps[0]));
        keeps[0] == 1
    }
}

#[test]
fn nothing_that_is_dropped_is_nearer_to_a_corner_of_a_cube_even_where_it_is_only_just_dropped() {
    let frame = UnitFrame::enclosing(&Aabb { min: [-1.0; 3], max: [1.0; 3] });
    let mut state = 31;
    println!("seed {state}");
    let mut dropped = [0; KINDS];
    for round in 0..40_000 {
        let size = [0.3, 0.05, 0.005, 1e-5][round % 4];
        let half_side = [0.1, 0.02, 0.0, 1e-4][round / 4 % 4];
        let distance = [0.7, 0.1, 1e-3][round / 16 % 3];
        let flatness = [1.0, 0.02][round / 48 % 2];
        let (at, turned) = (random_vector(&mut state) * 0.5, random_vector(&mut state).normalize());
        let mut corner = || {
            let offset = random_vector(&mut state) * size;
            at + offset - turned * (offset.dot(&turned) * (1.0 - flatness))
        };
        let triangles: [[Vector3<f64>; 3]; 4] = std::array::from_fn(|_| std::array::from_fn(|_| corner()));
        let disc = BoundingDisc::enclosing(&triangles, 0, 4, &frame);
        let center = at + random_vector(&mut state) * distance;
        let triangle = ApproxTriangle::new(triangles[0], &frame);
        let case = Case { triangle, disc, center, half_side, rounding: UnitFrame::rounding(1.0) };
        // A point moves from the disc's center toward the cube, until the cull only just drops the triangles.
        let start = triangles[case.disc.slot as usize][0];
        let axis = Vector3::from_fn(|axis, _| if axis == round % 3 { 1.0 } else { 0.0 });
        let direction = (random_vector(&mut state) * [1.0, 0.1][round / 96 % 2] + axis).normalize();
        let direction = direction * (center - start).dot(&direction).signum();
        let path = (center - start).dot(&direction) - half_side * direction.abs().sum();
        for kind in 0..KINDS {
            if path <= 0.0 || case.keeps(kind, start + direction * path) {
                continue;
            }
            let [mut kept_at, mut dropped_at] = [0.0, path];
            for _ in 0..20 {
                let middle = 0.5 * (kept_at + dropped_at);
                *(if case.keeps(kind, start + direction * middle) { &mut kept_at } else { &mut dropped_at }) = middle;
            }
            dropped[kind] += 1;
            let (triangles, point) = (&triangles[..[1, 4][kind]], start + direction * dropped_at);
            let is_nearer = is_nearer(triangles, center, half_side, point, f64::from(case.rounding));
            assert!(!is_nearer, "{kind} {triangles:?} {center:?} {half_side} {point:?}");
        }
    }
    assert!(dropped.iter().all(|count| *count > 4000), "{dropped:?}");
}
