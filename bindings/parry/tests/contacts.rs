//! Contacts that parry has for the same bodies: of rounded shapes far beyond a grid, of thin, lying and passing bodies.

#[allow(dead_code, reason = "each test uses a part of it")]
mod scene;

use parry3d::math::{Pose, Vector};
use parry3d::query::details::ShapeCastOptions;
use parry3d::query::{
    ContactManifold, DefaultQueryDispatcher, NonlinearRigidMotion, PersistentQueryDispatcher, QueryDispatcher,
};
use parry3d::shape::{
    Ball, Capsule, Cuboid, Cylinder, RoundCuboid, RoundShape, Shape, SharedShape, TriMesh, TriMeshFlags,
};
use rapier3d::prelude::ColliderBuilder;
use scene::{Mesh, World, bake};
use sdf_bake::{MeshDistance, TriangleMesh, lattice_around, sparse};
use sdf_core::placed::Similarity;
use sdf_core::{AnyField, shapes};
use sdf_parry::{InvalidShape, SdfDispatcher, SdfShape, Search};
use sdf_procedural::random::{Random, test_seed};

const SPACING: f64 = 0.06;

fn dispatcher() -> impl PersistentQueryDispatcher<(), ()> {
    SdfDispatcher::default().chain(DefaultQueryDispatcher)
}

fn shape(field: impl Into<AnyField>) -> SdfShape {
    SdfShape::new(field).unwrap()
}

fn cuboid([x, y, z]: [f64; 3]) -> AnyField {
    shapes::Cuboid::new([x, y, z]).unwrap().into()
}

fn at(x: f32, y: f32, z: f32) -> Pose {
    Pose::from_translation(Vector::new(x, y, z))
}

fn mesh_of(cuboid: &Cuboid) -> Mesh {
    let (points, faces) = cuboid.to_trimesh();
    (points.into_iter().map(|point| point.to_array().map(f64::from)).collect(), faces)
}

