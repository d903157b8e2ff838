//! Metamorphic laws: pairs of queries with related answers, though neither answer is known. Scenes are moved, rotated, scaled and
//! mirrored, corners permuted, elements divided, fields united; for every field, method, number type and kind of element.
//!
//! The intervals from lower bound to value overlap without exception, for the truth is in both. Equality of the values holds for
//! nearly all searches: where two directions of descent are equally steep, rounding chooses.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use sdf_core::Sdf;
use sdf_core::combine::Union;
use sdf_core::placed::{Placed, Similarity, Stretch};
use sdf_tests::methods::{Method, methods};
use sdf_tests::oracle::random_simplex;
use sdf_tests::random::Random;
use sdf_tests::scene_field::SceneField;
use sdf_tests::scenes::{IDENTITY, scenes};
use sdf_tests::stability::answer::{FoundMinimum, Number, query};
use sdf_tests::stability::problem::{BUDGET, ROUNDINGS, ROUNDINGS_OF_GAP, TOLERANCE, certifies, name};

type Point = Vector3<f64>;

/// A query before and after a change.
struct Pair {
    before: (SceneField, Vec<Point>),
    after: (SceneField, Vec<Point>),
    /// The factor from lengths before to lengths after.
    scale: f64,
}

fn minimum(field: &SceneField, method: &Method, corners: &[Point], number: Number) -> FoundMinimum {
    query(field, method, f64::INFINITY, corners, number).minimum.unwrap()
}

/// The allowed error of a value.
fn rounding((field, corners): &(SceneField, Vec<Point>), size: f64, number: Number) -> f64 {
    let largest = corners.iter().fold(size, |max, corner| max.max(corner.amax()));
    ROUNDINGS * number.epsilon() * field.slope_bound() * largest
}

/// The allowed difference between two values of the same descent.
///
/// A search that stops at a tolerance may stop on either side of it. Only the methods named here go on until rounding stops
/// them, or their steps are spent.
fn allowed_difference(method: &Method, range: f64, rounding: f64) -> f64 {
    let descends = matches!(
        method,
        Method::FrankWolfe(_) | Method::ProjectedGradient(_) | Method::PointSampling(_) | Method::GoldenSection(_)
    );
    if descends { 1e-5 * range + 8.0 * rounding } else { 2.0 * TOLERANCE * range + 8.0 * rounding }
}

fn longest_edge(corners: &[Point]) -> f64 {
    let lengths = corners.iter().flat_map(|a| corners.iter().map(move |b| (a - b).norm()));
    lengths.fold(0.0, f64::max)
}

/// The number of answers of each method in each number type, and how many differed.
#[derive(Default)]
struct Counts(BTreeMap<String, [usize; 2]>);

impl Counts {
    fn add(&mut self, method: &Method, number: Number, differs: bool) {
        let [all, differing] = self.0.entry(format!("{} in {}", name(method), number.name())).or_default();
        *all += 1;
        *differing += usize::from(differs);
    }

    fn assert_at_most_one_in(&self, count: usize) {
        println!("{:?}", self.0);
        for (method, [all, differing]) in &self.0 {
            assert!(differing * count <= *all, "{method}: {differing} of {all} differ");
        }
    }
}

/// Checks that the intervals of all pairs overlap, and that the values agree for all but one in a hundred.
fn assert_answers_agree(budget: u32, change: impl Fn(&SceneField, f64, &[Point], &mut Random) -> Pair) {
    let mut random = Random::seeded();
    let mut counts = Counts::default();
    for scene in scenes(1.0) {
        let (size, scene_name) = (scene.size, scene.name);
        let field = scene.field;
        for round in 0..18 {
            let triangle = random_simplex::<3>(&mut random, size).corners;
            let corners = &triangle[..round % 3 + 1];
            let Pair { before: original, after: changed, scale } = change(&field, size, corners, &mut random);
            for method in methods(corners.len(), budget) {
                for number in Number::BOTH {
                    let [before, after] =
                        [&original, &changed].map(|(field, corners)| minimum(field, &method, corners, number));
                    let slack =
                        rounding(&original, size, number) + rounding(&changed, size * scale.max(1.0), number) / scale;
                    let (value, lower_bound) = (after.value / scale, after.lower_bound / scale);
                    let overlap = before.lower_bound <= value + slack && lower_bound <= before.value + slack;
                    assert!(
                        overlap,
                        "{scene_name} by {method:?} in {number:?}: {before:?}, then {after:?} of {corners:?}"
                    );
                    let range = longest_edge(corners) * field.slope_bound();
                    counts.add(
                        &method,
                        number,
                        (before.value - value).abs() > allowed_difference(&method, range, slack),
                    );
                }
            }
        }
    }
    counts.assert_at_most_one_in(100);
}

fn placed(field: &SceneField, corners: &[Point], placement: Similarity, scale: f64) -> Pair {
    let moved = corners.iter().map(|corner| placement.push(*corner)).collect();
    let after = SceneField::new(Placed { field: field.clone(), placement });
    Pair { before: (field.clone(), corners.to_vec()), after: (after, moved), scale }
}

#[test]
fn moving_field_and_element_moves_the_answer() {
    assert_answers_agree(BUDGET, |field, size, corners, random| {
        let offset = random.in_cube(20.0 * size);
        placed(field, corners, Similarity::new(offset.into(), IDENTITY, 1.0).unwrap(), 1.0)
    });
}

#[test]
fn rotating_field_and_element_rotates_the_answer() {
    assert_answers_agree(BUDGET, |field, _, corners, random| {
        let rotation = [(); 4].map(|()| random.between(-1.0, 1.0));
        placed(field, corners, Similarity::new([0.0; 3], rotation, 1.0).unwrap(), 1.0)
    });
}

