//! Moving fields: is ∂φ/∂t the derivative, do the bounds of it hold, and does a point carried by the surface stay on it?

use nalgebra::Vector3;
use sdf_core::moving::{Animated, Morphing, MovingSdf, RigidMotion, Travelling};
use sdf_core::placed::{Placed, Rigid};
use sdf_core::shapes::{Capsule, Cuboid, Cylinder, HalfSpace, RoundedBox, Sphere, Torus};
use sdf_core::{Aabb, EnclosedSdf, Sdf};
use sdf_tests::random::Random;
use sdf_tests::scenes::{cube_lattice, measured_grid, noise, scenes, with_block_bounds};

use crate::random_pose as pose;

type Point = Vector3<f64>;

/// −∂φ/∂t and −dφ/dt along paths, all over a box: does no difference of values exceed the bounds?
fn check_bounds(name: &str, field: &impl MovingSdf, size: f64, random: &mut Random) {
    for _ in 0..40 {
        let from = random.between(0.0, 0.9);
        let until = random.between(from + 0.01, 1.0);
        let (centre, half) = (random.in_cube(1.2 * size), size * random.between(0.01, 0.4));
        let region = Aabb::centered([half; 3]);
        let region = Aabb {
            min: std::array::from_fn(|k| region.min[k] + centre[k]),
            max: std::array::from_fn(|k| region.max[k] + centre[k]),
        };
        let fall_bound = field.fall_bound(&region, from, until);
        let path: [[Point; 2]; 3] =
            [0; 3].map(|_| [centre + random.in_cube(half), centre + random.in_cube(2.0 * half)]);
        let approach_bound = field.approach_bound(&path, from, until);
        assert!(fall_bound >= 0.0 && approach_bound >= 0.0, "{name}");
        for _ in 0..6 {
            let t = random.between(from, until);
            let later = random.between(t, until);
            let slack = 1e-12 * (1.0 + size);
            let point = centre + random.in_cube(half);
            let fall = field.at(t).value(point) - field.at(later).value(point);
            assert!(
                fall <= fall_bound * (later - t) + slack,
                "{name}: fell {fall} in {}, bound {fall_bound}",
                later - t
            );
            let mut weights = [random.unit(), random.unit(), random.unit()];
            let sum: f64 = weights.iter().sum();
            weights.iter_mut().for_each(|weight| *weight /= sum);
            let at = |time: f64| {
                path.iter().zip(weights).map(|([a, b], weight)| (a + (b - a) * time) * weight).sum::<Point>()
            };
            let fall = field.at(t).value(at(t)) - field.at(later).value(at(later));
            assert!(fall <= approach_bound * (later - t) + slack, "{name}: {fall}, bound {approach_bound}");
        }
    }
}

#[test]
fn no_field_falls_faster_than_its_bounds() {
    let mut random = Random::seeded();
    let scenes = scenes(1.0);
    for scene in &scenes {
        let motion = RigidMotion::between(pose(&mut random, 0.5), pose(&mut random, 0.5));
        check_bounds(scene.name, &scene.field, scene.size, &mut random);
        check_bounds(scene.name, &Travelling { field: &scene.field, motion }, scene.size, &mut random);
        let other = &scenes[random.below(scenes.len())].field;
        let morphing = Morphing::new(&scene.field, other);
        check_bounds(scene.name, &morphing, scene.size, &mut random);
        check_bounds(scene.name, &Travelling { field: morphing, motion }, scene.size, &mut random);
    }
}

fn check_animated<F: Animated>(name: &str, now: F, later: F, random: &mut Random) {
    let bound = now.max_difference(&later);
    for _ in 0..2000 {
        let point = random.in_cube(2.5);
        let difference = (later.value(point) - now.value(point)).abs();
        assert!(difference <= bound + 1e-12, "{name}: {difference}, bound {bound}");
    }
    check_bounds(name, &Morphing::animated(now, later), 1.5, random);
}

