//! Bounds that a sparse grid states of its bricks and of regions: range, slope and error.

use sdf_bake::sparse::Quantize;
use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES, Sparse, brick_counts};
use sdf_core::grid::{Dense, Grid, Storage, WithBlockBounds, cell_slope};
use sdf_core::{Aabb, EnclosedSdf, Sdf};

use super::{BAND, bake, closed_meshes, nodes_of, open_meshes};
use crate::meshes::Mesh;
use crate::oracle::{self, Baked};
use crate::random::Random;

#[test]
fn the_bounds_of_each_brick_hold_for_its_nodes_and_cells() {
    fn check<C: Quantize>(name: &str, mesh: &Mesh) {
        let lattice = Baked::from_mesh(mesh, None, 27).lattice;
        let grid = bake::<C>(mesh, &lattice);
        let storage = Sparse::new(&lattice, &grid).unwrap();
        assert_eq!(grid.samples.len(), grid.slots.len() * BRICK_SAMPLES);
        let [row, rows, _] = brick_counts(&lattice).map(|n| n as usize);
        let brick_of = |node: [u32; 3]| {
            let [x, y, z] = node.map(|n| (n / BRICK) as usize);
            grid.table[(z * rows + y) * row + x] as usize
        };
        let mut exact: Vec<_> = grid.slots.iter().map(|_| (f32::INFINITY, f32::NEG_INFINITY, 0.0_f32)).collect();
        let [cells_x, cells_y, cells_z] = lattice.cells();
        for index in 0..cells_x * cells_y * cells_z {
            let cell = [index % cells_x, index / cells_x % cells_y, index / cells_x / cells_y];
            let corners = storage.corners(cell);
            for (node, value) in nodes_of(cell).into_iter().zip(corners) {
                let Some((lower, upper, slope)) = exact.get_mut(brick_of(node)) else { continue };
                *lower = lower.min(value);
                *upper = upper.max(value);
                *slope = slope.max(cell_slope(corners, lattice.spacing()) as f32);
            }
        }
        for (bounds, (lower, upper, slope)) in grid.bounds.iter().zip(exact) {
            assert_eq!((bounds.range.lower, bounds.range.upper), (lower, upper), "{name}");
            assert!(
                slope <= bounds.slope_bound && bounds.slope_bound <= slope * (1.0 + 2e-6),
                "{name}: {slope} {}",
                bounds.slope_bound
            );
        }
    }
    let mut random = Random::from_env();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        check::<f32>(name, &mesh);
        check::<u16>(name, &mesh);
        check::<u8>(name, &mesh);
    }
}

/// Small boxes and large, inside the grid, across its faces and outside.
#[test]
fn the_enclosure_of_a_box_holds_at_its_points() {
    fn check<S: Storage>(name: &str, field: &Grid<S>, random: &mut Random) -> usize {
        let (bounds, spacing) = (field.lattice().bounds(), field.lattice().spacing());
        let inflated = bounds.inflate(3.0 * spacing);
        let mut tighter = 0;
        for _ in 0..3000 {
            let middle = random.point_in_box(inflated.min, inflated.max);
            let size = spacing * 10.0_f64.powf(random.between(-2.0, 1.0));
            let half = random.point_in_cube(size).abs();
            let region = Aabb { min: (middle - half).into(), max: (middle + half).into() };
            let local = field.enclose_box(&region);
            tighter += usize::from(local.slope_bound < field.slope_bound());
            let points: Vec<_> = (0..8).map(|_| random.point_in_box(region.min, region.max)).collect();
            let values: Vec<f64> = points.iter().map(|point| field.value(*point)).collect();
            // A sparse grid's bounds are those of the coarse corners, interpolated in f32 by seven interpolations.
            let rounding =
                8.0 * f64::from(f32::EPSILON) * values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
            for value in &values {
                assert!(
                    local.range.lower - rounding <= *value && *value <= local.range.upper + rounding,
                    "{name}: {value} {local:?}"
                );
            }
            for (a, b) in [(0, 1), (2, 3), (4, 5), (6, 7)] {
                let (change, distance) = ((values[a] - values[b]).abs(), (points[a] - points[b]).norm());
                let max_change = local.slope_bound * distance + rounding * (1.0 + distance / spacing);
                assert!(change <= max_change, "{name}: {change} > {max_change} over {distance}: {local:?}");
            }
        }
        tighter
    }
    let mut random = Random::from_env();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        let Baked { lattice, grid: dense } = Baked::from_mesh(&mesh, None, 40);
        let storage =
            WithBlockBounds::new(&lattice, Dense::new(&lattice, &dense.distances).unwrap(), &dense.bounds).unwrap();
        let field = Grid::new(lattice, storage, dense.slope_bound).unwrap();
        assert!(
            check(name, &field, &mut random) > 500,
            "{name}: blocks of a dense grid have no tighter slopes than the whole"
        );
        let (float, words, bytes) =
            (bake::<f32>(&mesh, &lattice), bake::<u16>(&mesh, &lattice), bake::<u8>(&mesh, &lattice));
        let float = Grid::new(lattice, Sparse::new(&lattice, &float).unwrap(), float.slope_bound).unwrap();
        let words = Grid::new(lattice, Sparse::new(&lattice, &words).unwrap(), words.slope_bound).unwrap();
        let bytes = Grid::new(lattice, Sparse::new(&lattice, &bytes).unwrap(), bytes.slope_bound).unwrap();
        check(name, &float, &mut random);
        check(name, &words, &mut random);
        check(name, &bytes, &mut random);
    }
}

#[test]
fn an_open_mesh_is_within_its_bricks_error_bounds() {
    fn check<C: Quantize>(name: &str, mesh: &Mesh, random: &mut Random) {
        let lattice = Baked::from_mesh(mesh, None, 40).lattice;
        let grid = bake::<C>(mesh, &lattice);
        let storage = Sparse::new(&lattice, &grid).unwrap();
        let field = Grid::new(lattice, storage, grid.slope_bound).unwrap();
        let corners = mesh.corners();
        let [row, rows, _] = brick_counts(&lattice).map(|n| n as usize);
        for _ in 0..3000 {
            let point = random.point_in_box(lattice.bounds().min, lattice.bounds().max);
            let cell = oracle::cell_of(&lattice, point);
            let exact = oracle::with_sign_of_cell(oracle::signed_distance(&corners, point), storage.corners(cell));
            if exact.abs() > BAND * lattice.spacing() {
                continue;
            }
            let [x, y, z] = cell.map(|n| (n / BRICK) as usize);
            let bound = grid.errors[grid.table[(z * rows + y) * row + x] as usize];
            let error = (field.value(point) - exact).abs();
            assert!(error <= f64::from(bound), "{name}: {error} > {bound} at {point:?}");
        }
    }
    let mut random = Random::from_env();
    for (name, mesh) in open_meshes(&mut random) {
        check::<f32>(name, &mesh, &mut random);
        check::<u8>(name, &mesh, &mut random);
    }
}
