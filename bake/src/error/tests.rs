//! Error bounds of cells: gradients within the cones of candidates, missing candidates, remote coordinates.

use super::*;
use crate::TriangleMesh;
use crate::error::normal_cones::tests::may_contain;
use crate::testing::{random, random_vector};

/// Two pyramids base to base.
fn bipyramid(sides: u32, top: f64, bottom: f64) -> TriangleMesh {
    let mut points = vec![[0.1, 0.0, top], [0.0, 0.05, -bottom]];
    let mut triangles = vec![];
    for side in 0..sides {
        let angle = std::f64::consts::TAU * f64::from(side) / f64::from(sides);
        points.push([angle.cos(), angle.sin(), 0.0]);
        let [here, next] = [side + 2, (side + 1) % sides + 2];
        triangles.extend([[0, here, next], [1, next, here]]);
    }
    TriangleMesh::new(&points, &triangles).unwrap()
}

#[test]
fn the_gradient_at_a_point_of_a_block_lies_in_the_cone_of_the_candidates_around_one_corner() {
    let mut state = 9;
    for (sides, top, bottom) in [(3, 1.0, 0.5), (4, 0.05, 0.05), (5, 2.0, -0.2), (9, 0.1, -0.05), (40, 0.7, 0.2)] {
        let mesh = bipyramid(sides, top, bottom);
        let distance = MeshDistance::new(&mesh, None);
        assert!(distance.solid_normals().is_some());
        for _ in 0..300 {
            let center = random_vector(&mut state) * 1.3;
            let block = ErrorBlock { center, half_side: 0.3 * random(&mut state).abs() };
            let nearest = distance.nearest(center, 0);
            let mut errors = BrickErrors::new(&distance, block, block.half_side, nearest.distance);
            let query = Query { block, distance: nearest.distance, slot: nearest.guess };
            let bounded = errors.bound_blocks(&[query]);
            let candidates = errors.candidates(&bounded[0]);
            let cones = distance.normals_by_corner(candidates);
            for _ in 0..10 {
                let point = center + random_vector(&mut state) * block.half_side;
                let nearest = distance.tree().nearest(point, 0);
                assert!(candidates.iter().any(|slot| *slot as usize == nearest.slot), "{point} of {block:?}");
                let outward = if distance.nearest(point, 0).is_inside { -1.0 } else { 1.0 };
                let Some(direction) = (point - nearest.on_triangle.point).try_normalize(1e-9) else { continue };
                let is_in_a_cone = cones.iter().any(|cone| may_contain(cone, direction * outward, &mut state));
                assert!(is_in_a_cone, "no corner's cone holds the gradient {direction} at {point}");
            }
        }
    }
}

#[test]
fn without_candidates_the_error_bound_is_that_of_any_distance() {
    let mesh = bipyramid(5, 1.0, 0.5);
    let distance = MeshDistance::new(&mesh, None);
    let block = ErrorBlock { center: Vector3::zeros(), half_side: 0.1 };
    let mut errors = BrickErrors::new(&distance, block, block.half_side, 1.0);
    let none = BoundedBlock { block, candidates: 0..0, error_bound: MAX_ERROR };
    assert_eq!(errors.block_error(&none), MAX_ERROR);
    assert_eq!(errors.cell_error(&none, 1.0, 0.0), MAX_ERROR);
}

#[test]
fn a_cell_around_a_corner_has_as_large_an_error_bound_far_from_the_origin_as_near_it() {
    let mut state = 21;
    println!("seed {state}");
    let points = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Vector3::from);
    for far in [0.0, 1e6, 1e8, 1e9] {
        let points = points.map(|point| <[f64; 3]>::from(point + Vector3::new(far, 0.7 * far, -0.3 * far)));
        let mesh = TriangleMesh::new(&points, &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).unwrap();
        let distance = MeshDistance::new(&mesh, None);
        for _ in 0..300 {
            let half_side = 0.004 + 0.004 * random(&mut state).abs();
            // The corner of three right angles is the middle of the last cell, the only one in the band.
            let rounding = random_vector(&mut state) * (4e-16 * far);
            let center = Vector3::from(points[0]).add_scalar(-0.5 * half_side) + rounding;
            let block = ErrorBlock { center, half_side };
            let nearest = distance.nearest(block.center, 0);
            let mut errors = BrickErrors::new(&distance, block, half_side, nearest.distance);
            let query = Query { block, distance: nearest.distance, slot: nearest.guess };
            let bounded = errors.bound_blocks(&[query]);
            let error = errors.cell_error(&bounded[0], 0.05 * half_side, 0.0);
            assert!(error > 0.6, "{error} at {far}");
        }
    }
}
