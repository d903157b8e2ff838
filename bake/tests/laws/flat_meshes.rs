//! Open meshes in a plane, or nearly so. Nodes in the plane of a flat mesh have the distance 0, and rounding decides their side.

use sdf_bake::sparse::SparseBaker;
use sdf_bake::{BakedGrid, MeshDistance, dense, lattice_around};
use sdf_core::Sdf;
use sdf_core::grid::{Precision, Storage};
use sdf_core::nalgebra::{Rotation3, Vector3};

use crate::meshes::{self, Mesh};
use crate::oracle;
use crate::random::Random;

/// Band in voxels.
const BAND: f64 = 3.0;

const PRECISIONS: [Precision; 3] = [Precision::F32, Precision::U16, Precision::U8];

/// Flat meshes in the x-y plane.
fn flat_meshes() -> Vec<(&'static str, Mesh)> {
    let far = |mesh: Mesh| mesh.moved(0.3, 2.7, 0.0);
    vec![
        ("square", meshes::sheet(1)),
        ("sheet", meshes::sheet(7)),
        ("sheet with holes", meshes::sheet(7).without(&[3, 30, 31, 77])),
        ("triangle", meshes::sheet(1).without(&[0])),
        ("two squares", meshes::sheet(2).and(far(meshes::sheet(1)).flipped())),
    ]
}

/// The grids of a mesh of either layout, dense first, each in all precisions.
fn grids(mesh: &Mesh, cells: u32) -> Vec<(f64, BakedGrid)> {
    let triangles = mesh.baked();
    let distance = MeshDistance::new(&triangles, None);
    let lattice = lattice_around(&triangles.bounds(), triangles.bounds().longest_side() / f64::from(cells), 4).unwrap();
    let band = BAND * lattice.spacing();
    let baked = dense::bake(&distance, &lattice, &|_| ());
    let baker = SparseBaker::new(&distance, &lattice, band).unwrap();
    let dense = PRECISIONS.map(|precision| (f64::INFINITY, baked.clone().into_grid_as(&lattice, precision)));
    let sparse = PRECISIONS.map(|precision| (band, baker.bake_as(precision, &|_| ())));
    dense.into_iter().chain(sparse).collect()
}

/// Points near the mesh and anywhere in the box, some of them in the planes of the lattice.
fn assert_within_bound(name: &str, mesh: &Mesh, (band, baked): &(f64, BakedGrid), random: &mut Random) {
    let lattice = baked.grid.lattice();
    let (bounds, corners) = (lattice.bounds(), mesh.corners());
    let origin = Vector3::from(lattice.origin());
    for round in 0..600 {
        let [a, b, c] = random.pick(&corners);
        let (u, v) = (random.unit(), random.unit());
        let near = a + (b - a) * u.min(v) + (c - a) * (1.0 - u.max(v)) + random.point_in_cube(lattice.spacing());
        let mut point = if round % 2 == 0 { near } else { random.point_in_box(bounds.min, bounds.max) };
        if round % 3 == 0 {
            let axis = random.below(3);
            let steps = (point[axis] - origin[axis]) / lattice.spacing();
            point[axis] = origin[axis] + steps.round() * lattice.spacing();
        }
        let of_cell = baked.grid.storage().corners(oracle::cell_of(lattice, point));
        let exact = oracle::with_sign_of_cell(oracle::signed_distance(&corners, point), of_cell);
        if exact.abs() > *band {
            continue;
        }
        let error = (baked.grid.value(point) - exact).abs();
        // Rounding of f64 sums, relative to coordinates of some units.
        assert!(error <= baked.error_bound + 1e-12, "{name}: {error} > {} at {point:?}", baked.error_bound);
    }
}

#[test]
fn a_flat_mesh_in_a_plane_of_the_nodes_has_no_inside_and_the_bound_of_a_closed_one() {
    let mut random = Random::from_env();
    let axes = [Rotation3::identity(), Rotation3::new(Vector3::x() * 0.5 * std::f64::consts::PI)];
    for (name, mesh) in flat_meshes() {
        for (turn, shift) in [(axes[0], 0.0), (axes[1], 0.3)] {
            let mesh = mesh.clone().turned(&turn).moved(shift, shift, shift);
            for cells in [24, 50] {
                for grid in grids(&mesh, cells) {
                    assert_within_bound(name, &mesh, &grid, &mut random);
                    let baked = &grid.1;
                    let [row, rows, layers] = baked.grid.lattice().nodes();
                    let mut samples = vec![0.0; row as usize];
                    let mut least = f32::INFINITY;
                    for line in 0..rows * layers {
                        baked.grid.storage().copy_row([0, line % rows, line / rows], row, &mut samples);
                        least = samples.iter().copied().fold(least, f32::min);
                    }
                    assert!(least >= 0.0, "{name} of {cells} cells: {least}");
                    // √3/2 h, and half a step of a code: of u8 h/42, for a distance differs by 7 √3 h at most in a block.
                    let in_voxels = baked.error_bound / baked.grid.lattice().spacing();
                    assert!(in_voxels < 0.866_1 + 1.0 / 42.0, "{name} of {cells} cells: {in_voxels}");
                }
            }
        }
    }
}

#[test]
fn no_point_of_a_flat_mesh_is_off_by_more_than_its_error_bound_however_it_is_turned_or_bent() {
    let mut random = Random::from_env();
    let bent = |mesh: Mesh, height: f64| {
        mesh.mapped(|p| p + Vector3::z() * (height * (1.0 - p.x * p.x) * (1.0 - 0.5 * p.y * p.y)))
    };
    for (name, mesh) in flat_meshes() {
        let tilt = Rotation3::new(Vector3::y() * 0.01);
        let slight = Rotation3::new(random.point_in_cube(1e-12));
        let turn = random.rotation();
        let mut meshes: Vec<Mesh> = [tilt, slight, turn].map(|turn| mesh.clone().turned(&turn)).into();
        meshes.extend([1e-14, 1e-9, 1e-6, 1e-3, 0.1].map(|height| bent(mesh.clone(), height)));
        for mesh in meshes {
            for grid in grids(&mesh, 24) {
                assert_within_bound(name, &mesh, &grid, &mut random);
            }
        }
    }
}
