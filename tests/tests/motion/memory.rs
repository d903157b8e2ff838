//! Elements remember the frame before: nothing within the margin is skipped, and starts are never lost.

use nalgebra::Vector3;
use sdf_core::contact::{
    Element, ElementMemory, MovingElement, Outcome, batch, contact, contact_again, speculative_margin,
};
use sdf_core::minimize::{Certified, FrankWolfe, Minimizer, ProjectedGradient};
use sdf_core::moving::{Morphing, MovingSdf, RigidMotion, Travelling};
use sdf_core::{Sdf, Simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::scenes;

use crate::{random_element, random_pose, random_weights};

#[test]
fn an_element_that_is_skipped_is_beyond_the_margin() {
    let mut random = Random::seeded();
    let (mut skipped, mut contacts, mut asked) = (0, 0, 0);
    let method = Certified { evaluations: 64, ..Certified::default() };
    for scene in scenes(1.0) {
        let margin = 0.05 * scene.size;
        let velocity = random.in_cube(0.1 * scene.size);
        let motion =
            RigidMotion::new(random_pose(&mut random, 0.2), velocity.into(), random.point_in_cube(0.1)).unwrap();
        let field = Travelling { field: &scene.field, motion };
        for id in 0..12 {
            let mut element: Element<f64, 3> = random_element(&mut random, id, 1.5 * scene.size, 0.4 * scene.size);
            let mut memory = ElementMemory::default();
            let frames = 8;
            for frame in 0..frames {
                let (before, now) = (f64::from(frame) / f64::from(frames), f64::from(frame + 1) / f64::from(frames));
                let drift = random.in_cube(0.03 * scene.size);
                let moved = element.simplex.corners.map(|corner| corner + drift + random.in_cube(0.01 * scene.size));
                // The path from time 0 to 1 on which the element makes this way between two frames.
                let path = [0, 1, 2].map(|k| {
                    let speed = (moved[k] - element.simplex.corners[k]) / (now - before);
                    [element.simplex.corners[k] - speed * before, moved[k] + speed * (1.0 - now)]
                });
                let fall = (now - before) * field.approach_bound(&path, before, now) * (1.0 + 1e-12);
                element.simplex = Simplex { corners: moved };
                let moment = field.at(now);
                let mut probe = memory;
                probe.recede(fall);
                skipped += u32::from(probe.is_apart(&moment, margin, &element));
                let outcome = contact_again(&moment, &method, margin, &element, fall, &mut memory);
                let alone = contact(&moment, &method, margin, &element);
                let name = scene.name;
                match (outcome, alone) {
                    (Outcome::Culled, Outcome::Contact(found)) => panic!("{name}: skipped {found:?}"),
                    (Outcome::Culled, _) => {}
                    (outcome, alone) => assert_eq!(outcome, alone, "{name}"),
                }
                asked += u32::from(!matches!(outcome, Outcome::Culled));
                contacts += u32::from(matches!(outcome, Outcome::Contact(_)));
                for _ in 0..20 {
                    let value = moment.value(element.simplex.point(random_weights(&mut random)));
                    assert!(memory.lower_bound() <= value + 1e-12 * scene.size, "{name}: {value}, {memory:?}");
                }
            }
        }
    }
    assert!(skipped > 1000 && contacts > 100, "{skipped} skipped, {asked} asked, {contacts} contacts");
}

#[test]
fn a_descent_from_last_frames_weights_never_ends_above_them() {
    let mut random = Random::seeded();
    let mut gained = 0;
    for scene in scenes(1.0) {
        for id in 0..40 {
            let element: Element<f64, 3> = random_element(&mut random, id, scene.size, scene.size);
            let start = random_weights(&mut random);
            let value = scene.field.value(element.simplex.point(start));
            let mut check = |from: f64, alone: f64| {
                assert!(from <= value, "{}: {from} above {value}", scene.name);
                gained += u32::from(from < alone);
            };
            let (fw, pgd) = (FrankWolfe { iterations: 2, ..Default::default() }, ProjectedGradient::default());
            let (field, simplex) = (&scene.field, &element.simplex);
            let from = fw.minimize_from(field, simplex, f64::INFINITY, start);
            check(from.sample.value, fw.minimize(field, simplex).sample.value);
            let from = pgd.minimize_from(field, simplex, f64::INFINITY, start);
            check(from.sample.value, pgd.minimize(field, simplex).sample.value);
        }
    }
    assert!(gained > 100, "{gained} ends are lower with the start");
}

#[test]
fn what_touches_before_the_next_detection_is_within_its_speculative_margin() {
    let mut random = Random::seeded();
    let mut touched = 0;
    for scene in scenes(1.0) {
        let thickness = 0.02 * scene.size;
        let motion = RigidMotion::between(random_pose(&mut random, 0.3), random_pose(&mut random, 0.3));
        let swollen = sdf_core::combine::Offset::new(&scene.field, 0.1 * scene.size).unwrap();
        let field = Travelling { field: Morphing::new(&scene.field, swollen), motion };
        for id in 0..30 {
            let start: Element<f64, 3> = random_element(&mut random, id, 1.5 * scene.size, 0.3 * scene.size);
            let way = random.in_cube(scene.size);
            let path = start.simplex.corners.map(|corner| [corner, corner + way + random.in_cube(0.2 * scene.size)]);
            let moving = MovingElement { id, vertices: start.vertices, path };
            let margin = speculative_margin(&field, thickness, &path);
            let method = Certified { evaluations: 256, tolerance: 1e-6, ..Certified::default() };
            let is_candidate = matches!(contact(&field.at(0.0), &method, margin, &moving.at(0.0)), Outcome::Contact(_));
            let touches = (0..40).any(|step| {
                let time = f64::from(step) / 39.0;
                let point = moving.at(time).simplex.point(random_weights(&mut random));
                field.at(time).value(point) <= thickness
            });
            touched += u32::from(touches);
            assert!(is_candidate || !touches, "{}: {margin}", scene.name);
        }
    }
    assert!(touched > 100, "{touched} touch");
}

#[test]
fn a_batch_with_a_margin_for_each_element_has_the_contacts_of_each() {
    let mut random = Random::seeded();
    for scene in scenes(1.0) {
        let elements: Vec<Element<f64, 3>> =
            (0..37).map(|id| random_element(&mut random, id, 1.5 * scene.size, 0.3 * scene.size)).collect();
        let margins: Vec<f64> = elements.iter().map(|_| scene.size * random.between(-0.1, 0.5)).collect();
        let method = FrankWolfe::default();
        let mut seen = 0;
        batch::contacts::<_, _, _, _, 3, 8>(&scene.field, &method, &margins[..], &elements, |index, outcome| {
            assert_eq!(outcome, contact(&scene.field, &method, margins[index], &elements[index]), "{}", scene.name);
            seen += 1;
        });
        assert_eq!(seen, elements.len());
        let mut refused = 0;
        batch::contacts::<_, _, _, _, 3, 8>(&scene.field, &method, &margins[..30], &elements, |index, outcome| {
            assert_eq!(matches!(outcome, Outcome::NotFinite), index >= 30, "{}", scene.name);
            refused += 1;
        });
        assert_eq!(refused, elements.len());
    }
}

#[test]
fn an_element_that_is_not_finite_is_told_again_and_forgets() {
    let ball = sdf_core::shapes::Sphere::new(1.0).unwrap();
    let method = FrankWolfe::default();
    let at = |x: f64| Element { id: 0, vertices: [0], simplex: Simplex { corners: [Vector3::new(x, 0.0, 0.0)] } };
    let mut memory = ElementMemory::default();
    assert_eq!(contact_again(&ball, &method, 0.0, &at(10.0), 0.0, &mut memory), Outcome::Culled);
    assert!(memory.lower_bound() > 8.9);
    assert_eq!(contact_again(&ball, &method, 0.0, &at(f64::NAN), 0.0, &mut memory), Outcome::NotFinite);
    assert_eq!(memory.weights(), None);
    let outcome = contact_again(&ball, &method, 0.0, &at(0.5), 0.0, &mut memory);
    assert!(matches!(outcome, Outcome::Contact(_)), "{outcome:?}");
}
