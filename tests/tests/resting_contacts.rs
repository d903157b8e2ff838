//! Contacts at φ = margin exactly: nothing that rests is lost, whatever the method.

use nalgebra::Vector3;
use sdf_core::contact::ContactStatus;
use sdf_core::placed::{Placed, Similarity};
use sdf_core::shapes::{Cuboid, HalfSpace};
use sdf_tests::any_field::AnyField;
use sdf_tests::methods::{Method, methods};
use sdf_tests::random::Random;
use sdf_tests::scenes::{bounded, cube_lattice, sampled};
use sdf_tests::stability::answer::{Fate, Number, ask};
use sdf_tests::stability::problem::BUDGET;

/// Fields whose surface lies at z = 0 around the origin, where their numbers, in units of `unit`, are exact in f32.
fn floors(unit: f64) -> Vec<(&'static str, AnyField)> {
    let plane = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
    let from_f64 = |z: f64| Similarity::new([0.0, 0.0, z * unit], [0.0, 0.0, 0.0, 1.0], 1.0).unwrap();
    let on = |field: AnyField, z: f64| AnyField::new(Placed { field, placement: from_f64(z) });
    let cuboid = AnyField::new(Cuboid::new([4.0 * unit, 4.0 * unit, 2.0 * unit]).unwrap());
    let half = AnyField::new(Cuboid::new([2.0 * unit, 2.0 * unit, unit]).unwrap());
    let doubled = Similarity::new([0.0, 0.0, -2.0 * unit], [0.0, 0.0, 0.0, 1.0], 2.0).unwrap();
    let lattice = cube_lattice(4.0 * unit, 8);
    vec![
        ("plane", AnyField::new(plane)),
        ("cuboid", on(cuboid, -2.0)),
        ("scaled cuboid", AnyField::new(Placed { field: half, placement: doubled })),
        ("grid", AnyField::new(sampled(&plane, lattice, 1.0))),
        ("bounded grid", AnyField::new(bounded(sampled(&plane, lattice, 1.0)))),
        ("placed grid", on(AnyField::new(sampled(&plane, lattice, 1.0)), 0.0)),
    ]
}

#[test]
fn what_rests_at_the_margin_exactly_is_a_contact() {
    let mut random = Random::of_test();
    for unit in [2.0_f64.powi(-20), 1.0, 2.0_f64.powi(20)] {
        for (name, field) in floors(unit) {
            for margin in [0.0, 0.25, 0.5, -0.5] {
                for _ in 0..20 {
                    let mut flat = || (random.between(-2.0, 2.0) * 64.0).round() / 64.0;
                    let corners = [(); 3].map(|()| Vector3::new(flat(), flat(), margin) * unit);
                    for count in 1..=3 {
                        for method in methods(count, BUDGET) {
                            for number in Number::BOTH {
                                let rests = ask(&field, &method, margin * unit, &corners[..count], number);
                                let told =
                                    format!("{name} in {unit:e} by {method:?} in {number:?}: {rests:?} of {corners:?}");
                                let is_contact = matches!(rests.fate, Fate::Contact(_));
                                assert!(is_contact && rests.found.unwrap().value == margin * unit, "{told}");
                                let below = match number {
                                    Number::Single => f64::from(((margin * unit) as f32).next_down()),
                                    Number::Double => (margin * unit).next_down(),
                                };
                                let hovers = ask(&field, &method, below, &corners[..count], number);
                                assert!(
                                    matches!(hovers.fate, Fate::Separated | Fate::Culled),
                                    "{told}, then {hovers:?}"
                                );
                            }
                        }
                    }
                }
            }
        }
    }
}

/// With one corner at the margin and the rest above: a method that looks at corners finds it, one that does not leaves it open.
#[test]
fn what_rests_on_a_corner_is_found_or_left_open() {
    let mut random = Random::of_test();
    for (name, field) in floors(1.0) {
        for round in 0..60 {
            let mut any = || (random.between(-2.0, 2.0) * 64.0).round() / 64.0;
            let mut corners = [(); 3].map(|()| Vector3::new(any(), any(), 0.75 + any() / 4.0));
            for count in 2..=3 {
                corners[round % count].z = 0.125;
                for method in methods(count, BUDGET) {
                    for number in Number::BOTH {
                        let rests = ask(&field, &method, 0.125, &corners[..count], number);
                        let told = format!("{name} by {method:?} in {number:?}: {rests:?} of {corners:?}");
                        let found = rests.found.as_ref().unwrap_or_else(|| panic!("{told}"));
                        match rests.fate {
                            Fate::Contact(status) => {
                                assert!(found.value == 0.125 && status != ContactStatus::OutsideGrid, "{told}");
                            }
                            // First + (corner − first) may round to the next number above.
                            Fate::Separated => assert!(found.lower_bound <= 0.125, "{told}"),
                            Fate::NotFinite | Fate::Culled => panic!("{told}"),
                        }
                    }
                }
                corners[round % count].z = 0.75;
            }
        }
    }
}

/// Straight up a plane's normal the slope bound is met: between a bound by it and the values only rounding is left, and a bound
/// that forgot it would cull what touches with its lower end.
#[test]
fn what_touches_with_the_end_of_its_steepest_way_is_not_culled() {
    let mut random = Random::of_test();
    for _ in 0..2000 {
        let normal = random.direction();
        let plane = AnyField::new(HalfSpace::new(normal.into(), random.between(-1.0, 1.0)).unwrap());
        let (from, length) = (random.in_cube(2.0), random.between(0.0, 2.0));
        let corners = [from, from + normal * length, from + normal * (0.5 * length)];
        for number in Number::BOTH {
            for count in 2..=3 {
                for method in methods(count, 8) {
                    let corners = &corners[..count];
                    let value = |corner| {
                        ask(&plane, &method_of_vertices(), f64::INFINITY, &[corner], number).found.unwrap().value
                    };
                    let least = corners.iter().map(|corner| value(*corner)).fold(f64::INFINITY, f64::min);
                    let touches = ask(&plane, &method, least, corners, number);
                    let told = format!("{least} by {method:?} in {number:?}: {touches:?} of {corners:?}");
                    // First + (corner − first) may round to the next number above.
                    let found = touches.found.as_ref().unwrap_or_else(|| panic!("{told}"));
                    assert!(found.lower_bound <= least, "{told}");
                }
            }
        }
    }
}

fn method_of_vertices() -> Method {
    methods(1, 0).remove(0)
}
