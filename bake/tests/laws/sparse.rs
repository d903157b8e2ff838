//! A sparse grid against the dense one of the same lattice, and against the mesh.

mod bounds;
mod deep;
mod jumps;
mod splat;

use sdf_bake::sparse::{self, Certify, Quantize, SparseGrid};
use sdf_core::Sdf;
use sdf_core::grid::sparse::{BRICK, NO_BRICK, Sparse, brick_counts};
use sdf_core::grid::{Dense, Grid, Lattice, Storage, measure_slope_bound};
use sdf_core::nalgebra::Vector3;

use crate::meshes::{self, Mesh};
use crate::oracle::{self, Baked};
use crate::random::Random;

/// Band in voxels.
const BAND: f64 = 3.0;

pub fn closed_meshes(random: &mut Random) -> Vec<(&'static str, Mesh)> {
    let turn = random.rotation();
    vec![
        ("sphere", meshes::icosphere(2)),
        ("turned cube", meshes::cube().turned(&turn)),
        ("star", meshes::star(1, 3, 1.5)),
        ("thin plate", meshes::block([1.0, 0.7, 0.01]).turned(&turn)),
        ("cavity", meshes::icosphere(1).and(meshes::icosphere(1).flipped().scaled(0.6))),
        ("two far apart", meshes::icosphere(1).scaled(0.2).and(meshes::icosphere(1).scaled(0.1).moved(3.0, 1.0, 0.5))),
        ("tiny torus", meshes::torus(1.0, 0.3, 16, 8).scaled(1e-12)),
        ("turned hull of voxels", meshes::with_edges_of_four_faces().remove(0).1.turned(&turn)),
    ]
}

pub fn open_meshes(random: &mut Random) -> Vec<(&'static str, Mesh)> {
    let sphere = meshes::icosphere(2);
    let bowl: Vec<usize> = (0..sphere.triangles.len()).filter(|t| sphere.corners()[*t][0].z > 0.1).collect();
    vec![
        ("bowl", sphere.without(&bowl)),
        ("one-sided sheet", meshes::sheet(3)),
        ("soup", meshes::soup(60, 0.7, random)),
    ]
}

fn bake<C: Quantize>(mesh: &Mesh, lattice: &Lattice) -> SparseGrid<C> {
    let mesh = mesh.baked();
    let distance = sdf_bake::MeshDistance::new(&mesh, None);
    sparse::bake(&distance, lattice, BAND * lattice.spacing(), &|_| ()).unwrap()
}

fn table<C>(lattice: &Lattice, grid: &SparseGrid<C>) -> Vec<u32> {
    let [row, rows, layers] = brick_counts(lattice).map(|n| n as usize);
    let mut table = vec![NO_BRICK; row * rows * layers];
    for (number, [x, y, z]) in (0..).zip(&grid.slots) {
        let entry = &mut table[(*z as usize * rows + *y as usize) * row + *x as usize];
        assert_eq!(*entry, NO_BRICK, "two bricks at one slot");
        *entry = number;
    }
    table
}

/// Nodes of a cell, x fastest.
fn nodes_of(cell: [u32; 3]) -> [[u32; 3]; 8] {
    std::array::from_fn(|corner| std::array::from_fn(|axis| cell[axis] + (corner as u32 >> axis & 1)))
}

/// The baker's promise of exactness: bricks are measured in f32 around their middles.
fn rounding(lattice: &Lattice) -> f32 {
    (1e-6 * lattice.bounds().diagonal()) as f32
}

