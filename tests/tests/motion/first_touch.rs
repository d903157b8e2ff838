//! The first touch of a moving element: never late by brute force in time, and early by no more than the tolerance.

use nalgebra::Vector3;
use sdf_core::combine::Union;
use sdf_core::contact::{FirstTouch, MovingElement, Touch};
use sdf_core::grid::Lattice;
use sdf_core::moving::{Morphing, MovingSdf, RigidMotion, Travelling};
use sdf_core::placed::Placed;
use sdf_core::shapes::{Cuboid, HalfSpace, Sphere, Torus};
use sdf_core::{EnclosedSdf, Sdf};
use sdf_tests::random::Random;
use sdf_tests::scenes::{sampled, scenes, shifted};

use crate::{random_element, random_pose, random_weights};

fn random_path<const N: usize>(random: &mut Random, id: u32, size: f64) -> MovingElement<f64, N> {
    let start = random_element::<N>(random, id, 1.5 * size, 0.4 * size);
    let way = random.in_cube(1.5 * size);
    let path = start.simplex.corners.map(|corner| [corner, corner + way + random.in_cube(0.3 * size)]);
    MovingElement { id, vertices: start.vertices, path }
}

#[derive(Default)]
struct Counts {
    touched: u32,
    never: u32,
    spent: u32,
}

/// Is no sample of the motion within the thickness before the time told, and the point told within the tolerance?
fn check<M: MovingSdf, const N: usize>(
    name: &str,
    field: &M,
    size: f64,
    moving: &MovingElement<f64, N>,
    random: &mut Random,
    counts: &mut Counts,
) {
    let thickness = 0.02 * size;
    let search = FirstTouch { tolerance: 1e-3 * size, ..FirstTouch::default() };
    let until = match search.first_touch(field, thickness, moving) {
        Touch::At { time, minimum } => {
            assert!((0.0..=1.0).contains(&time), "{name}: {time}");
            let point = moving.at(time).simplex.point(minimum.weights);
            let value = field.at(time).value(point);
            assert!(value <= thickness + search.tolerance * (1.0 + 1e-9), "{name}: {value} at {time}");
            counts.touched += 1;
            time
        }
        Touch::Never => {
            counts.never += 1;
            1.0 + f64::EPSILON
        }
        Touch::BudgetSpent { time } => {
            counts.spent += 1;
            time
        }
        Touch::NotFinite => panic!("{name}: not finite"),
    };
    for step in 0..60 {
        let time = f64::from(step) / 59.0;
        if time >= until {
            break;
        }
        let (moment, simplex) = (field.at(time), moving.at(time).simplex);
        for sample in 0..4 {
            // Corners first: a vertex has no other point.
            let mut weights = [0.0; N];
            match sample {
                corner if corner < N => weights[corner] = 1.0,
                _ => weights = random_weights(random),
            }
            let value = moment.value(simplex.point(weights));
            assert!(value > thickness - 1e-12 * size, "{name}: late, {value} at {time} before {until}");
        }
    }
}

/// `counts` are those of fields that stand still, and of fields that travel and change.
fn check_all(name: &str, field: &impl EnclosedSdf, size: f64, random: &mut Random, counts: &mut [Counts; 2]) {
    let [still, moving] = counts;
    let motion = RigidMotion::between(random_pose(random, 0.3 * size), random_pose(random, 0.3 * size));
    let swollen = sdf_core::combine::Offset::new(field, 0.1 * size).unwrap();
    let changing = Travelling { field: Morphing::new(field, swollen), motion };
    for id in 0..5 {
        check(name, field, size, &random_path::<1>(random, id, size), random, still);
        check(name, field, size, &random_path::<2>(random, id, size), random, still);
        check(name, field, size, &random_path::<3>(random, id, size), random, still);
        check(name, &changing, size, &random_path::<3>(random, id, size), random, moving);
    }
}

#[test]
fn a_first_touch_is_never_late_and_its_point_touches() {
    let mut random = Random::seeded();
    let mut counts = [Counts::default(), Counts::default()];
    for scene in scenes(1.0) {
        check_all(scene.name, &scene.field, scene.size, &mut random, &mut counts);
    }
    let [still, moving] = counts;
    for Counts { touched, never, .. } in [&still, &moving] {
        assert!(*touched > 20 && *never > 20, "{touched} touch, {never} never");
    }
    // A grid that changes into another one has no exact minimum, and takes many evaluations.
    assert!(50 * still.spent < still.touched + still.never, "{} are left open", still.spent);
    assert!(2 * moving.spent < moving.touched + moving.never, "{} are left open", moving.spent);
}

