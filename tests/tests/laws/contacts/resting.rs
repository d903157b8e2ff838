//! Contacts at φ = margin exactly: no resting element is lost, by any method.

use nalgebra::Vector3;
use sdf_core::contact::ContactStatus;
use sdf_core::placed::{Placed, Similarity};
use sdf_core::shapes::{Cuboid, HalfSpace};
use sdf_tests::methods::{Method, methods};
use sdf_tests::random::Random;
use sdf_tests::scene_field::SceneField;
use sdf_tests::scenes::{IDENTITY, cube_lattice, sampled, with_block_bounds};
use sdf_tests::stability::answer::{Fate, Number, query};
use sdf_tests::stability::problem::BUDGET;

/// Fields with the surface at z = 0 around the origin. Their lengths are multiples of `unit` and exact in f32.
fn floors(unit: f64) -> Vec<(&'static str, SceneField)> {
    let plane = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
    let lifted = |field: SceneField, z: f64| {
        let placement = Similarity::new([0.0, 0.0, z * unit], IDENTITY, 1.0).unwrap();
        SceneField::new(Placed { field, placement })
    };
    let cuboid = SceneField::new(Cuboid::new([4.0 * unit, 4.0 * unit, 2.0 * unit]).unwrap());
    let half = SceneField::new(Cuboid::new([2.0 * unit, 2.0 * unit, unit]).unwrap());
    let doubled = Similarity::new([0.0, 0.0, -2.0 * unit], IDENTITY, 2.0).unwrap();
    let lattice = cube_lattice(4.0 * unit, 8);
    vec![
        ("plane", SceneField::new(plane)),
        ("cuboid", lifted(cuboid, -2.0)),
        ("scaled cuboid", SceneField::new(Placed { field: half, placement: doubled })),
        ("grid", SceneField::new(sampled(&plane, lattice, 1.0))),
        ("bounded grid", SceneField::new(with_block_bounds(sampled(&plane, lattice, 1.0)))),
        ("placed grid", lifted(SceneField::new(sampled(&plane, lattice, 1.0)), 0.0)),
    ]
}

#[test]
fn an_element_exactly_at_the_margin_is_a_contact() {
    let mut random = Random::seeded();
    for unit in [2.0_f64.powi(-20), 1.0, 2.0_f64.powi(20)] {
        for (name, field) in floors(unit) {
            for margin in [0.0, 0.25, 0.5, -0.5] {
                for _ in 0..20 {
                    let mut flat = || (random.between(-2.0, 2.0) * 64.0).round() / 64.0;
                    let corners = [(); 3].map(|()| Vector3::new(flat(), flat(), margin) * unit);
                    for count in 1..=3 {
                        for method in methods(count, BUDGET) {
                            for number in Number::BOTH {
                                let resting = query(&field, &method, margin * unit, &corners[..count], number);
                                let context = || {
                                    format!("{name} at {unit:e} by {method:?} in {number:?}, {count} of {corners:?}")
                                };
                                let is_contact = matches!(resting.fate, Fate::Contact(_));
                                let is_at_margin = resting.minimum.as_ref().unwrap().value == margin * unit;
                                assert!(is_contact && is_at_margin, "{}: {resting:?}", context());
                                let below = match number {
                                    Number::Single => f64::from(((margin * unit) as f32).next_down()),
                                    Number::Double => (margin * unit).next_down(),
                                };
                                let hovering = query(&field, &method, below, &corners[..count], number);
                                assert!(
                                    matches!(hovering.fate, Fate::Separated | Fate::Culled),
                                    "{}: {hovering:?}",
                                    context()
                                );
                            }
                        }
                    }
                }
            }
        }
    }
}

/// One corner at the margin, the rest above. A method that evaluates corners finds the contact, any other leaves it open.
#[test]
fn an_element_that_rests_on_a_corner_is_found_or_left_open() {
    let mut random = Random::seeded();
    for (name, field) in floors(1.0) {
        for round in 0..60 {
            let mut coordinate = || (random.between(-2.0, 2.0) * 64.0).round() / 64.0;
            let mut corners = [(); 3].map(|()| Vector3::new(coordinate(), coordinate(), 0.75 + coordinate() / 4.0));
            for count in 2..=3 {
                corners[round % count].z = 0.125;
                for method in methods(count, BUDGET) {
                    for number in Number::BOTH {
                        let resting = query(&field, &method, 0.125, &corners[..count], number);
                        let context = || format!("{name} by {method:?} in {number:?}: {resting:?} of {corners:?}");
                        let found = resting.minimum.as_ref().unwrap_or_else(|| panic!("{}", context()));
                        match resting.fate {
                            Fate::Contact(status) => {
                                assert!(found.value == 0.125 && status != ContactStatus::OutsideGrid, "{}", context());
                            }
                            // First + (corner − first) may round up to the next number.
                            Fate::Separated => assert!(found.lower_bound <= 0.125, "{}", context()),
                            Fate::NotFinite | Fate::Culled => panic!("{}", context()),
                        }
                    }
                }
                corners[round % count].z = 0.75;
            }
        }
    }
}

/// Uses elements along a plane's normal, where φ is as steep as the slope bound: only rounding is left between bound and value.
/// A bound without an allowance for rounding would cull elements that touch with their lower end.
#[test]
fn an_element_along_the_steepest_direction_that_touches_with_its_end_is_not_culled() {
    let mut random = Random::seeded();
    for _ in 0..2000 {
        let normal = random.direction();
        let plane = SceneField::new(HalfSpace::new(normal.into(), random.between(-1.0, 1.0)).unwrap());
        let (from, length) = (random.in_cube(2.0), random.between(0.0, 2.0));
        let corners = [from, from + normal * length, from + normal * (0.5 * length)];
        for number in Number::BOTH {
            for count in 2..=3 {
                for method in methods(count, 8) {
                    let corners = &corners[..count];
                    let value =
                        |corner| query(&plane, &any_method(), f64::INFINITY, &[corner], number).minimum.unwrap().value;
                    let lowest = corners.iter().map(|corner| value(*corner)).fold(f64::INFINITY, f64::min);
                    let touching = query(&plane, &method, lowest, corners, number);
                    let context = || format!("{lowest} by {method:?} in {number:?}: {touching:?} of {corners:?}");
                    // First + (corner − first) may round up to the next number.
                    let found = touching.minimum.as_ref().unwrap_or_else(|| panic!("{}", context()));
                    assert!(found.lower_bound <= lowest, "{}", context());
                }
            }
        }
    }
}

/// A method for vertices, on which all methods return the same value.
fn any_method() -> Method {
    methods(1, 0).remove(0)
}
