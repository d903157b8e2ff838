//! Nearest points, tests of intersection and casts of fields against parry's own shapes and meshes.

#[allow(dead_code, reason = "each test uses a part of it")]
mod scene;

use parry3d::math::{Pose, Vector};
use parry3d::query::details::ShapeCastOptions;
use parry3d::query::{
    ClosestPoints, ContactManifold, DefaultQueryDispatcher, NonlinearRigidMotion, PersistentQueryDispatcher,
    PointQuery, QueryDispatcher, ShapeCastStatus,
};
use parry3d::shape::{Ball, Cuboid, HeightField, Shape, SharedShape, TriMesh, TriMeshFlags};
use parry3d::utils::Array2;
use scene::{Mesh, bake, lumpy_ball};
use sdf_bake::{MeshDistance, TriangleMesh, lattice_around, sparse};
use sdf_core::placed::Similarity;
use sdf_core::{AnyField, shapes};
use sdf_parry::{SdfDispatcher, SdfShape, Search};
use sdf_procedural::random::{Random, test_seed};

/// Side of a grid's cells.
const SPACING: f64 = 0.04;

fn dispatcher() -> impl QueryDispatcher {
    SdfDispatcher::default().chain(DefaultQueryDispatcher)
}

fn shape(field: impl Into<AnyField>) -> SdfShape {
    SdfShape::new(field).unwrap()
}

fn bake_sparse((points, faces): &Mesh) -> AnyField {
    let mesh = TriangleMesh::new(points, faces).unwrap();
    let lattice = lattice_around(&mesh.bounds(), SPACING, 4).unwrap();
    let (distance, band) = (MeshDistance::new(&mesh, None), 3.0 * SPACING);
    sparse::bake::<u16>(&distance, &lattice, band, &|_| ()).unwrap().into_grid(&lattice, band).grid.into()
}

fn scaled((points, faces): (Vec<Vector>, Vec<[u32; 3]>), scale: Vector) -> Mesh {
    (points.into_iter().map(|point| (point * scale).to_array().map(f64::from)).collect(), faces)
}

/// Fields, the meshes of the same bodies, and how far their surfaces may be from each other.
fn meshed_fields() -> Vec<(&'static str, SdfShape, TriMesh, f32)> {
    let lumpy = lumpy_ball();
    let lumpy = scaled((lumpy.vertices().to_vec(), lumpy.indices().to_vec()), Vector::new(4.0, 1.0, 1.5));
    let plate = scaled(Cuboid::new(Vector::ONE).to_trimesh(), Vector::new(1.0, 0.5, 0.2));
    let round = scaled(Ball::new(1.0).to_trimesh(200, 100), Vector::new(2.0, 0.5, 0.5));
    let ellipsoid = shapes::Ellipsoid::new([2.0, 0.5, 0.5]).unwrap().into();
    // A grid rounds edges off by less than half a cell. The ellipsoid's mesh is inscribed: 2 (1 − cos(π/100)) at the most.
    let (grid_error, facet_error) = (0.5 * SPACING as f32, 1e-3);
    let all = [
        ("a plate in a dense grid", bake(&plate, SPACING), &plate, grid_error),
        ("a plate in a sparse grid", bake_sparse(&plate), &plate, grid_error),
        ("a lumpy body in a dense grid", bake(&lumpy, SPACING), &lumpy, grid_error),
        ("a lumpy body in a sparse grid", bake_sparse(&lumpy), &lumpy, grid_error),
        ("a plate", shapes::Cuboid::new([1.0, 0.5, 0.2]).unwrap().into(), &plate, facet_error),
        ("an ellipsoid", ellipsoid, &round, facet_error),
    ];
    let mesh = |(points, faces): &Mesh| {
        let points = points.iter().map(|point| Vector::from_array(point.map(|x| x as f32))).collect();
        TriMesh::with_flags(points, faces.clone(), TriMeshFlags::ORIENTED).unwrap()
    };
    all.map(|(name, field, source, error)| (name, shape(field), mesh(source), error)).into()
}

