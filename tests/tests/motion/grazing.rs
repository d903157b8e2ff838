//! Cases in which a bound is nearly tight, so that a margin or a path which is a little too short leaves out a contact: clusters so
//! small that their box tells what their faces tell, and elements that go straight to the surface and just touch it.

use nalgebra::Vector3;
use sdf_core::contact::{CLUSTER_SIZE, Element, Outcome, contact, speculative_margin};
use sdf_core::grid::Lattice;
use sdf_core::minimize::{Certified, FrankWolfe};
use sdf_core::moving::{Morphing, MovingSdf, RigidMotion, Travelling};
use sdf_core::placed::Rigid;
use sdf_core::{EnclosedSdf, Sdf, Simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{measured_grid, node_indices, scenes, with_block_bounds};

use crate::clusters::Faces;
use crate::{random_element, random_pose};

type Point = Vector3<f64>;

/// Of the cases of a law at least this share must be as near as [`TIGHT`].
const SHARE: f64 = 0.5;

/// A bound is nearly tight where no more than this part of it is slack.
const TIGHT: f64 = 0.05;

#[test]
fn a_cluster_whose_nearest_face_grazes_the_margin_is_visited() {
    let mut random = Random::seeded();
    let (mut tight, mut all) = (0, 0);
    for scene in scenes(1.0) {
        for _ in 0..20 {
            let (centre, radius) = (random.in_cube(1.5 * scene.size), 1e-4 * scene.size);
            let points = (0..CLUSTER_SIZE as u32 + 2).map(|_| (centre + random.in_cube(radius)).into()).collect();
            let faces = (0..CLUSTER_SIZE as u32).map(|k| [k, k + 1, k + 2]).collect();
            let pose = random_pose(&mut random, 0.2 * scene.size);
            let faces = Faces::new(points, faces, Some(pose));
            let lowest = faces.elements().map(|element| {
                match contact(&scene.field, &FrankWolfe::default(), 1e6 * scene.size, &element) {
                    Outcome::Contact(contact) => contact.distance,
                    other => panic!("{}: {other:?}", scene.name),
                }
            });
            let margin = lowest.fold(f64::INFINITY, f64::min);
            assert_eq!(faces.near(&scene.field, margin).len(), faces.count(), "{}: margin {margin}", scene.name);
            tight += u32::from(faces.near(&scene.field, margin - TIGHT * scene.size).is_empty());
            all += 1;
        }
    }
    assert!(f64::from(tight) > SHARE * f64::from(all), "{tight} of {all} clusters are near enough to their bound");
}

/// The vector along the gradient on which φ falls to `level`, and a little further; `None` where it does not.
fn straight_way(field: &impl Sdf, from: Point, level: f64, size: f64) -> Option<Point> {
    let downhill = -field.evaluate(from).gradient.try_normalize(1e-9)?;
    let falls = |way: f64| field.value(from + downhill * way) <= level;
    let step = 0.01 * size;
    let first = (1..400).map(|k| f64::from(k) * step).find(|way| falls(*way))?;
    let (mut low, mut high) = (first - step, first);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if falls(middle) { high = middle } else { low = middle }
    }
    Some(downhill * (high + 1e-4 * size))
}

/// Is the element, which touches before the end of its path, within its margin at the beginning? Returns if the margin is tight.
fn check(name: &str, field: &impl MovingSdf, thickness: f64, element: &Element<f64, 3>, way: Point) -> bool {
    let path = element.simplex.corners.map(|corner| [corner, corner + way]);
    let touches = path.iter().any(|corner| field.at(1.0).value(corner[1]) <= thickness);
    let margin = speculative_margin(field, thickness, &path);
    let method = Certified { evaluations: 256, tolerance: 1e-6, ..Certified::default() };
    match contact(&field.at(0.0), &method, margin, element) {
        Outcome::Contact(found) => (1.0 - TIGHT) * (margin - thickness) < found.distance - thickness,
        other => {
            assert!(!touches, "{name}: touches at the end, but with the margin {margin} it is {other:?}");
            false
        }
    }
}

#[test]
fn what_touches_at_the_very_end_of_its_path_is_within_its_speculative_margin() {
    let mut random = Random::seeded();
    let (mut tight, mut all) = ([0; 3], 0);
    let still = Rigid::new([0.0; 3], [0.0, 0.0, 0.0, 1.0]).unwrap();
    for scene in scenes(1.0) {
        let (field, thickness) = (&scene.field, 0.02 * scene.size);
        for id in 0..20 {
            let element: Element<f64, 3> = random_element(&mut random, id, 1.2 * scene.size, 1e-4 * scene.size);
            let from = element.simplex.corners[0];
            let Some(way) = straight_way(field, from, thickness, scene.size) else { continue };
            all += 1;
            // The element comes to the field, the field to the element, and the field grows.
            tight[0] += u32::from(check(scene.name, field, thickness, &element, way));
            let motion = RigidMotion::new(still, (-way).into(), [0.0; 3]).unwrap();
            let moving = Travelling { field, motion };
            tight[1] += u32::from(check(scene.name, &moving, thickness, &element, Vector3::zeros()));
            let growth = field.value(from) - thickness + 1e-4 * scene.size;
            if let Some(grown) = sdf_core::combine::Offset::new(field, growth).filter(|_| growth > 0.0) {
                let growing = Morphing::new(field, grown);
                tight[2] += u32::from(check(scene.name, &growing, thickness, &element, Vector3::zeros()));
            }
        }
    }
    let enough = SHARE * f64::from(all);
    assert!(tight.iter().all(|count| f64::from(*count) > enough), "{tight:?} of {all} margins are tight");
}

/// A grid that rises along x by 1 a unit, and by 7 in the middle of one of its thirds: in a block of 8 cells but for the last, which the
/// bounds of the next block know of.
fn staircase(steep_third: u32) -> impl EnclosedSdf {
    let blocks_of_a_third = 3;
    let lattice = Lattice::new([0.0; 3], 1.0 / 72.0, [73, 9, 9]).unwrap();
    let is_steep = |cell: u32| cell / 8 == blocks_of_a_third * steep_third + 1 && cell % 8 < 7;
    let slope = |cell: u32| if is_steep(cell) { 7.0 } else { 1.0 };
    let height = |[x, ..]: [u32; 3]| ((0..x).map(slope).sum::<f64>() / 72.0) as f32;
    with_block_bounds(measured_grid(lattice, node_indices(lattice.nodes()).map(height).collect()))
}

#[test]
fn every_third_of_a_path_counts_for_the_speculative_margin() {
    for third in 0..3 {
        let field = staircase(third);
        let path = [71.0, 1.0].map(|cell| Vector3::new(cell / 72.0, 1.0 / 18.0, 1.0 / 18.0));
        let thickness = field.value(path[1]) + 1e-6;
        let margin = speculative_margin(&field, thickness, &[path]);
        let element = Element { id: 0, vertices: [0], simplex: Simplex { corners: [path[0]] } };
        let outcome = contact(&field, &FrankWolfe::default(), margin, &element);
        assert!(matches!(outcome, Outcome::Contact(_)), "steep in third {third}: margin {margin}, {outcome:?}");
        // A margin by the other two thirds alone would leave it out.
        let others = [0, 1, 2].into_iter().filter(|part| *part != 2 - third).map(f64::from);
        let bounds = others.map(|part| field.approach_bound(&[path], part / 3.0, (part + 1.0) / 3.0));
        let fall = field.value(path[0]) - thickness;
        assert!(bounds.fold(0.0, f64::max) < 0.8 * fall, "steep in third {third}");
    }
}
