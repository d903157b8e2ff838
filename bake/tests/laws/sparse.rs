//! A sparse grid against the dense one of the same lattice, and against the mesh.

use sdf_bake::sparse::{self, Quantize, SparseGrid};
use sdf_core::Sdf;
use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES, NO_BRICK, Sparse, brick_counts};
use sdf_core::grid::{Dense, Grid, Lattice, Storage, slope_bound};
use sdf_core::nalgebra::Vector3;

use crate::meshes::{self, Mesh};
use crate::oracle::{self, Baked};
use crate::random::Random;

/// In voxels.
const BAND: f64 = 3.0;

fn closed_meshes(random: &mut Random) -> Vec<(&'static str, Mesh)> {
    let turn = random.rotation();
    vec![
        ("sphere", meshes::icosphere(2)),
        ("turned cube", meshes::cube().turned(&turn)),
        ("star", meshes::star(1, 3, 1.5)),
        ("thin plate", meshes::block([1.0, 0.7, 0.01]).turned(&turn)),
        ("cavity", meshes::icosphere(1).and(meshes::icosphere(1).flipped().scaled(0.6))),
        ("two far apart", meshes::icosphere(1).scaled(0.2).and(meshes::icosphere(1).scaled(0.1).moved(3.0, 1.0, 0.5))),
        ("tiny torus", meshes::torus(1.0, 0.3, 16, 8).scaled(1e-12)),
    ]
}

fn open_meshes(random: &mut Random) -> Vec<(&'static str, Mesh)> {
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
    sparse::bake(&distance, lattice, BAND * lattice.spacing(), &|_| ())
}

fn table<C>(lattice: &Lattice, grid: &SparseGrid<C>) -> Vec<u32> {
    let [row, rows, layers] = brick_counts(lattice).map(|n| n as usize);
    let mut table = vec![NO_BRICK; row * rows * layers];
    for (number, [x, y, z]) in (0..).zip(&grid.places) {
        let place = &mut table[(*z as usize * rows + *y as usize) * row + *x as usize];
        assert_eq!(*place, NO_BRICK, "a place has two bricks");
        *place = number;
    }
    table
}

/// The nodes of a cell, by their corners.
fn nodes_of(cell: [u32; 3]) -> [[u32; 3]; 8] {
    std::array::from_fn(|corner| std::array::from_fn(|axis| cell[axis] + (corner as u32 >> axis & 1)))
}

fn cell_at(lattice: &Lattice, point: Vector3<f64>) -> [u32; 3] {
    let steps = (point - Vector3::from(lattice.origin())) / lattice.spacing();
    std::array::from_fn(|axis| (steps[axis] as u32).min(lattice.cells()[axis] - 1))
}

#[test]
fn within_the_band_it_has_the_dense_grids_samples_bit_for_bit() {
    let mut random = Random::of_test();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        let dense = Baked::of(&mesh, None, 40);
        let grid = bake::<f32>(&mesh, &dense.lattice);
        assert_eq!(grid.table, table(&dense.lattice, &grid), "{name}");
        let storage = Sparse::new(&dense.lattice, &grid).unwrap();
        let dense_storage = Dense::new(&dense.lattice, &dense.grid.distances).unwrap();
        let corners = mesh.corners();
        let bounds = dense.lattice.bounds();
        let mut seen = 0;
        for round in 0..4000 {
            // Half near the surface, so that the band is met.
            let point = match round % 2 {
                0 => random.in_box(bounds.min, bounds.max),
                _ => {
                    let [a, b, c] = corners[random.below(corners.len())];
                    let (u, v) = (random.unit(), random.unit());
                    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                    a + (b - a) * u + (c - a) * v + random.in_cube(BAND * dense.lattice.spacing())
                }
            };
            if oracle::distance(&corners, point) > BAND * dense.lattice.spacing() {
                continue;
            }
            let inside = (0..3).all(|axis| bounds.min[axis] <= point[axis] && point[axis] <= bounds.max[axis]);
            if !inside {
                continue;
            }
            seen += 1;
            let cell = cell_at(&dense.lattice, point);
            for node in nodes_of(cell) {
                let [row, rows, _] = brick_counts(&dense.lattice).map(|n| n as usize);
                let [x, y, z] = node.map(|n| (n / BRICK) as usize);
                assert_ne!(
                    grid.table[(z * rows + y) * row + x],
                    NO_BRICK,
                    "{name}: node {node:?} of the band is not there"
                );
            }
            assert_eq!(storage.corners(cell), dense_storage.corners(cell), "{name}: cell {cell:?}");
        }
        assert!(seen > 500, "{name}: {seen} points in the band");
    }
}

