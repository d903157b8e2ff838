//! Casts of shapes that slide along something, of small ones beside large surfaces, and over surfaces of many triangles.

use parry3d::math::{Pose, Vector};
use parry3d::query::details::ShapeCastOptions;
use parry3d::query::{DefaultQueryDispatcher, NonlinearRigidMotion, QueryDispatcher, ShapeCastHit, ShapeCastStatus};
use parry3d::shape::{Ball, HeightField, Shape, SharedShape, TriMesh};
use parry3d::utils::Array2;
use sdf_bake::{MeshDistance, TriangleMesh, dense, lattice_around};
use sdf_core::placed::Similarity;
use sdf_core::{AnyField, shapes};
use sdf_parry::{SdfDispatcher, SdfShape, Search};
use sdf_procedural::random::{Random, test_seed};

fn shape(field: impl Into<AnyField>) -> SdfShape {
    SdfShape::new(field).unwrap()
}

/// A floor whose upper side is z = 0, and a wall whose near side is x = 3: half extents and middles.
const LEVEL: [([f64; 3], [f64; 3]); 2] = [([5.0, 5.0, 0.5], [0.0, 0.0, -0.5]), ([0.5, 5.0, 2.0], [3.5, 0.0, 2.0])];

fn field_level() -> AnyField {
    let part = |(half_extents, middle)| {
        let place = Similarity::new(middle, [0.0, 0.0, 0.0, 1.0], 1.0).unwrap();
        AnyField::from(shapes::Cuboid::new(half_extents).unwrap()).placed(place)
    };
    AnyField::union(LEVEL.map(part).into()).unwrap()
}

fn compound_level() -> SharedShape {
    SharedShape::compound(
        LEVEL
            .map(|(half_extents, middle)| {
                let [[x, y, z], middle] = [half_extents, middle].map(|numbers| numbers.map(|x| x as f32));
                (Pose::from_translation(middle.into()), SharedShape::cuboid(x, y, z))
            })
            .into(),
    )
}

fn meshed_level() -> TriMesh {
    let (mut points, mut faces) = (vec![], vec![]);
    for (pose, part) in compound_level().as_compound().unwrap().shapes() {
        let (more, triangles) = part.as_cuboid().unwrap().to_trimesh();
        let first = points.len() as u32;
        points.extend(more.into_iter().map(|point| pose.transform_point(point)));
        faces.extend(triangles.into_iter().map(|face| face.map(|vertex| vertex + first)));
    }
    TriMesh::new(points, faces).unwrap()
}

/// A voxel of 0.125 has the sides of the level on its nodes: the grid is exact up to edges.
fn baked_level() -> AnyField {
    let level = meshed_level();
    let points: Vec<[f64; 3]> = level.vertices().iter().map(|point| point.to_array().map(f64::from)).collect();
    let mesh = TriangleMesh::new(&points, level.indices()).unwrap();
    let lattice = lattice_around(&mesh.bounds(), 0.125, 3).unwrap();
    dense::bake(&MeshDistance::new(&mesh, None), &lattice, &|_| ()).into_grid(&lattice).grid.into()
}

/// Bodies that reach 0.5 to each side, as a field and as a shape.
fn bodies() -> [(SdfShape, SharedShape); 3] {
    let capsule = AnyField::from(shapes::Capsule::new([0.0, 0.0, -0.2], [0.0, 0.0, 0.2], 0.5).unwrap());
    [
        (shape(shapes::Sphere::new(0.5).unwrap()), SharedShape::ball(0.5)),
        (shape(shapes::Cuboid::new([0.5, 0.5, 0.7]).unwrap()), SharedShape::cuboid(0.5, 0.5, 0.7)),
        (shape(capsule), SharedShape::capsule(Vector::new(0.0, 0.0, -0.2), Vector::new(0.0, 0.0, 0.2), 0.5)),
    ]
}

type Case<'a> = (&'a dyn Shape, &'a dyn Shape);

