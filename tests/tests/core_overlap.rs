//! Two fields against each other: closed forms, a lattice as the oracle, and what no motion, scale or exchange may change.

use std::f64::consts::PI;

use nalgebra::Vector3;
use sdf_core::combine::Union;
use sdf_core::grid::{Dense, Grid, Lattice};
use sdf_core::overlap::{
    BoxNode, DeepestPoint, DepthSearch, LocalMinima, MortonLeaf, NoRegion, OverlapPoint, Pair, Patch, PatchPoint,
};
use sdf_core::placed::{Placed, Rigid};
use sdf_core::shapes::{Capsule, Cuboid, HalfSpace, Sphere, Torus};
use sdf_core::{Aabb, EnclosedSdf, Float, Sdf};
use sdf_tests::random::Random;
use sdf_tests::scenes::{Scene, bounded, cube_lattice, sampled, sampled_in_bricks, scenes};

type Point = Vector3<f64>;

const UNTURNED: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

fn shifted<F: EnclosedSdf>(field: F, translation: [f64; 3]) -> Placed<F, Rigid> {
    Placed { field, placement: Rigid::new(translation, UNTURNED).unwrap() }
}

fn deepest<R: Float>(pair: &Pair<impl EnclosedSdf, impl EnclosedSdf>, tolerance: f64) -> DeepestPoint<R> {
    pair.deepest(&DepthSearch { tolerance, ..DepthSearch::default() }, &mut vec![BoxNode::EMPTY; 1 << 14])
}

fn patch<R: Float>(pair: &Pair<impl EnclosedSdf, impl EnclosedSdf>, resolution: f64) -> (Patch<R>, Vec<PatchPoint<R>>) {
    let mut points = vec![];
    let patch = pair.patch(resolution, 1 << 22, |point| points.push(point));
    assert!(patch.is_complete && patch.point_count as usize == points.len());
    (patch, points)
}

fn minima(pair: &Pair<impl EnclosedSdf, impl EnclosedSdf>, resolution: f64) -> (LocalMinima, Vec<OverlapPoint<f64>>) {
    let (mut scratch, mut found) = (vec![MortonLeaf::empty(); 1 << 18], vec![None; 32]);
    let minima = pair.minima(resolution, 1 << 22, &mut scratch, &mut found);
    assert!(minima.is_complete);
    (minima, found.into_iter().flatten().collect())
}

fn region_of(pair: &Pair<impl EnclosedSdf, impl EnclosedSdf>, share: f64) -> f64 {
    pair.region().longest_side() * share
}

fn highest(a: &impl EnclosedSdf, b: &impl EnclosedSdf, point: Point) -> f64 {
    a.value(point).max(b.value(point))
}

/// Nodes of a lattice over a box, its corners among them.
fn lattice_points(bounds: &Aabb, cells: usize) -> Vec<Point> {
    let at = |axis: usize, i: usize| bounds.min[axis] + bounds.extents()[axis] * i as f64 / cells as f64;
    let along = 0..=cells;
    along
        .clone()
        .flat_map(|k| along.clone().flat_map(move |j| (0..=cells).map(move |i| [i, j, k])))
        .map(|[i, j, k]| Vector3::new(at(0, i), at(1, j), at(2, k)))
        .collect()
}

fn within(bounds: &Aabb, point: Point) -> bool {
    (0..3).all(|k| bounds.min[k] <= point[k] && point[k] <= bounds.max[k])
}

