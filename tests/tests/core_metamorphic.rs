//! Laws between two queries whose answers are known to go together, though neither is: moved, turned, scaled and mirrored
//! scenes, corners in another order, elements in parts, fields in a union. Asked of every field, method, number type and kind
//! of element.
//!
//! What holds without exception is that the answers' intervals from lower bound to value meet, for the truth lies in both. That
//! the values are the same is a law of nearly all searches: where two ways down are equally steep, rounding chooses.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use sdf_core::Sdf;
use sdf_core::combine::Union;
use sdf_core::placed::{Placed, Similarity, Stretch};
use sdf_tests::any_field::AnyField;
use sdf_tests::methods::{Method, methods};
use sdf_tests::oracle::random_simplex;
use sdf_tests::random::Random;
use sdf_tests::scenes::scenes;
use sdf_tests::stability::answer::{Found, Number, ask};
use sdf_tests::stability::problem::{BUDGET, ROUNDINGS, ROUNDINGS_OF_GAP, TOLERANCE, certifies, name};

type Point = Vector3<f64>;

/// A query before and after it is changed.
struct Pair {
    before: (AnyField, Vec<Point>),
    after: (AnyField, Vec<Point>),
    /// What a length before is multiplied by.
    scale: f64,
}

fn least(field: &AnyField, method: &Method, corners: &[Point], number: Number) -> Found {
    ask(field, method, f64::INFINITY, corners, number).found.unwrap()
}

/// By how much a value may be off.
fn rounding((field, corners): &(AnyField, Vec<Point>), size: f64, number: Number) -> f64 {
    let largest = corners.iter().fold(size, |most, corner| most.max(corner.amax()));
    ROUNDINGS * number.epsilon() * field.slope_bound() * largest
}

/// The most that two values of the same descent differ by. A search that stops at a tolerance may stop on either side of it:
/// only the methods named here go on until rounding stops them, or their steps are spent.
fn likeness(method: &Method, range: f64, rounding: f64) -> f64 {
    let descends = matches!(
        method,
        Method::FrankWolfe(_)
            | Method::ProjectedGradient(_)
            | Method::PointSampling(_)
            | Method::LineSearch(_)
            | Method::GoldenSection(_)
    );
    if descends { 1e-5 * range + 8.0 * rounding } else { 2.0 * TOLERANCE * range + 8.0 * rounding }
}

fn longest_edge(corners: &[Point]) -> f64 {
    let lengths = corners.iter().flat_map(|a| corners.iter().map(move |b| (a - b).norm()));
    lengths.fold(0.0, f64::max)
}

/// How many answers of each method in each number type differed.
#[derive(Default)]
struct Counts(BTreeMap<String, [usize; 2]>);

impl Counts {
    fn add(&mut self, method: &Method, number: Number, differs: bool) {
        let [all, differing] = self.0.entry(format!("{} in {}", name(method), number.name())).or_default();
        *all += 1;
        *differing += usize::from(differs);
    }

    fn at_most_one_of(&self, rare: usize) {
        println!("{:?}", self.0);
        for (method, [all, differing]) in &self.0 {
            assert!(differing * rare <= *all, "{method}: {differing} of {all} differ");
        }
    }
}

/// Of all pairs the intervals meet, and of all but one in a hundred the values are alike.
fn answers_go_together(budget: u32, change: impl Fn(&AnyField, f64, &[Point], &mut Random) -> Pair) {
    let mut random = Random::of_test();
    let mut counts = Counts::default();
    for scene in scenes(1.0) {
        let (size, told) = (scene.size, scene.name);
        let field = AnyField::new(scene);
        for round in 0..18 {
            let triangle = random_simplex::<3>(&mut random, size).corners;
            let corners = &triangle[..round % 3 + 1];
            let Pair { before: asked, after: changed, scale } = change(&field, size, corners, &mut random);
            for method in methods(corners.len(), budget) {
                for number in Number::BOTH {
                    let [before, after] = [&asked, &changed].map(|(field, at)| least(field, &method, at, number));
                    let slack =
                        rounding(&asked, size, number) + rounding(&changed, size * scale.max(1.0), number) / scale;
                    let (value, lower_bound) = (after.value / scale, after.lower_bound / scale);
                    let meet = before.lower_bound <= value + slack && lower_bound <= before.value + slack;
                    assert!(meet, "{told} by {method:?} in {number:?}: {before:?}, then {after:?} of {corners:?}");
                    let range = longest_edge(corners) * field.slope_bound();
                    counts.add(&method, number, (before.value - value).abs() > likeness(&method, range, slack));
                }
            }
        }
    }
    counts.at_most_one_of(100);
}

fn placed(field: &AnyField, corners: &[Point], placement: Similarity, scale: f64) -> Pair {
    let moved = corners.iter().map(|corner| placement.push(*corner)).collect();
    let after = AnyField::new(Placed { field: field.clone(), placement });
    Pair { before: (field.clone(), corners.to_vec()), after: (after, moved), scale }
}

#[test]
fn moving_field_and_element_moves_the_answer() {
    answers_go_together(BUDGET, |field, size, corners, random| {
        let away = random.in_cube(20.0 * size);
        placed(field, corners, Similarity::new(away.into(), [0.0, 0.0, 0.0, 1.0], 1.0).unwrap(), 1.0)
    });
}

