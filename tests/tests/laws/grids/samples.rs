//! Samples and what lies between them: nodes, interpolation, slope bounds, sparse storage.

use nalgebra::Vector3;
use sdf_core::Sdf;
use sdf_core::grid::{Dense, Grid, Lattice, Storage, measure_slope_bound};
use sdf_core::shapes::Sphere;
use sdf_tests::random::Random;
use sdf_tests::scenes::{Meaning, cube_lattice, dense_grid, node_indices, noise, sampled_in_bricks, scenes};

#[test]
fn at_a_node_the_value_is_the_sample() {
    let mut random = Random::seeded();
    let lattice = cube_lattice(1.0, 8);
    let samples = noise(&lattice, [-1.0, 1.0], &mut random);
    let grid = dense_grid(lattice, samples.clone(), 100.0);
    for node in node_indices(lattice.nodes()) {
        let sample = grid.evaluate(Vector3::from(lattice.node(node)));
        assert_eq!(sample.value, f64::from(samples[lattice.index(node)]), "{node:?}");
        assert!(!sample.status.outside_grid, "{node:?}");
    }
}

/// Interpolation reproduces every c₀ + c₁x + c₂y + c₃z + c₄xy + c₅yz + c₆zx + c₇xyz exactly, with its gradient.
#[test]
fn a_trilinear_function_is_interpolated_as_itself() {
    let mut random = Random::seeded();
    let c: [f64; 8] = std::array::from_fn(|_| random.between(-1.0, 1.0));
    let value = |p: Vector3<f64>| {
        c[0] + c[1] * p.x
            + c[2] * p.y
            + c[3] * p.z
            + c[4] * p.x * p.y
            + c[5] * p.y * p.z
            + c[6] * p.z * p.x
            + c[7] * p.x * p.y * p.z
    };
    let gradient = |p: Vector3<f64>| {
        Vector3::new(
            c[1] + c[4] * p.y + c[6] * p.z + c[7] * p.y * p.z,
            c[2] + c[4] * p.x + c[5] * p.z + c[7] * p.x * p.z,
            c[3] + c[5] * p.y + c[6] * p.x + c[7] * p.x * p.y,
        )
    };
    let lattice = Lattice::new([-0.5, 0.25, -1.0], 0.25, [6, 4, 9]).unwrap();
    let sample = |node| value(Vector3::from(lattice.node(node))) as f32;
    let grid = dense_grid(lattice, node_indices(lattice.nodes()).map(sample).collect(), 100.0);
    let bounds = lattice.bounds();
    for _ in 0..2000 {
        let point = Vector3::from_fn(|axis, _| random.between(bounds.min[axis], bounds.max[axis]));
        let sample = grid.evaluate(point);
        // Samples of at most 8 round to f32, and the gradient divides their differences by the spacing.
        assert!((sample.value - value(point)).abs() < 1e-6, "{point:?}: {sample:?}");
        assert!((sample.gradient - gradient(point)).norm() < 1e-5, "{point:?}: {sample:?}");
    }
}

#[test]
fn the_measured_slope_bound_is_met_and_not_exceeded() {
    let mut random = Random::seeded();
    for scene in scenes(1.0).iter().filter(|scene| scene.meaning == Meaning::Samples) {
        let mut steepest: f64 = 0.0;
        for point in scene.random_points(&mut random, 20_000) {
            steepest = steepest.max(scene.evaluate(point).gradient.norm());
        }
        // Both include the samples' rounding to f32; only the gradient has that of the interpolation.
        assert!(steepest <= scene.slope_bound() * (1.0 + 1e-12), "{}: {steepest}", scene.name);
        assert!(steepest > 0.5 * scene.slope_bound(), "{}: {steepest} of {}", scene.name, scene.slope_bound());
    }
}

#[test]
fn samples_that_are_not_finite_are_reported_by_the_status() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let lattice = cube_lattice(1.0, 4);
        let mut samples = vec![0.5; lattice.node_count()];
        samples[lattice.index([2, 2, 2])] = bad;
        let grid = dense_grid(lattice, samples, 1.0);
        for point in [[0.0, 0.0, 0.0], [0.1, -0.2, 0.3]] {
            let sample = grid.sample(Vector3::<f64>::from(point));
            assert!(sample.status.not_finite && sample.value.is_finite(), "{sample:?}");
        }
        let beside = grid.sample(Vector3::<f64>::repeat(0.9));
        assert!(!beside.status.not_finite && beside.value == 0.5, "{beside:?}");
    }
}

/// Inside bricks, across their borders, and far from all bricks, where the coarse grid is used.
#[test]
fn the_corners_of_a_cell_of_a_sparse_grid_are_its_nodes() {
    let lattice = cube_lattice(1.0, 40);
    let grid = sampled_in_bricks::<f32>(&Sphere::new(0.7).unwrap(), lattice, 0.05);
    let (mut in_bricks, mut far) = (0, 0);
    for cell in node_indices(lattice.cells()) {
        let nodes: [_; 8] =
            std::array::from_fn(|corner| [0, 1, 2].map(|axis| cell[axis] + (corner as u32 >> axis & 1)));
        let has_brick = nodes.map(|node| grid.storage().brick_at(node.map(|node| node / 8)).is_some());
        in_bricks += usize::from(has_brick == [true; 8]);
        far += usize::from(has_brick == [false; 8]);
        assert_eq!(grid.storage().corners(cell), nodes.map(|node| grid.storage().node(node)), "{cell:?}");
    }
    assert!(in_bricks > 1000 && far > 1000, "{in_bricks} cells in bricks, {far} far from them");
}

#[test]
fn an_invalid_slope_bound_is_refused() {
    let lattice = cube_lattice(1.0, 2);
    let samples = vec![0.0_f32; lattice.node_count()];
    let storage = Dense::new(&lattice, &samples[..]).unwrap();
    for bad in [f64::NAN, f64::INFINITY, -1.0] {
        assert!(Grid::new(lattice, storage, bad).is_none());
    }
    assert_eq!(measure_slope_bound(&lattice, &storage), 1.0);
    assert!(Dense::new(&lattice, &samples[1..]).is_none());
}
