//! Answers about fields against those of parry's own shapes, and pairs without a field against plain rapier.

#[allow(dead_code, reason = "each test uses a part of it")]
mod scene;

use parry3d::math::{Pose, Vector};
use parry3d::query::details::ShapeCastOptions;
use parry3d::query::{
    ContactManifold, DefaultQueryDispatcher, NonlinearRigidMotion, PersistentQueryDispatcher, PointQuery,
    QueryDispatcher, Ray, RayCast,
};
use parry3d::shape::{
    Ball, Capsule, Compound, Cuboid, HalfSpace, RoundCuboid, RoundShape, Shape, SharedShape, TriMesh,
};
use rapier3d::prelude::{ColliderBuilder, NarrowPhase, RigidBodyBuilder};
use scene::{World, bake, bumpy_slab, lumpy_ball};
use sdf_core::combine::{Intersection, Offset};
use sdf_core::placed::Similarity;
use sdf_core::{AnyField, shapes};
use sdf_parry::{InvalidShape, SdfDispatcher, SdfShape, Search};
use sdf_procedural::random::{Random, test_seed};

fn dispatcher() -> impl PersistentQueryDispatcher<(), ()> {
    SdfDispatcher::default().chain(DefaultQueryDispatcher)
}

/// Poses about the origin, turned any way.
fn poses(random: &mut Random, reach: f32, count: usize) -> Vec<Pose> {
    let mut vector = |half: f32| {
        let [x, y, z] = random.point_in_cube(f64::from(half));
        Vector::new(x as f32, y as f32, z as f32)
    };
    (0..count).map(|_| Pose::new(vector(reach), vector(3.0))).collect()
}

/// A field, parry's shape of the same body, and shapes to put beside it.
fn pairs() -> (Vec<(SdfShape, SharedShape)>, Vec<SharedShape>) {
    let sdf = |field| SdfShape::new(field).unwrap();
    let bodies = vec![
        (sdf(sdf_core::AnyField::from(shapes::Sphere::new(0.7).unwrap())), SharedShape::ball(0.7)),
        (sdf(shapes::Cuboid::new([0.5, 0.6, 0.7]).unwrap().into()), SharedShape::cuboid(0.5, 0.6, 0.7)),
    ];
    let cube = Cuboid::new(Vector::new(0.3, 0.4, 0.2));
    let (points, faces) = cube.to_trimesh();
    let others = vec![
        SharedShape::ball(0.4),
        SharedShape::capsule_x(0.3, 0.2),
        SharedShape::new(cube),
        SharedShape::convex_hull(&points).unwrap(),
        SharedShape::new(RoundCuboid { inner_shape: cube, border_radius: 0.1 }),
        SharedShape::new(TriMesh::new(points, faces).unwrap()),
        SharedShape::compound(vec![(Pose::translation(0.2, 0.0, 0.1), SharedShape::ball(0.3))]),
    ];
    (bodies, others)
}

#[test]
fn distances_are_those_of_the_same_shapes() {
    let mut random = Random::new(test_seed(11));
    let (bodies, others) = pairs();
    let mut apart = 0;
    for (field, body) in &bodies {
        for other in &others {
            for pose in poses(&mut random, 1.5, 40) {
                let expected = DefaultQueryDispatcher.distance(&pose, &**body, &**other).unwrap().distance;
                let found = dispatcher().distance(&pose, field, &**other).unwrap().distance;
                let flipped = dispatcher().distance(&pose.inverse(), &**other, field).unwrap().distance;
                // The search on a triangle is local.
                let slack = 0.01;
                // parry's own distance of a capsule and of borders is right to less than that, too.
                assert!((found - expected).abs() <= slack, "{found} for {expected}");
                assert!((found - flipped).abs() < 1e-3, "{found} and {flipped} from the other side");
                let touches = dispatcher().intersection_test(&pose, field, &**other).unwrap().intersecting;
                assert!(touches == (expected <= 0.0) || expected.abs() < slack, "{touches}, and {expected} apart");
                apart += usize::from(expected > 0.1);
                if let Some(contact) =
                    dispatcher().contact(&pose, field, &**other, 0.5).unwrap().filter(|_| expected > 0.01)
                {
                    let way = pose.transform_point(contact.point2) - contact.point1;
                    assert!(
                        (way - contact.normal1 * contact.dist).length() < 1e-3 && (contact.dist - found).abs() < 1e-5
                    );
                    assert!((pose.rotation * contact.normal2 + contact.normal1).length() < 1e-4);
                }
            }
        }
    }
    assert!(apart > 100);
}