#[test]
fn within_the_band_it_has_the_dense_grids_samples_and_signs() {
    let mut random = Random::from_env();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        let dense = Baked::from_mesh(&mesh, None, 40);
        let grid = bake::<f32>(&mesh, &dense.lattice);
        assert_eq!(grid.table, table(&dense.lattice, &grid), "{name}");
        let storage = Sparse::new(&dense.lattice, &grid).unwrap();
        let dense_storage = Dense::new(&dense.lattice, &dense.grid.distances).unwrap();
        let corners = mesh.corners();
        let bounds = dense.lattice.bounds();
        let mut count = 0;
        for round in 0..4000 {
            // Half of the points are near the surface, in the band.
            let point = match round % 2 {
                0 => random.point_in_box(bounds.min, bounds.max),
                _ => {
                    let [a, b, c] = corners[random.below(corners.len())];
                    let (u, v) = (random.unit(), random.unit());
                    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                    a + (b - a) * u + (c - a) * v + random.point_in_cube(BAND * dense.lattice.spacing())
                }
            };
            if oracle::distance(&corners, point) > BAND * dense.lattice.spacing() {
                continue;
            }
            let inside = (0..3).all(|axis| bounds.min[axis] <= point[axis] && point[axis] <= bounds.max[axis]);
            if !inside {
                continue;
            }
            count += 1;
            let cell = oracle::cell_of(&dense.lattice, point);
            for node in nodes_of(cell) {
                let [row, rows, _] = brick_counts(&dense.lattice).map(|n| n as usize);
                let [x, y, z] = node.map(|n| (n / BRICK) as usize);
                assert_ne!(
                    grid.table[(z * rows + y) * row + x],
                    NO_BRICK,
                    "{name}: node {node:?} of the band has no brick"
                );
            }
            for (found, wanted) in std::iter::zip(storage.corners(cell), dense_storage.corners(cell)) {
                assert!((found - wanted).abs() <= rounding(&dense.lattice), "{name}: cell {cell:?}: {found}, {wanted}");
                assert_eq!(found.is_sign_negative(), wanted.is_sign_negative(), "{name}: cell {cell:?}");
            }
        }
        assert!(count > 500, "{name}: {count} points in the band");
    }
}

#[test]
fn it_is_continuous_and_no_steeper_than_its_slope_bound_everywhere() {
    fn check<C: Quantize>(name: &str, mesh: &Mesh, random: &mut Random) {
        let lattice = Baked::from_mesh(mesh, None, 40).lattice;
        let grid = bake::<C>(mesh, &lattice);
        let storage = Sparse::new(&lattice, &grid).unwrap();
        let steepest = measure_slope_bound(&lattice, &storage);
        assert!(steepest <= grid.slope_bound * (1.0 + 1e-6), "{name}: {steepest} > {}", grid.slope_bound);
        let field = Grid::new(lattice, storage, grid.slope_bound).unwrap();
        let bounds = lattice.bounds().inflate(lattice.spacing());
        // The coarse grid is interpolated in f32, and its values are at most the box's diagonal.
        let rounding = 4.0 * f64::from(f32::EPSILON) * bounds.diagonal();
        for _ in 0..20_000 {
            let from = random.point_in_box(bounds.min, bounds.max);
            let size = lattice.spacing() * 10.0_f64.powf(random.between(-4.0, 1.2));
            let to = from + random.point_in_cube(size);
            let change = (field.value(to) - field.value(from)).abs();
            let max_change = grid.slope_bound * (to - from).norm() + rounding * grid.slope_bound;
            assert!(change <= max_change, "{name}: {change} > {max_change} from {from:?} to {to:?}");
        }
    }
    let mut random = Random::from_env();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        check::<f32>(name, &mesh, &mut random);
        check::<u16>(name, &mesh, &mut random);
        check::<u8>(name, &mesh, &mut random);
    }
}

/// Beyond its box a grid goes on as a distance outside, so it is steep there where it is cut off inside of the solid.
#[test]
fn a_box_that_cuts_the_solid_counts_where_no_brick_is() {
    let mesh = meshes::icosphere(3);
    for (origin, with_bricks) in [([-0.3; 3], false), ([-0.2, -0.3, 0.3], true)] {
        let lattice = Lattice::new(origin, 0.02, [40; 3]).unwrap();
        let grid = bake::<u16>(&mesh, &lattice);
        assert_eq!(!grid.slots.is_empty(), with_bricks);
        let steepest = measure_slope_bound(&lattice, &Sparse::new(&lattice, &grid).unwrap());
        assert!(steepest <= grid.slope_bound * (1.0 + 1e-6), "{steepest} > {}", grid.slope_bound);
    }
}

