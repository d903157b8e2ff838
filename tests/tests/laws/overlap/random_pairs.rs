//! Pairs of scenes in random poses, with a lattice as the oracle.

use nalgebra::Vector3;
use sdf_core::overlap::{BoxNode, DepthSearch, NoRegion, OverlapPoint, Pair};
use sdf_core::placed::{Placed, Rigid};
use sdf_core::{Aabb, Sdf};
use sdf_tests::random::Random;
use sdf_tests::scene_field::SceneField;
use sdf_tests::scenes::{node_indices, scenes};

use super::{Point, fraction_of_region, max_value, minima, patch};

/// Nodes of a lattice over a box, its corners among them.
fn lattice_points(bounds: &Aabb, cells: u32) -> Vec<Point> {
    let coordinate = |axis: usize, i: u32| bounds.min[axis] + bounds.extents()[axis] * f64::from(i) / f64::from(cells);
    node_indices([cells + 1; 3]).map(|node| Vector3::from_fn(|axis, _| coordinate(axis, node[axis]))).collect()
}

fn contains(bounds: &Aabb, point: Point) -> bool {
    (0..3).all(|k| bounds.min[k] <= point[k] && point[k] <= bounds.max[k])
}

/// Checks the law for pairs of scenes in random poses near each other, except for pairs of unbounded ones.
fn pairs(random: &mut Random, partners: usize, mut law: impl FnMut(&str, &SceneField, &SceneField, f64)) {
    let scenes = scenes(1.0);
    let mut tried = 0;
    for first in &scenes {
        for _ in 0..partners {
            let second = &scenes[random.below(scenes.len())];
            let mut pose = |max_offset: f64| {
                let rotation = [0; 4].map(|_| random.between(-1.0, 1.0));
                Rigid::new(random.in_cube(max_offset).into(), rotation).unwrap()
            };
            let a = SceneField::new(Placed { field: first.field.clone(), placement: pose(0.1) });
            let placement = pose(0.7 * (first.size + second.size));
            let b = SceneField::new(Placed { field: second.field.clone(), placement });
            let margin = random.pick(&[0.0, 0.0, 0.05, -0.05, 0.3]);
            if Pair::new(&a, &b, margin).err() != Some(NoRegion::Unbounded) {
                tried += 1;
                law(&format!("{} and {} within {margin}", first.name, second.name), &a, &b, margin);
            }
        }
    }
    assert!(tried > scenes.len());
}

#[test]
fn bounds_on_the_deepest_point_hold_at_every_node_of_a_lattice() {
    let mut random = Random::seeded();
    let (mut contacts, mut separated, mut converged) = (0, 0, 0);
    pairs(&mut random, 3, |name, a, b, margin| {
        let surroundings = a.bounds(0.5).union(&b.bounds(0.5));
        let surroundings = surroundings.intersection(&Aabb::centered([3.0; 3])).unwrap();
        let nodes = lattice_points(&surroundings, 24);
        let lowest = nodes.iter().map(|node| max_value(a, b, *node)).fold(f64::INFINITY, f64::min);
        let Ok(pair) = Pair::new(a, b, margin) else {
            assert!(margin < lowest, "{name}: {lowest} without a region");
            separated += 1;
            return;
        };
        let region = pair.region();
        for node in &nodes {
            assert!(
                contains(&region, *node) || margin < max_value(a, b, *node),
                "{name}: {node} is outside the region"
            );
        }
        let search = DepthSearch { evaluations: 1 << 13, tolerance: 1e-2 };
        let deepest = pair.deepest::<f64>(&search, &mut vec![BoxNode::EMPTY; 1 << 12]);
        let Some(at) = deepest.point else {
            assert!(margin < deepest.lower_bound && deepest.lower_bound <= lowest, "{name}: {deepest:?} {lowest}");
            separated += 1;
            return;
        };
        assert_eq!(at.value, max_value(a, b, at.point));
        assert!(deepest.lower_bound <= at.value, "{name}");
        let in_region = lattice_points(&region, 24);
        let lowest = in_region.iter().map(|node| max_value(a, b, *node)).fold(f64::INFINITY, f64::min);
        assert!(deepest.lower_bound <= lowest, "{name}: {lowest} is below {}", deepest.lower_bound);
        let gap = 1.01e-2 * region.longest_side();
        if deepest.converged {
            converged += 1;
            assert!(at.value <= lowest + gap || margin < deepest.lower_bound, "{name}: {} {lowest}", at.value);
            assert!(at.value - deepest.lower_bound <= gap || margin < deepest.lower_bound, "{name}");
        }
        contacts += usize::from(at.value <= margin);
        separated += usize::from(margin < deepest.lower_bound);
        // In f32 the same to rounding.
        let in_f32 = pair.deepest::<f32>(&search, &mut vec![BoxNode::EMPTY; 1 << 12]);
        assert!(f64::from(in_f32.lower_bound) <= lowest, "{name}: {lowest} is below {} in f32", in_f32.lower_bound);
        if deepest.converged && in_f32.converged && at.value <= margin {
            let difference = (f64::from(in_f32.point.unwrap().value) - at.value).abs();
            assert!(difference <= gap + 1e-4, "{name}: {difference} in f32");
        }
    });
    println!("{contacts} contacts, {separated} separated, {converged} converged");
    assert!(contacts > 50 && separated > 10 && converged > 100, "{contacts} {separated} {converged}");
}

