//! The smooth gradient depends on the six nodes about a point's own cell, and turns no faster than its bound.

use sdf_core::Sdf;
use sdf_core::grid::{Dense, Grid, Lattice};
use sdf_core::nalgebra::Vector3;

const NODES: u32 = 14;

/// A lattice with spacing 1 whose samples are zero, but for one.
fn impulse(at: [u32; 3]) -> (Lattice, Vec<f32>) {
    let lattice = Lattice::new([0.0; 3], 1.0, [NODES; 3]).unwrap();
    let mut samples = vec![0.0; lattice.node_count()];
    samples[lattice.index(at)] = 1.0;
    (lattice, samples)
}

#[test]
fn the_smooth_gradient_does_not_jump_within_a_cell() {
    // An edge of the grid rises by 1 at most, so L ≤ √3: |∂S/∂x(x) − ∂S/∂x(y)| ≤ 2 (5/3)³ L |x − y|.
    let bound = 2.0 * (5.0_f64 / 3.0).powi(3) * 3.0_f64.sqrt();
    const STEPS: u32 = 1 << 10;
    let (lattice, samples) = impulse([6; 3]);
    let grid = Grid::new(lattice, Dense::new(&lattice, &samples[..]).unwrap(), 2.0).unwrap();
    for axis in 0..3 {
        let gradient = |step: u32| {
            let mut point = Vector3::new(6.3, 6.2, 6.4);
            point[axis] = 3.0 + f64::from(step) * 8.0 / f64::from(STEPS);
            grid.evaluate_smooth(point).gradient
        };
        for step in 0..STEPS {
            let change = (gradient(step + 1) - gradient(step)).amax();
            assert!(change <= bound * 8.0 / f64::from(STEPS), "axis {axis}, step {step}: {change}");
        }
    }
}

#[test]
fn the_smooth_gradient_takes_two_nodes_beyond_the_cell_of_its_point_and_no_others() {
    for (node, is_taken) in [(2, false), (3, true), (8, true), (9, false)] {
        for fraction in [0.25, 0.75] {
            let (lattice, samples) = impulse([node, 5, 5]);
            let grid = Grid::new(lattice, Dense::new(&lattice, &samples[..]).unwrap(), 2.0).unwrap();
            let gradient = grid.evaluate_smooth(Vector3::new(5.0 + fraction, 5.3, 5.4)).gradient;
            assert_eq!(gradient.amax() > 0.0, is_taken, "node {node}, fraction {fraction}: {gradient:?}");
        }
    }
}