#[test]
fn it_is_continuous_and_no_steeper_than_its_slope_bound_everywhere() {
    fn check<C: Quantize>(name: &str, mesh: &Mesh, random: &mut Random) {
        let lattice = Baked::of(mesh, None, 40).lattice;
        let grid = bake::<C>(mesh, &lattice);
        let storage = Sparse::new(&lattice, &grid).unwrap();
        // Asked of every cell, as of a dense grid.
        let of_all_cells = slope_bound(&lattice, &storage);
        assert!(of_all_cells <= grid.slope_bound * (1.0 + 1e-6), "{name}: {of_all_cells} > {}", grid.slope_bound);
        let field = Grid::new(lattice, storage, grid.slope_bound).unwrap();
        let bounds = lattice.bounds().inflate(lattice.spacing());
        // The coarse grid is interpolated in f32, and the largest value is the box's size.
        let rounding = 4.0 * f64::from(f32::EPSILON) * bounds.diagonal();
        for _ in 0..20_000 {
            let from = random.in_box(bounds.min, bounds.max);
            let reach = lattice.spacing() * 10.0_f64.powf(random.between(-4.0, 1.2));
            let to = from + random.in_cube(reach);
            let change = (field.value(to) - field.value(from)).abs();
            let most = grid.slope_bound * (to - from).norm() + rounding * grid.slope_bound;
            assert!(change <= most, "{name}: {change} from {from:?} to {to:?}, at most {most}");
        }
    }
    let mut random = Random::of_test();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        check::<f32>(name, &mesh, &mut random);
        check::<u16>(name, &mesh, &mut random);
        check::<u8>(name, &mesh, &mut random);
    }
}

#[test]
fn in_the_band_it_is_within_its_error_bound_and_beyond_it_claims_no_more_than_the_distance() {
    fn check<C: Quantize>(name: &str, mesh: &Mesh, random: &mut Random) -> f64 {
        let lattice = Baked::of(mesh, None, 40).lattice;
        let grid = bake::<C>(mesh, &lattice);
        let storage = Sparse::new(&lattice, &grid).unwrap();
        let field = Grid::new(lattice, storage, grid.slope_bound).unwrap();
        let corners = mesh.corners();
        let bounds = lattice.bounds();
        for _ in 0..2000 {
            let point = random.in_box(bounds.min, bounds.max);
            let exact = oracle::signed_distance(&corners, point);
            let value = field.value(point);
            if exact.abs() <= BAND * lattice.spacing() {
                let error = (value - exact).abs();
                assert!(error <= grid.error_bound, "{name}: {error} at {point:?}, at most {}", grid.error_bound);
            } else {
                assert_eq!(value.signum(), exact.signum(), "{name}: {value} at {point:?} where {exact} is true");
                let claim = value.abs() - exact.abs();
                assert!(claim <= grid.error_bound, "{name}: {value} at {point:?} where {exact} is true");
            }
        }
        grid.error_bound / lattice.spacing()
    }
    let mut random = Random::of_test();
    for (name, mesh) in closed_meshes(&mut random) {
        let bounds = [
            check::<f32>(name, &mesh, &mut random),
            check::<u16>(name, &mesh, &mut random),
            check::<u8>(name, &mesh, &mut random),
        ];
        // Half a cell's diagonal, and half a step of 14 voxels' range at most for u8.
        assert!(bounds[0] < 0.8661 && bounds[1] < 0.8664 && bounds[2] < 0.8661 + 0.031, "{name}: {bounds:?}");
    }
}