#[test]
fn shrinking_keeps_every_point_where_the_fields_overlap() {
    let mut random = Random::seeded();
    pairs(&mut random, 2, |name, a, b, margin| {
        let Ok(pair) = Pair::new(a, b, margin) else { return };
        let shrunk = [
            pair.shrink_evaluating(24, [false, false]),
            pair.shrink_evaluating(24, [true, false]),
            pair.shrink_evaluating(24, [false, true]),
            pair.shrink::<f64>(24),
            pair.shrink::<f32>(24),
        ];
        for node in lattice_points(&pair.region(), 24) {
            if max_value(a, b, node) <= margin {
                let holds = |pair: &Result<Pair<_, _>, NoRegion>| {
                    pair.as_ref().is_ok_and(|pair| contains(&pair.region(), node))
                };
                assert!(shrunk.iter().all(holds), "{name}: {node}");
            }
        }
    });
}

/// The point where the middle surface φ_a = φ_b crosses a segment, if any, by bisection.
fn crossing(a: &SceneField, b: &SceneField, ends: [Point; 2]) -> Option<Point> {
    let side = |point: Point| a.value(point) - b.value(point);
    let [mut low, mut high] = ends;
    if side(low) == 0.0 {
        return Some(low);
    }
    if side(low) * side(high) > 0.0 {
        return None;
    }
    for _ in 0..60 {
        let middle = (low + high) * 0.5;
        if side(low) * side(middle) > 0.0 { low = middle } else { high = middle }
    }
    Some(low)
}

#[test]
fn no_point_of_the_patch_is_outside_of_its_leaves_and_every_piece_is_on_the_middle_surface() {
    let mut random = Random::seeded();
    let mut checked = 0;
    pairs(&mut random, 2, |name, a, b, margin| {
        let Some(pair) = Pair::new(a, b, margin).ok().and_then(|pair| pair.shrink::<f64>(16).ok()) else { return };
        let resolution = fraction_of_region(&pair, 1.0 / 24.0);
        let (patch, points) = patch::<f64>(&pair, resolution);
        for piece in &points {
            let at = piece.point;
            let tolerance = 0.06 * resolution;
            assert!((at.a.value - at.b.value).abs() <= tolerance, "{name}: {at:?}");
            assert!(
                at.value <= margin + 1e-12 && piece.area > 0.0 && contains(&pair.region(), at.point),
                "{name}: {at:?}"
            );
            assert!(
                (at.normal.norm() - 1.0).abs() < 1e-9 && piece.area <= 6.0 * resolution * resolution,
                "{name}: {at:?}"
            );
        }
        let nodes = lattice_points(&pair.region(), 16);
        for (node, next) in nodes.iter().zip(&nodes[1..]).filter(|(node, next)| (*node - *next).norm() < 0.2) {
            let Some(point) = crossing(a, b, [*node, *next]).filter(|point| max_value(a, b, *point) <= margin) else {
                continue;
            };
            checked += 1;
            assert!(patch.bounds.is_some_and(|bounds| contains(&bounds, point)), "{name}: {point} {patch:?}");
        }
    });
    assert!(checked > 1000, "{checked}");
}

