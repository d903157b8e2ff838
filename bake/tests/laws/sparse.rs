//! A sparse grid against the dense one of the same lattice, and against the mesh.

use sdf_bake::sparse::{self, Quantize, SparseGrid};
use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES, NO_BRICK, Sparse, brick_counts};
use sdf_core::grid::{Dense, Grid, Lattice, Storage, WithBlockBounds, cell_slope, slope_bound};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, EnclosedSdf, Sdf};

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
                // Of a point of the surface at this distance, nodes are no farther than half a cell's spread allows.
                let claim = value.abs() - exact.abs();
                let most = grid.error_bound + 0.375 * lattice.spacing() / BAND;
                assert!(claim <= most, "{name}: {value} at {point:?} where {exact} is true");
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

/// Beyond the band the samples stay below the distance, and no two neighbours differ by more than their way.
#[test]
fn it_is_no_steeper_than_a_distance() {
    fn steepest<C: Quantize>(mesh: &Mesh, cells: u32) -> f64 {
        let lattice = Baked::of(mesh, None, cells).lattice;
        bake::<C>(mesh, &lattice).slope_bound
    }
    let mut random = Random::of_test();
    // The step of a code over a brick whose samples reach over a diagonal of 7 voxels, half of it to each side.
    let rounded = |codes: f64| 3.0_f64.sqrt() * (1.0 + 7.0 * 3.0_f64.sqrt() / codes) * 1.000_01;
    for (name, mesh) in closed_meshes(&mut random) {
        for cells in [24, 100] {
            let slopes = [steepest::<f32>(&mesh, cells), steepest::<u16>(&mesh, cells), steepest::<u8>(&mesh, cells)];
            let most = [3.0_f64.sqrt() * 1.000_01, rounded(65535.0), rounded(255.0)];
            assert!((0..3).all(|precision| slopes[precision] <= most[precision]), "{name}: {slopes:?} > {most:?}");
        }
    }
}

#[test]
fn no_sample_is_more_than_the_distance() {
    let mut random = Random::of_test();
    // Around a speck the distance is a cone, and between the nodes of the coarse grid far less than at them.
    let mut specks = || {
        let speck = meshes::tetrahedron().scaled(0.01);
        let [x, y, z] = random.in_cube(0.4).into();
        (
            "specks",
            speck.clone().moved(-0.5, -0.5, -0.5).and(speck.clone().moved(0.5, 0.5, 0.5)).and(speck.moved(x, y, z)),
        )
    };
    let specks: Vec<_> = (0..6).map(|_| specks()).collect();
    let meshes = closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)).chain(specks);
    for (name, mesh) in meshes {
        let dense = Baked::of(&mesh, None, 64);
        let grid = bake::<f32>(&mesh, &dense.lattice);
        let storage = Sparse::new(&dense.lattice, &grid).unwrap();
        let [row, rows, _] = dense.lattice.nodes();
        for (index, exact) in (0_u32..).zip(&dense.grid.distances) {
            let value = storage.node([index % row, index / row % rows, index / (row * rows)]);
            // The coarse grid is interpolated in f32.
            assert!(value.abs() <= exact.abs() * (1.0 + 8.0 * f32::EPSILON), "{name}: {value} where {exact} is true");
        }
    }
}

#[test]
fn what_it_says_of_each_brick_holds_of_the_bricks_nodes_and_cells() {
    fn check<C: Quantize>(name: &str, mesh: &Mesh) {
        let lattice = Baked::of(mesh, None, 27).lattice;
        let grid = bake::<C>(mesh, &lattice);
        let storage = Sparse::new(&lattice, &grid).unwrap();
        assert_eq!(grid.samples.len(), grid.places.len() * BRICK_SAMPLES);
        let [row, rows, _] = brick_counts(&lattice).map(|n| n as usize);
        let brick_of = |node: [u32; 3]| {
            let [x, y, z] = node.map(|n| (n / BRICK) as usize);
            grid.table[(z * rows + y) * row + x] as usize
        };
        let mut seen: Vec<_> = grid.places.iter().map(|_| (f32::INFINITY, f32::NEG_INFINITY, 0.0_f32)).collect();
        let [cells_x, cells_y, cells_z] = lattice.cells();
        for index in 0..cells_x * cells_y * cells_z {
            let cell = [index % cells_x, index / cells_x % cells_y, index / cells_x / cells_y];
            let corners = storage.corners(cell);
            for (node, value) in nodes_of(cell).into_iter().zip(corners) {
                let Some(seen) = seen.get_mut(brick_of(node)) else { continue };
                seen.0 = seen.0.min(value);
                seen.1 = seen.1.max(value);
                seen.2 = seen.2.max(cell_slope(corners, lattice.spacing()) as f32);
            }
        }
        for (bounds, (least, greatest, slope)) in grid.bounds.iter().zip(seen) {
            assert_eq!((bounds.range.lower, bounds.range.upper), (least, greatest), "{name}");
            assert!(
                slope <= bounds.slope_bound && bounds.slope_bound <= slope.next_up(),
                "{name}: {slope} {}",
                bounds.slope_bound
            );
        }
    }
    let mut random = Random::of_test();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        check::<f32>(name, &mesh);
        check::<u16>(name, &mesh);
        check::<u8>(name, &mesh);
    }
}