#[test]
fn a_vertex_meets_a_sphere_at_the_root_of_its_equation() {
    let mut random = Random::seeded();
    let (mut hits, search) = (0, FirstTouch { tolerance: 1e-9, ..FirstTouch::default() });
    for _ in 0..6000 {
        let radius = random.between(0.2, 1.0);
        let (start, way) = (random.in_cube(3.0), random.in_cube(6.0));
        if start.norm() < radius {
            continue;
        }
        // |start + t way|² = radius².
        let (a, b, c) = (way.dot(&way), start.dot(&way), start.dot(&start) - radius * radius);
        let discriminant = b * b - a * c;
        let time = (-b - discriminant.max(0.0).sqrt()) / a;
        // Near grazing the tolerance decides, and not the equation.
        if discriminant.abs() < 0.05 * a * radius * radius {
            continue;
        }
        let expected = (discriminant > 0.0 && (0.0..=1.0).contains(&time)).then_some(time);
        let moving = MovingElement { id: 0, vertices: [0], path: [[start, start + way]] };
        let found = match search.first_touch(&Sphere::new(radius).unwrap(), 0.0, &moving) {
            Touch::At { time, .. } => Some(time),
            Touch::Never => None,
            other => panic!("{other:?}"),
        };
        assert_eq!(found.is_some(), expected.is_some(), "{found:?} for {expected:?}");
        if let (Some(found), Some(expected)) = (found, expected) {
            // The speed towards the surface there.
            let at = start + way * expected;
            let speed = -at.dot(&way) / radius;
            let early = expected - found;
            assert!(-1e-13 <= early && early <= 1.01e-9 / speed + 1e-13, "{found} for {expected}");
            hits += 1;
        }
    }
    assert!(hits > 100, "{hits}");
}

#[test]
fn a_triangle_meets_a_plane_with_its_first_corner() {
    let mut random = Random::seeded();
    let ground = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
    let (search, mut hits) = (FirstTouch { tolerance: 1e-7, ..FirstTouch::default() }, 0);
    for _ in 0..500 {
        let thickness = random.between(0.0, 0.1);
        let path = [0; 3].map(|_| {
            let start = random.in_cube(1.0) + Vector3::z() * 1.2;
            [start, random.in_cube(1.5)]
        });
        let touches = path.map(|[start, end]| (start.z - thickness) / (start.z - end.z));
        let reached = path.iter().zip(touches).filter(|([_, end], _)| end.z <= thickness).map(|(_, time)| time);
        let expected = reached.fold(f64::INFINITY, f64::min);
        if path.iter().any(|[_, end]| (end.z - thickness).abs() < 1e-6) {
            continue;
        }
        let moving = MovingElement { id: 0, vertices: [0, 1, 2], path };
        match search.first_touch(&ground, thickness, &moving) {
            Touch::At { time, .. } => {
                let slowest = path.iter().map(|[start, end]| (start.z - end.z).abs()).fold(f64::INFINITY, f64::min);
                let early = expected - time;
                assert!(-1e-12 <= early && early <= 1.01e-7 / slowest, "{time} for {expected}");
                hits += 1;
            }
            Touch::Never => assert_eq!(expected, f64::INFINITY),
            other => panic!("{other:?}"),
        }
    }
    assert!(hits > 100, "{hits}");
}

