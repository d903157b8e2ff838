//! Overlaps with known answers: balls, blocks, rings, bars, and grids of one cell.

use std::f64::consts::PI;

use nalgebra::Vector3;
use sdf_core::combine::Union;
use sdf_core::grid::Lattice;
use sdf_core::overlap::{MortonLeaf, NoRegion, OverlapPoint, Pair};
use sdf_core::placed::{Placed, Rigid};
use sdf_core::shapes::{Capsule, Cuboid, HalfSpace, Torus};
use sdf_tests::random::Random;
use sdf_tests::scene_field::SceneField;
use sdf_tests::scenes::dense_grid;

use super::{deepest, fraction_of_region, max_value, minima, patch, ring_and_bar, shifted, sphere};

#[test]
fn balls_meet_in_the_middle_of_their_centres_in_a_disc() {
    let mut random = Random::seeded();
    for _ in 0..100 {
        let [first, second] = [0; 2].map(|_| random.between(0.3, 1.5));
        let centre = random.in_cube(3.0);
        let distance =
            (first + second) * random.between(0.7, 1.3).max((first - second).abs() / (first + second) * 1.05);
        let axis = random.direction();
        let a = shifted(&sphere(first), (centre + axis * distance).into());
        let b = shifted(&sphere(second), centre.into());
        let gap = distance - first - second;
        let pair = Pair::new(&a, &b, 0.5 * gap.max(0.0) + 1e-9).unwrap();
        let found = deepest::<f64>(&pair, 1e-6);
        let at = found.point.unwrap();
        assert!(
            found.converged && (at.separation() - gap).abs() < 1e-5 && (at.value - 0.5 * gap).abs() < 1e-5,
            "{found:?}"
        );
        // Off the axis the value rises with the square of the distance from it.
        assert!((at.point - centre - axis * (second + 0.5 * gap)).norm() < 1e-2, "{found:?}");
        assert!((at.normal - axis).norm() < 1e-2, "from the second into the first: {found:?}");
        let in_f32 = deepest::<f32>(&pair, 1e-4);
        assert!((f64::from(in_f32.point.unwrap().value) - 0.5 * gap).abs() < 1e-3);
    }
    for distance in [0.5, 1.0, 1.9] {
        let ball = sphere(1.0);
        let centre = random.direction() * distance;
        let other = shifted(&ball, centre.into());
        let pair = Pair::new(&other, &ball, 0.0).unwrap().shrink::<f64>(32).unwrap();
        let area = PI * (1.0 - 0.25 * distance * distance);
        let (found, points) = patch::<f64>(&pair, fraction_of_region(&pair, 1.0 / 64.0));
        assert!((found.area / area - 1.0).abs() < 2e-3, "{} {area}", found.area);
        assert!((points.iter().map(|piece| piece.area).sum::<f64>() - found.area).abs() < 1e-9);
        let (coarse, _) = patch::<f64>(&pair, fraction_of_region(&pair, 1.0 / 16.0));
        assert!(
            (found.area - area).abs() < 0.5 * (coarse.area - area).abs() + 1e-4,
            "a finer resolution is not better"
        );
        let (in_f32, _) = patch::<f32>(&pair, fraction_of_region(&pair, 1.0 / 64.0));
        assert!((f64::from(in_f32.area) / area - 1.0).abs() < 5e-3);
        // Every point of the disc is near a point of the patch.
        let axis = centre.normalize();
        for _ in 0..200 {
            let offset = axis.cross(&random.direction()).normalize() * (area / PI).sqrt() * random.unit().sqrt();
            let point = axis * (0.5 * distance) + offset;
            let nearest = points.iter().map(|piece| (piece.point.point - point).norm()).fold(f64::INFINITY, f64::min);
            assert!(nearest < 2.0 * found.resolution, "{nearest}");
        }
    }
}

#[test]
fn a_block_rests_on_the_floor_with_its_face() {
    let floor = SceneField::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap());
    for depth in [1e-3, 1e-4] {
        let block = SceneField::new(Cuboid::new([0.5, 0.3, 0.2]).unwrap());
        let block = shifted(&block, [0.1, -0.2, 0.2 - depth]);
        let pair = Pair::new(&block, &floor, 0.0).unwrap().shrink::<f64>(32).unwrap();
        let found = deepest::<f64>(&pair, 1e-6);
        let at = found.point.unwrap();
        assert!(found.converged && found.evaluations < 2000, "a face on a plane takes too long: {found:?}");
        assert!((at.value + 0.5 * depth).abs() < 2e-6 && (at.normal.z - 1.0).abs() < 1e-9, "{found:?}");
        for fraction in [1.0 / 24.0, 1.0 / 48.0, 1.0 / 96.0] {
            let (found, points) = patch::<f64>(&pair, fraction_of_region(&pair, fraction));
            // At the boundary, where the middle surface bends, half a row of leaves may be missed.
            assert!((found.area - 0.6).abs() < 0.5 * 3.2 * found.resolution, "{found:?}");
            assert!(
                points.iter().all(|piece| piece.point.point.z.abs() <= depth && piece.point.normal.z > 0.7),
                "{found:?}"
            );
        }
        let (_, points) = minima(&pair, fraction_of_region(&pair, 1.0 / 48.0));
        assert_eq!(points.len(), 1, "a face is one minimum");
    }
}