#[test]
fn rays_and_points_are_answered_as_by_the_same_shapes() {
    let mut random = Random::new(test_seed(12));
    let mut hits = 0;
    for (field, body) in pairs().0 {
        for (from, to) in poses(&mut random, 2.0, 300).into_iter().zip(poses(&mut random, 0.9, 300)) {
            let ray = Ray::new(from.translation, to.translation - from.translation);
            for solid in [true, false] {
                let expected = body.cast_local_ray_and_get_normal(&ray, 5.0, solid);
                let found = field.cast_local_ray_and_get_normal(&ray, 5.0, solid);
                // A ray that grazes may do so by one and not by the other.
                let Some((expected, found)) = expected.zip(found) else {
                    assert!(expected.is_none() == found.is_none() || field.field_graze(&ray), "{expected:?} {found:?}");
                    continue;
                };
                hits += 1;
                assert!((expected.time_of_impact - found.time_of_impact).abs() < 1e-3, "{expected:?} {found:?}");
            }
            let (near, exact) =
                (field.project_local_point(from.translation, false), body.project_local_point(from.translation, false));
            assert_eq!(near.is_inside, exact.is_inside);
            assert!((near.point - exact.point).length() < 1e-3, "{near:?} {exact:?}");
        }
    }
    assert!(hits > 300);
}

trait Graze {
    fn field_graze(&self, ray: &Ray) -> bool;
}

impl Graze for SdfShape {
    /// Does the ray come within a thousandth of the surface without more?
    fn field_graze(&self, ray: &Ray) -> bool {
        let distances = (0..5000).map(|k| self.distance_to_local_point(ray.point_at(k as f32 * 1e-3), false));
        distances.fold(f32::INFINITY, f32::min).abs() < 1e-2
    }
}

#[test]
fn a_moving_shape_arrives_when_it_touches() {
    let mut random = Random::new(test_seed(13));
    let (bodies, others) = pairs();
    let mut hits = 0;
    for (field, body) in &bodies {
        // Ball and cuboid, for which parry's own casts are exact.
        for other in [&others[0], &others[2]] {
            for pose in poses(&mut random, 2.5, 30) {
                let velocity = -pose.translation;
                let options =
                    ShapeCastOptions { stop_at_penetration: true, ..ShapeCastOptions::with_max_time_of_impact(2.0) };
                let expected = DefaultQueryDispatcher.cast_shapes(&pose, velocity, &**body, &**other, options).unwrap();
                let found = dispatcher().cast_shapes(&pose, velocity, field, &**other, options).unwrap();
                let flipped = dispatcher().cast_shapes(
                    &pose.inverse(),
                    pose.rotation.inverse() * -velocity,
                    &**other,
                    field,
                    options,
                );
                let (Some(expected), Some(found), Some(flipped)) = (expected, found, flipped.unwrap()) else {
                    panic!("a shape that moves to the middle arrives");
                };
                let [exact, times @ ..] = [expected, found, flipped].map(|hit| hit.time_of_impact);
                assert!(times.iter().all(|time| (time - exact).abs() < 5e-3), "{exact} {times:?}");
                let (still, turn) = (NonlinearRigidMotion::identity(), Vector::new(2.0, -1.0, 3.0));
                let moving = NonlinearRigidMotion::new(pose, Vector::ZERO, velocity, turn);
                let turned =
                    dispatcher().cast_shapes_nonlinear(&still, field, &moving, &**other, 0.0, 2.0, true).unwrap();
                let turned = turned.expect("it arrives, turning").time_of_impact;
                // Nothing touches before, and something does then.
                let at = |time: f32| {
                    DefaultQueryDispatcher.distance(&moving.position_at_time(time), &**body, &**other).unwrap().distance
                };
                assert!(
                    (0..98).all(|k| turned == 0.0 || at(turned * k as f32 / 100.0) > 0.0) && at(turned) < 0.01,
                    "{turned}: {}",
                    at(turned)
                );
                hits += 1;
            }
        }
    }
    assert!(hits == 120);
}

#[test]
fn mass_is_that_of_the_same_shape() {
    for (field, body) in pairs().0 {
        let (found, expected) = (field.mass_properties(3.0), body.mass_properties(3.0));
        assert!((found.mass() / expected.mass() - 1.0).abs() < 5e-3, "{} for {}", found.mass(), expected.mass());
        assert!(found.local_com.length() < 1e-3);
        let (mut a, mut b) = (found.principal_inertia().to_array(), expected.principal_inertia().to_array());
        a.sort_by(f32::total_cmp);
        b.sort_by(f32::total_cmp);
        assert!(a.iter().zip(b).all(|(a, b)| (a / b - 1.0).abs() < 0.01), "{a:?} {b:?}");
    }
}