/// A body that starts at a height over the floor, seen from the level and from the body, by both searches.
fn casts(
    (level, body): Case,
    at: Vector,
    velocity: Vector,
    options: ShapeCastOptions,
    check: impl Fn(Option<ShapeCastHit>),
) {
    let pose = Pose::from_translation(at);
    for search in [Search::Local, Search::Certified] {
        let dispatcher = SdfDispatcher { search }.chain(DefaultQueryDispatcher);
        check(dispatcher.cast_shapes(&pose, velocity, level, body, options).unwrap());
        check(dispatcher.cast_shapes(&pose.inverse(), -velocity, body, level, options).unwrap());
        if options.target_distance == 0.0 {
            let still = NonlinearRigidMotion::identity();
            let moving = NonlinearRigidMotion::new(pose, Vector::ZERO, velocity, Vector::ZERO);
            let (end, stops) = (options.max_time_of_impact, options.stop_at_penetration);
            let hit = dispatcher.cast_shapes_nonlinear(&still, level, &moving, body, 0.0, end, stops);
            check(hit.unwrap());
        }
    }
}

#[test]
fn what_slides_along_a_floor_meets_the_wall() {
    let (compound, mesh) = (compound_level(), meshed_level());
    let fields = [("closed forms", shape(field_level())), ("a grid", shape(baked_level()))];
    for (field, body) in bodies() {
        let half_height = body.compute_local_aabb().half_extents().z;
        let mut cases: Vec<(&str, Case)> =
            fields.iter().map(|(name, level)| (*name, (level as _, &*body as _))).collect();
        cases.extend([("a compound", (&*compound as _, &field as _)), ("a mesh", (&mesh as _, &field as _))]);
        for (name, case) in cases {
            // What is deep in the floor meets the wall as deep.
            for (target, gap) in
                [(0.0, 0.1), (0.0, 1e-3), (0.0, 0.0), (0.0, -0.01), (0.02, 0.02), (0.02, 0.0201), (0.02, 0.01)]
            {
                let at = Vector::new(0.2, 0.1, half_height + gap);
                let options = ShapeCastOptions {
                    max_time_of_impact: 10.0,
                    target_distance: target,
                    stop_at_penetration: false,
                    ..Default::default()
                };
                let context = format!("{name}, {:?}, gap {gap}, target {target}", body.shape_type());
                let time = 3.0 - 0.5 - 0.2 - target;
                let late = (target - gap).max(0.0);
                let sliding = Vector::new(1.0, 0.0, 0.0);
                casts(case, at, sliding, options, |hit| {
                    let hit = hit.unwrap_or_else(|| panic!("{context}: through the wall"));
                    assert_eq!(hit.status, ShapeCastStatus::Converged, "{context}");
                    let off = hit.time_of_impact - time;
                    // In the cells along the edge between floor and wall the interpolant is as much less than the distance.
                    let early = if name == "a grid" { 0.125 } else { 1e-3 };
                    assert!(-early < off && off < late + 1e-3, "{context}: {} for {time}", hit.time_of_impact);
                });
                // Away from wall and floor there is nothing, and into the floor it goes no further.
                casts(case, at, Vector::new(-0.1, 0.0, 1.0), options, |hit| {
                    assert!(hit.is_none(), "{context}: {hit:?}")
                });
                casts(case, at, Vector::new(0.5, 0.0, -1.0), options, |hit| {
                    let hit = hit.unwrap_or_else(|| panic!("{context}: through the floor"));
                    let time = (gap - target).max(0.0);
                    assert!((hit.time_of_impact - time).abs() < 1e-3, "{context}: {} for {time}", hit.time_of_impact);
                });
            }
        }
    }
}