/// A slab with its upper side at 0.5, in closed form, in a dense grid with three cells around it, and in a sparse one with a band of three.
fn slabs() -> [(&'static str, SdfShape); 3] {
    let (points, faces) = mesh_of(&Cuboid::new(Vector::new(3.0, 3.0, 0.5)));
    let mesh = TriangleMesh::new(&points, &faces).unwrap();
    let lattice = lattice_around(&mesh.bounds(), SPACING, 3).unwrap();
    let (distance, band) = (MeshDistance::new(&mesh, None), 3.0 * SPACING);
    let sparse = sparse::bake::<u16>(&distance, &lattice, band, &|_| ()).unwrap().into_grid(&lattice, band);
    let dense = bake(&(points.clone(), faces.clone()), SPACING);
    [
        ("closed form", shape(cuboid([3.0, 3.0, 0.5]))),
        ("dense", shape(dense)),
        ("sparse", shape(AnyField::from(sparse.grid))),
    ]
}

#[test]
fn a_rounded_shape_is_as_far_off_as_it_is_however_wide_its_border() {
    for (name, slab) in slabs() {
        for border in [0.05, 0.1, 0.2, 0.3, 0.5, 1.0] {
            let round: RoundCuboid = RoundShape { inner_shape: Cuboid::new(Vector::splat(0.2)), border_radius: border };
            for gap in [-0.04, 0.01, 0.3] {
                let pose = at(0.03, 0.02, 0.5 + 0.2 + border + gap);
                let contact = dispatcher().contact(&pose, &slab, &round, 1.0).unwrap().unwrap();
                // The samples of a sparse grid have 16 bits; the rest is f32.
                assert!((contact.dist - gap).abs() < 1e-4, "{name}, border {border}: {} for {gap}", contact.dist);
                assert!((contact.normal1 - Vector::Z).length() < 1e-3, "{name}, border {border}: {}", contact.normal1);
                let distance = dispatcher().distance(&pose.inverse(), &round, &slab).unwrap().distance;
                assert!((distance - gap.max(0.0)).abs() < 1e-4, "{name}, border {border}: {distance} for {gap}");
                let intersects = dispatcher().intersection_test(&pose, &slab, &round).unwrap().intersecting;
                assert_eq!(intersects, gap < 0.0, "{name}, border {border}, gap {gap}");
            }
        }
    }
}

#[test]
fn distances_beyond_a_grid_are_those_of_its_body() {
    let exact = Cuboid::new(Vector::new(3.0, 3.0, 0.5));
    let mut random = Random::new(test_seed(31));
    for (name, slab) in slabs() {
        for other in [SharedShape::ball(0.3), SharedShape::capsule_x(0.3, 0.2), SharedShape::cuboid(0.3, 0.2, 0.1)] {
            for round in 0..40 {
                let [x, y, z] = random.point_in_cube(1.0).map(|x| x as f32);
                let reach = [1.3, 2.0, 4.0, 8.0][round % 4];
                let pose = Pose::new(Vector::new(3.0 * x, 3.0 * y, z.signum() + z) * reach, Vector::new(y, z, x));
                let truth = DefaultQueryDispatcher.distance(&pose, &exact, &*other).unwrap().distance;
                let found = dispatcher().distance(&pose, &slab, &*other).unwrap().distance;
                // A grid rounds corners off by less than a cell.
                let error = if name == "closed form" { 1e-3 } else { SPACING as f32 };
                assert!((found - truth).abs() < error + 1e-3 * truth, "{name}: {found} for {truth} at {pose:?}");
            }
        }
    }
}

/// Two fields, each of which has a mesh, have one distance in either order.
#[test]
fn the_distance_of_two_fields_is_that_of_the_second_and_the_first() {
    let half = Cuboid::new(Vector::new(0.7, 0.4, 0.9));
    let mesh = mesh_of(&half);
    let grid = shape(bake(&mesh, 0.04)).with_mesh(&mesh.0, &mesh.1).unwrap();
    let (points, faces) = Ball::new(0.5).to_trimesh(48, 24);
    let points: Vec<[f64; 3]> = points.into_iter().map(|point| point.to_array().map(f64::from)).collect();
    let ball = shape(shapes::Sphere::new(0.5).unwrap()).with_mesh(&points, &faces).unwrap();
    let mut random = Random::new(test_seed(32));
    for _ in 0..100 {
        let mut vector = |reach: f64| Vector::from_array(random.point_in_cube(reach).map(|x| x as f32));
        let pose = Pose::new(vector(2.5), vector(3.0));
        let truth = DefaultQueryDispatcher.distance(&pose, &half, &Ball::new(0.5)).unwrap().distance;
        let one = dispatcher().distance(&pose, &grid, &ball).unwrap().distance;
        let other = dispatcher().distance(&pose.inverse(), &ball, &grid).unwrap().distance;
        // Half a cell, and what the ball's mesh is inscribed by.
        assert!((one - truth).abs() < 0.03 && (other - truth).abs() < 0.03, "{one} and {other} for {truth}");
    }
}

#[test]
fn a_shape_that_passes_close_by_a_flat_side_does_not_arrive() {
    let plate = shape(cuboid([10.0, 10.0, 0.5]));
    for other in [SharedShape::ball(0.3), SharedShape::cuboid(0.3, 0.3, 0.3)] {
        for gap in [0.03, 0.01, 0.001] {
            let (pose, velocity) = (at(-9.0, 0.0, 0.8 + gap), Vector::X);
            let options = ShapeCastOptions::with_max_time_of_impact(18.0);
            let hit = dispatcher().cast_shapes(&pose, velocity, &plate, &*other, options).unwrap();
            assert!(hit.is_none(), "{gap}: {hit:?}");
            let still = NonlinearRigidMotion::identity();
            let moving = NonlinearRigidMotion::new(pose, Vector::ZERO, velocity, Vector::ZERO);
            let nonlinear = dispatcher().cast_shapes_nonlinear(&moving, &*other, &still, &plate, 0.0, 18.0, true);
            assert!(nonlinear.unwrap().is_none(), "{gap}");
        }
    }
    let torus = shape(shapes::Torus::new(1.0, 0.25).unwrap());
    let away = dispatcher().cast_shapes(&at(0.0, 0.0, 2.0), Vector::Z, &torus, &Ball::new(0.3), Default::default());
    assert!(away.unwrap().is_none());
}

/// A rounded shape arrives with its border, also where the triangles within are beyond the grid.
#[test]
fn a_rounded_shape_arrives_when_its_border_does() {
    for (name, slab) in slabs() {
        for border in [0.05, 0.3, 1.0] {
            let round: RoundCuboid = RoundShape { inner_shape: Cuboid::new(Vector::splat(0.2)), border_radius: border };
            let start = at(0.03, 0.02, 0.5 + 0.2 + border + 3.0);
            let options = ShapeCastOptions::with_max_time_of_impact(4.0);
            let hit =
                dispatcher().cast_shapes(&start, -Vector::Z, &slab, &round, options).unwrap().expect("it arrives");
            assert!((hit.time_of_impact - 3.0).abs() < 1e-3, "{name}, border {border}: {}", hit.time_of_impact);
        }
    }
}

/// When a turning field meets what comes towards it does not depend on how long one looks.
#[test]
fn a_turning_field_is_met_when_it_is_however_long_one_looks() {
    let field = shape(shapes::Sphere::new(0.5).unwrap());
    let turning = NonlinearRigidMotion::new(Pose::IDENTITY, Vector::ZERO, Vector::ZERO, Vector::new(0.0, 0.0, 2.0));
    let coming = NonlinearRigidMotion::new(at(5.0, 0.0, 0.0), Vector::ZERO, -Vector::X, Vector::ZERO);
    for end in [10.0, 1e3, 1e6, f32::MAX] {
        let ball = Ball::new(0.3);
        let hit = dispatcher().cast_shapes_nonlinear(&turning, &field, &coming, &ball, 0.0, end, true).unwrap();
        let time = hit.expect("they meet").time_of_impact;
        assert!((time - 4.2).abs() < 1e-3, "{time} of {end}");
    }
}

#[test]
fn a_lying_cylinder_rests_on_both_of_its_ends() {
    let slab = shape(cuboid([3.0, 3.0, 0.5]));
    let cylinder = Cylinder::new(0.4, 0.3);
    let mut manifolds: Vec<ContactManifold<(), ()>> = vec![];
    dispatcher().contact_manifolds(&at(0.0, 0.0, 0.79), &slab, &cylinder, 0.02, &mut manifolds, &mut None).unwrap();
    let points = || manifolds.iter().flat_map(|manifold| &manifold.points);
    for end in [-0.4, 0.4] {
        let deepest = points().filter(|point| (point.local_p1.y - end).abs() < 1e-3).map(|point| point.dist);
        let deepest = deepest.fold(f32::INFINITY, f32::min);
        assert!((deepest + 0.01).abs() < 1e-4, "{deepest} at {end}");
    }
}

#[test]
fn the_mass_of_thin_bodies_is_theirs() {
    let mut bodies = vec![];
    for half in [[1.0, 0.005, 0.005], [1.0, 1.0, 0.005], [1.0, 1.0, 0.01], [0.5, 0.02, 1.0]] {
        let solid = SharedShape::new(Cuboid::new(Vector::from_array(half.map(|x| x as f32))));
        bodies.push((cuboid(half), solid, Pose::IDENTITY));
    }
    let turn = [0.3, -0.2, 0.1, 0.9];
    let plate = cuboid([1.0, 1.0, 0.01]).placed(Similarity::new([0.5, 0.0, 0.0], turn, 1.0).unwrap());
    let [x, y, z, w] = turn.map(|x| x as f32);
    let pose = Pose::from_parts(Vector::new(0.5, 0.0, 0.0), parry3d::math::Rotation::from_xyzw(x, y, z, w).normalize());
    bodies.push((plate, SharedShape::cuboid(1.0, 1.0, 0.01), pose));
    let [a, b] = [[-0.6, -0.5, -0.4], [0.6, 0.5, 0.4]];
    let capsule = Capsule::new(Vector::from_array(a), Vector::from_array(b), 0.01);
    let field = shapes::Capsule::new(a.map(f64::from), b.map(f64::from), 0.01).unwrap();
    bodies.push((field.into(), SharedShape::new(capsule), Pose::IDENTITY));
    for (field, solid, pose) in bodies {
        let (found, expected) = (shape(field).mass_properties(1.0), solid.mass_properties(1.0));
        let share = found.mass() / expected.mass();
        assert!((share - 1.0).abs() < 0.05, "{share} of the mass of {:?}", solid.shape_type());
        let center = pose.transform_point(expected.local_com);
        let thin = solid.compute_local_aabb().half_extents().min_element();
        assert!((found.local_com - center).length() < 0.1 * thin, "{} for {center}", found.local_com);
    }
}

/// φ of a box is convex: the search of each triangle ends at its lowest point.
#[test]
fn boxes_that_overlap_do_so_by_either_search() {
    let mut random = Random::new(test_seed(33));
    let (mut overlapping, mut apart) = (0, 0);
    for _ in 0..1500 {
        let mut half = || random.point_in_cube(1.0).map(|x| 0.2 + 0.8 * x.abs());
        let (g, h) = (half(), half());
        let mut vector = |reach: f64| Vector::from_array(random.point_in_cube(reach).map(|x| x as f32));
        let pose = Pose::new(vector(1.5), vector(3.0));
        let [of_g, of_h] = [g, h].map(|half| Cuboid::new(Vector::from_array(half.map(|x| x as f32))));
        let (points, faces) = of_h.to_trimesh();
        let mesh = TriMesh::with_flags(points, faces, TriMeshFlags::ORIENTED).unwrap();
        let truth = DefaultQueryDispatcher.contact(&pose, &of_g, &of_h, 10.0).unwrap().map_or(10.0, |c| c.dist);
        for search in [Search::Local, Search::Certified] {
            let dispatcher = SdfDispatcher { search };
            let intersects = dispatcher.intersection_test(&pose, &shape(cuboid(g)), &mesh).unwrap().intersecting;
            let distance = dispatcher.distance(&pose, &shape(cuboid(g)), &mesh).unwrap().distance;
            if truth < -1e-3 {
                assert!(intersects && distance == 0.0, "{search:?}: {distance} for {truth} at {pose:?}, {g:?}, {h:?}");
                overlapping += 1;
            } else if truth > 1e-3 {
                // A local search may have spent its 32 steps before its condition is met.
                let is_right = !intersects && (distance - truth).abs() < 3.5e-3;
                assert!(is_right, "{search:?}: {distance} for {truth} at {pose:?}, {g:?}, {h:?}");
                apart += 1;
            }
        }
    }
    assert!(overlapping > 300 && apart > 300);
}

#[test]
fn balls_and_capsules_without_a_radius_are_points_and_segments() {
    let slab = shape(cuboid([3.0, 3.0, 0.5]));
    let exact = Cuboid::new(Vector::new(3.0, 3.0, 0.5));
    let segment = Capsule::new(Vector::new(-0.3, 0.0, 0.0), Vector::new(0.3, 0.0, 0.0), 0.0);
    for other in [SharedShape::ball(0.0), SharedShape::new(segment)] {
        for z in [0.49, 0.505, 0.8] {
            let pose = at(0.1, 0.2, z);
            let expected = DefaultQueryDispatcher.contact(&pose, &exact, &*other, 1.0).unwrap().unwrap();
            let contact = dispatcher().contact(&pose, &slab, &*other, 1.0).unwrap().unwrap();
            assert!((contact.dist - expected.dist).abs() < 1e-4, "{} for {}", contact.dist, expected.dist);
            assert!((contact.normal1 - Vector::Z).length() < 1e-3);
            let mut manifolds: Vec<ContactManifold<(), ()>> = vec![];
            dispatcher().contact_manifolds(&pose, &slab, &*other, 0.02, &mut manifolds, &mut None).unwrap();
            let points: Vec<_> = manifolds.iter().flat_map(|manifold| &manifold.points).collect();
            assert!(points.len() <= 2 && points.iter().all(|point| point.local_p1.is_finite()), "{points:?}");
        }
    }
    assert_eq!(SdfShape::new(shapes::Sphere::new(1e39).unwrap()).err(), Some(InvalidShape::TooFar));
    assert!(dispatcher().distance(&at(0.0, 0.0, 1.0), &slab, &Ball::new(f32::INFINITY)).is_err());
}

/// On triangles that are wider than it, with its mesh and without.
#[test]
fn a_field_that_moves_rests_on_wide_triangles() {
    let floor = vec![[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]];
    let floor = floor.into_iter().map(|[x, y]| Vector::new(x, y, 0.5)).collect();
    let grounds =
        [SharedShape::trimesh(floor, vec![[0, 1, 2], [0, 2, 3]]).unwrap(), SharedShape::cuboid(3.0, 3.0, 0.5)];
    for half in [[0.3, 0.3, 0.3], [0.6, 0.4, 0.1]] {
        let (points, faces) = mesh_of(&Cuboid::new(Vector::from_array(half)));
        let field = || shape(cuboid(half.map(f64::from)));
        for body in [field(), field().with_mesh(&points, &faces).unwrap()] {
            for ground in &grounds {
                let mut world = World::with_fields(Search::Local);
                world.colliders.insert(ColliderBuilder::new(ground.clone()).friction(0.8));
                let start = Vector::new(0.1, 0.0, 0.7 + half[2]);
                let body = world.add(SharedShape::new(body.clone()), start, Vector::new(0.1, 0.05, 0.2));
                (0..600).for_each(|_| world.step());
                let mut fastest = 0.0_f32;
                for _ in 0..200 {
                    world.step();
                    fastest = fastest.max(world.body(body).linvel().length());
                }
                let height = world.body(body).translation().z - 0.5 - half[2];
                assert!(height.abs() < 2e-3 && fastest < 0.02, "{half:?}: {height} off, {fastest} fast");
            }
        }
    }
}