#[test]
fn a_field_that_moves_into_an_element_at_rest_touches_when_it_gets_there() {
    let ball = Sphere::new(0.5).unwrap();
    let motion = RigidMotion::new(
        sdf_core::placed::Rigid::new([-3.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap(),
        [4.0, 0.0, 0.0],
        [0.0, 0.0, 20.0],
    )
    .unwrap();
    let corners = [Vector3::new(0.0, -1.0, -1.0), Vector3::new(0.0, 1.0, -1.0), Vector3::new(0.0, 0.0, 1.0)];
    let resting = MovingElement { id: 0, vertices: [0, 1, 2], path: corners.map(|corner| [corner, corner]) };
    let search = FirstTouch { tolerance: 1e-6, ..FirstTouch::default() };
    let Touch::At { time, .. } = search.first_touch(&Travelling { field: ball, motion }, 0.0, &resting) else {
        panic!("no touch");
    };
    assert!((0.625 - 1e-6..=0.625).contains(&time), "{time}");
    // The same from the ball's frame, where the face moves.
    let flying =
        MovingElement { path: corners.map(|corner| [corner + Vector3::x() * 3.0, corner - Vector3::x()]), ..resting };
    let Touch::At { time, .. } = search.first_touch(&ball, 0.0, &flying) else { panic!("no touch") };
    assert!((0.625 - 1e-6..=0.625).contains(&time), "{time}");
}

/// A tangent plane tells at once, where the speed alone would need a step for each gap of the way: beside closed forms and grids, those
/// that are turned, and those that move while the face rests.
#[test]
fn a_face_that_slides_above_a_flat_side_needs_few_evaluations() {
    let mut random = Random::seeded();
    let search = FirstTouch { tolerance: 1e-6, evaluations: 24 };
    let floor = HalfSpace::new([0.0, 0.0, 1.0], 20.0).unwrap();
    let block = Cuboid::new([40.0, 40.0, 20.0]).unwrap();
    let lattice = Lattice::new([-8.0, -8.0, 12.0], 4.0, [5; 3]).unwrap();
    let grid = sampled(&block, lattice, 1.0);
    for _ in 0..200 {
        let pose = random_pose(&mut random, 2.0);
        let gap = 10.0_f64.powf(random.between(-4.0, -1.0));
        let direction = random.between(0.0, std::f64::consts::TAU);
        let way = Vector3::new(direction.cos(), direction.sin(), 0.0) * 0.4;
        let path = [0; 3].map(|_| {
            let start = Vector3::new(random.between(-0.3, 0.3), random.between(-0.3, 0.3), 20.0 + gap);
            [start, start + way]
        });
        let face = MovingElement { id: 0, vertices: [0, 1, 2], path };
        let moved = MovingElement { path: path.map(|corner| corner.map(|point| pose.push(point))), ..face };
        let resting = MovingElement { path: moved.path.map(|[start, _]| [start; 2]), ..face };
        let velocity = pose.push(Vector3::zeros()) - pose.push(way);
        let motion = RigidMotion::new(pose, velocity.into(), [0.0; 3]).unwrap();
        macro_rules! check {
            ($field:expr) => {
                let alone = search.first_touch(&$field, 0.0, &face);
                let beside = search.first_touch(&Travelling { field: &$field, motion }, 0.0, &resting);
                assert_eq!([alone, beside], [Touch::Never; 2], "gap {gap}");
            };
        }
        macro_rules! check_turned {
            ($field:expr) => {
                check!($field);
                let turned = Placed { field: &$field, placement: pose };
                assert_eq!(search.first_touch(&turned, 0.0, &moved), Touch::Never, "gap {gap}");
            };
        }
        check_turned!(floor);
        check_turned!(block);
        check_turned!(grid);
        // Beside something else, and beside a part without a plane.
        check!(Union(&floor, shifted(Sphere::new(1.0).unwrap(), [0.0, 0.0, 23.0])));
        check!(Union(shifted(Torus::new(1.0, 0.5).unwrap(), [9.0, 0.0, 20.0]), &block));
        // Down on the plane, it touches just before.
        let fallen = MovingElement { path: path.map(|[start, end]| [start, end - Vector3::z() * 2.0 * gap]), ..face };
        let Touch::At { time, .. } = search.first_touch(&floor, 0.0, &fallen) else { panic!("no touch, gap {gap}") };
        assert!((0.5 - 1e-6 / gap..=0.5 + 1e-12 / gap).contains(&time), "{time}, gap {gap}");
    }
}

#[test]
fn inputs_that_are_not_finite_and_budgets_that_are_spent_have_a_status() {
    let ball = Sphere::new(1.0).unwrap();
    let at = |start: f64, end: f64| MovingElement {
        id: 0,
        vertices: [0],
        path: [[Vector3::new(start, 0.0, 0.0), Vector3::new(end, 0.0, 0.0)]],
    };
    let search = FirstTouch::default();
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        assert_eq!(search.first_touch(&ball, 0.0, &at(2.0, bad)), Touch::NotFinite);
        assert_eq!(search.first_touch(&ball, 0.0, &at(bad, 2.0)), Touch::NotFinite);
        assert_eq!(search.first_touch(&ball, bad, &at(3.0, 2.0)), Touch::NotFinite);
    }
    let none = FirstTouch { evaluations: 0, ..search };
    assert_eq!(none.first_touch(&ball, 0.0, &at(3.0, 0.0)), Touch::BudgetSpent { time: 0.0 });
    assert!(matches!(search.first_touch(&ball, 0.0, &at(0.5, 3.0)), Touch::At { time: 0.0, .. }));
    assert_eq!(search.first_touch(&ball, 0.0, &at(3.0, 3.0)), Touch::Never);
}