/// Pairs of scenes in random poses near each other, those left out that both go on for ever.
fn pairs(
    random: &mut Random,
    partners: usize,
    mut law: impl FnMut(&str, &Placed<&Scene, Rigid>, &Placed<&Scene, Rigid>, f64),
) {
    let scenes = scenes(1.0);
    let mut tried = 0;
    for first in &scenes {
        for _ in 0..partners {
            let second = &scenes[random.below(scenes.len())];
            let mut place = |reach: f64| {
                let turn = [0; 4].map(|_| random.between(-1.0, 1.0));
                Rigid::new(random.in_cube(reach).into(), turn).unwrap()
            };
            let a = Placed { field: first, placement: place(0.1) };
            let b = Placed { field: second, placement: place(0.7 * (first.size + second.size)) };
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
fn what_is_proven_of_the_deepest_point_holds_at_every_node_of_a_lattice() {
    let mut random = Random::of_test();
    let (mut contacts, mut apart, mut converged) = (0, 0, 0);
    pairs(&mut random, 3, |name, a, b, margin| {
        let around = a.bounds(0.5).union(&b.bounds(0.5));
        let around = around.intersection(&Aabb::centered([3.0; 3])).unwrap();
        let nodes = lattice_points(&around, 24);
        let lowest = nodes.iter().map(|node| highest(a, b, *node)).fold(f64::INFINITY, f64::min);
        let Ok(pair) = Pair::new(a, b, margin) else {
            assert!(margin < lowest, "{name}: {lowest} though there is no region");
            apart += 1;
            return;
        };
        let region = pair.region();
        for node in &nodes {
            assert!(within(&region, *node) || margin < highest(a, b, *node), "{name}: {node} is left out");
        }
        let search = DepthSearch { evaluations: 1 << 13, tolerance: 1e-2 };
        let deepest = pair.deepest::<f64>(&search, &mut vec![BoxNode::EMPTY; 1 << 12]);
        let Some(at) = deepest.point else {
            assert!(margin < deepest.lower_bound && deepest.lower_bound <= lowest, "{name}: {deepest:?} {lowest}");
            apart += 1;
            return;
        };
        assert_eq!(at.value, highest(a, b, at.point));
        assert!(deepest.lower_bound <= at.value, "{name}");
        let in_region = lattice_points(&region, 24);
        let lowest = in_region.iter().map(|node| highest(a, b, *node)).fold(f64::INFINITY, f64::min);
        assert!(deepest.lower_bound <= lowest, "{name}: {lowest} is below {}", deepest.lower_bound);
        let gap = 1.01e-2 * region.longest_side();
        if deepest.converged {
            converged += 1;
            assert!(at.value <= lowest + gap || margin < deepest.lower_bound, "{name}: {} {lowest}", at.value);
            assert!(at.value - deepest.lower_bound <= gap || margin < deepest.lower_bound, "{name}");
        }
        contacts += usize::from(at.value <= margin);
        apart += usize::from(margin < deepest.lower_bound);
        // In f32 the same, but for what it rounds.
        let in_f32 = pair.deepest::<f32>(&search, &mut vec![BoxNode::EMPTY; 1 << 12]);
        assert!(f64::from(in_f32.lower_bound) <= lowest, "{name}: {lowest} is below {} in f32", in_f32.lower_bound);
        if deepest.converged && in_f32.converged && at.value <= margin {
            let off = (f64::from(in_f32.point.unwrap().value) - at.value).abs();
            assert!(off <= gap + 1e-4, "{name}: {off} in f32");
        }
    });
    println!("{contacts} contacts, {apart} apart, {converged} converged");
    assert!(contacts > 50 && apart > 10 && converged > 100, "{contacts} {apart} {converged}");
}

#[test]
fn shrinking_leaves_out_no_point_in_which_the_fields_touch() {
    let mut random = Random::of_test();
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
            if highest(a, b, node) <= margin {
                let holds =
                    |pair: &Result<Pair<_, _>, NoRegion>| pair.as_ref().is_ok_and(|pair| within(&pair.region(), node));
                assert!(shrunk.iter().all(holds), "{name}: {node}");
            }
        }
    });
}

/// Where the middle surface crosses a segment, if it does: by bisection.
fn crossing(a: &impl EnclosedSdf, b: &impl EnclosedSdf, ends: [Point; 2]) -> Option<Point> {
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
    let mut random = Random::of_test();
    let mut checked = 0;
    pairs(&mut random, 2, |name, a, b, margin| {
        let Some(pair) = Pair::new(a, b, margin).ok().and_then(|pair| pair.shrink::<f64>(16).ok()) else { return };
        let resolution = region_of(&pair, 1.0 / 24.0);
        let (patch, points) = patch::<f64>(&pair, resolution);
        for piece in &points {
            let at = piece.point;
            let near = 0.06 * resolution;
            assert!((at.a.value - at.b.value).abs() <= near, "{name}: {at:?}");
            assert!(
                at.value <= margin + 1e-12 && piece.area > 0.0 && within(&pair.region(), at.point),
                "{name}: {at:?}"
            );
            assert!(
                (at.normal.norm() - 1.0).abs() < 1e-9 && piece.area <= 6.0 * resolution * resolution,
                "{name}: {at:?}"
            );
        }
        let nodes = lattice_points(&pair.region(), 16);
        for (node, next) in nodes.iter().zip(&nodes[1..]).filter(|(node, next)| (*node - *next).norm() < 0.2) {
            let Some(point) = crossing(a, b, [*node, *next]).filter(|point| highest(a, b, *point) <= margin) else {
                continue;
            };
            checked += 1;
            assert!(patch.bounds.is_some_and(|bounds| within(&bounds, point)), "{name}: {point} {patch:?}");
        }
    });
    assert!(checked > 1000, "{checked}");
}

