//! Scale, motion and sampling: the overlap changes as its fields do.

use sdf_core::overlap::{BoxNode, DeepestPoint, DepthSearch, Pair};
use sdf_core::placed::{Placed, Rigid};
use sdf_core::shapes::{Capsule, Cuboid};
use sdf_tests::random::Random;
use sdf_tests::scene_field::SceneField;
use sdf_tests::scenes::{cube_lattice, sampled, sampled_in_bricks, scenes, with_block_bounds};

use super::{deepest, fraction_of_region, patch, shifted, sphere};

#[test]
fn a_scale_by_a_power_of_two_leaves_every_bit_but_the_exponent() {
    let (small, large) = (scenes(1.0), scenes(4.0));
    for (index, first) in small.iter().enumerate() {
        let other = (index * 7 + 3) % small.len();
        let shift = [0.4, -0.3, 0.2];
        let (a, b) = (&first.field, shifted(&small[other].field, shift));
        let (scaled_a, scaled_b) = (&large[index].field, shifted(&large[other].field, shift.map(|x| 4.0 * x)));
        let (Ok(pair), Ok(scaled)) = (Pair::new(a, &b, 0.0), Pair::new(scaled_a, &scaled_b, 0.0)) else { continue };
        let search = DepthSearch { evaluations: 1 << 10, tolerance: 1e-2 };
        let one: DeepestPoint<f64> = pair.deepest(&search, &mut [BoxNode::EMPTY; 512]);
        let four: DeepestPoint<f64> = scaled.deepest(&search, &mut [BoxNode::EMPTY; 512]);
        let name = format!("{} and {}", first.name, small[other].name);
        assert_eq!((one.lower_bound * 4.0, one.evaluations), (four.lower_bound, four.evaluations), "{name}");
        let (Some(one), Some(four)) = (one.point, four.point) else { continue };
        assert_eq!((one.point * 4.0, one.value * 4.0, one.normal), (four.point, four.value, four.normal), "{name}");
        let resolution = fraction_of_region(&pair, 1.0 / 16.0);
        let ((one, _), (four, _)) = (patch::<f64>(&pair, resolution), patch::<f64>(&scaled, 4.0 * resolution));
        assert_eq!((one.area * 16.0, one.leaf_count), (four.area, four.leaf_count), "{name}");
    }
}

#[test]
fn moving_both_fields_moves_their_overlap() {
    let mut random = Random::seeded();
    for _ in 0..30 {
        let bar = Capsule::new([-0.5, 0.1, 0.0], [random.between(0.3, 0.8), 0.0, 0.2], 0.4).unwrap();
        let rotation = [0; 4].map(|_| random.between(-1.0, 1.0));
        let motion = Rigid::new(random.in_cube(5.0).into(), rotation).unwrap();
        let (a, b) = (SceneField::new(bar), shifted(&sphere(0.5), (random.direction() * 0.8).into()));
        let Ok(pair) = Pair::new(&a, &b, 0.0).and_then(|pair| pair.shrink::<f64>(32)) else { continue };
        let moved = |field: &SceneField| SceneField::new(Placed { field: field.clone(), placement: motion });
        let (moved_a, moved_b) = (moved(&a), moved(&b));
        let moved = Pair::new(&moved_a, &moved_b, 0.0).unwrap().shrink::<f64>(32).unwrap();
        let [one, other] = [deepest::<f64>(&pair, 1e-5).point.unwrap(), deepest::<f64>(&moved, 1e-5).point.unwrap()];
        assert!(
            (one.value - other.value).abs() < 3e-5 && (motion.push(one.point) - other.point).norm() < 0.03,
            "{one:?} {other:?}"
        );
        let rotated = motion.push_vector(one.normal);
        assert!((rotated - other.normal).norm() < 0.1, "{one:?} {other:?}");
        let resolution = fraction_of_region(&pair, 1.0 / 64.0);
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
    let (ball, block) = (sphere(0.5), SceneField::new(Cuboid::new([0.25, 0.5, 0.375]).unwrap()));
    let lattice = cube_lattice(0.75, 48);
    // Bound of the error of trilinear interpolation of a distance: half a cell's diagonal.
    let error = 0.5 * 3.0_f64.sqrt() * lattice.spacing();
    let pose = Rigid::new([0.5, 0.35, 0.2], [0.1, 0.2, 0.3, 0.9]).unwrap();
    let placed = |field: &SceneField| SceneField::new(Placed { field: field.clone(), placement: pose });
    let placed_block = placed(&block);
    let exact = Pair::new(&ball, &placed_block, 0.0).unwrap();
    let truth = deepest::<f64>(&exact, 1e-5).point.unwrap();
    let area = patch::<f64>(&exact.shrink::<f64>(32).unwrap(), 0.01).0.area;
    let dense = SceneField::new(with_block_bounds(sampled(&ball, lattice, 1.0)));
    let dense_block = SceneField::new(sampled(&block, lattice, 1.0));
    let bricks = SceneField::new(sampled_in_bricks::<u16>(&ball, lattice, 0.1));
    let block_bricks = SceneField::new(sampled_in_bricks::<f32>(&block, lattice, 0.1));
    for (name, a, b) in [
        ("dense and dense", &dense, &dense_block),
        ("dense and sparse", &dense, &block_bricks),
        ("sparse and sparse", &bricks, &block_bricks),
        ("sparse and shape", &bricks, &block),
        ("shape and dense", &ball, &dense_block),
    ] {
        let b = placed(b);
        let pair = Pair::new(a, &b, 0.0).unwrap().shrink::<f64>(32).unwrap();
        let (found, grid_area) = (deepest::<f64>(&pair, 1e-3), patch::<f64>(&pair, 0.01).0.area);
        let at = found.point.unwrap();
        assert!((at.value - truth.value).abs() <= error + 1e-4, "{name}: {} {}", at.value, truth.value);
        assert!(
            found.converged && found.lower_bound <= at.value && (at.point - truth.point).norm() < 0.1,
            "{name}: {found:?}"
        );
        assert!((grid_area / area - 1.0).abs() < 0.1, "{name}: {grid_area} {area}");
    }
}