#[test]
fn it_is_within_its_error_bound_in_the_band_and_at_most_the_distance_beyond() {
    fn check<C: Quantize>(name: &str, mesh: &Mesh, random: &mut Random) -> f64 {
        let lattice = Baked::from_mesh(mesh, None, 40).lattice;
        let grid = bake::<C>(mesh, &lattice);
        let storage = Sparse::new(&lattice, &grid).unwrap();
        let field = Grid::new(lattice, storage, grid.slope_bound).unwrap();
        let corners = mesh.corners();
        let bounds = lattice.bounds();
        for _ in 0..2000 {
            let point = random.point_in_box(bounds.min, bounds.max);
            let exact = oracle::signed_distance(&corners, point);
            let value = field.value(point);
            if exact.abs() <= BAND * lattice.spacing() {
                let error = (value - exact).abs();
                assert!(error <= grid.error_bound, "{name}: {error} > {} at {point:?}", grid.error_bound);
            } else {
                assert_eq!(value.signum(), exact.signum(), "{name}: {value} at {point:?} where {exact} is true");
                // Beyond the band the excess is at most 3h²/(8B) (docs/error-bounds.md, "Beyond the band").
                let max_excess = grid.error_bound + 0.375 * lattice.spacing() / BAND;
                assert!(
                    value - exact <= max_excess || exact < 0.0,
                    "{name}: {value} at {point:?} where {exact} is true"
                );
            }
        }
        grid.error_bound / lattice.spacing()
    }
    let mut random = Random::from_env();
    for (name, mesh) in closed_meshes(&mut random) {
        let bounds = [
            check::<f32>(name, &mesh, &mut random),
            check::<u16>(name, &mesh, &mut random),
            check::<u8>(name, &mesh, &mut random),
        ];
        // √3/2 voxels for any distance, the rounding of distances, and rounding to codes: at most half a step of a range of
        // 14 voxels.
        assert!(bounds[0] < 0.867 && bounds[1] < 0.867 && bounds[2] < 0.867 + 0.031, "{name}: {bounds:?}");
    }
}

/// A distance has slope one along each axis, so an interpolant of slope at most √3.
#[test]
fn it_is_no_steeper_than_an_interpolated_distance() {
    fn steepest<C: Quantize>(mesh: &Mesh, cells: u32) -> f64 {
        let lattice = Baked::from_mesh(mesh, None, cells).lattice;
        bake::<C>(mesh, &lattice).slope_bound
    }
    let mut random = Random::from_env();
    // Codes divide the range of a brick's samples, at most its diagonal of 7√3 voxels; each of two samples is off by
    // half a step.
    let rounded = |codes: f64| 3.0_f64.sqrt() * (1.0 + 7.0 * 3.0_f64.sqrt() / codes) * 1.000_1;
    for (name, mesh) in closed_meshes(&mut random) {
        for cells in [24, 100] {
            let slopes = [steepest::<f32>(&mesh, cells), steepest::<u16>(&mesh, cells), steepest::<u8>(&mesh, cells)];
            let limits = [3.0_f64.sqrt() * 1.000_1, rounded(65535.0), rounded(255.0)];
            assert!((0..3).all(|precision| slopes[precision] <= limits[precision]), "{name}: {slopes:?} > {limits:?}");
        }
    }
}

