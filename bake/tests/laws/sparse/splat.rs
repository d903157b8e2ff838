//! Samples of bricks against brute force over all triangles.

use sdf_bake::sparse::SparseBaker;
use sdf_bake::{MeshDistance, SignMethod, lattice_around};
use sdf_core::nalgebra::Vector3;

use super::BAND;
use crate::meshes::{self, Mesh};
use crate::oracle;
use crate::random::Random;

/// Meshes of every kind that a brick can meet, and how many cells they are baked with.
fn all_kinds(random: &mut Random) -> Vec<(&'static str, Mesh, u32)> {
    let turn = random.rotation();
    let lidless = meshes::cube().without(&[10, 11]).refined();
    let cube = meshes::cube();
    vec![
        ("a cube along the axes", cube.clone(), 17),
        ("large triangles", cube.clone().turned(&turn), 90),
        ("thin plate", meshes::block([1.0, 0.8, 0.003]).turned(&turn), 21),
        ("star", meshes::star(1, 3, 1.5).turned(&turn), 30),
        ("slivers, closed", meshes::torus(1.0, 0.4, 120, 5).turned(&turn), 24),
        ("knife edge", meshes::leaning_spike(0.02).turned(&turn), 40),
        ("long lists", meshes::icosphere(3).turned(&turn), 9),
        ("open", lidless.turned(&turn), 30),
        ("one-sided sheet", meshes::sheet(5).turned(&turn), 25),
        ("crossing", meshes::icosphere(1).and(meshes::icosphere(1).moved(0.7, 0.3, 0.2)), 25),
        ("nested", meshes::icosphere(1).and(cube.clone().flipped().scaled(0.3)), 25),
        ("soup", meshes::soup_of_all_sizes(60, random), 30),
        ("needles", meshes::needles(60, 1e-4, random), 30),
        ("without area", meshes::degenerate_soup(60, random), 30),
        ("duplicates", cube.clone().with_triangle([0, 1, 2]).with_triangle([2, 1, 0]), 17),
    ]
}

/// Compares samples within W with the distance, and all signs with the winding number. Returns the number of nodes.
fn check(name: &str, mesh: &Mesh, cells: u32, sign: Option<SignMethod>, random: &mut Random) -> usize {
    let baked = mesh.baked();
    let distance = MeshDistance::new(&baked, sign);
    let lattice = lattice_around(&baked.bounds(), baked.bounds().longest_side() / f64::from(cells), 3).unwrap();
    let h = lattice.spacing();
    let grid = SparseBaker::new(&distance, &lattice, BAND * h).unwrap().bake::<f32>(&|_| ());
    let corners = mesh.corners_with_area();
    let mut near = 0;
    for _ in 0..800 {
        let (brick, index) = (random.below(grid.slots.len()), random.below(512));
        let step = [index % 8, index / 8 % 8, index / 64].map(|n| n as u32);
        let node = Vector3::from(lattice.node(std::array::from_fn(|axis| grid.slots[brick][axis] * 8 + step[axis])));
        let sample = grid.samples[512 * brick + index];
        let exact = oracle::distance(&corners, node);
        if exact <= (BAND + 3.0_f64.sqrt()) * h * (1.0 - 1e-4) {
            let error = (f64::from(sample.abs()) - exact).abs();
            assert!(error <= 1e-6 * oracle::diagonal(mesh), "{name}: {sample} at {node:?} where {exact} is true");
            near += 1;
        }
        // Rounding may decide on which side of the surface that closes a mesh a node is.
        let winding = distance.winding_number(node.into());
        if (winding.abs() - 0.5).abs() > 1e-6 && exact > 1e-9 * h {
            assert_eq!(sample < 0.0, winding.abs() > 0.5, "{name}: {sample} at {node:?}, winding number {winding}");
        }
    }
    near
}

#[test]
fn bricks_hold_the_distances_and_sides_that_brute_force_finds() {
    let mut random = Random::from_env();
    for (name, mesh, cells) in all_kinds(&mut random) {
        let near = check(name, &mesh, cells, None, &mut random);
        assert!(near > 100, "{name}: {near} nodes near the surface");
        check(name, &mesh, cells, Some(SignMethod::Winding), &mut random);
    }
    // Pseudo-normals of several shells: no side can be carried along edges of the grid.
    let apart = meshes::cube().and(meshes::cube().scaled(0.3).moved(3.0, 0.0, 0.0));
    check("apart", &apart, 40, Some(SignMethod::PseudoNormal), &mut random);
}

#[test]
fn bricks_hold_them_at_any_scale() {
    let mut random = Random::from_env();
    let star = meshes::star(1, 3, 1.5).turned(&random.rotation());
    for exponent in [-60, -20, 20, 60] {
        check(&format!("2^{exponent}"), &star.clone().scaled(2.0_f64.powi(exponent)), 30, None, &mut random);
    }
    // Far from the origin, nodes themselves are rounded.
    check("far", &star.moved(1e6, -2e6, 3e5), 30, None, &mut random);
}
