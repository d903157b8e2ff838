//! Short cuts of sparse grids: boxes of nodes that are copied, smooth gradients from such copies, lower bounds without slopes.

mod bricks;

use bricks::Bricks;
use sdf_core::grid::sparse::{BRICK, NO_BRICK, Scale, Sparse, brick_counts};
use sdf_core::grid::{BlockBounds, Dense, Grid, Lattice, Storage};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, EnclosedSdf, Interval, Sdf};

/// More slots along x than are held at once.
const NODES: [u32; 3] = [83, 29, 21];

fn random(seed: &mut u64) -> u64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    *seed >> 33
}

/// A sparse grid of random samples between a lowest one and two more, with some slots empty.
fn random_bricks(lattice: &Lattice, lowest: f32) -> Bricks {
    let mut seed = 7;
    let [x, y, z] = brick_counts(lattice);
    let mut bricks = Bricks::default();
    for _ in 0..x * y * z {
        if random(&mut seed).is_multiple_of(3) {
            bricks.table.push(NO_BRICK);
            continue;
        }
        bricks.table.push(bricks.scales.len() as u32);
        bricks.scales.push(Scale { base: lowest, step: 2.0 / 65535.0 });
        bricks.bounds.push(BlockBounds { range: Interval { lower: lowest, upper: lowest + 2.0 }, slope_bound: 9.0 });
        bricks.samples.extend((0..BRICK * BRICK * BRICK).map(|_| random(&mut seed) as u16));
    }
    let coarse = (0..(x + 1) * (y + 1) * (z + 1)).map(|_| lowest + random(&mut seed) as f32 / 2.0_f32.powi(30));
    bricks.coarse = coarse.collect();
    bricks
}

fn lattice() -> Lattice {
    Lattice::new([0.0; 3], 1.0, NODES).unwrap()
}

#[test]
fn a_copied_box_has_the_samples_of_its_nodes() {
    let (lattice, mut seed) = (lattice(), 1);
    let bricks = random_bricks(&lattice, -1.0);
    let sparse = Sparse::new(&lattice, bricks.slices()).unwrap();
    for case in 0..300 {
        // The first boxes are longer than all slots that are held at once.
        let first = NODES.map(|nodes| if case < 5 { 0 } else { random(&mut seed) as u32 % nodes });
        let counts: [u32; 3] = std::array::from_fn(|axis| {
            let most = NODES[axis] - first[axis];
            if case < 5 { most } else { 1 + random(&mut seed) as u32 % most.min(19) }
        });
        let mut samples = vec![f32::NAN; counts.iter().product::<u32>() as usize + 8];
        sparse.copy_box(first, counts, &mut samples);
        let mut copied = samples.into_iter();
        for k in 0..counts[2] {
            for j in 0..counts[1] {
                for i in 0..counts[0] {
                    let node = [first[0] + i, first[1] + j, first[2] + k];
                    let sample = copied.next().unwrap();
                    assert_eq!(
                        sample.to_bits(),
                        sparse.node(node).to_bits(),
                        "box {first:?} {counts:?}, node {node:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_smooth_gradient_of_a_sparse_grid_is_that_of_its_samples_bit_for_bit() {
    let (lattice, mut seed) = (lattice(), 2);
    let bricks = random_bricks(&lattice, -1.0);
    let sparse = Sparse::new(&lattice, bricks.slices()).unwrap();
    let [x, y, z] = NODES;
    let nodes = (0..x * y * z).map(|index| sparse.node([index % x, index / x % y, index / (x * y)]));
    let dense = Dense::new(&lattice, nodes.collect::<Vec<_>>()).unwrap();
    let (sparse, dense) = (Grid::new(lattice, sparse, 9.0).unwrap(), Grid::new(lattice, dense, 9.0).unwrap());
    for _ in 0..2000 {
        let point =
            Vector3::from(NODES.map(|nodes| random(&mut seed) as f64 / f64::from(1_u32 << 31) * f64::from(nodes)));
        let [a, b] = [sparse.evaluate_smooth(point).gradient, dense.evaluate_smooth(point).gradient];
        assert_eq!(a.map(f64::to_bits), b.map(f64::to_bits), "{point:?}: {a:?}, {b:?}");
    }
}

#[test]
fn a_lower_bound_without_slopes_is_not_above_that_of_the_enclosure() {
    let (lattice, mut seed) = (lattice(), 3);
    for lowest in [-1.0, 0.25] {
        let bricks = random_bricks(&lattice, lowest);
        let grid = Grid::new(lattice, Sparse::new(&lattice, bricks.slices()).unwrap(), 9.0).unwrap();
        let mut known = 0;
        for _ in 0..2000 {
            // Inside of the grid, across its border and beyond.
            let share = |seed: &mut u64| random(seed) as f64 / f64::from(1_u32 << 31);
            let min: [f64; 3] = NODES.map(|nodes| (share(&mut seed) * 2.0 - 0.5) * f64::from(nodes));
            let region = Aabb { min, max: min.map(|x| x + 4.0 * share(&mut seed)) };
            let (lowest, enclosed) = (grid.lowest_in_box(&region), grid.enclose_box(&region).range.lower);
            assert!(lowest <= enclosed, "{region:?}: {lowest}, {enclosed}");
            let is_inside = grid.lattice().bounds().encloses(&region);
            assert!(!is_inside || lowest == enclosed, "{region:?}: {lowest}, {enclosed}");
            known += usize::from(lowest > f64::NEG_INFINITY);
        }
        assert!(known > 1500, "{known}");
    }
}
