//! Parts of a sparse grid, joined, are the grid that is baked at once, whatever is in memory; and a box that cuts through the solid.

use std::convert::Infallible;

use sdf_bake::sparse::{BakedPart, BrickColumns, BrickSamples, BrickShard, SparseBaker, SparseGrid, UnboundedGrid};
use sdf_bake::{MeshDistance, lattice_around};
use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::{BRICK_SAMPLES, Sparse};
use sdf_core::grid::{Storage, measure_slope_bound};

use crate::meshes::cube;
use crate::random::Random;
use crate::sparse::{closed_meshes, open_meshes};

const BAND: f64 = 3.0;

/// Samples in memory that are handed out brick by brick, as from a file.
struct Shelf(Vec<u16>);

impl BrickSamples<u16> for Shelf {
    type Error = Infallible;
    fn read(&self, bricks: &[u32]) -> Result<Vec<u16>, Infallible> {
        assert!(bricks.is_sorted_by(|a, b| a < b));
        let brick = |brick: &u32| self.0[*brick as usize * BRICK_SAMPLES..][..BRICK_SAMPLES].to_vec();
        Ok(bricks.iter().flat_map(brick).collect())
    }
}

/// The grid of parts, bounded a few bricks at a time.
fn joined(
    mesh: &MeshDistance,
    baker: &SparseBaker,
    count: u32,
    slots_at_a_time: usize,
    bricks_at_a_time: usize,
) -> SparseGrid<u16> {
    let (mut near, mut closing) = (BrickColumns::default(), BrickColumns::default());
    let (mut near_samples, mut closing_samples) = (vec![], vec![]);
    for index in 0..count {
        let mut samples = vec![];
        let mut take = |codes: Vec<u16>| {
            samples.extend(codes);
            Ok::<(), Infallible>(())
        };
        let shard = BrickShard { index, count };
        let Ok(part) = baker.bake_part(shard, slots_at_a_time, &mut take, &|_| ());
        closing_samples.extend(samples.split_off(part.near.slots.len() * BRICK_SAMPLES));
        near_samples.extend(samples);
        near.append(part.near);
        closing.append(part.closing);
    }
    near_samples.extend(closing_samples);
    let shelf = Shelf(near_samples);
    let (parts, coarse) = (BakedPart { near, closing }, baker.coarse_map().clone());
    let unbounded = UnboundedGrid::new(baker.lattice(), baker.band(), baker.is_continuous(), parts, coarse);
    assert_eq!(unbounded.missing(), None);
    let Ok((grid, sources)) = unbounded.bounded(&shelf, bricks_at_a_time, Some(mesh));
    let places: Vec<u32> = (0..grid.slots.len() as u32).map(|brick| sources.place(brick)).collect();
    let Ok(samples) = shelf.read(&places);
    grid.with_samples(samples)
}

#[test]
fn parts_are_the_grid_that_is_baked_at_once() {
    let mut random = Random::from_env();
    let mut closing = 0;
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        let mesh = mesh.baked();
        let lattice = lattice_around(&mesh.bounds(), mesh.bounds().longest_side() / 48.0, 2).unwrap();
        let distance = MeshDistance::new(&mesh, None);
        let baker = SparseBaker::new(&distance, &lattice, BAND * lattice.spacing()).unwrap();
        let whole = baker.bake::<u16>(&|_| ());
        for (count, slots, bricks) in [(1, 100, 7), (3, 1, 64), (11, usize::MAX, 1000)] {
            assert!(joined(&distance, &baker, count, slots, bricks) == whole, "{name} in {count} parts");
        }
        let mut take = |_: Vec<u16>| Ok::<(), Infallible>(());
        let Ok(part) = baker.bake_part(BrickShard::WHOLE, 1000, &mut take, &|_| ());
        closing += part.closing.slots.len();
    }
    assert!(closing > 0, "no mesh was closed by bricks");
}

/// Inside at the box, all of it near the surface: only bricks can tell.
#[test]
fn a_solid_that_reaches_the_box_has_the_slope_bound_of_what_lies_beyond() {
    let mesh = cube().baked();
    let bounds = mesh.bounds();
    let distance = MeshDistance::new(&mesh, None);
    let spacing = bounds.longest_side() / 6.0;
    let middle = 0.5 * (bounds.min[0] + bounds.max[0]);
    let origin = [middle, bounds.min[1] - 4.0 * spacing, bounds.min[2] - 4.0 * spacing];
    let lattice = Lattice::new(origin, spacing, [20, 16, 16]).unwrap();
    let grid = sdf_bake::sparse::bake::<f32>(&distance, &lattice, BAND * lattice.spacing(), &|_| ()).unwrap();
    let storage = Sparse::new(&lattice, &grid).unwrap();
    assert!(storage.corners([0, 7, 7])[0] < 0.0, "it does not reach the box");
    let steepest = measure_slope_bound(&lattice, &storage);
    assert!(steepest > 1.2 && grid.slope_bound >= steepest, "{} below {steepest}", grid.slope_bound);
}