#[test]
fn balls_meet_in_the_middle_of_their_centres_in_a_disc() {
    let mut random = Random::of_test();
    for _ in 0..100 {
        let [first, second] = [0; 2].map(|_| random.between(0.3, 1.5));
        let centre = random.in_cube(3.0);
        let distance =
            (first + second) * random.between(0.7, 1.3).max((first - second).abs() / (first + second) * 1.05);
        let way = random.direction();
        let a = shifted(Sphere::new(first).unwrap(), (centre + way * distance).into());
        let b = shifted(Sphere::new(second).unwrap(), centre.into());
        let gap = distance - first - second;
        let pair = Pair::new(&a, &b, 0.5 * gap.max(0.0) + 1e-9).unwrap();
        let found = deepest::<f64>(&pair, 1e-6);
        let at = found.point.unwrap();
        assert!(
            found.converged && (at.separation() - gap).abs() < 1e-5 && (at.value - 0.5 * gap).abs() < 1e-5,
            "{found:?}"
        );
        // Beside the axis the value rises as the square of the way.
        assert!((at.point - centre - way * (second + 0.5 * gap)).norm() < 1e-2, "{found:?}");
        assert!((at.normal - way).norm() < 1e-2, "out of the second, into the first: {found:?}");
        let in_f32 = deepest::<f32>(&pair, 1e-4);
        assert!((f64::from(in_f32.point.unwrap().value) - 0.5 * gap).abs() < 1e-3);
    }
    for distance in [0.5, 1.0, 1.9] {
        let ball = Sphere::new(1.0).unwrap();
        let other = shifted(ball, (random.direction() * distance).into());
        let pair = Pair::new(&other, &ball, 0.0).unwrap().shrink::<f64>(32).unwrap();
        let area = PI * (1.0 - 0.25 * distance * distance);
        let (found, points) = patch::<f64>(&pair, region_of(&pair, 1.0 / 64.0));
        assert!((found.area / area - 1.0).abs() < 2e-3, "{} {area}", found.area);
        assert!((points.iter().map(|piece| piece.area).sum::<f64>() - found.area).abs() < 1e-9);
        let (coarse, _) = patch::<f64>(&pair, region_of(&pair, 1.0 / 16.0));
        assert!((found.area - area).abs() < 0.5 * (coarse.area - area).abs() + 1e-4, "finer is no better");
        let (in_f32, _) = patch::<f32>(&pair, region_of(&pair, 1.0 / 64.0));
        assert!((f64::from(in_f32.area) / area - 1.0).abs() < 5e-3);
        // Every point of the disc is near a piece of it.
        let axis = other.placement.push(Vector3::zeros()).normalize();
        for _ in 0..200 {
            let across = axis.cross(&random.direction()).normalize() * (area / PI).sqrt() * random.unit().sqrt();
            let point = axis * (0.5 * distance) + across;
            let nearest = points.iter().map(|piece| (piece.point.point - point).norm()).fold(f64::INFINITY, f64::min);
            assert!(nearest < 2.0 * found.resolution, "{nearest}");
        }
    }
}

#[test]
fn a_block_rests_on_the_floor_with_its_face() {
    let floor = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
    for depth in [1e-3, 1e-4] {
        let block = shifted(Cuboid::new([0.5, 0.3, 0.2]).unwrap(), [0.1, -0.2, 0.2 - depth]);
        let pair = Pair::new(&block, &floor, 0.0).unwrap().shrink::<f64>(32).unwrap();
        let found = deepest::<f64>(&pair, 1e-6);
        let at = found.point.unwrap();
        assert!(found.converged && found.evaluations < 2000, "flat on flat is no harder: {found:?}");
        assert!((at.value + 0.5 * depth).abs() < 2e-6 && (at.normal.z - 1.0).abs() < 1e-9, "{found:?}");
        for share in [1.0 / 24.0, 1.0 / 48.0, 1.0 / 96.0] {
            let (found, points) = patch::<f64>(&pair, region_of(&pair, share));
            // Along the rim, where the middle surface bends, half a row of leaves may be missed.
            assert!((found.area - 0.6).abs() < 0.5 * 3.2 * found.resolution, "{found:?}");
            assert!(
                points.iter().all(|piece| piece.point.point.z.abs() <= depth && piece.point.normal.z > 0.7),
                "{found:?}"
            );
        }
        let (_, points) = minima(&pair, region_of(&pair, 1.0 / 48.0));
        assert_eq!(points.len(), 1, "a face is one minimum");
    }
}

#[test]
fn a_ball_sinks_into_a_block_by_its_depth() {
    let block = Cuboid::new([0.5, 0.6, 0.7]).unwrap();
    for depth in [0.05, 0.2] {
        let ball = shifted(Sphere::new(0.3).unwrap(), [0.1, -0.1, 0.7 + 0.3 - depth]);
        let pair = Pair::new(&ball, &block, 0.0).unwrap();
        let at = deepest::<f64>(&pair, 1e-6).point.unwrap();
        assert!((at.separation() + depth).abs() < 1e-5 && (at.normal.z - 1.0).abs() < 1e-6, "{at:?}");
        assert!((at.point - Vector3::new(0.1, -0.1, 0.7 - 0.5 * depth)).norm() < 1e-2, "{at:?}");
    }
}