#[test]
fn scaling_field_and_element_scales_the_answer() {
    assert_answers_agree(BUDGET, |field, _, corners, random| {
        let scale = random.pick(&[1e-6, 1e-2, 7.0, 1e6]);
        placed(field, corners, Similarity::new([0.0; 3], IDENTITY, scale).unwrap(), scale)
    });
}

#[test]
fn mirroring_field_and_element_mirrors_the_answer() {
    assert_answers_agree(BUDGET, |field, _, corners, random| {
        let factors = [(); 3].map(|()| random.pick(&[-1.0, 1.0]));
        let mirrored = corners.iter().map(|corner| corner.component_mul(&Vector3::from(factors))).collect();
        let after = SceneField::new(Placed { field: field.clone(), placement: Stretch::new(factors).unwrap() });
        Pair { before: (field.clone(), corners.to_vec()), after: (after, mirrored), scale: 1.0 }
    });
}

/// The budget gives a power of four samples, which are spread evenly and prefer no corner.
#[test]
fn the_order_of_corners_does_not_matter() {
    assert_answers_agree(63, |field, _, corners, random| {
        let mut shuffled = corners.to_vec();
        random.shuffle(&mut shuffled);
        Pair { before: (field.clone(), corners.to_vec()), after: (field.clone(), shuffled), scale: 1.0 }
    });
}

/// Halves of an edge, quarters of a face.
fn parts(corners: &[Point]) -> Vec<Vec<Point>> {
    match *corners {
        [a, b] => vec![vec![a, (a + b) * 0.5], vec![(a + b) * 0.5, b]],
        [a, b, c] => {
            let (ab, bc, ca) = ((a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5);
            [[ab, bc, ca], [a, ab, ca], [ab, b, bc], [ca, bc, c]].map(|part| part.to_vec()).to_vec()
        }
        _ => unreachable!("a vertex has no parts"),
    }
}

/// The intervals overlap without exception, and certified values are within their tolerances. A local search of the whole takes
/// other steps than those of the parts and may end lower: one in eleven does for projected gradient descent.
#[test]
fn the_minimum_of_an_element_is_the_minimum_of_its_parts() {
    let mut random = Random::seeded();
    let mut counts = Counts::default();
    for scene in scenes(1.0) {
        let (size, scene_name) = (scene.size, scene.name);
        let field = scene.field;
        let slope_bound = field.slope_bound();
        for round in 0..12 {
            let triangle = random_simplex::<3>(&mut random, size).corners;
            let corners = &triangle[..round % 2 + 2];
            let parts = parts(corners);
            for method in methods(corners.len(), BUDGET) {
                for number in Number::BOTH {
                    let whole = minimum(&field, &method, corners, number);
                    let of_parts: Vec<_> = parts.iter().map(|part| minimum(&field, &method, part, number)).collect();
                    let value = of_parts.iter().fold(f64::INFINITY, |lowest, part| lowest.min(part.value));
                    let lower_bound = of_parts.iter().fold(f64::INFINITY, |lowest, part| lowest.min(part.lower_bound));
                    let slack = 2.0 * rounding(&(field.clone(), corners.to_vec()), size, number);
                    let context =
                        || format!("{scene_name} by {method:?} in {number:?}: {whole:?}, {of_parts:?} of {corners:?}");
                    assert!(lower_bound <= whole.value + slack && whole.lower_bound <= value + slack, "{}", context());
                    let range = longest_edge(corners) * slope_bound;
                    if certifies(&method) && whole.converged && of_parts.iter().all(|part| part.converged) {
                        let rounding = ROUNDINGS_OF_GAP * slack * slope_bound.max(1.0 / slope_bound);
                        assert!((whole.value - value).abs() <= 2.0 * TOLERANCE * range + rounding, "{}", context());
                    }
                    counts.add(&method, number, value > whole.value + allowed_difference(&method, range, slack));
                }
            }
        }
    }
    counts.assert_at_most_one_in(8);
}

#[test]
fn the_minimum_of_a_union_of_fields_is_the_lower_of_the_two_minima() {
    let mut random = Random::seeded();
    let all: Vec<(&str, f64, SceneField)> =
        scenes(1.0).into_iter().map(|scene| (scene.name, scene.size, scene.field)).collect();
    for (index, (name, size, a)) in all.iter().enumerate() {
        let (other, _, b) = &all[(index + 1 + random.below(all.len() - 1)) % all.len()];
        let union = SceneField::new(Union(a.clone(), b.clone()));
        for round in 0..18 {
            let triangle = random_simplex::<3>(&mut random, *size).corners;
            let corners = &triangle[..round % 3 + 1];
            for method in methods(corners.len(), BUDGET) {
                for number in Number::BOTH {
                    let [of_union, of_a, of_b] = [&union, a, b].map(|field| minimum(field, &method, corners, number));
                    let (value, lower_bound) = (of_a.value.min(of_b.value), of_a.lower_bound.min(of_b.lower_bound));
                    let slack = rounding(&(union.clone(), corners.to_vec()), 2.0 * size, number);
                    let context =
                        || format!("{name} or {other} by {method:?} in {number:?}: {of_union:?}, {of_a:?}, {of_b:?}");
                    assert!(
                        lower_bound <= of_union.value + slack && of_union.lower_bound <= value + slack,
                        "{}",
                        context()
                    );
                    if corners.len() == 1 {
                        assert_eq!(of_union.value, value, "{}", context());
                    }
                }
            }
        }
    }
}
