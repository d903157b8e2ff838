//! Regions of an open ball, compared with each cell by itself.

use sdf_core::grid::owned::{Layout, Precision};

use super::*;
use crate::sparse::SparseBaker;
use crate::testing::random;
use crate::{BakedGrid, TriangleMesh, dense, lattice_around};

/// A ball of quadrangles cut in two, without its cap and one more face.
fn open_ball(state: &mut u64) -> TriangleMesh {
    let (mut points, mut triangles) = (vec![], vec![]);
    for i in 0..=10 {
        for j in 0..16 {
            let (up, round) = (std::f64::consts::PI * f64::from(i) / 10.0, std::f64::consts::TAU * f64::from(j) / 16.0);
            let radius = if i % 10 == 0 { 1.0 } else { 1.0 + 0.1 * random(state) };
            points.push([up.sin() * round.cos(), up.sin() * round.sin(), up.cos()].map(|x| radius * x));
            let (next, below) = (16 * i + (j + 1) % 16, 16 * (i + 1) + j);
            if (2..10).contains(&i) && (i, j) != (6, 3) {
                triangles.extend([[16 * i + j, below, next], [next, below, 16 * (i + 1) + (j + 1) % 16]]);
            }
        }
    }
    TriangleMesh::new(&points, &triangles).unwrap()
}

/// Cells, those that may err more, and the largest magnitude of these: each cell by itself.
fn cell_by_cell(mesh: &MeshDistance, grid: &OwnedGrid, exact_within: f32) -> (u64, u64, f32) {
    let (lattice, storage) = (grid.lattice(), grid.storage());
    let (mut cells, mut jumps, mut largest) = (0, 0, 0.0_f32);
    let [nx, ny, nz] = lattice.cells();
    for index in 0..nx * ny * nz {
        let cell = [index % nx, index / nx % ny, index / nx / ny];
        let has_samples = storage.layout() == Layout::Dense || storage.brick_at(cell.map(|n| n / BRICK)).is_some();
        let corners = storage.corners(cell);
        let magnitude = corners.iter().fold(0.0_f32, |max, corner| max.max(corner.abs()));
        if !has_samples || magnitude > exact_within {
            continue;
        }
        cells += 1;
        let inside = corners.iter().filter(|corner| **corner < 0.0).count();
        let center = lattice.node(cell).map(|x| x + 0.5 * lattice.spacing()).into();
        if inside % 8 != 0 && !mesh.excludes_jump(center, MAX_ERROR * lattice.spacing()) {
            jumps += 1;
            largest = largest.max(magnitude);
        }
    }
    (cells, jumps, largest)
}

#[test]
fn slots_decide_for_their_cells_what_each_would_by_itself() {
    let mut state = 17;
    let mesh = open_ball(&mut state);
    let mesh = MeshDistance::new(&mesh, None);
    assert_eq!(mesh.sign_method(), SignMethod::Winding);
    for resolution in [21.0, 46.0] {
        let lattice = lattice_around(&mesh.bounds(), mesh.bounds().longest_side() / resolution, 3).unwrap();
        let band = 3.0 * lattice.spacing();
        let sparse = SparseBaker::new(&mesh, &lattice, band).unwrap().bake_as(Precision::U16, &|_| ());
        let dense = dense::bake(&mesh, &lattice, &|_| ()).into_grid(&lattice);
        for (baked, band) in [(sparse, Some(band)), (dense, None)] {
            let found = mesh.error_regions(&baked).unwrap();
            let BakedGrid { grid, .. } = baked;
            let exact_within = band.map_or(f64::INFINITY, |band| band + 2.0 * MAX_ERROR * lattice.spacing()) as f32;
            let (cells, jumps, largest) = cell_by_cell(&mesh, &grid, exact_within);
            assert_eq!((found.cells, found.cells - found.cells_within), (cells, jumps));
            assert!(0 < jumps && jumps < cells, "{jumps} of {cells}");
            let worst = found.regions.iter().map(|region| region.error_bound).fold(0.0, f64::max);
            assert_eq!(worst, found.error_bound + 2.0 * f64::from(largest));
        }
    }
}
