//! Shells inside of the solid: what is left of a mesh without them bounds the same solid, and no more than that.

use sdf_bake::MeshDistance;
use sdf_core::nalgebra::Vector3;

use crate::meshes::{self, Mesh};
use crate::oracle;
use crate::random::Random;

/// Triangles with a side outside of the solid, by brute force: winding numbers a little beside their middles.
fn surface_of_solid(mesh: &Mesh) -> Vec<[Vector3<f64>; 3]> {
    let all = mesh.corners();
    let is_inside = |point| oracle::winding_number(&all, point).abs() >= 0.5;
    let is_surface = |corners: &&[Vector3<f64>; 3]| {
        let [a, b, c] = **corners;
        let step = (b - a).cross(&(c - a)).normalize() * 1e-6;
        let middle = (a + b + c) / 3.0;
        !is_inside(middle + step) || !is_inside(middle - step)
    };
    all.iter().filter(is_surface).copied().collect()
}

fn random_shell(random: &mut Random) -> Mesh {
    let turn = random.rotation();
    let shell = match random.below(4) {
        0 => meshes::cube(),
        1 => meshes::tetrahedron().moved(-0.25, -0.25, -0.25).scaled(2.0),
        2 => meshes::icosphere(1),
        _ => meshes::torus(1.0, 0.4, 8, 5),
    };
    shell.turned(&turn)
}

/// Shells in shells, each wound either way, apart from each other.
pub fn nested(random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    for tower in 0..3 {
        let mut size = 1.0;
        for _ in 0..1 + random.below(5) {
            // An inscribed ball of any of these bodies but the torus has a fifth of their size.
            let shell = match random.below(3) {
                0 => meshes::cube(),
                1 => meshes::icosphere(1),
                _ => meshes::l_solid().moved(-0.5, -0.5, -0.5),
            };
            let shell = shell.turned(&random.rotation()).scaled(size);
            let shell = if random.below(3) == 0 { shell.flipped() } else { shell };
            mesh = mesh.and(shell.moved(6.0 * f64::from(tower), 0.0, 0.0));
            size *= 0.2;
        }
    }
    mesh
}

#[test]
fn a_cube_in_a_cube_is_one_cube() {
    let mesh = meshes::cube().and(meshes::cube().scaled(0.5));
    let baked = mesh.baked().without_inner_shells();
    let report = baked.report();
    assert_eq!((report.inner_shells, report.inner_triangles, report.entangled_shells), (1, 12, 0));
    let distance = MeshDistance::new(&baked, None);
    assert_eq!(distance.sign_reason(), "pseudo-normal: closed, consistently wound, one shell");
    assert_eq!(distance.signed_distance([0.5, 0.0, 0.0]), -0.5);
    assert_eq!(distance.signed_distance([0.0; 3]), -1.0);
    let cavity = meshes::cube().and(meshes::cube().scaled(0.5).flipped()).baked().without_inner_shells();
    assert_eq!((cavity.report().inner_shells, cavity.triangle_count()), (0, 24));
}

/// A volume is held against the shell's own size: a small one is as certain.
#[test]
fn a_cube_of_any_size_in_a_cube_is_one_cube() {
    for size in [1e-3, 1e-5, 1e-8] {
        let baked = meshes::cube().and(meshes::cube().scaled(size)).baked().without_inner_shells();
        let report = baked.report();
        assert_eq!((report.inner_shells, report.inner_triangles, report.entangled_shells), (1, 12, 0), "{size}");
        assert_eq!(MeshDistance::new(&baked, None).signed_distance([0.0; 3]), -1.0, "{size}");
    }
}

#[test]
fn nested_shells_have_the_distances_of_the_surface_of_the_solid() {
    let mut random = Random::from_env();
    let mut dropped = 0;
    for round in 0..60 {
        let mesh = nested(&mut random);
        let baked = mesh.baked().without_inner_shells();
        let surface = surface_of_solid(&mesh);
        assert_eq!(baked.report().entangled_shells, 0, "round {round}");
        assert_eq!(baked.triangle_count(), surface.len(), "round {round}");
        dropped += baked.report().inner_shells;
        let distance = MeshDistance::new(&baked, None);
        let all = mesh.corners();
        for _ in 0..100 {
            let size = 10.0_f64.powf(random.between(-3.0, 0.3));
            let center = Vector3::new(6.0 * random.below(3) as f64, 0.0, 0.0);
            let point = center + random.point_in_cube(size);
            let magnitude = oracle::distance(&surface, point);
            let exact = if oracle::winding_number(&all, point).abs() >= 0.5 { -magnitude } else { magnitude };
            let found = distance.signed_distance(point.into());
            assert!((found - exact).abs() < 1e-12, "round {round}: {found} for {exact} at {point:?}");
        }
    }
    assert!(dropped > 40, "{dropped}");
}