#[test]
fn a_bar_across_a_ring_touches_it_twice() {
    let ring = Torus::new(1.0, 0.3).unwrap();
    let bar = shifted(Capsule::new([-1.0, 0.0, 0.0], [1.0, 0.5, 0.0], 0.2).unwrap(), [0.0, 0.0, 0.45]);
    let pair = Pair::new(&ring, &bar, 0.0).unwrap();
    // Where the bar's axis is over the circle in the middle of the ring.
    let expected = [Vector3::new(-1.0, 0.0, 0.275), Vector3::new(15.0 / 17.0, 8.0 / 17.0, 0.275)];
    let found = deepest::<f64>(&pair, 1e-3);
    assert!(found.converged && (found.point.unwrap().value + 0.025).abs() < 3e-3, "{found:?}");
    for share in [1.0 / 32.0, 1.0 / 64.0] {
        let (_, points) = minima(&pair, region_of(&pair, share));
        assert_eq!(points.len(), 2, "{points:?}");
        for expected in expected {
            let nearest =
                points.iter().min_by(|a, b| (a.point - expected).norm().total_cmp(&(b.point - expected).norm()));
            let at = nearest.unwrap();
            assert!((at.point - expected).norm() < 1e-3 && (at.value + 0.025).abs() < 1e-6, "{at:?}");
            assert!((at.normal.z + 1.0).abs() < 1e-3, "out of the bar, down into the ring: {at:?}");
        }
    }
}

#[test]
fn minima_are_parted_by_what_rises_between_them() {
    let floor = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
    let weight = |x: f64, z: f64| shifted(Sphere::new(0.5).unwrap(), [x, 0.0, z]);
    // Two weights on a bar, one a little deeper.
    let dumbbell = Union(
        Union(weight(-1.0, 0.45), weight(1.0, 0.4)),
        Capsule::new([-1.0, 0.0, 0.45], [1.0, 0.0, 0.4], 0.2).unwrap(),
    );
    let pair = Pair::new(&dumbbell, &floor, 0.0).unwrap();
    let (found, points) = minima(&pair, region_of(&pair, 1.0 / 64.0));
    assert_eq!((found.count, points.len()), (2, 2), "{found:?} {points:?}");
    for (at, [x, value]) in points.iter().zip([[1.0, -0.05], [-1.0, -0.025]]) {
        assert!((at.point.x - x).abs() < 1e-2 && (at.value - value).abs() < 1e-4, "{at:?}");
    }
    // With room for one it is the deepest, and the count says that there are two.
    let mut room = [None];
    let short =
        pair.minima::<f64>(region_of(&pair, 1.0 / 64.0), 1 << 22, &mut vec![MortonLeaf::empty(); 1 << 18], &mut room);
    assert_eq!((short.count, room[0].unwrap().value), (2, points[0].value));
    // Sunk so far that the bar is under the floor too, the weights are joined, and the lower hollow is still there.
    let sunk = shifted(dumbbell, [0.0, 0.0, -0.5]);
    let pair = Pair::new(&sunk, &floor, 0.0).unwrap();
    let (joined, points) = minima(&pair, region_of(&pair, 1.0 / 96.0));
    let climb = |at: &OverlapPoint<f64>| {
        (0..=100)
            .map(|i| highest(&sunk, &floor, at.point + (points[0].point - at.point) * (f64::from(i) / 100.0)))
            .fold(at.value, f64::max)
            - at.value
    };
    assert!(joined.barrier < 0.06 && points.len() == 2, "{joined:?} {points:?}");
    assert!(climb(&points[1]) > 0.5 * joined.barrier, "{points:?}");
    // A ring that lies flat is one minimum, though every chord between two of its points rises.
    let ring = shifted(Torus::new(1.0, 0.2).unwrap(), [0.0, 0.0, 0.15]);
    let pair = Pair::new(&ring, &floor, 0.0).unwrap();
    let (_, points) = minima(&pair, region_of(&pair, 1.0 / 64.0));
    assert!(points.len() == 1 && (points[0].value + 0.025).abs() < 1e-6, "{points:?}");
}