#[test]
fn nearest_points_are_those_of_the_mesh() {
    let mut random = Random::new(test_seed(21));
    for (name, field, mesh, error) in meshed_fields() {
        let bounds = mesh.local_aabb();
        let (mut inside, mut far_off, mut count) = (0, 0, 0);
        // Within the body's box, around the grid's, and far outside.
        for reach in [1.0, 1.2, 1.5, 5.0] {
            for _ in 0..1000 {
                let [x, y, z] = random.point_in_cube(reach).map(|x| x as f32);
                let point = bounds.center() + bounds.half_extents() * Vector::new(x, y, z);
                let [found, exact] =
                    [field.distance_to_local_point(point, false), mesh.distance_to_local_point(point, false)];
                if exact.abs() <= error {
                    continue;
                }
                assert_eq!(found < 0.0, exact < 0.0, "{name}: the side of {point}");
                let on_surface = mesh.distance_to_local_point(field.project_local_point(point, false).point, false);
                assert!(on_surface.abs() <= error, "{name}: {point} goes {on_surface} beside the surface");
                let (found, exact) = (found.abs(), exact.abs());
                // What is on the surface is no nearer than the nearest point; and of several points to which the way is a right angle,
                // a search finds one of the nearer.
                assert!(
                    found >= exact - error && found <= 1.5 * exact + error,
                    "{name}: {found} for {exact} at {point}"
                );
                far_off += u32::from(found > 1.05 * exact + error);
                inside += u32::from(field.contains_local_point(point));
                count += 1;
            }
        }
        assert!(inside > 400 && count > 3000);
        assert!(far_off * 100 <= count, "{name}: {far_off} of {count} distances are off by more than 5 %");
    }
}

/// The middle of a hoop's box is no point of the hoop.
#[test]
fn a_ball_in_the_hole_of_a_torus_does_not_touch_it() {
    let torus = shape(shapes::Torus::new(1.0, 0.25).unwrap());
    for radius in [0.3, 0.6] {
        let ball = Ball::new(radius);
        let pose = Pose::IDENTITY;
        assert!(!dispatcher().intersection_test(&pose, &torus, &ball).unwrap().intersecting);
        assert!(!dispatcher().intersection_test(&pose, &ball, &torus).unwrap().intersecting);
        let distance = dispatcher().distance(&pose, &torus, &ball).unwrap().distance;
        // The search along a ball ends within a millionth of its radius; f32.
        assert!((distance - (0.75 - radius)).abs() < 1e-4, "{distance}");
    }
}

#[test]
fn a_field_inside_of_a_solid_intersects_it() {
    let small = [
        (shape(shapes::Sphere::new(0.1).unwrap()), SharedShape::ball(0.1)),
        (shape(shapes::Cuboid::new([0.1, 0.2, 0.1]).unwrap()), SharedShape::cuboid(0.1, 0.2, 0.1)),
    ];
    let cuboid = SharedShape::cuboid(1.0, 1.5, 2.0);
    let pose = Pose::from_translation(Vector::new(0.2, 0.1, 0.3));
    for (field, body) in small {
        for flipped in [false, true] {
            let order = |body: &dyn Shape, answer: &dyn Fn(&Pose, &dyn Shape, &dyn Shape)| {
                if flipped { answer(&pose.inverse(), &*cuboid, body) } else { answer(&pose, body, &*cuboid) }
            };
            let exact = std::cell::Cell::new(0.0);
            order(&*body, &|pose, a, b| {
                exact.set(DefaultQueryDispatcher.contact(pose, a, b, 0.0).unwrap().unwrap().dist);
            });
            order(&field, &|pose, a, b| {
                assert!(dispatcher().intersection_test(pose, a, b).unwrap().intersecting);
                assert_eq!(dispatcher().distance(pose, a, b).unwrap().distance, 0.0);
                assert_eq!(dispatcher().closest_points(pose, a, b, 5.0).unwrap(), ClosestPoints::Intersecting);
                let contact = dispatcher().contact(pose, a, b, 0.0).unwrap().expect("they intersect");
                assert!((contact.dist - exact.get()).abs() < 1e-3, "{} for {}", contact.dist, exact.get());
                let way = pose.transform_point(contact.point2) - contact.point1;
                assert!((way - contact.normal1 * contact.dist).length() < 1e-4);
                assert!((pose.rotation * contact.normal2 + contact.normal1).length() < 1e-4);
                // Moved as far as it says, they touch no more.
                let apart = Pose::from_translation(contact.normal1 * (1e-2 - contact.dist)) * *pose;
                assert!(!dispatcher().intersection_test(&apart, a, b).unwrap().intersecting);
            });
        }
    }
}

