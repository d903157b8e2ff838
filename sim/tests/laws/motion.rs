//! The solver itself, without contacts.

use sdf_sim::{Body, Rows, Stretch, World};

use crate::{GRAVITY, V3, cuboid, falling};

fn steps(world: &mut World, count: usize, dt: f64, mut visit: impl FnMut(&World)) {
    let mut rows = Rows::default();
    for _ in 0..count {
        world.step(dt, &mut rows);
        visit(world);
    }
}

#[test]
fn what_flies_freely_falls_by_half_g_t_squared() {
    let mut world = falling();
    world.add_particle(V3::zeros(), 2.0);
    let (points, faces) = cuboid([0.1, 0.2, 0.3]);
    let (body, _) = Body::of_mesh(&points, &faces, 3.0).unwrap();
    world.add_body(Body { velocity: V3::new(1.0, 0.0, 2.0), ..body });
    let (energy, dt) = (world.energy(), 1.0 / 2400.0);
    steps(&mut world, 2400, dt, |_| ());
    // Velocity first, then position: ½ g t (t + dt).
    let fallen = 0.5 * GRAVITY * (1.0 + dt);
    assert!((world.x[0].z + fallen).abs() < 1e-9, "{}", world.x[0].z);
    assert!((world.bodies[0].position - V3::new(1.0, 0.0, 2.0 - fallen)).norm() < 1e-9);
    assert!((world.energy() - energy).abs() < 0.01 * (3.0 * 0.5 * GRAVITY * GRAVITY), "{}", world.energy() - energy);
}

#[test]
fn a_spinning_body_keeps_momentum_to_the_last_bit_and_its_energy() {
    let (points, faces) = cuboid([0.1, 0.2, 0.3]);
    let (mut body, _) = Body::of_mesh(&points, &faces, 3.0).unwrap();
    // About the middle axis: it tumbles.
    body.set_angular_velocity(&V3::new(0.01, 10.0, 0.0));
    let (momentum, energy) = (body.momentum, body.kinetic_energy());
    let mut world = World::default();
    world.add_body(body);
    let mut worst: f64 = 0.0;
    let mut least_turn: f64 = 1.0;
    steps(&mut world, 6000, 1.0 / 600.0, |world| {
        worst = worst.max((world.bodies[0].kinetic_energy() / energy - 1.0).abs());
        least_turn = least_turn.min(world.bodies[0].angular_velocity().normalize().y);
    });
    assert_eq!(world.bodies[0].momentum, momentum);
    assert!(worst < 1e-3, "energy off by {worst}");
    assert!(least_turn < 0.99, "it did not tumble");
}

/// Each coordinate is off by half a unit in its last place at most.
#[test]
fn a_place_far_away_costs_a_body_no_digits_of_its_inertia() {
    let (points, faces) = cuboid([0.1, 0.2, 0.3]);
    let (near, _) = Body::of_mesh(&points, &faces, 3.0).unwrap();
    for place in [V3::new(500_000.0, 4_000_000.0, 100.0), V3::new(-1e9, 0.0, 1e9)] {
        let moved: Vec<[f64; 3]> = points.iter().map(|point| (V3::from(*point) + place).into()).collect();
        let (far, own) = Body::of_mesh(&moved, &faces, 3.0).unwrap();
        let rounding = f64::EPSILON * place.amax();
        assert!((far.position - place).norm() <= 4.0 * rounding, "{}", far.position);
        assert!((far.inertia - near.inertia).norm() <= 50.0 * rounding * near.inertia.norm(), "{}", far.inertia);
        let errors = own.iter().zip(&points).map(|(a, b)| (V3::from(*a) - V3::from(*b)).norm());
        assert!(errors.fold(0.0, f64::max) <= 4.0 * rounding);
    }
}

#[test]
fn a_pendulum_keeps_its_energy_within_one_percent() {
    let mut world = falling();
    let [pivot, bob] = [world.add_particle(V3::zeros(), 0.0), world.add_particle(V3::new(1.0, 0.0, 0.0), 1.0)];
    world.stretches.push(Stretch { ends: [pivot, bob], rest: 1.0, compliance: 0.0 });
    let energy = world.energy();
    let (mut worst, mut lowest): (f64, f64) = (0.0, 0.0);
    steps(&mut world, 2 * 9600, 1.0 / 9600.0, |world| {
        worst = worst.max((world.energy() - energy).abs() / GRAVITY);
        lowest = lowest.min(world.x[1].z);
    });
    assert!(worst < 0.01, "energy off by {worst} of what it swings through");
    assert!(lowest < -0.999 && (world.x[1] - world.x[0]).norm() < 1.001);
}

#[test]
fn a_chain_in_free_flight_keeps_its_momentum() {
    let mut world = World::default();
    for index in 0..20 {
        let along = f64::from(index);
        world.add_particle(V3::new(0.1 * along, 0.0, 0.0), 1.0 + along % 3.0);
        world.v[index as usize] = V3::new(0.0, (7.0 * along).sin(), (3.0 * along).cos());
    }
    world.stretches = (0..19).map(|a| Stretch { ends: [a, a + 1], rest: 0.1, compliance: 0.0 }).collect();
    let momentum = world.momentum();
    let energy = world.energy();
    steps(&mut world, 600, 1.0 / 600.0, |world| assert!(world.energy() < energy * 1.001));
    assert!((world.momentum() - momentum).norm() < 1e-12 * 20.0, "{}", (world.momentum() - momentum).norm());
}