#[test]
fn a_ball_sinks_into_a_block_by_its_depth() {
    let block = SceneField::new(Cuboid::new([0.5, 0.6, 0.7]).unwrap());
    for depth in [0.05, 0.2] {
        let ball = shifted(&sphere(0.3), [0.1, -0.1, 0.7 + 0.3 - depth]);
        let pair = Pair::new(&ball, &block, 0.0).unwrap();
        let at = deepest::<f64>(&pair, 1e-6).point.unwrap();
        assert!((at.separation() + depth).abs() < 1e-5 && (at.normal.z - 1.0).abs() < 1e-6, "{at:?}");
        assert!((at.point - Vector3::new(0.1, -0.1, 0.7 - 0.5 * depth)).norm() < 1e-2, "{at:?}");
    }
}

#[test]
fn a_bar_across_a_ring_touches_it_twice() {
    let [ring, bar] = ring_and_bar();
    let pair = Pair::new(&ring, &bar, 0.0).unwrap();
    // The points where the bar's axis is over the ring's centre line.
    let expected = [Vector3::new(-1.0, 0.0, 0.275), Vector3::new(15.0 / 17.0, 8.0 / 17.0, 0.275)];
    let found = deepest::<f64>(&pair, 1e-3);
    assert!(found.converged && (found.point.unwrap().value + 0.025).abs() < 3e-3, "{found:?}");
    for fraction in [1.0 / 32.0, 1.0 / 64.0] {
        let (_, points) = minima(&pair, fraction_of_region(&pair, fraction));
        assert_eq!(points.len(), 2, "{points:?}");
        for expected in expected {
            let nearest =
                points.iter().min_by(|a, b| (a.point - expected).norm().total_cmp(&(b.point - expected).norm()));
            let at = nearest.unwrap();
            assert!((at.point - expected).norm() < 1e-3 && (at.value + 0.025).abs() < 1e-6, "{at:?}");
            assert!((at.normal.z + 1.0).abs() < 1e-3, "from the bar down into the ring: {at:?}");
        }
    }
}

#[test]
fn minima_are_separated_by_barriers() {
    let floor = SceneField::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap());
    let ball = |x: f64, z: f64| shifted(&sphere(0.5), [x, 0.0, z]);
    // Two balls on a bar, one a little deeper.
    let balls = SceneField::new(Union(ball(-1.0, 0.45), ball(1.0, 0.4)));
    let bar = SceneField::new(Capsule::new([-1.0, 0.0, 0.45], [1.0, 0.0, 0.4], 0.2).unwrap());
    let dumbbell = SceneField::new(Union(balls, bar));
    let pair = Pair::new(&dumbbell, &floor, 0.0).unwrap();
    let (found, points) = minima(&pair, fraction_of_region(&pair, 1.0 / 64.0));
    assert_eq!((found.count, points.len()), (2, 2), "{found:?} {points:?}");
    for (at, [x, value]) in points.iter().zip([[1.0, -0.05], [-1.0, -0.025]]) {
        assert!((at.point.x - x).abs() < 1e-2 && (at.value - value).abs() < 1e-4, "{at:?}");
    }
    // A buffer for one keeps the deepest, and the count is still two.
    let mut buffer = [None];
    let short = pair.minima::<f64>(
        fraction_of_region(&pair, 1.0 / 64.0),
        1 << 22,
        &mut vec![MortonLeaf::empty(); 1 << 18],
        &mut buffer,
    );
    assert_eq!((short.count, buffer[0].unwrap().value), (2, points[0].value));
    // Sunk until the bar is below the floor too, the balls are connected, and both minima remain.
    let sunk = shifted(&dumbbell, [0.0, 0.0, -0.5]);
    let pair = Pair::new(&sunk, &floor, 0.0).unwrap();
    let (connected, points) = minima(&pair, fraction_of_region(&pair, 1.0 / 96.0));
    let climb = |at: &OverlapPoint<f64>| {
        (0..=100)
            .map(|i| max_value(&sunk, &floor, at.point + (points[0].point - at.point) * (f64::from(i) / 100.0)))
            .fold(at.value, f64::max)
            - at.value
    };
    assert!(connected.barrier < 0.06 && points.len() == 2, "{connected:?} {points:?}");
    assert!(climb(&points[1]) > 0.5 * connected.barrier, "{points:?}");
    // A flat ring is one minimum, though the value rises along every chord.
    let ring = shifted(&SceneField::new(Torus::new(1.0, 0.2).unwrap()), [0.0, 0.0, 0.15]);
    let pair = Pair::new(&ring, &floor, 0.0).unwrap();
    let (_, points) = minima(&pair, fraction_of_region(&pair, 1.0 / 64.0));
    assert!(points.len() == 1 && (points[0].value + 0.025).abs() < 1e-6, "{points:?}");
}

