//! Depths inside, beyond a sparse grid's band: how far are they from the distances to the mesh?

use sdf_bake::MeshDistance;
use sdf_bake::sparse::{self, Quantize};
use sdf_core::grid::sparse::{DEEP_ERROR, Sparse};
use sdf_core::grid::{Grid, Lattice};
use sdf_core::{Aabb, EnclosedSdf, Sdf};

use super::{BAND, closed_meshes, open_meshes};
use crate::meshes::{self, Mesh};
use crate::random::Random;

/// Closed solids with convex, concave, sharp, smooth and hollow parts, several band widths deep.
fn solids(random: &mut Random) -> Vec<(&'static str, Mesh)> {
    let turn = random.rotation();
    let spikes = meshes::star(2, 5, 0.1).flipped();
    let mut solids = vec![
        ("ball", meshes::icosphere(4).scaled(0.5)),
        ("turned cube", meshes::cube().turned(&turn)),
        ("L", meshes::l_solid().turned(&turn)),
        (
            "ball with a cavity",
            meshes::icosphere(3).and(meshes::icosphere(2).flipped().scaled(0.3).moved(0.2, 0.1, 0.0)),
        ),
        ("cube with a spiked cavity", meshes::cube().and(spikes.turned(&turn))),
        ("cube around a speck", meshes::cube().and(meshes::tetrahedron().flipped().scaled(1e-3).moved(0.1, 0.2, 0.3))),
        ("thick torus", meshes::torus(1.0, 0.6, 24, 12)),
    ];
    solids.extend(closed_meshes(random));
    solids
}

/// Largest error beyond the band, inside, in voxels, and the number of points there.
fn worst_error<C: Quantize>(name: &str, mesh: &Mesh, cells: u32, random: &mut Random) -> (f64, usize) {
    let baked = mesh.baked();
    let distance = MeshDistance::new(&baked, None);
    let lattice = lattice(&baked, cells);
    let band = BAND * lattice.spacing();
    let grid = sparse::bake::<C>(&distance, &lattice, band, &|_| ()).unwrap();
    let storage = Sparse::new(&lattice, &grid).unwrap();
    let field = Grid::new(lattice, storage, grid.slope_bound).unwrap().with_band(band);
    let field = field.with_error_bound(grid.error_bound).with_deep_error(DEEP_ERROR * lattice.spacing());
    let (mut worst, mut count) = (0.0_f64, 0);
    for _ in 0..10_000 {
        let point = random.point_in_box(baked.bounds().min, baked.bounds().max);
        let exact = distance.signed_distance(point.into());
        if exact >= -band {
            continue;
        }
        count += 1;
        let value = field.value(point);
        let bound = field.error_bound(&Aabb { min: point.into(), max: point.into() });
        assert!(value < 0.0, "{name}: {value} at {point:?} where {exact} is true");
        assert!(value - exact <= bound.above && exact - value <= bound.below, "{name}: {value} for {exact}: {bound:?}");
        assert!(bound.above <= 8.0 * lattice.spacing(), "{name}: {bound:?}");
        worst = worst.max((value - exact).abs() / lattice.spacing());
    }
    (worst, count)
}

fn lattice(baked: &sdf_bake::TriangleMesh, cells: u32) -> Lattice {
    let bounds = baked.bounds();
    sdf_bake::lattice_around(&bounds, bounds.longest_side() / f64::from(cells), 2).unwrap()
}

#[test]
fn depths_beyond_the_band_are_within_the_bound_that_the_grid_states() {
    let mut random = Random::from_env();
    let mut count = 0;
    for (name, mesh) in solids(&mut random) {
        for cells in [50, 96] {
            let (worst, points) = worst_error::<f32>(name, &mesh, cells, &mut random);
            println!("{name}, {cells} cells: off by {worst:.2} voxels");
            count += points;
        }
        count += worst_error::<u8>(name, &mesh, 50, &mut random).1;
    }
    assert!(count > 40_000, "{count} points");
}

/// The jump of an open mesh's sign must not mix depths with lower bounds.
#[test]
fn depths_in_an_open_mesh_are_within_the_bound_where_the_sign_is_right() {
    let mut random = Random::from_env();
    for (name, mesh) in open_meshes(&mut random) {
        let baked = mesh.baked();
        let distance = MeshDistance::new(&baked, None);
        let lattice = lattice(&baked, 96);
        let band = BAND * lattice.spacing();
        let grid = sparse::bake::<f32>(&distance, &lattice, band, &|_| ()).unwrap();
        let field =
            Grid::new(lattice, Sparse::new(&lattice, &grid).unwrap(), grid.slope_bound).unwrap().with_band(band);
        let mut wrong = 0;
        for _ in 0..20_000 {
            let point = random.point_in_box(baked.bounds().min, baked.bounds().max);
            let exact = distance.signed_distance(point.into());
            let value = field.value(point);
            let bound = field.error_bound(&Aabb { min: point.into(), max: point.into() });
            if exact < -band && value < 0.0 {
                // Within a voxel of the jump, values of both signs are mixed.
                wrong += usize::from(value - exact > bound.above);
            }
        }
        assert!(wrong <= 100, "{name}: {wrong}");
    }
}

#[test]
fn a_ball_is_a_tenth_deep_where_it_is() {
    let mesh = meshes::icosphere(5).scaled(0.5).baked();
    let distance = MeshDistance::new(&mesh, None);
    let lattice = sdf_bake::lattice_around(&mesh.bounds(), 1.0 / 128.0, 4).unwrap();
    let grid = sparse::bake::<u16>(&distance, &lattice, BAND / 128.0, &|_| ()).unwrap();
    let field = Grid::new(lattice, Sparse::new(&lattice, &grid).unwrap(), grid.slope_bound).unwrap();
    for (x, deep) in [(0.4_f64, 0.1_f64), (0.3, 0.2), (0.2, 0.3), (0.1, 0.4)] {
        let value = field.value([x, 0.0, 0.0].into());
        assert!((value + deep).abs() <= 1.5 / 128.0, "{value} for {}", -deep);
    }
}
