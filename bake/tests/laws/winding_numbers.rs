//! Winding numbers, and the signs that follow from them.

use sdf_bake::{MeshDistance, SignMethod};
use sdf_core::nalgebra::Vector3;

use crate::meshes::{self, Mesh};
use crate::oracle::{self, Baked};
use crate::random::Random;

/// Error bound of the library's winding numbers.
const WINDING_ERROR: f64 = 0.1;

/// Nearer to one half than this, rounding decides the side.
const ROUNDING: f64 = 1e-9;

/// Winding numbers this near to one half are the hardest: all of them are compared.
const CLOSE: f64 = 0.01;

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

/// Removes one in `one_in` triangles at random.
fn with_random_holes(mesh: Mesh, one_in: usize, random: &mut Random) -> Mesh {
    let missing: Vec<usize> = (0..mesh.triangles.len()).filter(|_| random.below(one_in) == 0).collect();
    mesh.without(&missing)
}

/// Removes the triangles near a random plane through the origin, in the upper half.
fn with_slit(mesh: Mesh, width: f64, random: &mut Random) -> Mesh {
    let normal = random.point_in_cube(1.0).normalize();
    let is_near = |corners: &[Vector3<f64>; 3]| corners[0].dot(&normal).abs() < width && corners[0].z > 0.0;
    let missing: Vec<usize> = (0..).zip(mesh.corners()).filter(|(_, c)| is_near(c)).map(|(index, _)| index).collect();
    mesh.without(&missing)
}

/// Meshes with holes and slits, nested shells, stacked sheets. One has too many boundary edges for a cone.
fn broken_meshes(random: &mut Random) -> Vec<(&'static str, Mesh)> {
    let sphere = || meshes::icosphere(3);
    let torus = || meshes::torus(1.0, 0.4, 36, 18);
    let turn = random.rotation();
    let holed = with_random_holes(sphere(), 40, random);
    let shells = (1..8).fold(holed.clone(), |all, k| all.and(holed.clone().scaled(1.0 - 0.01 * f64::from(k))));
    vec![
        ("sphere with random holes", holed),
        ("torus with random holes", with_random_holes(torus(), 30, random).turned(&turn)),
        ("sphere in rags", with_random_holes(sphere(), 3, random)),
        ("slit sphere", with_slit(sphere(), 0.1, random)),
        ("slit torus", with_slit(torus(), 0.15, random)),
        ("shells with holes", shells),
        ("torus through a sphere", with_slit(sphere(), 0.2, random).and(with_random_holes(torus(), 9, random))),
        (
            "two slit spheres",
            with_slit(sphere(), 0.1, random).and(with_slit(sphere().moved(0.7, 0.4, 0.3), 0.2, random)),
        ),
        (
            "one inward",
            with_slit(sphere(), 0.1, random).and(with_random_holes(sphere().scaled(0.6).flipped(), 20, random)),
        ),
        (
            "sheets",
            (0..5).fold(meshes::sheet(12), |all, k| all.and(meshes::sheet(12).moved(0.1, 0.05, 0.1 * f64::from(k)))),
        ),
        ("two layers", meshes::sheet(20).and(meshes::sheet(20).moved(0.0, 0.0, 1e-3)).turned(&turn)),
        ("a long boundary", meshes::soup(1200, 0.15, random)),
    ]
}

#[test]
fn the_winding_number_is_within_its_bound_of_the_exact_sum_and_on_the_same_side_of_one_half() {
    let mut random = Random::from_env();
    let mut worst = 0.0_f64;
    let open = open_meshes(&mut random).into_iter().chain(broken_meshes(&mut random));
    for (name, mesh) in open.chain(closed_meshes()) {
        let baked = mesh.baked();
        let distance = MeshDistance::new(&baked, None);
        let corners: Vec<_> = mesh.corners();
        let mut worst_here = 0.0_f64;
        for _ in 0..300 {
            let bounds = baked.bounds().inflate(0.3 * baked.bounds().longest_side());
            let point = random.point_in_box(bounds.min, bounds.max);
            let exact = oracle::winding_number(&corners, point);
            let winding = distance.winding_number(point.into());
            worst_here = worst_here.max((winding - exact).abs());
            if (exact.abs() - 0.5).abs() > ROUNDING {
                assert_eq!(winding.abs() >= 0.5, exact.abs() >= 0.5, "{name}: {winding} for {exact} at {point:?}");
            }
        }
        println!("{name}: {worst_here:e}");
        worst = worst.max(worst_here);
    }
    println!("worst: {worst:e}");
    assert!(worst <= WINDING_ERROR);
}

/// Compares all samples with a winding number close to one half, and some of the others.
fn assert_sides(mesh: &Mesh, name: &str, samples: impl Iterator<Item = (Vector3<f64>, f64)>, random: &mut Random) {
    let (baked, corners) = (mesh.baked(), mesh.corners());
    let distance = MeshDistance::new(&baked, None);
    let mut close = 0;
    for (node, signed) in samples {
        let is_close = (distance.winding_number(node.into()).abs() - 0.5).abs() < CLOSE;
        close += usize::from(is_close);
        if signed.abs() < 1e-9 || !is_close && random.below(40) > 0 {
            continue;
        }
        let winding = oracle::winding_number(&corners, node).abs();
        // On the surface, to which a sample in f32 can have a distance, rounding decides.
        if (winding - 0.5).abs() > ROUNDING && oracle::distance(&corners, node) > 1e-9 {
            assert_eq!(signed < 0.0, winding >= 0.5, "{name} at {node:?}: {signed}, {winding}");
        }
    }
    println!("{name}: {close} close");
}

#[test]
fn every_sign_is_that_of_the_exact_winding_number() {
    let mut random = Random::from_env();
    let broken = broken_meshes(&mut random);
    for (name, mesh) in open_meshes(&mut random).into_iter().chain(closed_meshes()).chain(broken) {
        let baked = mesh.baked();
        let distance = MeshDistance::new(&baked, Some(SignMethod::Winding));
        let dense = Baked::new(&distance, &baked.bounds(), 10 + random.below(6) as u32);
        assert_sides(&mesh, name, dense.nodes(), &mut random);
        let sparse =
            sdf_bake::sparse::bake::<f32>(&distance, &dense.lattice, dense.lattice.spacing(), &|_| ()).unwrap();
        let node = |(index, sample): (usize, &f32)| {
            let (brick, step) = (sparse.slots[index / 512], [index % 8, index / 8 % 8, index / 64 % 8]);
            let node = std::array::from_fn(|axis| brick[axis] * 8 + step[axis] as u32);
            (Vector3::from(dense.lattice.node(node)), f64::from(*sample))
        };
        assert_sides(&mesh, &format!("{name}, sparse"), sparse.samples.iter().enumerate().map(node), &mut random);
    }
}

/// The error of the dipole falls with the third power of the distance, that of its first correction with the fourth.
#[test]
fn far_away_the_error_falls_with_the_fourth_power_of_the_distance() {
    let mut random = Random::from_env();
    // Too many edges for a boundary cone, so that the sum is not refined.
    let mesh = meshes::soup(800, 0.5, &mut random);
    let (baked, corners) = (mesh.baked(), mesh.corners());
    let distance = MeshDistance::new(&baked, None);
    for far in [10.0, 100.0, 1000.0_f64] {
        for _ in 0..200 {
            let point = random.point_in_cube(1.0).normalize() * far;
            let off = (distance.winding_number(point.into()) - oracle::winding_number(&corners, point)).abs();
            assert!(off <= 30.0 / far.powi(4) + 1e-13, "{off:e} off, {far} away");
        }
    }
}