#[test]
fn no_sample_outside_is_more_than_the_distance() {
    let mut random = Random::from_env();
    // The distance to a speck is a cone: between the nodes of the coarse grid it is far less than at them.
    let mut specks = || {
        let speck = meshes::tetrahedron().scaled(0.01);
        let [x, y, z] = random.point_in_cube(0.4).into();
        (
            "specks",
            speck.clone().moved(-0.5, -0.5, -0.5).and(speck.clone().moved(0.5, 0.5, 0.5)).and(speck.moved(x, y, z)),
        )
    };
    let specks: Vec<_> = (0..6).map(|_| specks()).collect();
    let meshes = closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)).chain(specks);
    for (name, mesh) in meshes {
        let dense = Baked::from_mesh(&mesh, None, 64);
        let grid = bake::<f32>(&mesh, &dense.lattice);
        let storage = Sparse::new(&dense.lattice, &grid).unwrap();
        let [row, rows, _] = dense.lattice.nodes();
        for (index, exact) in (0_u32..).zip(&dense.grid.distances) {
            let value = storage.node([index % row, index / row % rows, index / (row * rows)]);
            // The coarse grid is interpolated in f32. Inside it holds distances, and is off by as much as they bend.
            let exact =
                if *exact < 0.0 { exact - 4.5 * 3.0_f32.sqrt() * dense.lattice.spacing() as f32 } else { *exact };
            let most = exact.abs() * (1.0 + 8.0 * f32::EPSILON) + rounding(&dense.lattice);
            assert!(value.abs() <= most, "{name}: {value} where {exact} is true");
        }
    }
}

#[test]
fn a_plan_predicts_the_grid() {
    let mut random = Random::from_env();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        let lattice = Baked::from_mesh(&mesh, None, 50).lattice;
        let mesh = mesh.baked();
        let distance = sdf_bake::MeshDistance::new(&mesh, None);
        let baker =
            sparse::SparseBaker::new(&distance, &lattice, BAND * lattice.spacing()).unwrap().certified(Certify::Tight);
        let done = std::sync::atomic::AtomicUsize::new(0);
        let count = |places| {
            done.fetch_add(places, std::sync::atomic::Ordering::Relaxed);
        };
        let grid = baker.bake::<f32>(&count);
        assert_eq!((baker.slot_count(), done.into_inner()), (grid.table.len(), grid.table.len()), "{name}");
        let bricks = grid.slots.len();
        assert!(bricks <= baker.max_bricks(), "{name}: {bricks} bricks, at most {}", baker.max_bricks());
        assert!(baker.max_bricks() <= 2 * bricks + 30, "{name}: {bricks} bricks, at most {}", baker.max_bricks());
        let Some(interpolation) = baker.interpolation_error(0.0, f64::INFINITY, &|_| ()) else {
            assert!(!distance.is_continuous(), "{name}");
            continue;
        };
        // Samples in f32 have little rounding beside that of distances, 2e-6 of the triangles' coordinates.
        let rounding = grid.error_bound - interpolation;
        assert!(0.0 <= rounding && rounding <= 1e-3 * lattice.spacing(), "{name}: {rounding} is not all rounding");
        assert_eq!(baker.interpolation_error(0.0, 0.5 * interpolation, &|_| ()), None, "{name}");
        // A bound that suffices is not tightened, and one that does not is.
        for factor in [1.0, 1.2, 3.0] {
            let sufficient = factor * interpolation;
            let bound = baker.interpolation_error(sufficient, f64::INFINITY, &|_| ()).unwrap();
            assert!(interpolation <= bound && bound <= sufficient, "{name}: {bound} in place of {interpolation}");
        }
        assert_eq!(
            baker.interpolation_error(0.7 * interpolation, f64::INFINITY, &|_| ()),
            Some(interpolation),
            "{name}"
        );
    }
}

#[test]
fn any_number_of_threads_bakes_the_same_grid() {
    let mut random = Random::from_env();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        let lattice = Baked::from_mesh(&mesh, None, 24).lattice;
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| bake::<u16>(&mesh, &lattice))
        };
        let one = on(1);
        assert!([2, 3, 7].into_iter().all(|threads| on(threads) == one), "{name}");
    }
}