/// A union is inside as soon as one of its parts is, whichever comes first.
#[test]
fn any_part_of_a_union_inside_of_a_solid_intersects_it() {
    let ball = |x: f64| {
        let place = Similarity::new([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], 1.0).unwrap();
        AnyField::from(shapes::Sphere::new(0.1).unwrap()).placed(place)
    };
    let cuboid = SharedShape::cuboid(1.0, 1.0, 1.0);
    for (first, around) in [-2.5, 2.5].into_iter().flat_map(|first| [(first, -2.5_f32), (first, 2.5)]) {
        let union = shape(AnyField::union(vec![ball(first), ball(-first)]).unwrap());
        let pose = Pose::from_translation(Vector::new(around, 0.1, 0.0));
        let context = format!("{first} first, around {around}");
        assert!(dispatcher().intersection_test(&pose, &union, &*cuboid).unwrap().intersecting, "{context}");
        let contact = dispatcher().contact(&pose, &union, &*cuboid, 0.0).unwrap().expect(&context);
        // Out by the nearest side: 1 − 0.1 and the radius.
        assert!((contact.dist + 1.0).abs() < 1e-3, "{context}: {contact:?}");
        let apart = Pose::from_translation(contact.normal1 * (1e-2 - contact.dist)) * pose;
        assert!(!dispatcher().intersection_test(&apart, &union, &*cuboid).unwrap().intersecting, "{context}");
    }
}

/// parry has no distance for points on the axis of a round cylinder.
#[test]
fn a_field_on_the_axis_of_a_round_solid_intersects_it() {
    let field = shape(shapes::Sphere::new(0.05).unwrap());
    let solids = [
        SharedShape::round_cylinder(0.97, 0.478, 0.0264),
        SharedShape::round_cone(0.9, 0.5, 0.05),
        SharedShape::round_cuboid(0.5, 0.6, 0.7, 0.1),
    ];
    for (solid, y) in solids.iter().flat_map(|solid| [0.0, 0.05, -0.1].map(|y| (solid, y))) {
        let pose = Pose::from_translation(Vector::new(0.0, y, 0.0));
        let context = format!("{:?} at {y}", solid.shape_type());
        assert!(dispatcher().intersection_test(&pose, &field, &**solid).unwrap().intersecting, "{context}");
        assert_eq!(dispatcher().distance(&pose, &field, &**solid).unwrap().distance, 0.0, "{context}");
    }
}

