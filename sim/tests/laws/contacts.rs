//! Rigid bodies and walls: friction at its angle, thin walls at any speed, two bodies exchanged.

use sdf_core::AnyField;
use sdf_core::combine::Shell;
use sdf_core::nalgebra::UnitQuaternion;
use sdf_core::shapes::{Cuboid, HalfSpace, Sphere};
use sdf_field::Field;
use sdf_sim::{Body, Carried, Carrier, Contacts, Elements, Motion, Obstacle, Query, Surface, World, cloth};

use crate::{GRAVITY, V3, cuboid, falling};

const SUBSTEPS: u32 = 10;
const DT: f64 = 1.0 / 600.0;

fn frame(world: &mut World, contacts: &mut Contacts, find: impl FnOnce(&World, &Motion, &mut Contacts)) {
    contacts.clear();
    find(world, &Motion::of(world, DT * f64::from(SUBSTEPS)), contacts);
    for _ in 0..SUBSTEPS {
        world.step(DT, contacts.rows());
    }
}

/// Distance that a box slides within a second on a slope of so many degrees with the friction of 30 degrees.
fn slide(degrees: f64) -> f64 {
    let angle = degrees.to_radians();
    let mut world = falling();
    // The slope is level, and gravity is not.
    world.gravity = V3::new(angle.sin(), 0.0, -angle.cos()) * GRAVITY;
    let (points, faces) = cuboid([0.3, 0.3, 0.05]);
    let (body, points) = Body::of_mesh(&points, &faces, 2.0).unwrap();
    let id = world.add_body(Body { position: V3::new(0.0, 0.0, 0.05), ..body });
    let surface = Surface::of_faces(faces, points.len(), Carrier::Body { id, points: points.into() });
    let floor = Field::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap());
    // Of a level face any point is the lowest: its vertices hold the corners.
    let elements = Elements { faces: true, edges: false, vertices: true };
    let query = Query { elements, friction: 30_f64.to_radians().tan(), ..Query::default() };
    let mut contacts = Contacts::default();
    for _ in 0..60 {
        frame(&mut world, &mut contacts, |world, motion, contacts| {
            query.find(&floor, &surface, world, motion, contacts).unwrap();
        });
    }
    world.bodies[0].position.x
}

#[test]
fn a_box_slides_within_one_degree_of_the_angle_of_friction() {
    let (held, slid) = (slide(29.0), slide(31.0));
    let angle = 31_f64.to_radians();
    let expected = 0.5 * GRAVITY * (angle.sin() - 30_f64.to_radians().tan() * angle.cos());
    assert!(held < 0.01, "at 29 degrees it slid by {held}");
    assert!((slid - expected).abs() < 0.1 * expected, "at 31 degrees it slid by {slid}, not by {expected}");
}

/// Points of a small sheet beyond the wall after it was thrown at it.
fn beyond(wall: &Field, is_beyond: impl Fn(&V3) -> bool, speed: f64, query: &Query, margin: bool) -> usize {
    let sheet = sdf_procedural::Sheet {
        cells: [7, 7],
        size: [0.5, 0.5],
        height: 0.3,
        bend: 0.0,
        floor: 0.0,
        holes: None,
        faces: None,
    };
    let mesh = sheet.mesh();
    let mut world = World::default();
    let surface = cloth::add(&mut world, &mesh.points, &mesh.triangles, &cloth::Fabric::default());
    world.v.fill(V3::new(0.0, 0.0, -speed));
    let mut contacts = Contacts::default();
    for _ in 0..(60.0 / speed.min(2.0)) as usize {
        frame(&mut world, &mut contacts, |world, motion, contacts| {
            let motion = if margin { *motion } else { Motion::NONE };
            query.find(wall, &surface, world, &motion, contacts).unwrap();
        });
    }
    world.x.iter().filter(|x| is_beyond(x)).count()
}

#[test]
fn nothing_goes_through_a_thin_wall_or_a_thin_shell_at_any_speed() {
    let wall = Field::new(Cuboid::new([1.0, 1.0, 0.005]).unwrap());
    let shell = Field::new(AnyField::Shell(Box::new(Shell::new(Sphere::new(0.25).unwrap().into(), 0.005).unwrap())));
    let query = Query { thickness: 0.002, ..Query::default() };
    for speed in [0.5, 5.0, 50.0, 500.0] {
        assert_eq!(beyond(&wall, |x| x.z < -0.005, speed, &query, true), 0, "wall at {speed}");
        assert_eq!(beyond(&shell, |x| x.norm() < 0.245, speed, &query, true), 0, "shell at {speed}");
    }
    // The scene proves something: without the margin all of it goes through.
    assert!(beyond(&wall, |x| x.z < -0.005, 50.0, &query, false) > 0);
}

/// Poses of two boxes after one fell onto the other; `swapped` names them the other way round.
fn boxes(swapped: bool) -> [(V3, [f64; 4]); 2] {
    let mut world = falling();
    let half = [0.5, 0.08, 0.08];
    let (points, faces) = cuboid(half);
    let field = Field::new(Cuboid::new(half).unwrap());
    let (body, points) = Body::of_mesh(&points, &faces, 1.0).unwrap();
    let turned = |axis: V3, angle: f64| UnitQuaternion::from_scaled_axis(axis * angle);
    let lower = Body {
        rotation: turned(V3::x(), 0.0),
        inv_mass: 0.2,
        inertia: body.inertia * 5.0,
        inv_inertia: body.inv_inertia * 0.2,
        ..body.clone()
    };
    let upper = Body {
        position: V3::new(0.02, 0.01, 0.35),
        rotation: turned(V3::z(), 1.5) * turned(V3::x(), 0.02),
        velocity: V3::new(0.0, 0.0, -1.0),
        ..body
    };
    world.gravity = V3::zeros();
    let bodies = if swapped { [upper, lower] } else { [lower, upper] };
    bodies.into_iter().for_each(|body| _ = world.add_body(body));
    let surfaces = [0, 1]
        .map(|id| Surface::of_faces(faces.clone(), points.len(), Carrier::Body { id, points: points.clone().into() }));
    let momentum = world.momentum();
    let energy = world.energy();
    let query = Query { elements: Elements { faces: true, edges: true, vertices: false }, ..Query::default() };
    let mut contacts = Contacts::default();
    let mut touched = 0;
    for _ in 0..30 {
        frame(&mut world, &mut contacts, |world, motion, contacts| {
            for (mine, other) in [(0, 1), (1, 0)] {
                let obstacle = Carried { field: &field, id: other as u32, body: &world.bodies[other] };
                query.find(&obstacle as &dyn Obstacle, &surfaces[mine], world, motion, contacts).unwrap();
            }
            contacts.sort_by_place();
        });
        touched += contacts.contacts.len();
    }
    assert!(touched > 0 && (world.momentum() - momentum).norm() < 1e-12);
    assert!(world.energy() <= energy * (1.0 + 1e-9), "{} from {energy}", world.energy());
    let [a, b] = [0, 1].map(|id| {
        let body: &Body = &world.bodies[id];
        let q = body.rotation.quaternion();
        (body.position, [q.i, q.j, q.k, q.w])
    });
    if swapped { [b, a] } else { [a, b] }
}

#[test]
fn two_boxes_exchanged_end_where_they_did_and_keep_their_momentum() {
    let [one, other] = [boxes(false), boxes(true)];
    assert_eq!(one, other);
    assert!(one[0].0.z < -0.01, "the lower box was not pushed: {one:?}");
}
