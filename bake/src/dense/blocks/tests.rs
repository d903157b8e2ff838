use sdf_core::Sdf;
use sdf_core::grid::Storage;
use sdf_core::grid::sparse::BRICK;
use sdf_core::nalgebra::Vector3;

use super::*;
use crate::testing::random;

/// Ranges of a block's samples: of both signs, of one, close to 0, a point, too small to be divided.
const RANGES: [[f32; 2]; 14] = [
    [-1.0, 1.0],
    [-1e-3, 2.0],
    [-2.0, 1e-3],
    [-1.0, 0.0],
    [0.0, 1.0],
    [0.5, 0.5000001],
    [-3.0, -1e-30],
    [-3.0, -0.011],
    [7.0, 15.0],
    [-15.0, -7.0],
    [-1e-30, 1e-28],
    [-5e-45, 7e-45],
    [-1e30, 1e29],
    [-0.25, -0.25],
];

fn check_scale<C: StepCode>() {
    let mut state = 5;
    for [lower, upper] in RANGES {
        let scale = BlockScale::new::<C>(lower, upper);
        let inside = |share: f64| (f64::from(lower) + share * (f64::from(upper) - f64::from(lower))) as f32;
        let near_zero = [0.0, -0.0, 1e-45, -1e-45, 1e-9, -1e-9, upper * 1e-7, lower * 1e-7];
        let samples = (0..2000).map(|_| inside(0.5 + 0.5 * random(&mut state))).chain(near_zero).chain([lower, upper]);
        for sample in samples.filter(|sample| (lower..=upper).contains(sample)) {
            let decoded = scale.encode::<C>(sample).decode(scale.scale);
            assert_eq!(decoded < 0.0, sample < 0.0, "{sample:e} becomes {decoded:e} in [{lower:e}, {upper:e}]");
            // Half a step, and the roundings of base, product, sum and quotient.
            let magnitude = f64::from(lower.abs().max(upper.abs()));
            let allowed = 0.5 * f64::from(scale.scale.step) + 4.0 * f64::from(f32::EPSILON) * magnitude + 1e-44;
            let error = (f64::from(decoded) - f64::from(sample)).abs();
            assert!(
                error <= allowed,
                "{sample:e} becomes {decoded:e} in [{lower:e}, {upper:e}]: {error:e} > {allowed:e}"
            );
        }
    }
}

#[test]
fn a_code_keeps_the_side_of_its_sample_and_is_off_by_half_a_step() {
    check_scale::<u16>();
    check_scale::<u8>();
}

/// Samples that change by less than a spacing from node to node, of both signs.
fn bumpy(lattice: &Lattice) -> DenseGrid {
    let [nx, ny, nz] = lattice.nodes();
    let nodes = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
    let sample = |node| {
        let [x, y, z] = lattice.node(node);
        (Vector3::new(x, y, z).norm() - 1.1 + 0.05 * (9.0 * x).sin() * (7.0 * y + z).cos()) as f32
    };
    DenseGrid { error_bound: 0.25, ..DenseGrid::from_samples(lattice, nodes.map(sample).collect()).unwrap() }
}

/// Every node has the value of its code, bounds and slopes are those of a grid of the decoded samples, and the error bound grows by
/// the largest change.
#[test]
fn the_bounds_of_a_grid_of_codes_are_those_of_its_decoded_samples() {
    for counts in [[2, 3, 5], [8, 8, 8], [9, 17, 20], [33, 8, 25]] {
        let lattice = Lattice::new([-1.3, -1.2, -1.4], 0.1, counts).unwrap();
        let dense = bumpy(&lattice);
        for precision in [Precision::U16, Precision::U8] {
            let BakedGrid { grid, error_bound, .. } = dense.clone().into_grid_as(&lattice, precision);
            assert_eq!((grid.storage().layout().name(), grid.storage().precision()), ("dense", precision));
            let [nx, ny, nz] = counts;
            let mut row = vec![0.0; nx as usize + 8];
            let mut decoded = vec![];
            for (y, z) in (0..nz).flat_map(|z| (0..ny).map(move |y| (y, z))) {
                grid.storage().copy_row([0, y, z], nx, &mut row);
                decoded.extend_from_slice(&row[..nx as usize]);
            }
            let change = |(a, b): (&f32, &f32)| (f64::from(*a) - f64::from(*b)).abs();
            let largest = decoded.iter().zip(&dense.distances).map(change).fold(0.0, f64::max);
            assert!(largest > 0.0 && error_bound >= 0.25 + largest && error_bound <= (0.25 + largest) * (1.0 + 1e-12));
            assert_eq!(grid.global_error_bound(), error_bound);
            assert!(decoded.iter().zip(&dense.distances).all(|(a, b)| (*a < 0.0) == (*b < 0.0)), "{counts:?}");
            let again = DenseGrid::from_samples(&lattice, decoded).unwrap();
            assert_eq!(grid.slope_bound(), again.slope_bound);
            let slots = brick_counts(&lattice);
            for (index, bounds) in (0..).zip(&again.bounds) {
                let first =
                    [index % slots[0], index / slots[0] % slots[1], index / slots[0] / slots[1]].map(|n| n * BRICK);
                assert_eq!(grid.storage().block_bounds(first, first).as_ref(), Some(bounds), "{first:?} of {counts:?}");
            }
        }
    }
}

/// A distance that is not a number is a fault of the baker, which no code may hide.
#[test]
#[should_panic(expected = "baked distances are finite")]
fn a_distance_that_is_not_a_number_gets_no_code() {
    let lattice = Lattice::new([-1.3, -1.2, -1.4], 0.1, [9, 17, 20]).unwrap();
    let mut dense = bumpy(&lattice);
    dense.distances[1000] = f32::NAN;
    dense.into_grid_as(&lattice, Precision::U16);
}
