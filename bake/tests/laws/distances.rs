//! Magnitudes: every sample is the distance of its node to the nearest triangle.

use parry3d_f64::math::Vec3;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::Triangle;
use sdf_bake::{MeshDistance, SignMethod};
use sdf_core::nalgebra::Vector3;

use crate::meshes::{self, Mesh};
use crate::oracle::{self, Baked};
use crate::random::Random;

/// Rounding to f32: half a unit in the last place, and a little for rounding in f64.
const TO_F32: f64 = 0.5 * f32::EPSILON as f64 * 1.000_001;

/// Rounding of a distance in f64, relative to the mesh's diagonal. A smaller distance has lost all digits.
const F64_ROUNDING: f64 = 1e-14;

/// Asserts that both sign methods store the oracle's magnitudes, within rounding to f32 and `tolerance` diagonals.
fn assert_exact_by(name: &str, mesh: &Mesh, cells: u32, tolerance: f64, oracle: impl Fn(Vector3<f64>) -> f64) {
    let diagonal = oracle::diagonal(mesh);
    let baked = [sdf_bake::SignMethod::PseudoNormal, sdf_bake::SignMethod::Winding]
        .map(|method| Baked::from_mesh(mesh, Some(method), cells));
    let mut worst = 0.0_f64;
    for ((node, by_normals), (_, by_winding)) in baked[0].nodes().zip(baked[1].nodes()) {
        assert_eq!(by_normals.abs(), by_winding.abs(), "{name} at {node:?}");
        let exact = oracle(node);
        let excess = ((by_normals.abs() - exact).abs() - exact * TO_F32) / diagonal;
        worst = worst.max(excess);
        assert!(excess <= tolerance, "{name}: {} for {exact} at {node:?}, {excess:e} diagonals off", by_normals.abs());
    }
    println!("{name}: at most {worst:e} diagonals off beside the rounding to f32");
}

fn assert_exact(name: &str, mesh: &Mesh, cells: u32, tolerance: f64) {
    let corners = mesh.corners_with_area();
    assert_exact_by(name, mesh, cells, tolerance, |node| oracle::distance(&corners, node));
}

#[test]
fn every_node_of_a_solid_has_the_distance_found_by_brute_force() {
    let mut random = Random::from_env();
    let turn = random.rotation();
    for (name, mesh) in [
        ("tetrahedron", meshes::tetrahedron()),
        ("cube", meshes::cube()),
        ("turned cube", meshes::cube().turned(&turn)),
        ("sphere", meshes::icosphere(2)),
        ("torus", meshes::torus(1.0, 0.3, 24, 12)),
        ("L", meshes::l_solid().turned(&turn)),
        ("star", meshes::star(2, 5, 1.5)),
        ("leaning spike", meshes::leaning_spike(0.05)),
    ] {
        assert_exact(name, &mesh, 12, F64_ROUNDING);
    }
}

#[test]
fn every_node_of_a_soup_has_the_distance_found_by_brute_force() {
    let mut random = Random::from_env();
    for triangles in [1, 2, 8, 9, 65, 600] {
        assert_exact("soup", &meshes::soup(triangles, 0.5, &mut random), 9, F64_ROUNDING);
    }
    assert_exact("soup of all sizes", &meshes::soup_of_all_sizes(500, &mut random), 9, F64_ROUNDING);
}

#[test]
fn every_node_of_a_soup_has_the_distance_that_parry_finds() {
    let mut random = Random::from_env();
    let mesh = meshes::soup(300, 0.5, &mut random);
    let parry: Vec<Triangle> = mesh
        .corners()
        .iter()
        .map(|corners| {
            let [a, b, c] = corners.map(|p| Vec3::new(p.x, p.y, p.z));
            Triangle::new(a, b, c)
        })
        .collect();
    assert_exact_by("soup", &mesh, 9, 1e-12, |node| {
        let node = Vec3::new(node.x, node.y, node.z);
        parry.iter().map(|triangle| triangle.distance_to_local_point(node, false)).fold(f64::INFINITY, f64::min)
    });
}

/// The normal of a needle of aspect a has a relative error of about ε/a. Below a = 1e-7 the baker replaces the needle
/// by its edges, which are at most a/2 from its points. (Some of the needles are thinner than their aspect.)
#[test]
fn every_node_around_needles_has_the_distance_found_by_brute_force() {
    let mut random = Random::from_env();
    for (aspect, tolerance) in
        [(1e-2, 1e-12), (1e-4, 1e-10), (1e-6, 1e-7), (1e-7, 1e-7), (1e-8, 1e-7), (1e-12, 1e-7), (0.0, 1e-13)]
    {
        for _ in 0..5 {
            assert_exact("needles", &meshes::needles(60, aspect, &mut random), 9, tolerance);
        }
    }
}