/// Points of a body that turns move, too: a rod that touches a wall along its side turns into it with one end.
#[test]
fn what_turns_into_a_wall_arrives() {
    let rod = shape(shapes::Cuboid::new([1.0, 0.1, 0.1]).unwrap());
    let wall = SharedShape::cuboid(2.0, 0.5, 2.0);
    let (still, pose) = (NonlinearRigidMotion::identity(), Pose::from_translation(Vector::new(0.0, -0.6, 0.0)));
    for turn in [Vector::Z, -Vector::Z] {
        let turning = NonlinearRigidMotion::new(pose, Vector::ZERO, Vector::ZERO, turn);
        let dispatcher = SdfDispatcher::default();
        let hit = dispatcher.cast_shapes_nonlinear(&still, &*wall, &turning, &rod, 0.0, 1.0, false).unwrap();
        let time = hit.expect("it turns into the wall").time_of_impact;
        assert!(time < 1e-3, "{time}");
        // Faster away than the end turns towards it.
        let leaving = NonlinearRigidMotion::new(pose, Vector::ZERO, Vector::new(0.0, -2.0, 0.0), turn);
        let hit = dispatcher.cast_shapes_nonlinear(&still, &*wall, &leaving, &rod, 0.0, 1.0, false).unwrap();
        assert!(hit.is_none(), "{hit:?}");
    }
}

/// How near counts as arrived is a fraction of the smaller body.
#[test]
fn a_small_body_beside_a_large_floor_is_not_at_it() {
    let ball = shape(shapes::Sphere::new(0.05).unwrap());
    for half in [1.0, 100.0, 10_000.0] {
        let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
        let points = corners.map(|[x, y]| Vector::new(x, y, 0.0)).into();
        let floor = TriMesh::new(points, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let case: Case = (&floor, &ball);
        let options = ShapeCastOptions::with_max_time_of_impact(10.0);
        let at = |gap: f32| Vector::new(0.3, 0.1, 0.05 + gap);
        casts(case, at(0.02), Vector::new(0.05, 0.0, 0.0), options, |hit| assert!(hit.is_none(), "{half}: {hit:?}"));
        casts(case, at(1.0), Vector::new(0.0, 0.0, -1.0), options, |hit| {
            let time = hit.expect("it falls").time_of_impact;
            // f32 at 10,000 counts in steps of 1e-3.
            assert!((time - 1.0).abs() < 1e-5 + 2e-7 * half, "{half}: {time}");
        });
    }
}

/// Only the triangles in reach are searched: the answers are those of parry, which knows balls exactly.
#[test]
fn casts_over_many_triangles_are_those_of_parry() {
    const SIDE: usize = 300;
    let height = |i: usize, j: usize| 0.3 * (0.5 * i as f32).sin() * (0.3 * j as f32).cos();
    let heights = (0..SIDE * SIDE).map(|index| height(index % SIDE, index / SIDE)).collect();
    let ground = HeightField::new(Array2::new(SIDE, SIDE, heights), Vector::new(60.0, 1.0, 60.0));
    let (points, faces) = ground.to_trimesh();
    let mesh = TriMesh::new(points, faces).unwrap();
    let (field, ball) = (shape(shapes::Sphere::new(0.2).unwrap()), Ball::new(0.2));
    let mut random = Random::new(test_seed(31));
    let mut hits = 0;
    for _ in 0..40 {
        let [x, y, z] = random.point_in_cube(1.0).map(|x| x as f32);
        let [u, v, w] = random.point_in_cube(1.0).map(|x| x as f32);
        let pose = Pose::from_translation(Vector::new(20.0 * x, 1.0 + 0.4 * y, 20.0 * z));
        let velocity = Vector::new(4.0 * u, -1.0 - v.abs(), 4.0 * w);
        for time in [0.3, 3.0] {
            let options = ShapeCastOptions::with_max_time_of_impact(time);
            // Of height fields its answers are off by up to a hundredth.
            let exact = DefaultQueryDispatcher.cast_shapes(&pose, velocity, &mesh, &ball, options).unwrap();
            for ground in [&ground as &dyn Shape, &mesh] {
                let found = SdfDispatcher::default().cast_shapes(&pose, velocity, ground, &field, options).unwrap();
                let [found, exact] = [found, exact].map(|hit| hit.map_or(time, |hit| hit.time_of_impact));
                assert!((found - exact).abs() < 2e-3, "{found} for {exact}: {pose:?} {velocity}");
            }
            hits += u32::from(exact.is_some());
        }
    }
    assert!(hits > 20, "{hits}");
}
