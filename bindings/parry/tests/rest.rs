//! Do bodies rest on a baked grid? Ten seconds to settle, ten seconds watched, and no body sleeps.

#[allow(dead_code, reason = "each test uses a part of it")]
mod scene;

use parry3d::math::Vector;
use scene::{STEPS, bake, bumpy_slab, four_bodies_on, surface_points};
use sdf_bake::{MeshDistance, TriangleMesh};
use sdf_core::Sdf;
use sdf_core::nalgebra::Vector3;
use sdf_parry::Search;

/// Speeds at rest, in units and radians a second.
const STILL: f32 = 1e-3;

/// Farthest way in ten seconds, as a fraction of a body's size: friction without memory creeps.
const DRIFT: f32 = 0.02;

/// Deepest penetration, and largest gap, as a fraction of a body's size.
const DEPTH: f64 = 0.01;

fn to_core(point: Vector) -> Vector3<f64> {
    Vector3::from(point.to_array().map(f64::from))
}

#[test]
fn box_ball_capsule_and_mesh_rest_on_a_baked_grid() {
    let slab = bumpy_slab();
    let ground = bake(&slab, 0.06);
    let mesh = TriangleMesh::new(&slab.0, &slab.1).unwrap();
    let truth = MeshDistance::new(&mesh, None);
    for search in [Search::Local, Search::Certified] {
        let (mut world, bodies) = four_bodies_on(ground.clone(), search);
        let points: Vec<Vec<Vector>> = bodies.iter().map(|(_, _, shape, _)| surface_points(shape)).collect();
        (0..10 * STEPS).for_each(|_| world.step());
        let start: Vec<Vector> = bodies.iter().map(|(.., body)| world.body(*body).translation()).collect();
        let mut speeds = [(0.0_f32, 0.0_f32); 4];
        let mut depths = [f64::INFINITY; 4];
        for step in 0..10 * STEPS {
            world.step();
            for (((.., handle), points), (speed, depth)) in
                bodies.iter().zip(&points).zip(speeds.iter_mut().zip(&mut depths))
            {
                let body = world.body(*handle);
                *speed = (speed.0.max(body.linvel().length()), speed.1.max(body.angvel().length()));
                if step % 30 == 0 {
                    let heights =
                        points.iter().step_by(7).map(|p| ground.value(to_core(body.position().transform_point(*p))));
                    *depth = heights.fold(*depth, f64::min);
                }
            }
        }
        for ((((name, size, _, handle), points), start), (speed, depth)) in
            bodies.iter().zip(&points).zip(start).zip(speeds.iter().zip(depths))
        {
            let body = world.body(*handle);
            let lowest = points.iter().map(|p| body.position().transform_point(*p));
            let lowest = lowest.map(|p| truth.signed_distance(to_core(p).into())).fold(f64::INFINITY, f64::min);
            let drift = (body.translation() - start).length();
            let manifolds =
                world.narrow.contact_pairs_with(world.bodies[*handle].colliders()[0]).map(|pair| pair.manifolds());
            let manifolds: Vec<usize> = manifolds.flatten().map(|manifold| manifold.points.len()).collect();
            println!(
                "{search:?} {name}: {lowest:.5} from the mesh, {depth:.5} from the grid, {speed:?} fast, drift {drift:.1e}, {manifolds:?}"
            );
            let limit = DEPTH * f64::from(*size);
            assert!(lowest.abs() <= limit && depth >= -limit, "{name}: penetration or gap {lowest}, {depth}");
            assert!(
                speed.0 <= STILL && speed.1 <= STILL && drift <= DRIFT * size,
                "{name} jitters: {speed:?}, {drift}"
            );
            assert!(
                manifolds.iter().all(|points| (1..=4).contains(points)) && manifolds.len() <= 16,
                "{name}: {manifolds:?}"
            );
        }
    }
}
