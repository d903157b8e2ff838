//! Dense and sparse grids, placed and combined.

use sdf_bake::{DenseGrid, SparseGrid};
use sdf_core::Sdf;
use sdf_core::combine::{Difference, Union};
use sdf_core::grid::blob::BlobStorage;
use sdf_core::grid::owned::{OwnedBricks, OwnedGrid, OwnedStorage};
use sdf_core::grid::sparse::brick_counts;
use sdf_core::grid::{Blob, Grid, Lattice, Precision};
use sdf_core::placed::{Placed, Similarity};
use sdf_core::shapes::{Cuboid, Sphere};
use sdf_field::Field;
use sdf_field::export::{ExportFormat, ExportOptions};

use super::{Meaning, Scene, cube_lattice, sampled, sampled_in_bricks, with_block_bounds};
use crate::scene_field::SceneField;

/// The grid as a blob of this precision, at an odd address.
fn blob(grid: OwnedGrid, precision: Precision) -> Grid<BlobStorage<'static>> {
    let options = ExportOptions { precision: Some(precision), ..ExportOptions::default() };
    let exported = Field::new(grid).export(ExportFormat::Blob, &options).unwrap();
    let bytes: &'static [u8] = Vec::leak([&[0], &exported.bytes[..]].concat());
    Blob::open(&bytes[1..]).unwrap().grid()
}

/// A dense grid of codes.
fn coded(field: &impl Sdf, lattice: Lattice, precision: Precision) -> OwnedGrid {
    let samples = sampled(field, lattice, 1.0).storage().samples().to_vec();
    DenseGrid::from_samples(&lattice, samples).unwrap().into_grid_as(&lattice, precision).grid
}

pub fn grids(s: f64) -> Vec<Scene> {
    use Meaning::Samples;
    let ball = Sphere::new(0.5 * s).unwrap();
    let block = Cuboid::new([0.25 * s, 0.5 * s, 0.375 * s]).unwrap();
    let turned = Placed {
        field: SceneField::new(sampled(&block, cube_lattice(0.75 * s, 12), 1.0)),
        placement: Similarity::new([0.125 * s, 0.0, 0.0], [0.5, 0.5, 0.5, 0.5], 1.5).unwrap(),
    };
    let creases = [0.75 * s, 0.5 * s, 0.625 * s, s];
    let fine = cube_lattice(0.75 * s, 48);
    vec![
        Scene::new("grid of a sphere", s, Samples, Some(sampled(&ball, cube_lattice(0.75 * s, 24), 1.0)))
            .creases(&creases),
        Scene::new("grid of a cuboid", s, Samples, Some(sampled(&block, cube_lattice(0.75 * s, 12), 1.0)))
            .creases(&creases),
        Scene::new("steep grid", s, Samples, Some(sampled(&ball, cube_lattice(0.75 * s, 12), 3.0))).creases(&creases),
        Scene::new("flat grid", s, Samples, Some(sampled(&ball, cube_lattice(0.75 * s, 12), 0.25))).creases(&creases),
        // The solid extends beyond the lattice.
        Scene::new("grid of a piece of a cuboid", s, Samples, Some(sampled(&block, cube_lattice(0.4375 * s, 7), 1.0)))
            .creases(&[0.4375 * s, 0.375 * s, s]),
        Scene::new("sparse grid of a sphere", s, Samples, Some(sampled_in_bricks::<f32>(&ball, fine, 0.0625 * s)))
            .creases(&creases),
        Scene::new(
            "sparse grid of a cuboid in u16",
            s,
            Samples,
            Some(sampled_in_bricks::<u16>(&block, fine, 0.03125 * s)),
        )
        .creases(&creases),
        Scene::new("sparse grid of a sphere in u8", s, Samples, Some(sampled_in_bricks::<u8>(&ball, fine, 0.0625 * s)))
            .creases(&creases),
        Scene::new("dense grid of a cuboid in u16", s, Samples, Some(coded(&block, fine, Precision::U16)))
            .creases(&creases),
        Scene::new("blob of a dense grid of a sphere in u8", s, Samples, {
            Some(blob(coded(&ball, cube_lattice(0.75 * s, 24), Precision::U8), Precision::U8))
        })
        .creases(&creases),
        Scene::new("turned grid", 1.5 * s, Samples, Some(turned)).creases(&[0.125 * s, 1.125 * s]),
        Scene::new(
            "bounded grid of a cuboid",
            s,
            Samples,
            Some(with_block_bounds(sampled(&block, cube_lattice(0.75 * s, 24), 1.0))),
        )
        .creases(&creases),
        Scene::new("blob of a grid of a cuboid in u16", s, Samples, {
            let grid = with_block_bounds(sampled(&block, cube_lattice(0.75 * s, 24), 1.0));
            let (samples, bounds) = (grid.storage().storage().samples().to_vec(), grid.storage().bounds().to_vec());
            let storage = OwnedStorage::dense(grid.lattice(), samples, bounds).unwrap();
            Some(blob(grid.with_storage(storage), Precision::U16))
        })
        .creases(&creases),
        Scene::new("blob of a sparse grid of a sphere", s, Samples, {
            let grid = sampled_in_bricks::<u16>(&ball, fine, 0.0625 * s);
            let counts = brick_counts(grid.lattice());
            let SparseGrid { table: _, slots, scales, samples, bounds, errors, coarse, .. } =
                grid.storage().bricks().clone();
            let table = OwnedBricks::<u16>::table_of(counts, &slots).unwrap();
            let coarse = OwnedBricks::<u16>::coarse_of(counts, &coarse).unwrap();
            let bricks = OwnedBricks { table, slots, scales, samples, bounds, errors, coarse };
            let storage = OwnedStorage::sparse(grid.lattice(), bricks).unwrap();
            Some(blob(grid.with_storage(storage), Precision::U16))
        })
        .creases(&creases),
        Scene::new("turned sparse grid less a sphere", 1.5 * s, Samples, {
            let field = SceneField::new(sampled_in_bricks::<u16>(&block, fine, 0.0625 * s));
            let placement = Similarity::new([0.125 * s, 0.0, 0.0], [0.5, 0.5, 0.5, 0.5], 1.5).unwrap();
            let sphere = SceneField::new(Sphere::new(0.25 * s).unwrap());
            Some(Difference(SceneField::new(Placed { field, placement }), sphere))
        })
        .creases(&[0.125 * s, 1.125 * s]),
        Scene::new("union of two grids", s, Samples, {
            let block = SceneField::new(sampled(&block, cube_lattice(0.75 * s, 12), 1.0));
            let field = SceneField::new(sampled(&ball, cube_lattice(s, 16), 1.0));
            let placement = Similarity::new([0.125 * s, 0.0, 0.0], [0.1, 0.2, 0.3, 0.9], 0.75).unwrap();
            Some(Union(SceneField::new(Placed { field, placement }), block))
        })
        .creases(&creases),
    ]
}
