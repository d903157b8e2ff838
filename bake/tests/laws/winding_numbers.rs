//! The winding number, and the signs that are drawn from it.

use sdf_bake::{MeshDistance, SignMethod};
use sdf_core::nalgebra::Vector3;

use crate::meshes::{self, Mesh};
use crate::oracle::{self, Baked};
use crate::random::Random;

/// The library's own bound of how far its winding numbers may be off.
const WINDING_ERROR: f64 = 0.1;

/// And where it is that near to one half, five times what was ever seen.
const NEAR_ONE_HALF: f64 = 0.005;

fn open_meshes(random: &mut Random) -> Vec<(&'static str, Mesh)> {
    let sphere = meshes::icosphere(3);
    let bowl: Vec<usize> = (0..sphere.triangles.len()).filter(|t| sphere.corners()[*t][0].z > 0.1).collect();
    let pinholes: Vec<usize> = (0..sphere.triangles.len()).step_by(50).collect();
    vec![
        ("bowl", sphere.clone().without(&bowl)),
        ("sphere with pinholes", sphere.without(&pinholes)),
        ("sheet", meshes::sheet(24)),
        (
            "wavy sheet",
            meshes::sheet(30).mapped(|p| p + Vector3::new(0.0, 0.0, 0.2 * (5.0 * p.x).sin() * (4.0 * p.y).cos())),
        ),
        ("cube without a side", meshes::cube().refined().refined().refined().without(&Vec::from_iter(0..128))),
        ("torus with a gap", meshes::torus(1.0, 0.3, 40, 20).without(&Vec::from_iter(0..100))),
        ("soup", meshes::soup(300, 0.5, random)),
        ("soup of large triangles", meshes::soup(40, 2.0, random)),
        ("soup of all sizes", meshes::soup_of_all_sizes(400, random)),
    ]
}

fn closed_meshes() -> Vec<(&'static str, Mesh)> {
    vec![
        ("sphere", meshes::icosphere(3)),
        ("cube", meshes::cube().refined().refined().refined()),
        ("torus", meshes::torus(1.0, 0.3, 40, 20)),
        ("star", meshes::star(3, 7, 1.5)),
        ("nested spheres", meshes::icosphere(3).and(meshes::icosphere(3).scaled(0.8))),
    ]
}

#[test]
fn the_winding_number_is_the_sum_of_all_solid_angles_within_its_bound() {
    let mut random = Random::of_test();
    let mut worst = 0.0_f64;
    for (name, mesh) in open_meshes(&mut random).into_iter().chain(closed_meshes()) {
        let baked = mesh.baked();
        let distance = MeshDistance::new(&baked, None);
        let corners: Vec<_> = mesh.corners();
        let mut worst_here = 0.0_f64;
        for _ in 0..1500 {
            let bounds = baked.bounds().inflate(0.3 * baked.bounds().longest_side());
            let point = random.in_box(bounds.min, bounds.max);
            let off = (distance.winding_number(point.into()) - oracle::winding_number(&corners, point)).abs();
            worst_here = worst_here.max(off);
            if (distance.winding_number(point.into()).abs() - 0.5).abs() < WINDING_ERROR {
                assert!(off < NEAR_ONE_HALF, "{name}: {off} off where it matters, at {point:?}");
            }
        }
        println!("{name}: {worst_here:e}");
        worst = worst.max(worst_here);
    }
    println!("worst: {worst:e}");
    assert!(worst <= WINDING_ERROR);
}

#[test]
fn the_flood_of_signs_says_what_the_winding_number_says_at_every_node() {
    let mut random = Random::of_test();
    for (name, mesh) in open_meshes(&mut random).into_iter().chain(closed_meshes()) {
        let baked = mesh.baked();
        let distance = MeshDistance::new(&baked, Some(SignMethod::Winding));
        let mut unsure = 0;
        let grid = Baked::new(&distance, &baked.bounds(), 32);
        for (node, signed) in grid.nodes() {
            let winding = distance.winding_number(node.into()).abs();
            if (winding - 0.5).abs() > WINDING_ERROR {
                assert_eq!(signed.is_sign_negative(), winding >= 0.5, "{name} at {node:?}: {signed}, {winding}");
            } else {
                unsure += 1;
            }
        }
        println!("{name}: {unsure} nodes of {} near a winding number of one half", grid.grid.distances.len());
    }
}

/// The boundary of what the exact winding number says is where the baked signs change, but for nodes near one half.
#[test]
fn the_signs_are_those_of_the_exact_winding_number() {
    let mut random = Random::of_test();
    for (name, mesh) in open_meshes(&mut random).into_iter().chain(closed_meshes()) {
        let corners = mesh.corners();
        for (node, signed) in Baked::of(&mesh, Some(SignMethod::Winding), 10).nodes() {
            let winding = oracle::winding_number(&corners, node).abs();
            if (winding - 0.5).abs() > WINDING_ERROR && signed.abs() > 1e-9 {
                assert_eq!(signed < 0.0, winding >= 0.5, "{name} at {node:?}: {signed}, {winding}");
            }
        }
    }
}

/// A dipole alone is off by the third power of the distance, its first correction by the fourth.
#[test]
fn far_away_the_error_falls_with_the_fourth_power_of_the_distance() {
    let mut random = Random::of_test();
    let mesh = meshes::soup(300, 0.5, &mut random);
    let (baked, corners) = (mesh.baked(), mesh.corners());
    let distance = MeshDistance::new(&baked, None);
    for far in [10.0, 100.0, 1000.0_f64] {
        for _ in 0..200 {
            let point = random.in_cube(1.0).normalize() * far;
            let off = (distance.winding_number(point.into()) - oracle::winding_number(&corners, point)).abs();
            assert!(off <= 10.0 / far.powi(4) + 1e-13, "{off:e} off, {far} away");
        }
    }
}