#[test]
fn what_cannot_be_a_collider_is_refused() {
    assert_eq!(
        SdfShape::new(shapes::HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap()).err(),
        Some(InvalidShape::Unbounded)
    );
    let ball = SdfShape::new(shapes::Sphere::new(1.0).unwrap()).unwrap();
    assert_eq!(ball.clone().with_mesh(&[[0.0; 3]], &[[0, 0, 1]]).err(), Some(InvalidShape::VertexOutOfRange));
    assert_eq!(ball.clone().with_mesh(&[[0.0; 3]], &[]).err(), Some(InvalidShape::NoFaces));
    let nan = [[0.0; 3], [f64::NAN, 1.0, 0.0], [1.0; 3]];
    assert_eq!(ball.clone().with_mesh(&nan, &[[0, 1, 2]]).err(), Some(InvalidShape::VertexNotFinite));
    // A ball that is shrunk to nothing, and what two balls that are apart have in common.
    let small = || AnyField::from(shapes::Sphere::new(0.5).unwrap());
    let apart = small().placed(Similarity::new([3.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], 1.0).unwrap());
    let empty = [
        AnyField::Offset(Box::new(Offset::new(small(), -0.7).unwrap())),
        AnyField::Intersection(Box::new(Intersection(small(), apart))),
    ];
    assert!(empty.into_iter().all(|field| SdfShape::new(field).err() == Some(InvalidShape::Unbounded)));
    assert!(SdfShape::new(AnyField::Offset(Box::new(Offset::new(small(), -0.49).unwrap()))).is_ok());
    // Two fields without a mesh, and a plane without one.
    assert!(dispatcher().distance(&Pose::identity(), &ball, &ball).is_err());
    assert!(dispatcher().distance(&Pose::identity(), &ball, &HalfSpace::new(Vector::Z)).is_err());
    let nan = Pose::translation(f32::NAN, 0.0, 0.0);
    assert!(dispatcher().contact(&nan, &ball, &Ball::new(1.0), 0.1).unwrap().is_none());
}

/// Impulses go on from step to step: a point that moves a little keeps its data.
#[test]
fn points_keep_their_data_while_a_box_slides() {
    let ground = SdfShape::new(bake(&bumpy_slab(), 0.1)).unwrap();
    let dispatcher = SdfDispatcher::default();
    let cuboid = Cuboid::new(Vector::splat(0.5));
    for flipped in [false, true] {
        let (mut manifolds, mut workspace): (Vec<ContactManifold<(), u32>>, _) = (vec![], None);
        let mut kept = 0;
        let mut total = 0;
        for step in 0..20 {
            let pose = Pose::translation(0.002 * step as f32, 0.0, 0.56);
            let (g1, g2, pos12): (&dyn Shape, &dyn Shape, Pose) =
                if flipped { (&cuboid, &ground, pose.inverse()) } else { (&ground, &cuboid, pose) };
            dispatcher.contact_manifolds(&pos12, g1, g2, 0.05, &mut manifolds, &mut workspace).unwrap();
            assert!(!manifolds.is_empty() && manifolds.iter().all(|manifold| (1..=4).contains(&manifold.points.len())));
            for manifold in &mut manifolds {
                assert!((pos12.rotation * manifold.local_n2 + manifold.local_n1).length() < 1e-5);
                for point in &mut manifold.points {
                    let way = pos12.transform_point(point.local_p2) - point.local_p1;
                    assert!((way.dot(manifold.local_n1) - point.dist).abs() < 5e-3);
                    total += u32::from(step > 0);
                    kept += u32::from(point.data > 0);
                    point.data += 1;
                }
            }
        }
        assert!(total > 40 && kept * 10 >= total * 8, "{kept} of {total} points kept their data");
    }
}

/// The dispatcher leaves all other pairs to parry: the same bits, step by step.
#[test]
fn pairs_without_a_field_move_as_in_plain_rapier() {
    let run = |narrow: NarrowPhase| {
        let mut world = World::new(narrow);
        world.colliders.insert(ColliderBuilder::cuboid(5.0, 5.0, 0.5));
        world.colliders.insert(
            ColliderBuilder::trimesh(
                vec![Vector::new(-3.0, -3.0, 0.5), Vector::new(3.0, -3.0, 0.5), Vector::new(0.0, 3.0, 1.5)],
                vec![[0, 1, 2]],
            )
            .unwrap(),
        );
        let shapes = [
            SharedShape::ball(0.4),
            SharedShape::cuboid(0.4, 0.3, 0.2),
            SharedShape::capsule_y(0.3, 0.2),
            SharedShape::new(lumpy_ball()),
        ];
        let bodies: Vec<_> = (0..12_u8)
            .map(|k| {
                let at =
                    Vector::new(0.9 * f32::from(k % 3) - 1.0, 0.8 * f32::from(k % 2), 2.0 + 0.9 * f32::from(k / 2));
                let body = world.bodies.insert(RigidBodyBuilder::dynamic().translation(at));
                world.colliders.insert_with_parent(
                    ColliderBuilder::new(shapes[usize::from(k % 4)].clone()),
                    body,
                    &mut world.bodies,
                );
                body
            })
            .collect();
        let mut poses = vec![];
        for _ in 0..240 {
            world.step();
            poses.extend(bodies.iter().map(|body| {
                let pose = world.body(*body).position();
                (pose.translation.to_array().map(f32::to_bits), pose.rotation.to_array().map(f32::to_bits))
            }));
        }
        poses
    };
    let plain = run(NarrowPhase::new());
    assert!(plain == run(NarrowPhase::with_query_dispatcher(SdfDispatcher::default().chain(DefaultQueryDispatcher))));
}