/// Shells that cross are kept; the solid and the distances outside of it stay as they were.
#[test]
fn whatever_the_shells_the_solid_stays_and_so_do_the_distances_outside() {
    let mut random = Random::from_env();
    let (mut dropped, mut entangled) = (0, 0);
    for round in 0..60 {
        let mut mesh = Mesh::default();
        for _ in 0..2 + random.below(7) {
            let shell = random_shell(&mut random).scaled(10.0_f64.powf(random.between(-1.5, 0.3)));
            let [x, y, z] = random.point_in_cube(0.5).into();
            let shell = if random.below(3) == 0 { shell.flipped() } else { shell };
            mesh = mesh.and(shell.moved(x, y, z));
        }
        let baked = mesh.baked().without_inner_shells();
        dropped += baked.report().inner_shells;
        entangled += baked.report().entangled_shells;
        let all = mesh.corners();
        let distance = MeshDistance::new(&baked, None);
        for _ in 0..200 {
            let point = random.point_in_cube(1.5);
            let found = distance.signed_distance(point.into());
            let exact = oracle::signed_distance(&all, point);
            assert_eq!(found < 0.0, exact < 0.0, "round {round}: {found} for {exact} at {point:?}");
            if exact > 0.0 {
                assert!((found - exact).abs() < 1e-12, "round {round}: {found} for {exact} at {point:?}");
            } else {
                assert!(found <= exact + 1e-12, "round {round}: {found} for {exact} at {point:?}");
            }
        }
    }
    assert!(dropped > 3 && entangled > 50, "{dropped} {entangled}");
}

/// Two crossing shells around others: what lies in them counts twice, so nothing there may be dropped.
#[test]
fn shells_in_crossing_shells_are_kept() {
    let crossing =
        meshes::cube().and(meshes::cube().turned(&sdf_core::nalgebra::Rotation3::new([0.3, 0.4, 0.5].into())));
    let inner = |size: f64| meshes::icosphere(1).scaled(size);
    let mesh = crossing.and(inner(0.8)).and(inner(0.6).flipped()).and(inner(0.45).flipped()).and(inner(0.3).flipped());
    let baked = mesh.baked().without_inner_shells();
    assert_eq!((baked.report().inner_shells, baked.report().entangled_shells), (0, 2));
    assert!(MeshDistance::new(&baked, None).signed_distance([0.0; 3]) > 0.0);
}

/// Touching is exact: a shell with one corner on a face of another, and a shell that shares one.
#[test]
fn shells_that_touch_are_kept() {
    let outer = meshes::cube();
    let on_face = meshes::cube().scaled(0.25).turned(&sdf_core::nalgebra::Rotation3::new([0.3, 0.4, 0.5].into()));
    let lowest = on_face.points.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    let mut on_face = on_face.moved(0.1, 0.2, -1.0 - lowest);
    on_face.points.iter_mut().filter(|p| p.z < -1.0 + 1e-9).for_each(|p| p.z = -1.0);
    let at_corner = meshes::tetrahedron().scaled(0.5).moved(-1.0, -1.0, -1.0);
    for inner in [on_face, at_corner] {
        let baked = outer.clone().and(inner).baked().without_inner_shells();
        assert_eq!((baked.report().inner_shells, baked.report().entangled_shells), (0, 2));
    }
}

#[test]
fn an_open_mesh_and_a_doubled_one_stay_as_they_are() {
    let nested = meshes::cube().and(meshes::cube().scaled(0.5));
    let open = nested.clone().without(&[0]).baked().without_inner_shells();
    assert_eq!((open.triangle_count(), open.report().inner_shells), (23, 0));
    let [a, b, c] = nested.triangles[3];
    let doubled = nested.with_triangle([c, b, a]).baked().without_inner_shells();
    assert_eq!((doubled.triangle_count(), doubled.report().inner_shells), (25, 0));
}