#[test]
fn its_error_bound_holds_what_rounding_to_codes_adds() {
    fn check<C: Quantize>(name: &str, mesh: &Mesh) {
        let dense = Baked::of(mesh, None, 40);
        let grid = bake::<C>(mesh, &dense.lattice);
        let added = grid.error_bound - 0.75_f64.sqrt() * dense.lattice.spacing();
        let mut largest = 0.0_f64;
        for (number, place) in grid.places.iter().enumerate() {
            for index in 0..BRICK_SAMPLES as u32 {
                let step = [index % BRICK, index / BRICK % BRICK, index / BRICK / BRICK];
                let node: [u32; 3] = std::array::from_fn(|axis| place[axis] * BRICK + step[axis]);
                if (0..3).all(|axis| node[axis] < dense.lattice.nodes()[axis]) {
                    let exact = dense.grid.distances[dense.lattice.index(node)];
                    let kept = grid.samples[number * BRICK_SAMPLES + index as usize].decode(grid.scales[number]);
                    largest = largest.max((f64::from(kept) - f64::from(exact)).abs());
                }
            }
        }
        // The dense grid's own rounding to f32 is in neither.
        let rounding = f64::from(f32::EPSILON) * dense.lattice.bounds().diagonal();
        assert!(largest <= added + rounding, "{name}: a sample is off by {largest}, more than {added}");
    }
    let mut random = Random::of_test();
    for (name, mesh) in closed_meshes(&mut random) {
        check::<u16>(name, &mesh);
        check::<u8>(name, &mesh);
    }
}

#[test]
fn what_it_says_of_each_brick_holds_in_the_bricks_cells() {
    let mut random = Random::of_test();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        let lattice = Baked::of(&mesh, None, 24).lattice;
        let grid = bake::<u16>(&mesh, &lattice);
        let storage = Sparse::new(&lattice, &grid).unwrap();
        let field = Grid::new(lattice, storage, grid.slope_bound).unwrap();
        assert_eq!(grid.samples.len(), grid.places.len() * BRICK_SAMPLES);
        for (place, cells) in grid.places.iter().zip(&grid.cells) {
            let first = lattice.node(place.map(|n| n * BRICK));
            for _ in 0..8 {
                let side = f64::from(BRICK) * lattice.spacing();
                let point = random.in_box(first, first.map(|x| x + side));
                let sample = field.sample(point);
                if sample.status.outside_grid {
                    continue;
                }
                // Interpolation in f64 of f32 samples rounds by less than f32 does.
                let rounding = f64::from(f32::EPSILON) * sample.value.abs();
                assert!(f64::from(cells.least) - rounding <= sample.value, "{name}");
                assert!(sample.value <= f64::from(cells.greatest) + rounding, "{name}");
                let slope = f64::from(cells.slope) * (1.0 + 1e-6);
                assert!(sample.gradient.norm() <= slope, "{name}: {} > {slope}", sample.gradient.norm());
            }
        }
    }
}

#[test]
fn threads_change_nothing() {
    let mut random = Random::of_test();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        let lattice = Baked::of(&mesh, None, 24).lattice;
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| bake::<u16>(&mesh, &lattice))
        };
        let one = on(1);
        assert!([2, 3, 7].into_iter().all(|threads| on(threads) == one), "{name}");
    }
}

#[test]
fn a_place_without_a_brick_is_on_one_side_as_a_whole() {
    let mut random = Random::of_test();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        let lattice = Baked::of(&mesh, None, 64).lattice;
        let grid = bake::<f32>(&mesh, &lattice);
        let storage = Sparse::new(&lattice, &grid).unwrap();
        let corners = mesh.corners();
        let [row, rows, _] = brick_counts(&lattice).map(|n| n as usize);
        for (index, _) in grid.table.iter().enumerate().filter(|(_, brick)| **brick == NO_BRICK) {
            let place = [index % row, index / row % rows, index / row / rows].map(|n| n as u32);
            let values = storage.coarse_corners(place);
            let middle = Vector3::from(lattice.node(place.map(|n| n * BRICK + BRICK / 2)));
            let side = oracle::signed_distance(&corners, middle).signum();
            // So near the surface that closes the holes, the baker's sums may see the other side.
            if (oracle::winding_number(&corners, middle).abs() - 0.5).abs() < 1e-2 {
                continue;
            }
            assert!(
                values.iter().all(|value| f64::from(value.signum()) == side),
                "{name}: {place:?} {side} {values:?}"
            );
        }
    }
}