/// A field can be the body that moves, on anything: with its mesh also on a plane and on another field.
#[test]
fn a_field_rests_on_a_plane_a_box_and_another_field() {
    let (points, faces) = Cuboid::new(Vector::splat(0.5)).to_trimesh();
    let points: Vec<[f64; 3]> = points.iter().map(|p| p.to_array().map(f64::from)).collect();
    let cube =
        || SdfShape::new(bake(&(points.clone(), faces.clone()), 0.05)).unwrap().with_mesh(&points, &faces).unwrap();
    let slab = SdfShape::new(shapes::Cuboid::new([3.0, 3.0, 0.5]).unwrap()).unwrap();
    let grounds = [
        (SharedShape::new(HalfSpace::new(Vector::Z)), 0.0),
        (SharedShape::cuboid(3.0, 3.0, 0.5), -0.5),
        (SharedShape::new(slab), -0.5),
    ];
    for (ground, height) in grounds {
        let mut world = World::with_fields(Search::Local);
        world.colliders.insert(ColliderBuilder::new(ground.clone()).translation(Vector::new(0.0, 0.0, height)));
        let body = world.add(SharedShape::new(cube()), Vector::new(0.1, 0.0, 0.8), Vector::new(0.1, 0.2, 0.0));
        (0..600).for_each(|_| world.step());
        let body = world.body(body);
        let (z, speed) = (body.translation().z, body.linvel().length());
        assert!((z - 0.5).abs() < 0.01 && speed < 1e-3, "{:?}: at {z}, {speed} fast", ground.shape_type());
        assert!((body.mass() - 1.0).abs() < 0.02);
    }
}

/// A bullet does not pass a thin wall that is a field.
#[test]
fn a_fast_ball_does_not_tunnel() {
    let mut world = World::with_fields(Search::Local);
    world.add_ground(shapes::Cuboid::new([0.05, 2.0, 2.0]).unwrap().into());
    let bullet =
        RigidBodyBuilder::dynamic().translation(Vector::new(-3.0, 0.0, 0.0)).linvel(Vector::new(200.0, 0.0, 0.0));
    let bullet = world.bodies.insert(bullet.ccd_enabled(true));
    world.colliders.insert_with_parent(ColliderBuilder::ball(0.1), bullet, &mut world.bodies);
    (0..30).for_each(|_| world.step());
    assert!(world.body(bullet).translation().x < 0.0, "{}", world.body(bullet).translation().x);
}

#[test]
fn a_capsule_and_its_compound_are_one() {
    let ground = SdfShape::new(shapes::Torus::new(1.0, 0.3).unwrap()).unwrap();
    let capsule = Capsule::new(Vector::new(-0.3, 0.0, 0.0), Vector::new(0.3, 0.1, 0.0), 0.2);
    let shifted = Pose::new(Vector::new(0.2, -0.1, 0.3), Vector::new(0.3, 0.5, -0.2));
    let compound = Compound::new(vec![(shifted, SharedShape::new(capsule))]);
    let round: RoundShape<Cuboid> = RoundShape { inner_shape: Cuboid::new(Vector::splat(0.2)), border_radius: 0.05 };
    let mut random = Random::new(test_seed(14));
    for pose in poses(&mut random, 1.5, 50) {
        let direct = dispatcher().distance(&(pose * shifted), &ground, &capsule).unwrap().distance;
        let nested = dispatcher().distance(&pose, &ground, &compound).unwrap().distance;
        assert!((direct - nested).abs() < 1e-3, "{direct} and {nested}");
        let sharp = dispatcher().distance(&pose, &ground, &round.inner_shape).unwrap().distance;
        let bordered = dispatcher().distance(&pose, &ground, &round).unwrap().distance;
        assert!(sharp < 0.05 || (sharp - bordered - 0.05).abs() < 1e-3, "{sharp} and {bordered}");
    }
}
