//! A closed form that is written reads as the same field, bit for bit, and is written again as the same text.

use std::collections::BTreeSet;
use std::fs;

use sdf_core::combine::{Difference, Intersection, Offset, Shell, SmoothUnion};
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placed, Similarity, Stretch};
use sdf_core::shapes::{
    Bowl, Capsule, Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Horseshoe, Octahedron, RoundedBox, Sphere, Torus,
};
use sdf_core::{AnyField, Sdf};
use sdf_formats::field_file::{self, Field};
use tempfile::TempDir;

use crate::grid_samples::{DENSE, Made};
use crate::random::Random;

/// Every shape that the reader knows but `grid`.
const SHAPES: &str = "bowl box capsule cone cylinder difference ellipsoid half_space horseshoe intersection octahedron offset \
                      rounded_box shell smooth_union sphere torus union";

/// A number in \[low, high) with all digits.
fn number(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * (random.bits() >> 11) as f64 / (1_u64 << 53) as f64
}

fn length(random: &mut Random) -> f64 {
    number(random, 0.1, 2.0)
}

fn lengths(random: &mut Random) -> [f64; 3] {
    std::array::from_fn(|_| length(random))
}

fn vector(random: &mut Random) -> [f64; 3] {
    std::array::from_fn(|_| number(random, -1.0, 1.0))
}

fn shape(random: &mut Random) -> AnyField {
    let [a, b, c] = lengths(random);
    let shape = match random.below(12) {
        0 => Sphere::new(a).map(AnyField::Sphere),
        1 => HalfSpace::new(vector(random), a - b).map(AnyField::HalfSpace),
        2 => Cuboid::new([a, b, c]).map(AnyField::Cuboid),
        3 => RoundedBox::new([a, b, c], length(random)).map(AnyField::RoundedBox),
        4 => Capsule::new(vector(random), vector(random), a).map(AnyField::Capsule),
        5 => Cylinder::new(a, b).map(AnyField::Cylinder),
        6 => Cone::new(number(random, 0.1, 1.5), a).map(AnyField::Cone),
        7 => Torus::new(a + b, a).map(AnyField::Torus),
        8 => Octahedron::new(a).map(AnyField::Octahedron),
        9 => Ellipsoid::new([a, b, c]).map(AnyField::Ellipsoid),
        10 => Bowl::new(a, a * number(random, -0.9, 0.9), 0.1 * b).map(AnyField::Bowl),
        _ => Horseshoe::new(a, 0.5 * a, number(random, 0.1, 1.5), b, c).map(AnyField::Horseshoe),
    };
    shape.unwrap()
}

fn similarity(random: &mut Random) -> Similarity {
    let rotation = [number(random, -1.0, 1.0), number(random, -1.0, 1.0), number(random, -1.0, 1.0), length(random)];
    // Each of the three is left out at times.
    let translation = if random.below(3) == 0 { [0.0; 3] } else { vector(random) };
    let rotation = if random.below(3) == 0 { [0.0, 0.0, 0.0, 1.0] } else { rotation };
    let scale = if random.below(3) == 0 { 1.0 } else { length(random) };
    Similarity::new(translation, rotation, scale).unwrap()
}

fn field(random: &mut Random, depth: usize) -> AnyField {
    if depth == 0 {
        return shape(random);
    }
    let part = |random: &mut Random| {
        let depth = random.below(depth);
        field(random, depth)
    };
    let pair = |random: &mut Random| (part(random), part(random));
    match random.below(10) {
        0 => shape(random),
        1 => {
            let count = 1 + random.below(4);
            AnyField::union((0..count).map(|_| pair(random).0).collect()).unwrap()
        }
        2 | 3 => {
            let (a, b) = pair(random);
            AnyField::Intersection(Box::new(Intersection(a, b)))
        }
        4 => {
            let (a, b) = pair(random);
            AnyField::Difference(Box::new(Difference(a, b)))
        }
        5 => {
            let (a, b) = pair(random);
            let blend = if random.below(2) == 0 { 0.25 } else { length(random) };
            AnyField::SmoothUnion(Box::new(SmoothUnion::new(a, b, blend).unwrap()))
        }
        6 => AnyField::Offset(Box::new(Offset::new(pair(random).0, number(random, -0.2, 0.2)).unwrap())),
        7 => AnyField::Shell(Box::new(Shell::new(pair(random).0, length(random)).unwrap())),
        8 => pair(random).0.placed(similarity(random)),
        _ => {
            let [x, y, z] = lengths(random);
            let stretched = Placed { field: pair(random).0, placement: Stretch::new([x, -y, z]).unwrap() };
            AnyField::Stretched(Box::new(stretched)).placed(similarity(random))
        }
    }
}

/// The bits of value and gradient at random points.
fn bits(field: &AnyField, seed: u64) -> Vec<[u64; 4]> {
    let mut state = seed;
    let mut coordinate = || sdf_procedural::random::next_bits(&mut state) as i64 as f64 / (1_u64 << 61) as f64;
    let samples = (0..40).map(|_| field.evaluate(Vector3::new(coordinate(), coordinate(), coordinate())));
    samples.map(|at| [at.value, at.gradient.x, at.gradient.y, at.gradient.z].map(f64::to_bits)).collect()
}