/// A ball or a capsule around a field is left by the shorter way, and a solver and a cast hear of it.
#[test]
fn a_field_inside_of_any_solid_has_a_way_out() {
    let fields = [shape(shapes::Sphere::new(0.2).unwrap()), shape(shapes::Cuboid::new([0.1, 0.15, 0.2]).unwrap())];
    let solids = [
        SharedShape::ball(2.0),
        SharedShape::capsule(Vector::new(-1.0, 0.0, 0.0), Vector::new(1.0, 0.0, 0.0), 2.0),
        SharedShape::cuboid(2.0, 2.5, 3.0),
        SharedShape::round_cuboid(1.8, 2.0, 2.5, 0.2),
    ];
    let searches = [Search::Local, Search::Certified];
    for (field, solid) in fields.iter().flat_map(|field| solids.iter().map(move |solid| (field, &**solid))) {
        for ((x, search), flipped) in [0.0, 0.3, 1.0, 1.6]
            .into_iter()
            .flat_map(|x| searches.map(|search| (x, search)))
            .zip([false, true].into_iter().cycle())
        {
            let dispatcher = SdfDispatcher { search }.chain(DefaultQueryDispatcher);
            let pose = Pose::from_translation(Vector::new(0.01, x, 0.02));
            let context = format!("{:?} {search:?} at {x}", solid.shape_type());
            let (pose, a, b): (Pose, &dyn Shape, &dyn Shape) =
                if flipped { (pose.inverse(), solid, field) } else { (pose, field, solid) };
            assert!(dispatcher.intersection_test(&pose, a, b).unwrap().intersecting, "{context}");
            assert_eq!(dispatcher.distance(&pose, a, b).unwrap().distance, 0.0, "{context}");
            assert_eq!(dispatcher.closest_points(&pose, a, b, 0.5).unwrap(), ClosestPoints::Intersecting, "{context}");
            let contact = dispatcher.contact(&pose, a, b, 0.0).unwrap().expect(&context);
            assert!(contact.dist < 0.0, "{context}: {contact:?}");
            let apart = Pose::from_translation(contact.normal1 * (1e-2 - contact.dist)) * pose;
            assert!(!dispatcher.intersection_test(&apart, a, b).unwrap().intersecting, "{context}: {contact:?}");
            let mut manifolds: Vec<ContactManifold<(), ()>> = vec![];
            dispatcher.contact_manifolds(&pose, a, b, 0.01, &mut manifolds, &mut None).unwrap();
            let deepest = manifolds.iter().flat_map(|manifold| &manifold.points).map(|point| point.dist);
            assert!((deepest.fold(0.0, f32::min) - contact.dist).abs() < 1e-3, "{context}: {contact:?}");
            let options = ShapeCastOptions::with_max_time_of_impact(1.0);
            let hit = dispatcher.cast_shapes(&pose, Vector::X, a, b, options).unwrap().expect(&context);
            assert_eq!(hit.status, ShapeCastStatus::PenetratingOrWithinTargetDist, "{context}");
        }
    }
}

/// Only triangles that can be nearest are looked at: the same distance as to all of them.
#[test]
fn distances_to_many_triangles_are_exact() {
    const SIDE: usize = 200;
    let height = |i: usize, j: usize| 0.3 * (0.5 * i as f32).sin() * (0.3 * j as f32).cos();
    let heights = (0..SIDE * SIDE).map(|index| height(index % SIDE, index / SIDE)).collect();
    let ground = HeightField::new(Array2::new(SIDE, SIDE, heights), Vector::new(40.0, 1.0, 40.0));
    let (points, faces) = ground.to_trimesh();
    let mesh = TriMesh::new(points, faces).unwrap();
    let ball = shape(shapes::Sphere::new(0.2).unwrap());
    let bar = shape(shapes::Capsule::new([-3.0, 0.0, 0.0], [3.0, 0.0, 0.0], 0.2).unwrap());
    let mut random = Random::new(test_seed(41));
    for _ in 0..60 {
        let [x, y, z] = random.point_in_cube(1.0).map(|x| x as f32);
        // Over the ground, and beside it.
        let at = Vector::new(30.0 * x, 2.0 + 1.5 * y, 30.0 * z);
        let pose = Pose::from_translation(at);
        let exact = mesh.distance_to_local_point(at, false) - 0.2;
        for ground in [&ground as &dyn Shape, &mesh] {
            let found = dispatcher().distance(&pose, ground, &ball).unwrap().distance;
            assert!((found - exact).abs() < 1e-4, "{found} for {exact} at {at}");
            let contact = dispatcher().contact(&pose.inverse(), &ball, ground, 50.0).unwrap().unwrap();
            assert!((contact.dist - exact).abs() < 1e-4, "{} for {exact} at {at}", contact.dist);
        }
        // Of a long one, whose middle is not what is nearest: by points all along its axis.
        let axis = (0..=600).map(|step| at + Vector::new(0.01 * step as f32 - 3.0, 0.0, 0.0));
        let exact = axis.map(|point| mesh.distance_to_local_point(point, false)).fold(f32::INFINITY, f32::min) - 0.2;
        let found = dispatcher().distance(&pose, &mesh, &bar).unwrap().distance;
        assert!(found < exact.max(0.0) + 1e-4 && found > exact - 0.01, "{found} for {exact} at {at}");
    }
}