#[test]
fn the_deepest_point_is_the_first_of_the_minima() {
    let mut random = Random::seeded();
    let mut compared = 0;
    pairs(&mut random, 2, |name, a, b, margin| {
        let Some(pair) = Pair::new(a, b, margin).ok().and_then(|pair| pair.shrink::<f64>(16).ok()) else { return };
        let found = pair
            .deepest::<f64>(&DepthSearch { evaluations: 1 << 13, tolerance: 1e-3 }, &mut vec![BoxNode::EMPTY; 1 << 12]);
        let (all, points) = minima(&pair, fraction_of_region(&pair, 1.0 / 24.0));
        assert!(
            points.windows(2).all(|two| two[0].value <= two[1].value) && points.len() == all.count.min(32),
            "{name}"
        );
        assert!(points.iter().all(|at| at.value <= margin + 1e-9 && at.value >= found.lower_bound), "{name}");
        let Some(lowest) = found.point.filter(|at| found.converged && at.value <= margin) else { return };
        compared += 1;
        let first = points.first().unwrap_or_else(|| panic!("{name}: {found:?} {all:?}"));
        assert!(
            first.value <= lowest.value + 0.01 * pair.region().longest_side(),
            "{name}: {} {}",
            first.value,
            lowest.value
        );
    });
    assert!(compared > 15, "{compared}");
}

#[test]
fn exchanged_fields_meet_in_the_same_points_with_opposite_normals() {
    let mut random = Random::seeded();
    let mut compared = 0;
    pairs(&mut random, 2, |name, a, b, margin| {
        let (Ok(forward), Ok(back)) = (Pair::new(a, b, margin), Pair::new(b, a, margin)) else { return };
        assert_eq!(forward.region(), back.region(), "{name}");
        let same = |at: &OverlapPoint<f64>, back: &OverlapPoint<f64>| {
            assert_eq!((at.point, at.value, at.a, at.b), (back.point, back.value, back.b, back.a), "{name}");
            assert_eq!(at.normal, -back.normal, "{name}");
        };
        let search = DepthSearch { evaluations: 1 << 12, tolerance: 1e-2 };
        let [one, other] =
            [forward.deepest(&search, &mut [BoxNode::EMPTY; 1024]), back.deepest(&search, &mut [BoxNode::EMPTY; 1024])];
        assert_eq!(
            (one.lower_bound, one.converged, one.evaluations),
            (other.lower_bound, other.converged, other.evaluations)
        );
        assert_eq!(one.point.is_some(), other.point.is_some(), "{name}");
        one.point.iter().zip(&other.point).for_each(|(one, other)| same(one, other));
        let resolution = fraction_of_region(&forward, 1.0 / 20.0);
        let ((one, points), (other, points_back)) = (patch::<f64>(&forward, resolution), patch(&back, resolution));
        assert_eq!(
            (one.point_count, one.leaf_count, one.bounds),
            (other.point_count, other.leaf_count, other.bounds),
            "{name}"
        );
        points.iter().zip(&points_back).for_each(|(one, other)| same(&one.point, &other.point));
        let ((_, points), (_, points_back)) = (minima(&forward, resolution), minima(&back, resolution));
        assert_eq!(points.len(), points_back.len(), "{name}");
        points.iter().zip(&points_back).for_each(|(one, other)| same(one, other));
        compared += points.len();
    });
    assert!(compared > 15, "{compared}");
}