#[test]
fn every_closed_form_is_read_as_it_was_written_bit_for_bit() {
    let mut random = Random::from_clock();
    let mut written = BTreeSet::new();
    for _ in 0..2000 {
        let depth = random.below(6);
        let (field, seed) = (field(&mut random, depth), random.bits());
        let text = field_file::to_text(&field, "a field").unwrap();
        let read = field_file::read_text(&text, "a field").unwrap_or_else(|error| panic!("{error}\n{text}"));
        assert_eq!(bits(&read, seed), bits(&field, seed), "{text}");
        assert_eq!(field_file::to_text(&read, "a field").unwrap(), text);
        let quoted = text.split("shape = \"").skip(1).filter_map(|rest| rest.split('"').next());
        written.extend(quoted.map(str::to_owned));
    }
    assert_eq!(written.into_iter().collect::<Vec<_>>().join(" "), SHAPES);
}

/// Angles in degrees, lists of parts, and poses come back as a person writes them.
#[test]
fn a_text_in_the_writers_layout_is_written_again_as_it_was() {
    let text = "[field]\n\
        shape = \"intersection\"\n\
        pose = { translation = [0.0, 0.1, -2.0], scale = [1.0, 2.0, -0.5] }\n\
        of = [\n    \
            { shape = \"cone\", half_angle_deg = 30.0, height = 1e-7 },\n    \
            { shape = \"sphere\", radius = 0.1, pose = { rotation = [0.0, 0.0, 2.0, 0.0], scale = 3.0 } },\n    \
            { shape = \"half_space\", normal = [0.0, 0.0, 7.0], offset = -0.0 },\n    \
            { shape = \"horseshoe\", radius = 1.0, thickness = 0.3, bend_deg = 77.7, leg = 0.5, half_depth = 0.2 },\n    \
            { shape = \"torus\", major_radius = 1.0, minor_radius = 0.25, pose = {} },\n\
        ]\n";
    assert_eq!(field_file::to_text(&field_file::read_text(text, "").unwrap(), "").unwrap(), text);
}

/// Joined in pairs, lists of any length inside lists come back as no deeper lists.
#[test]
fn a_list_of_parts_is_written_as_a_list() {
    for count in 1..40 {
        for inner in 1..6 {
            let sphere = "{ shape = 'sphere', radius = 1.0 }";
            let list = |part: &str, count| vec![part; count].join(", ");
            let nested = format!("{{ shape = 'intersection', of = [{}] }}", list(sphere, inner));
            let parts = [list(sphere, count), nested, list(sphere, count)].join(", ");
            let text = format!("[field]\nshape = 'intersection'\nof = [{parts}]\n");
            let written = field_file::to_text(&field_file::read_text(&text, "").unwrap(), "").unwrap();
            assert!(written.matches("intersection").count() <= 2, "{text}\n{written}");
            let again = field_file::to_text(&field_file::read_text(&written, "").unwrap(), "").unwrap();
            assert_eq!((again, written.matches("sphere").count()), (written.clone(), 2 * count + inner));
        }
    }
}

/// Trees of pairs, complete and not, come back as the same trees.
#[test]
fn a_tree_of_pairs_is_read_as_the_same_tree() {
    fn tree(random: &mut Random, depth: usize) -> AnyField {
        if depth == 0 || random.below(5) == 0 {
            return shape(random);
        }
        let (a, b) = (tree(random, depth - 1), tree(random, depth - 1));
        AnyField::SmoothUnion(Box::new(SmoothUnion::new(a, b, 0.25).unwrap()))
    }
    let mut random = Random::from_clock();
    for _ in 0..500 {
        let depth = random.below(6);
        let tree = tree(&mut random, depth);
        let text = field_file::to_text(&tree, "a tree").unwrap();
        let read = field_file::read_text(&text, "a tree").unwrap();
        assert_eq!(format!("{read:?}"), format!("{tree:?}"), "{text}");
    }
}

#[test]
fn shapes_are_written_as_deep_as_they_are_read() {
    let nested = |levels: usize| {
        let sphere = AnyField::Sphere(Sphere::new(1.0).unwrap());
        (0..levels).fold(sphere, |inner, _| AnyField::Shell(Box::new(Shell::new(inner, 0.1).unwrap())))
    };
    let text = field_file::to_text(&nested(63), "deep").unwrap();
    let read = field_file::read_text(&text, "deep").unwrap();
    assert_eq!(bits(&read, 1), bits(&nested(63), 1));
    let error = field_file::to_text(&nested(64), "deep").unwrap_err().to_string();
    assert!(error.starts_with("deep: field.of.of.") && error.contains("deeper than 64 shapes"), "{error}");
}

#[test]
fn a_grid_among_the_parts_is_refused_by_its_place() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("ball.sdf.h5");
    Made::new([9, 9, 9], DENSE).write(&path);
    let Field::Grid(stored) = field_file::read(&path).unwrap() else { panic!("shapes") };
    let parts = vec![AnyField::Sphere(Sphere::new(1.0).unwrap()), AnyField::from(stored.grid)];
    let target = folder.path().join("union.sdf.toml");
    let error = field_file::write(&target, &AnyField::union(parts).unwrap()).unwrap_err().to_string();
    assert!(error.contains("union.sdf.toml: field.of[1]: a grid cannot be written in TOML: save it"), "{error}");
    assert!(!target.exists());
}

#[test]
fn a_file_has_the_text() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("shell.sdf.toml");
    let shell = AnyField::Shell(Box::new(Shell::new(shape(&mut Random::new(7)), 0.1).unwrap()));
    field_file::write(&path, &shell).unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), field_file::to_text(&shell, "").unwrap());
    let Field::Analytic(read) = field_file::read(&path).unwrap() else { panic!("a grid") };
    assert_eq!(bits(&read, 2), bits(&shell, 2));
    let missing = folder.path().join("no folder").join("shell.sdf.toml");
    let error = field_file::write(&missing, &shell).unwrap_err().to_string();
    assert!(error.contains("shell.sdf.toml: "), "{error}");
}