#[test]
fn turning_field_and_element_turns_the_answer() {
    answers_go_together(BUDGET, |field, _, corners, random| {
        let turn = [(); 4].map(|()| random.between(-1.0, 1.0));
        placed(field, corners, Similarity::new([0.0; 3], turn, 1.0).unwrap(), 1.0)
    });
}

#[test]
fn scaling_field_and_element_scales_the_answer() {
    answers_go_together(BUDGET, |field, _, corners, random| {
        let scale = random.pick(&[1e-6, 1e-2, 7.0, 1e6]);
        placed(field, corners, Similarity::new([0.0; 3], [0.0, 0.0, 0.0, 1.0], scale).unwrap(), scale)
    });
}

#[test]
fn mirroring_field_and_element_mirrors_the_answer() {
    answers_go_together(BUDGET, |field, _, corners, random| {
        let factors = [(); 3].map(|()| random.pick(&[-1.0, 1.0]));
        let mirrored = corners.iter().map(|corner| corner.component_mul(&Vector3::from(factors))).collect();
        let after = AnyField::new(Placed { field: field.clone(), placement: Stretch::new(factors).unwrap() });
        Pair { before: (field.clone(), corners.to_vec()), after: (after, mirrored), scale: 1.0 }
    });
}

/// Sampled points are evenly spread, so that no corner is preferred, where there are a power of four.
#[test]
fn the_order_of_corners_does_not_matter() {
    answers_go_together(63, |field, _, corners, random| {
        let mut shuffled = corners.to_vec();
        random.shuffle(&mut shuffled);
        Pair { before: (field.clone(), corners.to_vec()), after: (field.clone(), shuffled), scale: 1.0 }
    });
}

/// An edge in two, a face in four.
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

/// The least of a whole is the least of its parts. That the intervals meet is exact, and so is that certified values are as near
/// as their tolerances say. A local search of the whole may end lower than those of the parts, whose steps are others: of
/// projected gradient descent one in eleven does.
#[test]
fn the_least_of_an_element_is_the_least_of_its_parts() {
    let mut random = Random::of_test();
    let mut counts = Counts::default();
    for scene in scenes(1.0) {
        let (size, told) = (scene.size, scene.name);
        let field = AnyField::new(scene);
        let steepness = field.slope_bound();
        for round in 0..12 {
            let triangle = random_simplex::<3>(&mut random, size).corners;
            let corners = &triangle[..round % 2 + 2];
            let parts = parts(corners);
            for method in methods(corners.len(), BUDGET) {
                for number in Number::BOTH {
                    let whole = least(&field, &method, corners, number);
                    let found: Vec<Found> = parts.iter().map(|part| least(&field, &method, part, number)).collect();
                    let value = found.iter().fold(f64::INFINITY, |least, part| least.min(part.value));
                    let lower_bound = found.iter().fold(f64::INFINITY, |least, part| least.min(part.lower_bound));
                    let slack = 2.0 * rounding(&(field.clone(), corners.to_vec()), size, number);
                    let told = || format!("{told} by {method:?} in {number:?}: {whole:?}, {found:?} of {corners:?}");
                    assert!(lower_bound <= whole.value + slack && whole.lower_bound <= value + slack, "{}", told());
                    let range = longest_edge(corners) * steepness;
                    if certifies(&method) && whole.converged && found.iter().all(|part| part.converged) {
                        let rounding = ROUNDINGS_OF_GAP * slack * steepness.max(1.0 / steepness);
                        assert!((whole.value - value).abs() <= 2.0 * TOLERANCE * range + rounding, "{}", told());
                    }
                    counts.add(&method, number, value > whole.value + likeness(&method, range, slack));
                }
            }
        }
    }
    counts.at_most_one_of(8);
}

/// The least of a union of fields is the lower of the two leasts.
#[test]
fn the_least_of_a_union_of_fields_is_the_lower_of_the_two() {
    let mut random = Random::of_test();
    let all: Vec<(&str, f64, AnyField)> =
        scenes(1.0).into_iter().map(|scene| (scene.name, scene.size, AnyField::new(scene))).collect();
    for (index, (name, size, a)) in all.iter().enumerate() {
        let (other, _, b) = &all[(index + 1 + random.below(all.len() - 1)) % all.len()];
        let union = AnyField::new(Union(a.clone(), b.clone()));
        for round in 0..18 {
            let triangle = random_simplex::<3>(&mut random, *size).corners;
            let corners = &triangle[..round % 3 + 1];
            for method in methods(corners.len(), BUDGET) {
                for number in Number::BOTH {
                    let [of_union, of_a, of_b] = [&union, a, b].map(|field| least(field, &method, corners, number));
                    let (value, lower_bound) = (of_a.value.min(of_b.value), of_a.lower_bound.min(of_b.lower_bound));
                    let slack = rounding(&(union.clone(), corners.to_vec()), 2.0 * size, number);
                    let told =
                        || format!("{name} or {other} by {method:?} in {number:?}: {of_union:?}, {of_a:?}, {of_b:?}");
                    assert!(
                        lower_bound <= of_union.value + slack && of_union.lower_bound <= value + slack,
                        "{}",
                        told()
                    );
                    if corners.len() == 1 {
                        assert_eq!(of_union.value, value, "{}", told());
                    }
                }
            }
        }
    }
}
