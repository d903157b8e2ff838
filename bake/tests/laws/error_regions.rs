//! Regions of the error of an open mesh: outside of them its grid is as good as that of a closed one.

use sdf_bake::sparse::SparseBaker;
use sdf_bake::{ErrorRegions, MeshDistance, TriangleMesh, dense, lattice_around};
use sdf_core::grid::owned::{OwnedGrid, Precision};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, Sdf};
use sdf_procedural::random::{Random, test_seed};
use sdf_procedural::{Bowl, CrackedNut};

/// A bowl without some of its faces, and a nut with cracks.
fn open_meshes() -> [TriangleMesh; 2] {
    let bowl = Bowl { slices: 24, stacks: 24, thickness: 0.3 }.mesh();
    let nut = CrackedNut { cells: 12, cracks: [54, 18], gap: 2e-3 }.mesh();
    [(&bowl, 40), (&nut, 0)].map(|(mesh, missing)| TriangleMesh::new(&mesh.points, &mesh.triangles[missing..]).unwrap())
}

fn contains(bounds: &Aabb, point: [f64; 3], slack: f64) -> bool {
    (0..3).all(|axis| point[axis] >= bounds.min[axis] - slack && point[axis] <= bounds.max[axis] + slack)
}

/// Points in the grid's box, and in the band of a sparse one, away from all regions.
fn assert_errors(mesh: &MeshDistance, grid: &OwnedGrid, found: &ErrorRegions, band: f64) {
    let seed = test_seed(9);
    let mut random = Random::new(seed);
    let bounds = grid.lattice().bounds();
    let mut counted = 0;
    for _ in 0..20_000 {
        let point = std::array::from_fn(|axis| random.between(bounds.min[axis], bounds.max[axis]));
        let exact = mesh.signed_distance(point);
        if exact.abs() > band || found.regions.iter().any(|region| contains(&region.bounds, point, 1e-9)) {
            continue;
        }
        counted += 1;
        let error = (grid.value(Vector3::from(point)) - exact).abs();
        assert!(error <= found.error_bound, "seed {seed}: {error} at {point:?}, {}", found.error_bound);
    }
    assert!(counted > 500, "seed {seed}: {counted}");
}

#[test]
fn away_from_the_regions_the_error_is_that_of_a_closed_mesh() {
    for mesh in open_meshes() {
        let distance = MeshDistance::new(&mesh, None);
        let lattice = lattice_around(&mesh.bounds(), mesh.bounds().longest_side() / 48.0, 3).unwrap();
        let dense = dense::bake(&distance, &lattice, &|_| ()).into_grid(&lattice);
        let band = 3.0 * lattice.spacing();
        let sparse = SparseBaker::new(&distance, &lattice, band).unwrap().bake_as(Precision::U8, &|_| ());
        for (baked, band) in [(dense, None), (sparse, Some(band))] {
            let found = distance.error_regions(&baked).unwrap();
            assert!(found.region_count <= found.regions.len() && found.cells_within < found.cells);
            assert!(found.cells_within as f64 > 0.9 * found.cells as f64, "{found:?}");
            assert!(found.error_bound < 0.95 * lattice.spacing());
            let worst = found.regions.iter().map(|region| region.error_bound).fold(found.error_bound, f64::max);
            assert!(worst <= baked.error_bound + 0.1 * lattice.spacing(), "{worst} of {}", baked.error_bound);
            assert_errors(&distance, &baked.grid, &found, band.unwrap_or(f64::INFINITY));
        }
    }
}

#[test]
fn a_closed_mesh_has_no_regions() {
    let bowl = Bowl { slices: 24, stacks: 24, thickness: 0.3 }.mesh();
    let mesh = TriangleMesh::new(&bowl.points, &bowl.triangles).unwrap();
    let distance = MeshDistance::new(&mesh, None);
    let lattice = lattice_around(&mesh.bounds(), mesh.bounds().longest_side() / 16.0, 3).unwrap();
    let baked = dense::bake(&distance, &lattice, &|_| ()).into_grid(&lattice);
    assert_eq!(distance.error_regions(&baked), None);
}
