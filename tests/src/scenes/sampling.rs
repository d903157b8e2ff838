//! Fields sampled on lattices: dense, with block bounds, and in bricks.

use nalgebra::Vector3;
use sdf_bake::SparseGrid;
use sdf_bake::sparse::Quantize;
use sdf_core::grid::sparse::{BRICK, NO_BRICK, Sparse, brick_counts};
use sdf_core::grid::{BlockBounds, Dense, Grid, Lattice, Storage, WithBlockBounds, cell_slope, measure_slope_bound};
use sdf_core::{Interval, Sdf};

use crate::random::Random;

/// A lattice over the cube [−half, half]³.
pub fn cube_lattice(half: f64, cells: u32) -> Lattice {
    Lattice::new([-half; 3], 2.0 * half / f64::from(cells), [cells + 1; 3]).unwrap()
}

/// Every index triple below `counts`, x fastest.
pub fn node_indices([x, y, z]: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    (0..z).flat_map(move |k| (0..y).flat_map(move |j| (0..x).map(move |i| [i, j, k])))
}

/// A sample for every node, uniform in [low, high].
pub fn noise(lattice: &Lattice, [low, high]: [f64; 2], random: &mut Random) -> Vec<f32> {
    (0..lattice.node_count()).map(|_| random.between(low, high) as f32).collect()
}

/// A dense grid with the given slope bound.
pub fn dense_grid(lattice: Lattice, samples: Vec<f32>, slope_bound: f64) -> Grid<Dense<Vec<f32>>> {
    Grid::new(lattice, Dense::new(&lattice, samples).unwrap(), slope_bound).unwrap()
}

/// A dense grid with the slope bound that its samples have.
pub fn measured_grid(lattice: Lattice, samples: Vec<f32>) -> Grid<Dense<Vec<f32>>> {
    with_measured_slope(lattice, Dense::new(&lattice, samples).unwrap())
}

fn with_measured_slope<S: Storage>(lattice: Lattice, storage: S) -> Grid<S> {
    let slope_bound = measure_slope_bound(&lattice, &storage);
    Grid::new(lattice, storage, slope_bound).unwrap()
}

/// The samples of a field on a lattice, multiplied by `steepness`.
pub fn sampled(field: &impl Sdf, lattice: Lattice, steepness: f64) -> Grid<Dense<Vec<f32>>> {
    let value = |node| (field.value(Vector3::from(lattice.node(node))) * steepness) as f32;
    measured_grid(lattice, node_indices(lattice.nodes()).map(value).collect())
}

/// The grid with the range and slope of each block of 8³ nodes beside its samples.
pub fn with_block_bounds(grid: Grid<Dense<Vec<f32>>>) -> Grid<WithBlockBounds<Dense<Vec<f32>>, Vec<BlockBounds>>> {
    let lattice = *grid.lattice();
    let bounds = node_indices(brick_counts(&lattice)).map(|block| block_bounds(&grid, block)).collect();
    let storage = WithBlockBounds::new(&lattice, grid.storage().clone(), bounds).unwrap();
    Grid::new(lattice, storage, grid.slope_bound()).unwrap()
}

/// Bounds over all cells with a corner in the block: their corners include a few nodes of its neighbours.
fn block_bounds(grid: &Grid<Dense<Vec<f32>>>, block: [u32; 3]) -> BlockBounds {
    let lattice = grid.lattice();
    let first = block.map(|n| (n * BRICK).saturating_sub(1));
    let end: [u32; 3] = std::array::from_fn(|axis| ((block[axis] + 1) * BRICK).min(lattice.cells()[axis]));
    let cells = node_indices(std::array::from_fn(|axis| end[axis] - first[axis]));
    let mut bounds = BlockBounds::EMPTY;
    for step in cells {
        let corners = grid.storage().corners(std::array::from_fn(|axis| first[axis] + step[axis]));
        let slope_bound = cell_slope(corners, lattice.spacing()) as f32 * (1.0 + f32::EPSILON);
        let corner_bounds = |sample: f32| BlockBounds { range: Interval { lower: sample, upper: sample }, slope_bound };
        bounds = corners.into_iter().map(corner_bounds).fold(bounds, BlockBounds::union);
    }
    bounds
}

/// A sparse grid: bricks with a node within `band` of the surface, and every eighth node for the rest.
pub fn sampled_in_bricks<C: Quantize>(field: &impl Sdf, lattice: Lattice, band: f64) -> Grid<Sparse<SparseGrid<C>>> {
    let mut grid = SparseGrid::<C> {
        table: vec![],
        slots: vec![],
        scales: vec![],
        samples: vec![],
        coarse: vec![],
        bounds: vec![],
        errors: vec![],
        slope_bound: 0.0,
        error_bound: 0.0,
        inside_reaches_box: false,
        jumps: None,
    };
    let counts = brick_counts(&lattice);
    let value = |node: [u32; 3]| field.value(Vector3::from(lattice.node(node))) as f32;
    for brick in node_indices(counts) {
        let node = |step: [u32; 3]| std::array::from_fn(|axis| brick[axis] * BRICK + step[axis]);
        let values: Vec<f32> = node_indices([BRICK; 3]).map(|step| value(node(step))).collect();
        let is_near = values.iter().any(|value| f64::from(value.abs()) < band);
        grid.table.push(if is_near { grid.slots.len() as u32 } else { NO_BRICK });
        if is_near {
            let lower = values.iter().copied().fold(f32::INFINITY, f32::min);
            let upper = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            let scale = C::scale(lower, upper);
            grid.slots.push(brick);
            grid.scales.push(scale);
            grid.samples.extend(values.iter().map(|value| C::encode(*value, scale)));
        }
    }
    grid.coarse = node_indices(counts.map(|count| count + 1)).map(|node| value(node.map(|n| n * BRICK))).collect();
    assert!(grid.table.contains(&NO_BRICK) && !grid.slots.is_empty(), "the scene has stored and empty bricks");
    grid.bounds = vec![BlockBounds { range: Interval { lower: 0.0, upper: 0.0 }, slope_bound: 0.0 }; grid.slots.len()];
    grid.bounds = grid.slots.iter().map(|brick| brick_bounds(&lattice, &grid, *brick)).collect();
    with_measured_slope(lattice, Sparse::new(&lattice, grid).unwrap())
}

/// Range over the nodes of a brick, and slope over all cells with a corner among them.
fn brick_bounds<C: Quantize>(lattice: &Lattice, grid: &SparseGrid<C>, brick: [u32; 3]) -> BlockBounds {
    let storage = Sparse::new(lattice, grid).unwrap();
    let mut bounds = BlockBounds::EMPTY;
    for step in node_indices([BRICK + 1; 3]) {
        let node: [u32; 3] = std::array::from_fn(|axis| brick[axis] * BRICK + step[axis]);
        if (0..3).all(|axis| node[axis] / BRICK == brick[axis] && node[axis] < lattice.nodes()[axis]) {
            let value = storage.node(node);
            bounds = BlockBounds { range: bounds.range.hull(Interval { lower: value, upper: value }), ..bounds };
        }
        let cell = node.map(|node| node.wrapping_sub(1));
        if (0..3).all(|axis| cell[axis] < lattice.cells()[axis]) {
            let slope = cell_slope(storage.corners(cell), lattice.spacing()) as f32;
            bounds.slope_bound = bounds.slope_bound.max(slope.next_up());
        }
    }
    bounds
}