/// Of small boxes and large, inside the grid, across its faces and outside.
#[test]
fn what_a_grid_says_of_a_region_holds_there() {
    fn check<S: Storage>(name: &str, field: &Grid<S>, random: &mut Random) -> usize {
        let (bounds, spacing) = (field.lattice().bounds(), field.lattice().spacing());
        let around = bounds.inflate(3.0 * spacing);
        let mut said = 0;
        for _ in 0..3000 {
            let middle = random.in_box(around.min, around.max);
            let size = spacing * 10.0_f64.powf(random.between(-2.0, 1.0));
            let half = random.in_cube(size).abs();
            let region = Aabb { min: (middle - half).into(), max: (middle + half).into() };
            let local = field.enclose_box(&region);
            said += usize::from(local.slope_bound < field.slope_bound());
            let points: Vec<_> = (0..8).map(|_| random.in_box(region.min, region.max)).collect();
            let values: Vec<f64> = points.iter().map(|point| field.value(*point)).collect();
            // Nodes of the coarse grid are interpolated in f32, by seven interpolations, and Sparse says the corners'.
            let rounding =
                8.0 * f64::from(f32::EPSILON) * values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            for value in &values {
                assert!(
                    local.range.lower - rounding <= *value && *value <= local.range.upper + rounding,
                    "{name}: {value} {local:?}"
                );
            }
            for (a, b) in [(0, 1), (2, 3), (4, 5), (6, 7)] {
                let (change, way) = ((values[a] - values[b]).abs(), (points[a] - points[b]).norm());
                let most = local.slope_bound * way + rounding * (1.0 + way / spacing);
                assert!(change <= most, "{name}: {change} over {way}, at most {most}: {local:?}");
            }
        }
        said
    }
    let mut random = Random::of_test();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        let Baked { lattice, grid: dense } = Baked::of(&mesh, None, 40);
        let storage =
            WithBlockBounds::new(&lattice, Dense::new(&lattice, &dense.distances).unwrap(), &dense.bounds).unwrap();
        let field = Grid::new(lattice, storage, dense.slope_bound).unwrap();
        assert!(check(name, &field, &mut random) > 500, "{name}: places of a dense grid are no better than the whole");
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

/// As of a dense grid: but where the surface that closes a hole cuts no edge of a cell.
#[test]
fn an_open_mesh_is_within_its_bricks_errors_but_where_the_grid_sees_no_change_of_sign() {
    fn check<C: Quantize>(name: &str, mesh: &Mesh, random: &mut Random) {
        let lattice = Baked::of(mesh, None, 40).lattice;
        let grid = bake::<C>(mesh, &lattice);
        let storage = Sparse::new(&lattice, &grid).unwrap();
        let field = Grid::new(lattice, storage, grid.slope_bound).unwrap();
        let corners = mesh.corners();
        let [row, rows, _] = brick_counts(&lattice).map(|n| n as usize);
        let mut unseen = 0;
        for _ in 0..3000 {
            let point = random.in_box(lattice.bounds().min, lattice.bounds().max);
            let exact = oracle::signed_distance(&corners, point);
            if exact.abs() > BAND * lattice.spacing() {
                continue;
            }
            let cell = cell_at(&lattice, point);
            let [x, y, z] = cell.map(|n| (n / BRICK) as usize);
            let bound = grid.errors[grid.table[(z * rows + y) * row + x] as usize];
            let error = (field.value(point) - exact).abs();
            let signs = storage.corners(cell).map(|corner| f64::from(corner).signum());
            let is_unseen = signs.iter().all(|sign| *sign != exact.signum());
            assert!(error <= f64::from(bound) || is_unseen, "{name}: {error} at {point:?}, at most {bound}");
            unseen += usize::from(error > f64::from(bound));
        }
        assert!(unseen <= 30, "{name}: {unseen} unseen");
    }
    let mut random = Random::of_test();
    for (name, mesh) in open_meshes(&mut random) {
        check::<f32>(name, &mesh, &mut random);
        check::<u8>(name, &mesh, &mut random);
    }
}

#[test]
fn a_plan_foretells_the_grid() {
    let mut random = Random::of_test();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        let lattice = Baked::of(&mesh, None, 50).lattice;
        let mesh = mesh.baked();
        let distance = sdf_bake::MeshDistance::new(&mesh, None);
        let plan = sparse::Plan::new(&distance, &lattice, BAND * lattice.spacing());
        let done = std::sync::atomic::AtomicUsize::new(0);
        let count = |places| {
            done.fetch_add(places, std::sync::atomic::Ordering::Relaxed);
        };
        let grid = plan.bake::<f32>(&count);
        assert_eq!((plan.places(), done.into_inner()), (grid.table.len(), grid.table.len()), "{name}");
        let bricks = grid.places.len();
        assert!(bricks <= plan.most_bricks(), "{name}: {bricks} bricks, at most {}", plan.most_bricks());
        assert!(plan.most_bricks() <= 2 * bricks + 30, "{name}: {bricks} bricks, at most {}", plan.most_bricks());
        let Some(interpolation) = plan.interpolation_error(f64::INFINITY) else {
            assert!(!distance.is_continuous(), "{name}");
            continue;
        };
        // In f32, samples round by little.
        let rounding = grid.error_bound - interpolation;
        assert!(0.0 <= rounding && rounding <= 1e-5 * lattice.spacing(), "{name}: {rounding} is not all rounding");
        assert_eq!(plan.interpolation_error(0.5 * interpolation), None, "{name}");
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

/// Promise 8. A power of two changes no digit, and no code.
#[test]
fn a_mesh_scaled_by_a_power_of_two_bakes_to_the_same_bricks_scaled() {
    let mut random = Random::of_test();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        // The tiny one has distances that f32 holds with fewer digits when it is made smaller still.
        for exponent in [-10, 7] {
            let scale = 2.0_f64.powi(exponent);
            let wanted = bake::<u16>(&mesh, &Baked::of(&mesh, None, 24).lattice);
            let scaled = mesh.clone().scaled(scale);
            let found = bake::<u16>(&scaled, &Baked::of(&scaled, None, 24).lattice);
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

/// Where it has no distances it must still show the way: a search that starts on a plateau stays there.
#[test]
fn beyond_the_band_it_rises_away_from_the_surface() {
    let mut random = Random::of_test();
    for (name, mesh) in [("sphere", meshes::icosphere(3)), ("torus", meshes::torus(1.0, 0.4, 48, 24))] {
        let lattice = Baked::of(&mesh, None, 96).lattice;
        let grid = bake::<u16>(&mesh, &lattice);
        let field = Grid::new(lattice, Sparse::new(&lattice, &grid).unwrap(), grid.slope_bound).unwrap();
        let (corners, bounds, h) = (mesh.corners(), lattice.bounds(), lattice.spacing());
        let (mut seen, mut wrong) = (0, 0);
        while seen < 400 {
            let point = random.in_box(bounds.min, bounds.max);
            let away = oracle::signed_distance(&corners, point);
            // Not on the medial surface, where there is no one way.
            if away.abs() < 8.0 * h || away < 0.0 {
                continue;
            }
            let sample = field.sample(point);
            let step = sample.gradient * (0.5 * h / sample.gradient.norm().max(1e-9));
            seen += 1;
            wrong += usize::from(oracle::signed_distance(&corners, point - step) >= away);
        }
        assert!(wrong * 50 < seen, "{name}: from {wrong} of {seen} points the gradient does not lead to the surface");
    }
}