/// How far a mesh is from the origin of its own frame says nothing of its size.
#[test]
fn a_mesh_far_from_its_origin_arrives_in_time() {
    let ground = shape(shapes::Cuboid::new([2.0, 2.0, 0.5]).unwrap());
    for offset in [0.0, 1000.0, 10_000.0] {
        let (points, faces) = Cuboid::new(Vector::splat(0.5)).to_trimesh();
        let points = points.into_iter().map(|point| point + Vector::new(offset, 0.0, 0.0)).collect();
        let cube = TriMesh::new(points, faces).unwrap();
        let pose = Pose::from_translation(Vector::new(-1.0 - offset, 0.0, 5.0));
        let options = ShapeCastOptions::with_max_time_of_impact(10.0);
        // Aslant, so that the last steps are short.
        let velocity = Vector::new(0.5, 0.0, -1.0);
        let hit = dispatcher().cast_shapes(&pose, velocity, &ground, &cube, options).unwrap().expect("it falls");
        // A cast ends within a ten-thousandth of the cube's size.
        assert!((hit.time_of_impact - 4.0).abs() < 1e-3, "{} at {offset}", hit.time_of_impact);
    }
}

/// A cast that starts late finds the bodies where they are then, not where they were at time zero.
#[test]
fn a_turning_field_meets_what_has_moved_before_the_start() {
    let arm = shape(shapes::Capsule::new([0.0; 3], [200.0, 0.0, 0.0], 0.5).unwrap());
    let turning = NonlinearRigidMotion::new(Pose::IDENTITY, Vector::ZERO, Vector::ZERO, Vector::new(0.0, 0.0, 10.0));
    let moving = NonlinearRigidMotion::new(Pose::IDENTITY, Vector::ZERO, Vector::X, Vector::ZERO);
    let (ball, start) = (Ball::new(0.5), 100.1);
    // At time t the arm's angle is 10 t, and the ball at x = t is t sin(10 t) off its axis: they meet as soon as that is one.
    let is_met = |time: f64| (10.0 * time).cos() > 0.0 && (time * (10.0 * time).sin()).abs() <= 1.0;
    let mut times = (0..700_000).map(|step| f64::from(start) + f64::from(step) * 1e-6);
    let first = times.find(|time| is_met(*time)).expect("a whole turn") as f32;
    let cast = |a: &NonlinearRigidMotion, first: &dyn Shape, b: &NonlinearRigidMotion, second: &dyn Shape| {
        dispatcher().cast_shapes_nonlinear(a, first, b, second, start, start + 0.7, true).unwrap()
    };
    for hit in [cast(&turning, &arm, &moving, &ball), cast(&moving, &ball, &turning, &arm)] {
        let time = hit.expect("the arm hits the ball").time_of_impact;
        // f32 at 100 counts in steps of 8e-6, in which the arm moves by 8e-3.
        assert!((time - first).abs() < 1e-4, "{time} for {first}");
    }
}
