//! Error bounds of a sparse grid's bricks, compared with the baker's own distances (tested elsewhere).

use sdf_bake::sparse::{Certify, Quantize, SparseBaker, SparseGrid, node_rounding};
use sdf_bake::{MeshDistance, SignMethod, TriangleMesh, lattice_around};
use sdf_core::Sdf;
use sdf_core::grid::sparse::{BRICK, Sparse, brick_counts};
use sdf_core::grid::{Grid, Lattice};
use sdf_core::nalgebra::Vector3;

use crate::meshes::{self, Mesh};
use crate::random::Random;

fn solids(random: &mut Random) -> Vec<(&'static str, Mesh)> {
    let mut turned = |mesh: Mesh| mesh.turned(&random.rotation());
    vec![
        ("tetrahedron", meshes::tetrahedron()),
        ("turned tetrahedron", turned(meshes::tetrahedron())),
        ("cube", meshes::cube()),
        ("turned cube", turned(meshes::cube())),
        ("refined cube", turned(meshes::cube().refined().refined())),
        ("L", turned(meshes::l_solid())),
        ("thin plate", meshes::block([1.0, 0.7, 0.02])),
        ("turned thin plate", turned(meshes::block([1.0, 0.7, 0.05]))),
        ("rod", turned(meshes::block([1.0, 0.06, 0.04]))),
        ("icosahedron", turned(meshes::icosphere(0))),
        ("coarse sphere", turned(meshes::icosphere(1))),
        ("sphere", turned(meshes::icosphere(2))),
        ("fine sphere", turned(meshes::icosphere(4))),
        ("star", turned(meshes::star(1, 3, 1.5))),
        ("fine star", turned(meshes::star(2, 5, 1.2))),
        ("spike", turned(meshes::leaning_spike(0.2))),
        ("torus", turned(meshes::torus(1.0, 0.3, 12, 7))),
        ("fine torus", turned(meshes::torus(1.0, 0.4, 60, 30))),
        ("thin torus", turned(meshes::torus(1.0, 0.07, 30, 6))),
        ("sphere with wrongly wound faces", turned(meshes::icosphere(2).with_flipped(&[3, 70, 71, 200]))),
        ("cube inside out", turned(meshes::cube().flipped())),
        ("torus of slivers", turned(meshes::torus(1.0, 0.4, 300, 5))),
    ]
}

/// Largest error over its brick's bound, which must be at most 1, and the bounds of all bricks in voxels.
pub fn check<C: Quantize>(
    name: &str,
    triangles: &TriangleMesh,
    cells: u32,
    band: f64,
    certify: Certify,
    random: &mut Random,
) -> (f64, Vec<f64>) {
    let distance = MeshDistance::new(triangles, None);
    let lattice = lattice_around(&triangles.bounds(), triangles.bounds().longest_side() / f64::from(cells), 2).unwrap();
    let spacing = lattice.spacing();
    let baker = SparseBaker::new(&distance, &lattice, band * spacing).unwrap().certified(certify);
    let grid: SparseGrid<C> = baker.bake(&|_| ());
    assert_eq!(grid.errors.len(), grid.slots.len());
    assert_eq!(grid.error_bound, f64::from(grid.errors.iter().copied().fold(0.0, f32::max)), "{name}");
    let field = Grid::new(lattice, Sparse::new(&lattice, &grid).unwrap(), grid.slope_bound).unwrap();
    let mut worst = 0.0_f64;
    let mut count = 0;
    for round in 0..10_000 {
        let (cell, point) = point_of_cell(&lattice, triangles, spacing * band, round, random);
        if !(0..3).all(|axis| cell[axis] < lattice.cells()[axis]) {
            continue;
        }
        let exact = distance.signed_distance(point.into());
        if exact.abs() > band * spacing {
            continue;
        }
        let [row, rows, _] = brick_counts(&lattice).map(|n| n as usize);
        let [x, y, z] = cell.map(|n| (n / BRICK) as usize);
        let error = (field.value(point) - exact).abs();
        let bound = f64::from(grid.errors[grid.table[(z * rows + y) * row + x] as usize]);
        // Rounding in f64, and of the point's own coordinates.
        let rounding = 1e-12 * (1.0 + point.norm());
        assert!(
            error <= bound + rounding,
            "{name} of {cells} cells: off by {} > {} voxels at {point:?}",
            error / spacing,
            bound / spacing
        );
        worst = worst.max(error / (bound + rounding));
        count += 1;
    }
    assert!(count > 200, "{name}: {count} points in the band");
    (worst, grid.errors.iter().map(|error| f64::from(*error) / spacing).collect())
}