#[test]
fn no_closed_form_changes_by_more_than_its_parameters_allow() {
    let mut random = Random::seeded();
    for _ in 0..20 {
        let lengths = [0; 8].map(|_| random.between(0.2, 1.0));
        let [a, b, c, d, e, f, g, h] = lengths;
        check_animated("sphere", Sphere::new(a).unwrap(), Sphere::new(b).unwrap(), &mut random);
        check_animated("torus", Torus::new(a + b, b).unwrap(), Torus::new(c + d, d).unwrap(), &mut random);
        check_animated("cylinder", Cylinder::new(a, b).unwrap(), Cylinder::new(c, d).unwrap(), &mut random);
        check_animated("cuboid", Cuboid::new([a, b, c]).unwrap(), Cuboid::new([d, e, f]).unwrap(), &mut random);
        let round = [RoundedBox::new([a, b, c], g), RoundedBox::new([d, e, f], h)].map(Option::unwrap);
        check_animated("rounded box", round[0], round[1], &mut random);
        let mut capsule = |radius| Capsule::new(random.point_in_cube(1.0), random.point_in_cube(1.0), radius).unwrap();
        let [now, later] = [capsule(g), capsule(h)];
        check_animated("capsule", now, later, &mut random);
        let ground = [a, -b].map(|offset| HalfSpace::new([c, d, -e], offset).unwrap());
        check_animated("half space", ground[0], ground[1], &mut random);
    }
}

#[test]
fn the_time_derivative_is_that_of_the_value() {
    let mut random = Random::seeded();
    let ball = Sphere::new(0.7).unwrap();
    let swelling = Morphing::animated(Torus::new(1.0, 0.2).unwrap(), Torus::new(1.2, 0.4).unwrap());
    for _ in 0..300 {
        let motion = RigidMotion::between(pose(&mut random, 1.0), pose(&mut random, 1.0));
        let (point, t, h) = (random.in_cube(2.0), random.between(0.1, 0.9), 1e-5);
        let check = |rate: f64, before: f64, after: f64| {
            let expected = (after - before) / (2.0 * h);
            assert!((rate - expected).abs() < 1e-5 * (1.0 + rate.abs()), "{rate} for {expected}");
        };
        let carried = Travelling { field: ball, motion };
        check(carried.time_derivative(point, t), carried.at(t - h).value(point), carried.at(t + h).value(point));
        check(swelling.time_derivative(point, t), swelling.at(t - h).value(point), swelling.at(t + h).value(point));
        let both = Travelling { field: swelling, motion };
        // A kink of the torus between the two times would be no derivative.
        if both.at(t - h).evaluate(point).gradient.dot(&both.at(t + h).evaluate(point).gradient) > 0.5 {
            check(both.time_derivative(point, t), both.at(t - h).value(point), both.at(t + h).value(point));
        }
    }
}

#[test]
fn a_point_that_moves_with_the_surface_stays_on_it() {
    let mut random = Random::seeded();
    let swelling = Morphing::animated(Sphere::new(0.5).unwrap(), Sphere::new(0.8).unwrap());
    for _ in 0..200 {
        let motion = RigidMotion::between(pose(&mut random, 1.0), pose(&mut random, 1.0));
        let field = Travelling { field: swelling, motion };
        let mut point = motion.pose(0.0).push(random.direction() * 0.5);
        let steps = 2000;
        for step in 0..steps {
            // The midpoint rule, second order.
            let (t, h) = (f64::from(step) / f64::from(steps), 1.0 / f64::from(steps));
            let half_way = point + field.surface_velocity(point, t) * (0.5 * h);
            point += field.surface_velocity(half_way, t + 0.5 * h) * h;
        }
        assert!(field.at(1.0).value(point).abs() < 1e-5, "{}", field.at(1.0).value(point));
    }
}