#[test]
fn triangles_of_almost_no_area_have_the_distance_of_their_segments() {
    let mut random = Random::from_env();
    let mixed = meshes::degenerate_soup(60, &mut random).and(meshes::icosphere(1).scaled(0.3));
    for (name, mesh) in [("degenerate", meshes::degenerate_soup(120, &mut random)), ("around a sphere", mixed)] {
        let kept = mesh.corners_with_area().len();
        assert!(kept > 20 && kept < mesh.triangles.len(), "{name}: {kept} kept");
        assert_exact(name, &mesh, 9, 1e-14);
    }
}

/// A coordinate of 1e6 diagonals is itself rounded by 1e-10 of one.
#[test]
fn every_node_far_from_the_origin_has_the_distance_found_by_brute_force() {
    let mut random = Random::from_env();
    for mesh in [meshes::icosphere(2), meshes::star(1, 3, 1.5), meshes::soup(200, 0.5, &mut random)] {
        let far = 1e6 * oracle::diagonal(&mesh);
        assert_exact("far out", &mesh.moved(far, -0.7 * far, 0.3 * far), 9, 1e-9);
    }
}

#[test]
fn every_node_has_its_distance_at_any_scale() {
    let mut random = Random::from_env();
    let soup = meshes::soup(100, 0.5, &mut random);
    for exponent in [-29, -20, -10, -3, 3, 10, 20, 29] {
        assert_exact("scaled", &soup.clone().scaled(10.0_f64.powi(exponent)), 7, F64_ROUNDING);
    }
}

/// The hardest points: beside a triangle, in its plane, over its corners and edges.
#[test]
fn a_point_near_a_triangle_has_the_distance_found_by_brute_force() {
    let mut random = Random::from_env();
    for (aspect, tolerance) in [(1.0, 1e-14), (1e-3, 1e-11), (1e-6, 1e-7), (1e-8, 1e-7), (0.0, 1e-15)] {
        let mesh = meshes::needles(80, aspect, &mut random);
        let (baked, corners) = (mesh.baked(), mesh.corners_with_area());
        let distance = sdf_bake::MeshDistance::new(&baked, None);
        let mut worst = 0.0_f64;
        for _ in 0..4000 {
            let [a, b, c] = corners[random.below(corners.len())];
            let (to_b, to_c) = (random.between(-0.1, 1.1), random.between(-0.1, 1.1));
            let far = 10.0_f64.powf(random.between(-12.0, 0.0));
            let point = a + (b - a) * to_b + (c - a) * to_c * (1.0 - to_b) + random.point_in_cube(far);
            let exact = oracle::distance(&corners, point);
            let off = (distance.signed_distance(point.into()).abs() - exact).abs();
            worst = worst.max(off);
            assert!(off <= tolerance * 3.5, "aspect {aspect}: {off:e} off of {exact} at {point:?}");
        }
        println!("aspect {aspect}: at most {worst:e} off");
    }
}

#[test]
fn a_point_on_the_mesh_has_distance_zero() {
    let mut random = Random::from_env();
    let mesh = meshes::icosphere(2).turned(&random.rotation());
    let baked = mesh.baked();
    let distance = sdf_bake::MeshDistance::new(&baked, None);
    for [a, b, c] in mesh.corners() {
        let t = random.unit();
        for (point, tolerance) in [(a, 0.0), (a + (b - a) * t, 3e-16), (a + (b - a + (c - b) * t) * t, 3e-16)] {
            let found = distance.signed_distance(point.into()).abs();
            assert!(found <= tolerance, "{found} at {point:?}");
        }
    }
}

/// Squares of the coordinates overflow; the point is outside all the same, as far as the mesh's middle.
#[test]
fn a_point_beyond_all_squares_has_its_distance() {
    let mesh = meshes::cube().baked();
    for sign in [SignMethod::PseudoNormal, SignMethod::Winding] {
        let distance = MeshDistance::new(&mesh, Some(sign));
        for x in [1e149, 1e151, 1e155, 1e300, f64::INFINITY] {
            assert_eq!(distance.signed_distance([0.0, -x, 0.0]), x);
        }
        assert!((distance.signed_distance([3e200, 4e200, 0.0]) / 5e200 - 1.0).abs() < 1e-15);
    }
}
