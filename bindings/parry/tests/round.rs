//! Balls and capsules against fields with edges: distances from the middle line, whatever lies between.

#[allow(dead_code, reason = "each test uses a part of it")]
mod scene;

use parry3d::math::{Pose, Vector};
use parry3d::query::details::ShapeCastOptions;
use parry3d::query::{
    ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher, PointQuery, QueryDispatcher, ShapeCastStatus,
};
use parry3d::shape::{Ball, Capsule, Cuboid, Shape};
use scene::bake;
use sdf_bake::{MeshDistance, TriangleMesh, lattice_around, sparse};
use sdf_core::shapes;
use sdf_parry::{SdfDispatcher, SdfShape, Search};
use sdf_procedural::random::{Random, test_seed};

const HALF: [f32; 3] = [0.5, 0.7, 0.9];

const RADII: [f32; 5] = [0.1, 0.3, 1.0, 3.0, 10.0];

const SEARCHES: [Search; 2] = [Search::Local, Search::Certified];

fn dispatcher(search: Search) -> impl PersistentQueryDispatcher<(), ()> {
    SdfDispatcher { search }.chain(DefaultQueryDispatcher)
}

fn vector(random: &mut Random, half: f64) -> Vector {
    Vector::from_array(random.point_in_cube(half).map(|x| x as f32))
}

/// The box in closed form, and in grids that are off by less than so much. Centres of large balls lie far outside of a grid, and beyond
/// the band of a sparse one.
fn fields() -> [(SdfShape, f32); 3] {
    let spacing = 0.05;
    let (points, faces) = Cuboid::new(Vector::from_array(HALF)).to_trimesh();
    let points: Vec<[f64; 3]> = points.into_iter().map(|point| point.to_array().map(f64::from)).collect();
    let mesh = TriangleMesh::new(&points, &faces).unwrap();
    let (lattice, band) = (lattice_around(&mesh.bounds(), spacing, 4).unwrap(), 3.0 * spacing);
    let bricks = sparse::bake::<u16>(&MeshDistance::new(&mesh, None), &lattice, band, &|_| ()).unwrap();
    let bricks = bricks.into_grid(&lattice, band).grid;
    let exact = shapes::Cuboid::new(HALF.map(f64::from)).unwrap();
    [
        (SdfShape::new(exact).unwrap(), 1e-5),
        (SdfShape::new(bake(&(points, faces), spacing)).unwrap(), 0.5 * spacing as f32),
        (SdfShape::new(bricks).unwrap(), 0.5 * spacing as f32),
    ]
}

/// The distance of a point from the box, negative inside.
fn distance(point: Vector) -> f32 {
    Cuboid::new(Vector::from_array(HALF)).distance_to_local_point(point, false)
}

/// Farthest along a direction from the origin, the shape is this far from the box.
fn place(direction: Vector, gap: f32, reach: f32, distance_at: impl Fn(Vector) -> f32) -> Vector {
    let (mut near, mut far) = (0.0_f32, 2.0 * reach + 5.0);
    for _ in 0..60 {
        let middle = 0.5 * (near + far);
        if distance_at(direction * middle) > gap { far = middle } else { near = middle }
    }
    direction * far
}

fn check(search: Search, field: &SdfShape, other: &dyn Shape, pose: &Pose, truth: f32, error: f32) {
    let dispatcher = dispatcher(search);
    let context = || format!("{search:?}: {truth} apart, at {pose:?}");
    let intersects = dispatcher.intersection_test(pose, field, other).unwrap().intersecting;
    assert!(intersects == (truth <= 0.0) || truth.abs() <= error, "{}", context());
    let found = dispatcher.distance(pose, field, other).unwrap().distance;
    assert!((found - truth.max(0.0)).abs() <= error, "{found}, {}", context());
    let contact = dispatcher.contact(pose, field, other, truth.abs() + 1.0).unwrap().expect("they are near");
    assert!((contact.dist - truth).abs() <= error, "{}, {}", contact.dist, context());
    let way = pose.transform_point(contact.point2) - contact.point1;
    assert!((way - contact.normal1 * contact.dist).length() <= error, "{}", context());
    let mut manifolds: Vec<ContactManifold<(), ()>> = vec![];
    dispatcher.contact_manifolds(pose, field, other, 2.0 * error, &mut manifolds, &mut None).unwrap();
    let deepest = manifolds.iter().flat_map(|manifold| &manifold.points).map(|point| point.dist);
    let deepest = deepest.fold(f32::INFINITY, f32::min);
    assert!(truth > error || deepest <= truth + error, "{deepest}, {}", context());
}

