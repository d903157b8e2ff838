//! Two fields against each other: closed forms, a lattice as the oracle, and invariance under motion, scale and exchange.

mod closed_forms;
mod limits;
mod motion;
mod random_pairs;

use nalgebra::Vector3;
use sdf_core::overlap::{
    BoxNode, DeepestPoint, DepthSearch, LocalMinima, MortonLeaf, OverlapPoint, Pair, Patch, PatchPoint,
};
use sdf_core::shapes::{Capsule, Sphere, Torus};
use sdf_core::{Float, Sdf};
use sdf_tests::scene_field::SceneField;
use sdf_tests::scenes;

type Point = Vector3<f64>;

type ScenePair<'a> = Pair<'a, SceneField, SceneField>;

/// The field, moved by `translation`.
fn shifted(field: &SceneField, translation: [f64; 3]) -> SceneField {
    SceneField::new(scenes::shifted(field.clone(), translation))
}

fn sphere(radius: f64) -> SceneField {
    SceneField::new(Sphere::new(radius).unwrap())
}

/// A ring of radii 1 and 0.3, and a bar that crosses it twice, 0.025 deep.
fn ring_and_bar() -> [SceneField; 2] {
    let bar = SceneField::new(Capsule::new([-1.0, 0.0, 0.0], [1.0, 0.5, 0.0], 0.2).unwrap());
    [SceneField::new(Torus::new(1.0, 0.3).unwrap()), shifted(&bar, [0.0, 0.0, 0.45])]
}

fn deepest<R: Float>(pair: &ScenePair, tolerance: f64) -> DeepestPoint<R> {
    pair.deepest(&DepthSearch { tolerance, ..DepthSearch::default() }, &mut vec![BoxNode::EMPTY; 1 << 14])
}

fn patch<R: Float>(pair: &ScenePair, resolution: f64) -> (Patch<R>, Vec<PatchPoint<R>>) {
    let mut points = vec![];
    let patch = pair.patch(resolution, 1 << 22, |point| points.push(point));
    assert!(patch.is_complete && patch.point_count as usize == points.len());
    (patch, points)
}

fn minima(pair: &ScenePair, resolution: f64) -> (LocalMinima, Vec<OverlapPoint<f64>>) {
    let (mut scratch, mut points) = (vec![MortonLeaf::empty(); 1 << 18], vec![None; 32]);
    let minima = pair.minima(resolution, 1 << 22, &mut scratch, &mut points);
    assert!(minima.is_complete);
    (minima, points.into_iter().flatten().collect())
}

/// A fraction of the region's longest side.
fn fraction_of_region(pair: &ScenePair, fraction: f64) -> f64 {
    pair.region().longest_side() * fraction
}

/// max(φ_a, φ_b): the field of the intersection.
fn max_value(a: &SceneField, b: &SceneField, point: Point) -> f64 {
    a.value(point).max(b.value(point))
}
