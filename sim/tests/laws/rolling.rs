//! Bodies that roll gain no energy: a ball on a floor, a plank on a log. With rolling friction a ball holds and rolls at its angle, and
//! stops where it must.

use sdf_core::nalgebra::{Matrix3, UnitQuaternion};
use sdf_core::shapes::Sphere;
use sdf_field::Field;
use sdf_sim::{Body, Carried, Carrier, Contacts, Motion, Query, Surface, World};

use crate::{GRAVITY, V3, cuboid};

const RADIUS: f64 = 0.5;
/// The lever of rolling friction over the radius is the tangent of the angle at which a ball begins to roll.
const ANGLE: f64 = 2.5;
const DT: f64 = 1.0 / 600.0;

/// A ball on a level floor that rolls along x at a speed, in gravity tilted by so many degrees; the worst gain of energy over its
/// start, and the ball after so many frames.
fn roll(degrees: f64, speed: f64, lever: f64, frames: u32) -> (f64, Body) {
    let angle = degrees.to_radians();
    let mut world = World::new([angle.sin() * GRAVITY, 0.0, -angle.cos() * GRAVITY]);
    world.rolling_friction = lever;
    let inertia = Matrix3::identity() * (0.4 * 2.0 * RADIUS * RADIUS);
    let ball = Body {
        position: V3::new(0.0, 0.0, RADIUS),
        velocity: V3::new(speed, 0.0, 0.0),
        momentum: inertia * V3::new(0.0, speed / RADIUS, 0.0),
        inv_mass: 0.5,
        inertia,
        inv_inertia: inertia.try_inverse().unwrap(),
        ..Body::fixed()
    };
    let ball = world.add_body(ball);
    let (points, faces) = cuboid([5.0, 3.0, 0.1]);
    let floor = world.add_body(Body { position: V3::new(1.0, 0.7, -0.1), ..Body::fixed() });
    // The floor has the faces and the ball is the field: it is round, and not a solid of facets, which rests on one.
    let surface = Surface::of_faces(faces, points.len(), Carrier::Body { id: floor, points: points.into() });
    let field = Field::new(Sphere::new(RADIUS).unwrap());
    let query = Query { friction: 0.5, ..Query::default() };
    let (start, mut gain) = (world.energy(), 0.0_f64);
    let mut contacts = Contacts::default();
    for _ in 0..frames {
        contacts.clear();
        let obstacle = Carried { field: &field, id: ball, body: &world.bodies[ball as usize] };
        query.find(&obstacle, &surface, &world, &Motion::of(&world, 10.0 * DT), &mut contacts).unwrap();
        for _ in 0..10 {
            world.step(DT, contacts.rows());
            gain = gain.max(world.energy() - start);
        }
    }
    (gain, world.bodies[ball as usize].clone())
}

#[test]
fn a_ball_holds_and_rolls_within_one_degree_of_the_angle_of_its_rolling_friction() {
    let lever = RADIUS * ANGLE.to_radians().tan();
    // It creeps in the frame in which it is let go. Without rolling friction it rolls by sixty times as much.
    let [held, free] = [lever, 0.0].map(|lever| roll(ANGLE - 1.0, 0.0, lever, 60).1.position.x);
    assert!(held.abs() < 0.003 && free > 0.08, "it rolled by {held}, without friction by {free}");
    let rolled = roll(ANGLE + 1.0, 0.0, lever, 60).1.position.x;
    let angle = (ANGLE + 1.0).to_radians();
    // A full ball turns with two fifths of its mass at its rim.
    let expected = 0.5 * GRAVITY * (angle.sin() - ANGLE.to_radians().tan() * angle.cos()) / 1.4;
    assert!((rolled - expected).abs() < 0.05 * expected, "it rolled by {rolled}, not by {expected}");
}

#[test]
fn a_ball_that_nothing_holds_rolls_on_at_its_speed() {
    let speed = 0.5;
    let (gain, ball) = roll(0.0, speed, 0.0, 180);
    let energy = 0.7 * 2.0 * speed * speed;
    // The search knows a minimum's height, not its place: the push leans a little.
    assert!(gain < 0.001 * energy, "{gain} of {energy}");
    assert!((ball.velocity.x - speed).abs() < 0.005 * speed, "{}", ball.velocity);
}

#[test]
fn a_rolling_ball_stops_where_its_rolling_friction_has_used_up_its_energy() {
    let speed = 0.5;
    let lever = RADIUS * ANGLE.to_radians().tan();
    let (gain, stopped) = roll(0.0, speed, lever, 180);
    let expected = speed * speed * 1.4 / (2.0 * GRAVITY * ANGLE.to_radians().tan());
    assert!(gain < 1e-9, "{gain}");
    let share = stopped.position.x / expected;
    assert!((0.98..1.02).contains(&share), "{} and not {expected}", stopped.position.x);
    assert!(stopped.velocity.norm() < 0.01, "{}", stopped.velocity);
}

/// A plank rolls to and fro on a round log, of radius 1, that stands still: its middle is at (R + h) n − R θ t at the tilt θ, where n is
/// the plank's normal and t its length.
#[test]
fn a_plank_that_rocks_on_a_log_gains_no_energy() {
    let (half, tilt) = ([1.2, 0.3, 0.05], 0.2_f64);
    let (points, faces) = cuboid(half);
    let (body, points) = Body::of_mesh(&points, &faces, 1.0).unwrap();
    let mut world = crate::falling();
    let [n, t] = [V3::new(tilt.sin(), 0.0, tilt.cos()), V3::new(tilt.cos(), 0.0, -tilt.sin())];
    let rotation = UnitQuaternion::from_axis_angle(&V3::y_axis(), tilt);
    let plank = world.add_body(Body { position: n * (1.0 + half[2]) - t * tilt, rotation, ..body });
    let surface = Surface::of_faces(faces, points.len(), Carrier::Body { id: plank, points: points.into() });
    let log = Field::new(Sphere::new(1.0).unwrap());
    let query = Query { friction: 1.0, ..Query::default() };
    let (start, mut gain, mut tilts) = (world.energy(), 0.0_f64, vec![]);
    let mut contacts = Contacts::default();
    for _ in 0..240 {
        contacts.clear();
        query.find(&log, &surface, &world, &Motion::of(&world, 10.0 * DT), &mut contacts).unwrap();
        for _ in 0..10 {
            world.step(DT, contacts.rows());
            gain = gain.max(world.energy() - start);
        }
        tilts.push((world.bodies[plank as usize].rotation * V3::z()).x);
    }
    let back = tilts.iter().fold(0.0_f64, |least, tilt| least.min(*tilt));
    let forth = tilts[120..].iter().fold(0.0_f64, |most, tilt| most.max(*tilt));
    let scale = start - GRAVITY * (1.0 + half[2]);
    assert!(gain < 0.02 * scale, "{gain} of {scale}");
    assert!([-back, forth].iter().all(|to| (to / tilt.sin() - 1.0).abs() < 0.02), "from {tilt} to {back} and {forth}");
}