#[test]
fn a_slot_without_a_brick_has_one_sign() {
    let mut random = Random::from_env();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        let lattice = Baked::from_mesh(&mesh, None, 64).lattice;
        let grid = bake::<f32>(&mesh, &lattice);
        let storage = Sparse::new(&lattice, &grid).unwrap();
        let corners = mesh.corners();
        let [row, rows, _] = brick_counts(&lattice).map(|n| n as usize);
        for (index, _) in grid.table.iter().enumerate().filter(|(_, brick)| **brick == NO_BRICK) {
            let slot = [index % row, index / row % rows, index / row / rows].map(|n| n as u32);
            let values = storage.coarse_corners(slot);
            let middle = Vector3::from(lattice.node(slot.map(|n| n * BRICK + BRICK / 2)));
            let side = oracle::signed_distance(&corners, middle).signum();
            // Near the surface that closes the holes, the baker's sums may be on the other side.
            if (oracle::winding_number(&corners, middle).abs() - 0.5).abs() < 1e-2 {
                continue;
            }
            assert!(values.iter().all(|value| f64::from(value.signum()) == side), "{name}: {slot:?} {side} {values:?}");
        }
    }
}

/// Promise 8: nothing depends on the unit of length. Scaling by a power of two is exact, and changes no code.
#[test]
fn a_mesh_scaled_by_a_power_of_two_bakes_to_the_same_bricks_scaled() {
    let mut random = Random::from_env();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        // Smaller exponents would make distances of the tiny torus subnormal in f32.
        for exponent in [-10, 7] {
            let scale = 2.0_f64.powi(exponent);
            let wanted = bake::<u16>(&mesh, &Baked::from_mesh(&mesh, None, 24).lattice);
            let scaled = mesh.clone().scaled(scale);
            let found = bake::<u16>(&scaled, &Baked::from_mesh(&scaled, None, 24).lattice);
            assert_eq!((&found.table, &found.samples), (&wanted.table, &wanted.samples), "{name} by 2^{exponent}");
            for (found, wanted) in std::iter::zip(&found.scales, &wanted.scales) {
                let by = scale as f32;
                assert_eq!((found.base, found.step), (wanted.base * by, wanted.step * by), "{name} by 2^{exponent}");
            }
            assert!(std::iter::zip(&found.coarse, &wanted.coarse).all(|(a, b)| *a == b * scale as f32), "{name}");
            assert_eq!(found.error_bound, wanted.error_bound * scale, "{name}");
        }
    }
}

/// Without distances it must still lead a search to the surface: one that starts on a plateau stays there.
#[test]
fn beyond_the_band_it_rises_away_from_the_surface() {
    let mut random = Random::from_env();
    for (name, mesh) in [("sphere", meshes::icosphere(3)), ("torus", meshes::torus(1.0, 0.4, 48, 24))] {
        let lattice = Baked::from_mesh(&mesh, None, 96).lattice;
        let grid = bake::<u16>(&mesh, &lattice);
        let field = Grid::new(lattice, Sparse::new(&lattice, &grid).unwrap(), grid.slope_bound).unwrap();
        let (corners, bounds, h) = (mesh.corners(), lattice.bounds(), lattice.spacing());
        let (mut count, mut wrong) = (0, 0);
        while count < 400 {
            let point = random.point_in_box(bounds.min, bounds.max);
            let exact = oracle::signed_distance(&corners, point);
            if exact < 8.0 * h {
                continue;
            }
            let sample = field.sample(point);
            let step = sample.gradient * (0.5 * h / sample.gradient.norm().max(1e-9));
            count += 1;
            wrong += usize::from(oracle::signed_distance(&corners, point - step) >= exact);
        }
        // A few points may be on the medial surface, where the gradient has no one direction.
        assert!(wrong * 50 < count, "{name}: from {wrong} of {count} points the gradient does not lead to the surface");
    }
}