#[test]
fn a_rigid_motion_ends_at_its_poses_and_turns_at_a_constant_rate() {
    let mut random = Random::seeded();
    for _ in 0..200 {
        let (now, later) = (pose(&mut random, 1.0), pose(&mut random, 1.0));
        let motion = RigidMotion::between(now, later);
        assert_eq!((motion.pose(0.0), motion.pose(1.0)), (now, later));
        assert!(Vector3::from(motion.spin()).norm() <= std::f64::consts::PI + 1e-12);
        let again = RigidMotion::new(now, motion.velocity(), motion.spin()).unwrap();
        let local = random.in_cube(1.0);
        assert!((again.pose(1.0).push(local) - later.push(local)).norm() < 1e-12);
        let (t, h) = (random.between(0.1, 0.9), 1e-5);
        let velocity = (motion.pose(t + h).push(local) - motion.pose(t - h).push(local)) / (2.0 * h);
        let told = motion.velocity_at(motion.pose(t).push(local), t);
        assert!((velocity - told).norm() < 1e-7, "{velocity} for {told}");
    }
    let twice = RigidMotion::new(pose(&mut random, 1.0), [0.0; 3], [0.0, 0.0, 4.0 * std::f64::consts::PI]).unwrap();
    let local = random.in_cube(1.0);
    assert!((twice.pose(0.5).push(local) - twice.pose(0.0).push(local)).norm() < 1e-12);
    assert_eq!(RigidMotion::new(pose(&mut random, 1.0), [f64::NAN, 0.0, 0.0], [0.0; 3]), None);
}

#[test]
fn a_field_that_travels_with_an_element_is_not_approached() {
    let mut random = Random::seeded();
    for _ in 0..100 {
        let now = pose(&mut random, 1.0);
        let shift = random.in_cube(3.0);
        let motion = RigidMotion::new(now, shift.into(), [0.0; 3]).unwrap();
        let field = Travelling { field: Sphere::new(0.5).unwrap(), motion };
        let path: [[Point; 2]; 3] = [0; 3].map(|_| {
            let start = random.in_cube(2.0);
            [start, start + shift]
        });
        assert!(field.approach_bound(&path, 0.0, 1.0) < 1e-14);
    }
}

#[test]
fn a_blend_is_each_of_its_fields_at_its_time_and_bounded_in_between() {
    let mut random = Random::seeded();
    let [rough, other] = [5, 6].map(|cells| {
        let lattice = cube_lattice(1.0, cells);
        with_block_bounds(measured_grid(lattice, noise(&lattice, [-0.4, 0.4], &mut random)))
    });
    let moved = Placed { field: other, placement: Rigid::new([0.1, 0.0, 0.2], [0.1, 0.2, 0.0, 1.0]).unwrap() };
    let morphing = Morphing::new(&rough, &moved);
    for _ in 0..500 {
        let point = random.in_cube(0.8);
        assert_eq!(morphing.at(0.0).value(point), rough.value(point));
        assert_eq!(morphing.at(1.0).value(point), moved.value(point));
        let t = random.unit();
        let mean = (1.0 - t) * rough.value(point) + t * moved.value(point);
        assert!((morphing.at(t).value(point) - mean).abs() < 1e-14);
        let half = random.between(0.01, 0.3);
        let region = Aabb { min: point.map(|x| x - half).into(), max: point.map(|x| x + half).into() };
        let corners = [0; 3].map(|_| point + random.in_cube(half));
        let (blend, inside) = (morphing.at(t), corners[0].lerp(&corners[1], random.unit()));
        let value = blend.value(inside);
        let enclosed = blend.enclose_box(&region).range;
        assert!(enclosed.lower - 1e-12 <= value && value <= enclosed.upper + 1e-12);
        let hull = blend.enclosure((corners[0] + corners[1] + corners[2]) / 3.0, &corners).range;
        assert!(hull.lower <= value && value <= hull.upper);
        let relaxed = blend.relaxation((corners[0] + corners[1] + corners[2]) / 3.0, &corners).enclosure.range;
        assert!(relaxed.lower <= value && value <= relaxed.upper);
    }
}