#[test]
fn a_ball_is_as_far_from_a_field_as_its_centre_less_the_radius() {
    let mut random = Random::new(test_seed(61));
    for (field, error) in fields() {
        for (search, radius) in SEARCHES.into_iter().flat_map(|search| RADII.map(|radius| (search, radius))) {
            let error = error + 1e-5 * radius;
            for gap in [0.05, 0.01, -0.005, -0.02, -0.2].map(|gap| gap * radius.min(1.0)) {
                for _ in 0..6 {
                    let direction = vector(&mut random, 1.0).normalize();
                    let centre = place(direction, gap, radius, |point| distance(point) - radius);
                    let pose = Pose::from_translation(centre);
                    check(search, &field, &Ball::new(radius), &pose, distance(centre) - radius, error);
                }
            }
        }
    }
}

#[test]
fn a_capsule_is_as_far_from_a_field_as_its_segment_less_the_radius() {
    let mut random = Random::new(test_seed(62));
    // The lowest of 2,001 points of the segment is off by less than the way to its neighbour.
    let of_segment = |[a, b]: [Vector; 2]| {
        (0..=2000).map(|k| distance(a + (b - a) * (k as f32 / 2000.0))).fold(f32::INFINITY, f32::min)
    };
    for (field, error) in fields() {
        for (search, radius) in SEARCHES.into_iter().flat_map(|search| [0.1, 0.5, 3.0].map(|radius| (search, radius))) {
            let error = error + 1e-3;
            for gap in [0.05, 0.01, -0.01, -0.03].map(|gap| gap * radius) {
                for _ in 0..6 {
                    let half = vector(&mut random, 1.0);
                    let ends = |centre: Vector| [centre - half, centre + half];
                    let direction = vector(&mut random, 1.0).normalize();
                    let centre = place(direction, gap, radius, |point| of_segment(ends(point)) - radius);
                    let truth = of_segment(ends(centre)) - radius;
                    let capsule = Capsule::new(-half, half, radius);
                    check(search, &field, &capsule, &Pose::from_translation(centre), truth, error);
                }
            }
        }
    }
}

/// Conservative advancement stops where the ball arrives at an edge.
#[test]
fn a_ball_that_flies_past_an_edge_arrives_in_time() {
    let mut random = Random::new(test_seed(63));
    let [(field, _), ..] = fields();
    for (search, radius) in SEARCHES.into_iter().flat_map(|search| [0.3, 1.0, 10.0].map(|radius| (search, radius))) {
        let (mut hits, ball) = (0, Ball::new(radius));
        for _ in 0..40 {
            let start = vector(&mut random, 1.0).normalize() * (2.0 * radius + 4.0);
            let velocity = vector(&mut random, 1.0) - start;
            let apart = |time: f32| distance(start + velocity * time) - radius;
            let first = (0..=20_000).map(|k| k as f32 / 20_000.0).find(|time| apart(*time) <= 0.0);
            let options = ShapeCastOptions::with_max_time_of_impact(1.0);
            let pose = Pose::from_translation(start);
            let hit = dispatcher(search).cast_shapes(&pose, velocity, &field, &ball, options).unwrap();
            let Some(first) = first else { continue };
            let hit = hit.expect("it arrives");
            let (time, apart) = (hit.time_of_impact, apart(hit.time_of_impact));
            // A cast ends within 1e-4 of the radius; where the ball grazes, that is long before.
            let is_near = apart <= 2e-4 * radius || hit.status == ShapeCastStatus::OutOfIterations;
            assert!(time <= first + 5e-5 && is_near, "{search:?}: {time} for {first}, {apart} apart, {hit:?}");
            hits += 1;
        }
        assert!(hits >= 20);
    }
}