/// A cell and one of its points near the surface: a node, the middle of an edge, a face or the cell, or any point.
fn point_of_cell(
    lattice: &Lattice,
    mesh: &TriangleMesh,
    band: f64,
    round: usize,
    random: &mut Random,
) -> ([u32; 3], Vector3<f64>) {
    let [a, b, c] = mesh.corners(random.below(mesh.triangle_count())).map(Vector3::from);
    let (u, v) = (random.unit(), random.unit());
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    // Half of the points are near edges and corners, where the gradient turns.
    let (u, v) = match round % 4 {
        0 => (0.0, v),
        1 => (0.0, 0.0),
        _ => (u, v),
    };
    let near = a + (b - a) * u + (c - a) * v + random.point_in_cube(band);
    let steps = (near - Vector3::from(lattice.origin())) / lattice.spacing();
    let cell: [u32; 3] = std::array::from_fn(|axis| steps[axis] as u32);
    let fraction =
        Vector3::from_fn(|_, _| if random.below(3) == 0 { random.unit() } else { 0.5 * random.below(2) as f64 });
    let point = (Vector3::from(cell.map(f64::from)) + fraction) * lattice.spacing() + Vector3::from(lattice.origin());
    (cell, point)
}

#[test]
fn no_point_of_the_band_is_off_by_more_than_its_bricks_error_bound() {
    let mut random = Random::from_env();
    for (name, mesh) in solids(&mut random) {
        let triangles = mesh.baked();
        for cells in [5, 17, 40] {
            let (worst, _) = check::<f32>(name, &triangles, cells, 3.0, Certify::Tight, &mut random);
            let (wide, _) = check::<u16>(name, &triangles, cells, 6.0, Certify::Fast, &mut random);
            let (coarse, _) = check::<u8>(name, &triangles, cells, 1.5, Certify::Fast, &mut random);
            println!("{name} of {cells} cells: {worst:.2}, {wide:.2}, {coarse:.2} of the bound");
        }
    }
}

#[test]
fn smooth_parts_of_a_mesh_have_small_error_bounds() {
    let mut random = Random::from_env();
    let quantile = |mut errors: Vec<f64>, fraction: f64| {
        errors.sort_by(f64::total_cmp);
        errors[(fraction * (errors.len() - 1) as f64) as usize]
    };
    let sphere = meshes::icosphere(5).turned(&random.rotation());
    for (certify, middle) in [(Certify::Tight, 0.15), (Certify::Fast, 0.3)] {
        let (_, errors) = check::<f32>("sphere", &sphere.baked(), 100, 3.0, certify, &mut random);
        assert!(quantile(errors.clone(), 0.5) < middle, "sphere: {} in the middle", quantile(errors, 0.5));
    }
    let cube = meshes::cube().turned(&random.rotation());
    let (_, fast) = check::<f32>("cube", &cube.baked(), 80, 3.0, Certify::Fast, &mut random);
    let (_, errors) = check::<f32>("cube", &cube.baked(), 80, 3.0, Certify::Tight, &mut random);
    // At an edge of 90° between flat faces the bound is (0.707 + 0.146)/2 = 0.43 voxels (docs/error-bounds.md).
    // Between them nothing but the rounding of distances to triangles of 80 voxels is left.
    let flat = |errors: &[f64]| errors.iter().filter(|error| **error < 1e-3).count();
    assert!(flat(&errors) * 2 > errors.len(), "cube: {} of {} bricks are flat", flat(&errors), errors.len());
    // The fast bound asks 4 × 4 × 4 cells at once.
    assert!(flat(&fast) * 4 > fast.len(), "cube: {} of {} bricks are flat", flat(&fast), fast.len());
    assert!(quantile(errors.clone(), 0.9) < 0.43, "cube: {} at its edges", quantile(errors, 0.9));
}

