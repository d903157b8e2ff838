//! Shells that cross, nest and touch, in sparse grids: what is kept is all of the solid's surface, and bricks have its sides.

use sdf_bake::sparse::{Certify, SparseGrid};
use sdf_bake::{MeshDistance, lattice_around, sparse};
use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES};

use crate::certified_errors;
use crate::inner_faces::{mesh_of, random_block, random_part, samples_of_surface};
use crate::inner_shells;
use crate::meshes::Mesh;
use crate::random::Random;

/// Blocks that share parts of faces, edges and corners. Turned, what was shared is apart by a rounding, or overlaps by one. Some are inside
/// out if they may be: where they are not turned, w is 0 in the plane between such a block and another, though on either side it is ±1.
fn touching_blocks(random: &mut Random, is_turned: bool, may_flip: bool) -> Mesh {
    let block = |random: &mut Random| {
        let block = mesh_of(&[random_block(random)]);
        if may_flip && random.below(4) == 0 { block.flipped() } else { block }
    };
    let mesh = (0..2 + random.below(5)).map(|_| block(random)).fold(Mesh::default(), Mesh::and);
    if is_turned { mesh.turned(&random.rotation()) } else { mesh }
}

/// Samples of the solid's surface are on what was kept, where blocks that were turned touch.
#[test]
fn no_surface_is_lost_where_turned_blocks_touch() {
    let mut random = Random::from_env();
    let mut tested = 0;
    for round in 0..60 {
        // None is inside out: blocks that share an edge are one shell, which gets one orientation.
        let mesh = touching_blocks(&mut random, true, false);
        let baked = mesh.baked().without_inner_faces();
        let distance = MeshDistance::new(&baked, None);
        for sample in samples_of_surface(&mesh.corners(), &mut random, 150) {
            let off = distance.signed_distance(sample.into()).abs();
            assert!(off < 1e-9, "round {round}: {off} off at {sample:?}");
            tested += 1;
        }
    }
    assert!(tested > 3000, "{tested}");
}

/// In bricks, sides come from the planes of the triangles beside which the outside of the solid is proven to be, and so do error
/// bounds: the sides are those of the winding number, the bounds hold, and many are less than that of any distance.
#[test]
fn bricks_of_shells_have_the_sides_of_winding_numbers_and_keep_within_their_bounds() {
    let mut random = Random::from_env();
    let (mut nodes, mut inside, mut bricks, mut tight) = (0, 0, 0, [0; 2]);
    for round in 0..60 {
        let mesh = match round % 3 {
            0 => inner_shells::nested(&mut random),
            1 => (0..2 + random.below(4)).map(|_| random_part(&mut random)).fold(Mesh::default(), Mesh::and),
            _ => {
                let is_turned = random.below(2) == 0;
                touching_blocks(&mut random, is_turned, is_turned)
            }
        };
        let turned = [(); 5].map(|()| random.below(mesh.triangles.len()));
        // Some faces are wound the wrong way round, but not where blocks share edges: which way is right there?
        let mesh = if round % 2 == 0 && round % 3 < 2 { mesh.with_flipped(&turned) } else { mesh };
        let baked = mesh.baked().without_inner_faces();
        let (cells, name) = (20 + random.below(60), format!("round {round}"));
        let distance = MeshDistance::new(&baked, None);
        let spacing = baked.bounds().longest_side() / cells as f64;
        let lattice = lattice_around(&baked.bounds(), spacing, 3).unwrap();
        let grid: SparseGrid<f32> = sparse::bake(&distance, &lattice, 3.0 * spacing, &|_| ()).unwrap();
        for _ in 0..3000 {
            let index = random.below(grid.samples.len());
            let (brick, node) = (index / BRICK_SAMPLES, index % BRICK_SAMPLES);
            let step = [node % 8, node / 8 % 8, node / 64];
            let at = lattice.node([0, 1, 2].map(|axis| grid.slots[brick][axis] * BRICK + step[axis] as u32));
            let exact = distance.signed_distance(at);
            let value = f64::from(grid.samples[index]);
            if exact.abs() > 1e-9 {
                assert_eq!(value < 0.0, exact < 0.0, "{name}: {value} for {exact} at {at:?}");
                (nodes, inside) = (nodes + 1, inside + usize::from(exact < 0.0));
            }
        }
        for (certify, tight) in [Certify::Fast, Certify::Tight].into_iter().zip(&mut tight) {
            let (_, errors) = certified_errors::check::<u16>(&name, &baked, cells as u32, 3.0, certify, &mut random);
            *tight += errors.iter().filter(|error| **error < 0.6).count();
            bricks += errors.len();
        }
    }
    assert!(nodes > 150_000 && inside > 8000, "{nodes} {inside}");
    assert!(tight.iter().all(|tight| *tight > bricks / 100), "{tight:?} of {bricks}");
}