#[test]
fn separation_is_proven_and_touching_is_not_mistaken_for_it() {
    let ball = sphere(1.0);
    let mut random = Random::seeded();
    assert_eq!(Pair::new(&ball, &shifted(&ball, [3.0, 0.0, 0.0]), 0.0).err(), Some(NoRegion::Separated));
    // Their boxes overlap.
    let corner = shifted(&ball, [1.3, 1.3, 1.3]);
    let pair = Pair::new(&ball, &corner, 0.0).unwrap();
    let found = deepest::<f64>(&pair, 1e-3);
    assert!(found.converged && 0.0 < found.lower_bound && found.lower_bound <= found.point.unwrap().value, "{found:?}");
    assert_eq!(pair.shrink::<f64>(32).err(), Some(NoRegion::Separated));
    assert_eq!(patch::<f64>(&pair, 0.05).0.bounds, None);
    let half = 0.5 * (1.3 * 3.0_f64.sqrt() - 2.0);
    let within = Pair::new(&ball, &corner, half + 1e-3).unwrap();
    assert!((deepest::<f64>(&within, 1e-5).point.unwrap().value - half).abs() < 1e-4);
    // 0.1 + 0.2 rounds up, and so would a box.
    let (a, b) = (sphere(0.2), shifted(&sphere(0.1), [0.1 + 0.2, 0.0, 0.0]));
    assert!(Pair::new(&a, &b, 0.0).is_ok());
    for _ in 0..50 {
        let axis = random.direction();
        let touching = shifted(&ball, (axis * 2.0).into());
        let found = deepest::<f64>(&Pair::new(&ball, &touching, 0.0).unwrap(), 1e-6);
        let at = found.point.unwrap();
        assert!(found.lower_bound <= 0.0 && at.value.abs() < 1e-8 && (at.point - axis).norm() < 1e-3, "{found:?}");
        let pair = Pair::new(&ball, &touching, 0.0).unwrap();
        assert!(pair.shrink::<f64>(64).is_ok(), "{axis}");
        let in_f32 = deepest::<f32>(&pair, 1e-4);
        assert!(in_f32.lower_bound <= 0.0 && in_f32.point.unwrap().value.abs() < 1e-4, "{in_f32:?}");
    }
}

#[test]
fn nested_and_identical_fields_have_a_deepest_point() {
    let (large, small) = (sphere(1.0), shifted(&sphere(0.25), [0.3, 0.2, 0.1]));
    let pair = Pair::new(&small, &large, 0.0).unwrap();
    let found = deepest::<f64>(&pair, 1e-4);
    let at = found.point.unwrap();
    assert!(
        found.converged && (at.value + 0.25).abs() < 1e-4 && (at.point - Vector3::new(0.3, 0.2, 0.1)).norm() < 1e-3,
        "{found:?}"
    );
    assert!(patch::<f64>(&pair, 0.01).0.point_count == 0, "the middle surface does not meet the small ball");
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
fn grids_of_one_cell_meet_too() {
    let lattice = Lattice::new([-0.5; 3], 1.0, [2; 3]).unwrap();
    // φ = z − 0.1 in the cell.
    let samples = vec![-0.6, -0.6, -0.6, -0.6, 0.4, 0.4, 0.4, 0.4_f32];
    let slab = SceneField::new(dense_grid(lattice, samples, 2.0_f64.sqrt()));
    let ball = shifted(&sphere(0.25), [0.1, 0.1, 0.3]);
    let pair = Pair::new(&ball, &slab, 0.0).unwrap();
    let found = deepest::<f64>(&pair, 1e-4);
    let at = found.point.unwrap();
    assert!(found.converged && (at.separation() + 0.05).abs() < 1e-3 && (at.normal.z - 1.0).abs() < 0.05, "{found:?}");
    let placement = Rigid::new([0.0, 0.0, 0.1], [1.0, 0.0, 0.0, 0.0]).unwrap();
    let upside_down = SceneField::new(Placed { field: slab.clone(), placement });
    let found = deepest::<f64>(&Pair::new(&slab, &upside_down, 0.0).unwrap(), 1e-3);
    // One solid is below z = 0.1, the other above z = 0: the overlap is 0.1 thick.
    assert!((found.point.unwrap().value + 0.05).abs() < 1e-3, "{found:?}");
}