/// Without normals of one solid nothing bounds how the gradient turns.
#[test]
fn a_mesh_that_does_not_bound_one_solid_has_the_error_bound_of_any_distance() {
    let mut random = Random::from_env();
    let two = meshes::cube().and(meshes::cube().scaled(0.3).moved(3.0, 0.0, 0.0));
    let (_, errors) = check::<f32>("two cubes", &two.baked(), 30, 3.0, Certify::Fast, &mut random);
    assert!(errors.iter().all(|error| (0.866..0.867).contains(error)));
}

/// Nothing but the whole winding numbers counts for that, not how many faces share an edge.
#[test]
fn a_closed_mesh_with_edges_of_four_faces_has_the_error_bound_of_any_distance() {
    let mut random = Random::from_env();
    let random_hull = |random: &mut Random| {
        let mut voxels: Vec<[i32; 3]> = (0..27).map(|place| [place % 3, place / 3 % 3, place / 9]).collect();
        random.shuffle(&mut voxels);
        meshes::voxel_hull(&voxels[..2 + random.below(12)])
    };
    let mut closed = meshes::with_edges_of_four_faces();
    closed.extend((0..8).map(|_| ("random hull of voxels", random_hull(&mut random))));
    let mut with_such_edges = 0;
    for (name, mesh) in closed {
        let triangles = mesh.turned(&random.rotation()).baked();
        for sign in [None, Some(SignMethod::PseudoNormal)] {
            let distance = MeshDistance::new(&triangles, sign);
            let topology = distance.topology();
            with_such_edges += usize::from(topology.non_manifold_edges > 0);
            let is_continuous = sign.is_none() || topology.bounds_one_solid();
            assert_eq!(distance.is_continuous(), is_continuous, "{name}: {}", distance.sign_reason());
        }
        for certify in [Certify::Fast, Certify::Tight] {
            let (_, errors) = check::<f32>(name, &triangles, 24, 3.0, certify, &mut random);
            let bounds_one_solid = MeshDistance::new(&triangles, None).topology().bounds_one_solid();
            let is_of_any = |error: &f64| (0.866..0.867).contains(error) || bounds_one_solid && *error < 0.867;
            assert!(errors.iter().all(is_of_any), "{name}: {errors:?}");
        }
    }
    assert!(with_such_edges > 10, "{with_such_edges} meshes");
}

/// Samples of f32 are off by their rounding alone.
#[test]
fn tight_bounds_of_a_grid_certified_fast_are_those_of_one_certified_tight() {
    let mut random = Random::from_env();
    for (name, mesh) in solids(&mut random) {
        let triangles = mesh.baked();
        let distance = MeshDistance::new(&triangles, None);
        let spacing = triangles.bounds().longest_side() / 30.0;
        let lattice = lattice_around(&triangles.bounds(), spacing, 2).unwrap();
        let baker = || SparseBaker::new(&distance, &lattice, 3.0 * spacing).unwrap();
        let tight: SparseGrid<f32> = baker().certified(Certify::Tight).bake(&|_| ());
        let Some(errors) = baker().tight_errors(&tight.slots) else {
            assert!(!distance.topology().bounds_one_solid(), "{name}");
            continue;
        };
        let rounding = node_rounding(&distance, &lattice, 3.0 * spacing) + 1e-6 * spacing;
        for (error, stated) in errors.iter().zip(tight.errors.iter().map(|error| f64::from(*error))) {
            assert!(*error <= stated && stated <= error + rounding, "{name}: {error} and {stated}");
        }
    }
}