#[test]
fn the_deepest_point_is_the_first_of_the_minima() {
    let mut random = Random::of_test();
    let mut compared = 0;
    pairs(&mut random, 2, |name, a, b, margin| {
        let Some(pair) = Pair::new(a, b, margin).ok().and_then(|pair| pair.shrink::<f64>(16).ok()) else { return };
        let found = pair
            .deepest::<f64>(&DepthSearch { evaluations: 1 << 13, tolerance: 1e-3 }, &mut vec![BoxNode::EMPTY; 1 << 12]);
        let (all, points) = minima(&pair, region_of(&pair, 1.0 / 24.0));
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
    let mut random = Random::of_test();
    let mut compared = 0;
    pairs(&mut random, 2, |name, a, b, margin| {
        let (Ok(there), Ok(back)) = (Pair::new(a, b, margin), Pair::new(b, a, margin)) else { return };
        assert_eq!(there.region(), back.region(), "{name}");
        let same = |at: &OverlapPoint<f64>, back: &OverlapPoint<f64>| {
            assert_eq!((at.point, at.value, at.a, at.b), (back.point, back.value, back.b, back.a), "{name}");
            assert_eq!(at.normal, -back.normal, "{name}");
        };
        let search = DepthSearch { evaluations: 1 << 12, tolerance: 1e-2 };
        let [one, other] =
            [there.deepest(&search, &mut [BoxNode::EMPTY; 1024]), back.deepest(&search, &mut [BoxNode::EMPTY; 1024])];
        assert_eq!(
            (one.lower_bound, one.converged, one.evaluations),
            (other.lower_bound, other.converged, other.evaluations)
        );
        assert_eq!(one.point.is_some(), other.point.is_some(), "{name}");
        one.point.iter().zip(&other.point).for_each(|(one, other)| same(one, other));
        let resolution = region_of(&there, 1.0 / 20.0);
        let ((one, points), (other, points_back)) = (patch::<f64>(&there, resolution), patch(&back, resolution));
        assert_eq!(
            (one.point_count, one.leaf_count, one.bounds),
            (other.point_count, other.leaf_count, other.bounds),
            "{name}"
        );
        points.iter().zip(&points_back).for_each(|(one, other)| same(&one.point, &other.point));
        let ((_, points), (_, points_back)) = (minima(&there, resolution), minima(&back, resolution));
        assert_eq!(points.len(), points_back.len(), "{name}");
        points.iter().zip(&points_back).for_each(|(one, other)| same(one, other));
        compared += points.len();
    });
    assert!(compared > 15, "{compared}");
}

#[test]
fn a_scale_by_a_power_of_two_leaves_every_bit_but_the_exponent() {
    let (small, large) = (scenes(1.0), scenes(4.0));
    for (index, first) in small.iter().enumerate() {
        let other = (index * 7 + 3) % small.len();
        let shift = [0.4, -0.3, 0.2];
        let (a, b) = (first, shifted(&small[other], shift));
        let (scaled_a, scaled_b) = (&large[index], shifted(&large[other], shift.map(|x| 4.0 * x)));
        let (Ok(pair), Ok(scaled)) = (Pair::new(a, &b, 0.0), Pair::new(scaled_a, &scaled_b, 0.0)) else { continue };
        let search = DepthSearch { evaluations: 1 << 10, tolerance: 1e-2 };
        let one: DeepestPoint<f64> = pair.deepest(&search, &mut [BoxNode::EMPTY; 512]);
        let four: DeepestPoint<f64> = scaled.deepest(&search, &mut [BoxNode::EMPTY; 512]);
        let name = format!("{} and {}", first.name, small[other].name);
        assert_eq!((one.lower_bound * 4.0, one.evaluations), (four.lower_bound, four.evaluations), "{name}");
        let (Some(one), Some(four)) = (one.point, four.point) else { continue };
        assert_eq!((one.point * 4.0, one.value * 4.0, one.normal), (four.point, four.value, four.normal), "{name}");
        let resolution = region_of(&pair, 1.0 / 16.0);
        let ((one, _), (four, _)) = (patch::<f64>(&pair, resolution), patch::<f64>(&scaled, 4.0 * resolution));
        assert_eq!((one.area * 16.0, one.leaf_count), (four.area, four.leaf_count), "{name}");
    }
}

#[test]
fn a_motion_of_both_moves_what_they_meet_in() {
    let mut random = Random::of_test();
    for _ in 0..30 {
        let bar = Capsule::new([-0.5, 0.1, 0.0], [random.between(0.3, 0.8), 0.0, 0.2], 0.4).unwrap();
        let ball = Sphere::new(0.5).unwrap();
        let turn = [0; 4].map(|_| random.between(-1.0, 1.0));
        let motion = Rigid::new(random.in_cube(5.0).into(), turn).unwrap();
        let (a, b) = (shifted(bar, [0.0; 3]), shifted(ball, (random.direction() * 0.8).into()));
        let Ok(pair) = Pair::new(&a, &b, 0.0).and_then(|pair| pair.shrink::<f64>(32)) else { continue };
        let (moved_a, moved_b) = (Placed { field: a, placement: motion }, Placed { field: b, placement: motion });
        let moved = Pair::new(&moved_a, &moved_b, 0.0).unwrap().shrink::<f64>(32).unwrap();
        let [one, other] = [deepest::<f64>(&pair, 1e-5).point.unwrap(), deepest::<f64>(&moved, 1e-5).point.unwrap()];
        assert!(
            (one.value - other.value).abs() < 3e-5 && (motion.push(one.point) - other.point).norm() < 0.03,
            "{one:?} {other:?}"
        );
        let turned = motion.push(one.normal) - motion.push(Vector3::zeros());
        assert!((turned - other.normal).norm() < 0.1, "{one:?} {other:?}");
        let resolution = region_of(&pair, 1.0 / 64.0);
        let ((one, _), (other, _)) = (patch::<f64>(&pair, resolution), patch::<f64>(&moved, resolution));
        assert!(
            (one.area - other.area).abs() < 0.03 * one.area + 8.0 * resolution * resolution,
            "{} {}",
            one.area,
            other.area
        );
    }
}

#[test]
fn grids_meet_where_their_shapes_do_within_their_error() {
    let (ball, block) = (Sphere::new(0.5).unwrap(), Cuboid::new([0.25, 0.5, 0.375]).unwrap());
    let lattice = cube_lattice(0.75, 48);
    // What trilinear interpolation of a distance is off by at most: half a cell's diagonal.
    let error = 0.5 * 3.0_f64.sqrt() * lattice.spacing();
    let turn = [0.1, 0.2, 0.3, 0.9];
    let pose = Rigid::new([0.5, 0.35, 0.2], turn).unwrap();
    let placed = Placed { field: block, placement: pose };
    let exact = Pair::new(&ball, &placed, 0.0).unwrap();
    let truth = deepest::<f64>(&exact, 1e-5).point.unwrap();
    let area = patch::<f64>(&exact.shrink::<f64>(32).unwrap(), 0.01).0.area;
    let (dense, dense_block) = (bounded(sampled(&ball, lattice, 1.0)), sampled(&block, lattice, 1.0));
    let (bricks, block_bricks) =
        (sampled_in_bricks::<u16>(&ball, lattice, 0.1), sampled_in_bricks::<f32>(&block, lattice, 0.1));
    let check = |name: &str, a: &dyn Fn() -> (DeepestPoint<f64>, f64)| {
        let (found, of_grids) = a();
        let at = found.point.unwrap();
        assert!((at.value - truth.value).abs() <= error + 1e-4, "{name}: {} {}", at.value, truth.value);
        assert!(
            found.converged && found.lower_bound <= at.value && (at.point - truth.point).norm() < 0.1,
            "{name}: {found:?}"
        );
        assert!((of_grids / area - 1.0).abs() < 0.1, "{name}: {of_grids} {area}");
    };
    macro_rules! pair {
        ($name:literal, $a:expr, $b:expr) => {
            check($name, &|| {
                let b = Placed { field: $b, placement: pose };
                let pair = Pair::new($a, &b, 0.0).unwrap().shrink::<f64>(32).unwrap();
                (deepest(&pair, 1e-3), patch::<f64>(&pair, 0.01).0.area)
            })
        };
    }
    pair!("dense and dense", &dense, &dense_block);
    pair!("dense and sparse", &dense, &block_bricks);
    pair!("sparse and sparse", &bricks, &block_bricks);
    pair!("sparse and shape", &bricks, &block);
    pair!("shape and dense", &ball, &dense_block);
}

#[test]
fn apart_is_proven_and_just_touching_is_not_taken_for_it() {
    let ball = Sphere::new(1.0).unwrap();
    let mut random = Random::of_test();
    assert_eq!(Pair::new(&ball, &shifted(ball, [3.0, 0.0, 0.0]), 0.0).err(), Some(NoRegion::Separated));
    // Their boxes overlap.
    let corner = shifted(ball, [1.3, 1.3, 1.3]);
    let pair = Pair::new(&ball, &corner, 0.0).unwrap();
    let found = deepest::<f64>(&pair, 1e-3);
    assert!(found.converged && 0.0 < found.lower_bound && found.lower_bound <= found.point.unwrap().value, "{found:?}");
    assert_eq!(pair.shrink::<f64>(32).err(), Some(NoRegion::Separated));
    assert_eq!(patch::<f64>(&pair, 0.05).0.bounds, None);
    let half = 0.5 * (1.3 * 3.0_f64.sqrt() - 2.0);
    let within = Pair::new(&ball, &corner, half + 1e-3).unwrap();
    assert!((deepest::<f64>(&within, 1e-5).point.unwrap().value - half).abs() < 1e-4);
    // 0.1 + 0.2 is rounded up, and so would a box be.
    let (a, b) = (Sphere::new(0.2).unwrap(), shifted(Sphere::new(0.1).unwrap(), [0.1 + 0.2, 0.0, 0.0]));
    assert!(Pair::new(&a, &b, 0.0).is_ok());
    for _ in 0..50 {
        let way = random.direction();
        let touching = shifted(ball, (way * 2.0).into());
        let found = deepest::<f64>(&Pair::new(&ball, &touching, 0.0).unwrap(), 1e-6);
        let at = found.point.unwrap();
        assert!(found.lower_bound <= 0.0 && at.value.abs() < 1e-8 && (at.point - way).norm() < 1e-3, "{found:?}");
        let pair = Pair::new(&ball, &touching, 0.0).unwrap();
        assert!(pair.shrink::<f64>(64).is_ok(), "{way}");
        let in_f32 = deepest::<f32>(&pair, 1e-4);
        assert!(in_f32.lower_bound <= 0.0 && in_f32.point.unwrap().value.abs() < 1e-4, "{in_f32:?}");
    }
}

#[test]
fn one_in_the_other_and_twice_the_same_have_a_deepest_point() {
    let (large, small) = (Sphere::new(1.0).unwrap(), shifted(Sphere::new(0.25).unwrap(), [0.3, 0.2, 0.1]));
    let pair = Pair::new(&small, &large, 0.0).unwrap();
    let found = deepest::<f64>(&pair, 1e-4);
    let at = found.point.unwrap();
    assert!(
        found.converged && (at.value + 0.25).abs() < 1e-4 && (at.point - Vector3::new(0.3, 0.2, 0.1)).norm() < 1e-3,
        "{found:?}"
    );
    assert!(patch::<f64>(&pair, 0.01).0.point_count == 0, "nowhere in the small one is it as deep as in the large one");
    assert_eq!(minima(&pair, 0.02).1.len(), 1);
    let same = Pair::new(&large, &large, 0.0).unwrap();
    let found = deepest::<f64>(&same, 1e-3);
    assert!(found.converged && (found.point.unwrap().value + 1.0).abs() < 2e-3, "{found:?}");
    assert_eq!(found.point.unwrap().normal, Vector3::zeros());
    let (all, _) = patch::<f64>(&same, 0.1);
    assert!(
        all.point_count == 0 && all.area == 0.0 && all.undefined_count == all.leaf_count && all.leaf_count > 4000,
        "{all:?}"
    );
}

#[test]
fn what_cannot_be_searched_is_said() {
    let (ball, floor) = (Sphere::new(1.0).unwrap(), HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap());
    for margin in [0.0, 1.0] {
        assert_eq!(Pair::new(&floor, &floor, margin).err(), Some(NoRegion::Unbounded));
    }
    for margin in [f64::NAN, f64::INFINITY] {
        assert!(Pair::new(&ball, &ball, margin).is_err(), "{margin}");
    }
    assert!(Pair::new(&ball, &Sphere::new(1e200).unwrap(), 0.0).is_ok());
    let pair = Pair::new(&ball, &floor, 0.0).unwrap();
    for resolution in [0.0, -1.0, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE] {
        let found = pair.patch::<f64>(resolution, 500, |_| ());
        assert!(
            found.resolution > 0.0 && found.resolution.is_finite() && found.evaluations < 520,
            "{resolution}: {found:?}"
        );
    }
    assert!(!pair.patch::<f64>(1e-3, 500, |_| ()).is_complete);
    let short = pair.minima::<f64>(0.1, 1 << 20, &mut [MortonLeaf::empty(); 8], &mut [None; 4]);
    assert!(!short.is_complete && short.leaf_count > 8, "{short:?}");
    let within = Aabb { min: [0.2, -1.0, -1.0], max: [1.0; 3] };
    let part = pair.restrict(&within).unwrap();
    assert!(within.encloses(&part.region()) && deepest::<f64>(&part, 1e-4).point.unwrap().point.x >= 0.2);
}

#[test]
fn with_little_room_or_few_looks_the_bounds_still_hold() {
    let ring = Torus::new(1.0, 0.3).unwrap();
    let bar = shifted(Capsule::new([-1.0, 0.0, 0.0], [1.0, 0.5, 0.0], 0.2).unwrap(), [0.0, 0.0, 0.45]);
    let pair = Pair::new(&ring, &bar, 0.0).unwrap();
    for room in [0, 1, 2, 3, 5, 8, 20, 100] {
        for evaluations in [0, 1, 10, 100, 1000, 10_000] {
            let found: DeepestPoint<f64> =
                pair.deepest(&DepthSearch { evaluations, tolerance: 1e-6 }, &mut vec![BoxNode::EMPTY; room]);
            assert!(
                found.lower_bound <= -0.025 && found.point.unwrap().value >= -0.025 - 1e-12,
                "{room} {evaluations}: {found:?}"
            );
            assert!(!found.converged, "{room} {evaluations}: {found:?}");
            assert!(found.evaluations <= evaluations + 200, "{room} {evaluations}: {found:?}");
        }
    }
}

#[test]
fn samples_that_are_no_numbers_prove_nothing_and_end_nothing() {
    let ball = Sphere::new(0.5).unwrap();
    let lattice = cube_lattice(0.75, 12);
    let whole = sampled(&ball, lattice, 1.0);
    let mut samples: Vec<f32> = (0..lattice.node_count())
        .map(|i| {
            let [x, y, _] = lattice.nodes().map(|n| n as usize);
            let node = [i % x, i / x % y, i / x / y].map(|n| n as u32);
            whole.value(Vector3::from(lattice.node(node))) as f32
        })
        .collect();
    for hole in [f32::NAN, f32::INFINITY] {
        samples.iter_mut().skip(lattice.index([6, 6, 9])).take(3).for_each(|sample| *sample = hole);
        let broken = Grid::new(lattice, Dense::new(&lattice, samples.clone()).unwrap(), 2.0).unwrap();
        let other = shifted(ball, [0.05, 0.0, 0.8]);
        let pair = Pair::new(&broken, &other, 0.0).unwrap();
        let search = DepthSearch { evaluations: 1 << 12, tolerance: 1e-3 };
        let found: DeepestPoint<f64> = pair.deepest(&search, &mut [BoxNode::EMPTY; 1024]);
        assert!(!found.converged && found.lower_bound == f64::NEG_INFINITY, "{found:?}");
        assert!(found.point.is_some_and(|at| at.value < -0.05 && at.point.iter().all(|x| x.is_finite())), "{found:?}");
        let (all, points) = patch::<f64>(&pair, 0.05);
        assert!(
            all.undefined_count > 0 && all.area.is_finite() && points.iter().all(|piece| piece.point.value.is_finite()),
            "{all:?}"
        );
        let (all, points) = minima(&pair, 0.05);
        assert!(all.undefined_count > 0 && points.iter().all(|at| at.value.is_finite()), "{all:?}");
    }
    // Nothing but holes.
    let broken = Grid::new(lattice, Dense::new(&lattice, vec![f32::NAN; lattice.node_count()]).unwrap(), 2.0).unwrap();
    let pair = Pair::new(&broken, &ball, 0.0).unwrap();
    let found: DeepestPoint<f64> =
        pair.deepest(&DepthSearch { evaluations: 100, tolerance: 1e-3 }, &mut [BoxNode::EMPTY; 64]);
    assert!(found.point.is_none() && found.lower_bound == f64::NEG_INFINITY && !found.converged, "{found:?}");
}

#[test]
fn grids_of_one_cell_meet_too() {
    let lattice = Lattice::new([-0.5; 3], 1.0, [2; 3]).unwrap();
    // φ = z − 0.1 in the cell.
    let samples = vec![-0.6, -0.6, -0.6, -0.6, 0.4, 0.4, 0.4, 0.4_f32];
    let slab = Grid::new(lattice, Dense::new(&lattice, samples).unwrap(), 2.0_f64.sqrt()).unwrap();
    let ball = shifted(Sphere::new(0.25).unwrap(), [0.1, 0.1, 0.3]);
    let pair = Pair::new(&ball, &slab, 0.0).unwrap();
    let found = deepest::<f64>(&pair, 1e-4);
    let at = found.point.unwrap();
    assert!(found.converged && (at.separation() + 0.05).abs() < 1e-3 && (at.normal.z - 1.0).abs() < 0.05, "{found:?}");
    let upside_down = Placed { field: &slab, placement: Rigid::new([0.0, 0.0, 0.1], [1.0, 0.0, 0.0, 0.0]).unwrap() };
    let found = deepest::<f64>(&Pair::new(&slab, &upside_down, 0.0).unwrap(), 1e-3);
    // The one is below 0.1, the other above 0: half of that deep in the middle.
    assert!((found.point.unwrap().value + 0.05).abs() < 1e-3, "{found:?}");
}

#[test]
fn no_value_is_below_the_linear_part_by_more_than_its_error() {
    let mut random = Random::of_test();
    let grid = sampled(&Sphere::new(0.5).unwrap(), cube_lattice(0.75, 24), 1.0);
    let [here, there] = [0.0, 8.0].map(|x| Aabb { min: [x + 0.25, 0.25, 0.25], max: [x + 0.375, 0.375, 0.375] });
    assert!(grid.linearization_error(&here) < 0.1);
    assert_eq!(shifted(&grid, [8.0, 0.0, 0.0]).linearization_error(&there), grid.linearization_error(&here));
    let mut known = 0;
    for scene in scenes(1.0) {
        for round in 0..300 {
            let middle = random.in_cube(1.2 * scene.size);
            let half: [f64; 3] = [0; 3].map(|_| random.between(0.0, if round % 2 == 0 { 0.05 } else { 0.5 }));
            let region = Aabb {
                min: std::array::from_fn(|k| middle[k] - half[k]),
                max: std::array::from_fn(|k| middle[k] + half[k]),
            };
            let error = scene.linearization_error(&region);
            assert!(error >= 0.0, "{}", scene.name);
            if error.is_infinite() {
                continue;
            }
            known += 1;
            let at = scene.sample(middle);
            for _ in 0..20 {
                let point = Vector3::from_fn(|k, _| random.between(region.min[k], region.max[k]));
                let linear = at.value + at.gradient.dot(&(point - middle));
                assert!(scene.value(point) >= linear - error - 1e-9, "{}: {point} in {region:?}", scene.name);
            }
        }
    }
    assert!(known > 3000, "{known}");
}
