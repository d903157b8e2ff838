//! Signs of solids so thin, so sharp, or so far from the origin that rounding decides which of their faces is nearest.

use sdf_bake::SignMethod::{PseudoNormal, Winding};
use sdf_bake::{MeshDistance, MeshSurface};
use sdf_core::nalgebra::{Rotation3, Vector3};

use crate::meshes::{self, Mesh};
use crate::oracle::{self, Baked};
use crate::random::Random;
use crate::signs::solid;

/// A block with a slot as wide as `gap`, open at one side.
fn slotted_block(gap: f64) -> Mesh {
    let outline =
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 0.0], [-0.5, 0.0], [-0.5, gap], [1.0, gap], [1.0, 1.0], [-1.0, 1.0]];
    let caps = [[0, 1, 3], [1, 2, 3], [0, 3, 4], [0, 4, 7], [4, 5, 7], [5, 6, 7]];
    meshes::prism(&outline, &caps, -1.0, 1.0)
}

/// Two triangles at each side of a parallelogram, cut along different diagonals: a solid of rounding alone.
fn parallelogram(random: &mut Random) -> Mesh {
    let mut corner = || [0; 3].map(|_| random.between(-10.0, 10.0).round() / 10.0);
    let ([a, b], origin) = ([corner(), corner()], corner());
    let at = |i: f64, j: f64| [0, 1, 2].map(|axis| origin[axis] + i * a[axis] + j * b[axis]);
    Mesh::new(&[at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)], &[[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
}

fn tetrahedron_with_a_flat_side(height: f64) -> Mesh {
    let points = [[0.0; 3], [1.0, 0.0, 0.0], [0.5, height, 0.0], [0.5, 0.5, 1.0]];
    Mesh::new(&points, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
}

/// A solid and where its inside is, but for what is as thin as rounding.
struct Solid {
    name: String,
    mesh: Mesh,
    is_inside: Box<dyn Fn(Vector3<f64>) -> bool>,
}

/// Thinner parts than this take no node of a grid, and give the oracle no digits.
const THIN: f64 = 1e-9;

fn solids(random: &mut Random) -> Vec<Solid> {
    let mut solids = vec![];
    for exponent in 2..=17 {
        let size = 10_f64.powi(-exponent);
        for is_turned in [false, true] {
            let turn = if is_turned { random.rotation() } else { Rotation3::identity() };
            let mut add = |name: &str, mesh: Mesh, is_inside_thin: fn(Vector3<f64>) -> bool| {
                let (name, mesh) = (format!("{name}, {size:e}, turned: {is_turned}"), mesh.turned(&turn));
                let is_inside: Box<dyn Fn(_) -> bool> = match size < THIN {
                    true => Box::new(move |point| is_inside_thin(turn.inverse() * point)),
                    false => Box::new(solid(&mesh)),
                };
                solids.push(Solid { name, mesh, is_inside });
            };
            add("plate", meshes::block([0.5, 0.5, size]), |_| false);
            add("slot", slotted_block(size), |point| point.amax() < 1.0);
            add("flat side", tetrahedron_with_a_flat_side(size), |_| false);
        }
        let [x, y, z] = [1.0, -0.9, 0.8].map(|part| part * 1e-3 / size);
        let far = meshes::tetrahedron().turned(&random.rotation()).moved(x, y, z);
        let is_inside = Box::new(solid(&far));
        solids.push(Solid { name: format!("tetrahedron at {x:e}"), mesh: far, is_inside });
    }
    let parallelograms = (0..60).map(|index| (format!("parallelogram {index}"), parallelogram(random)));
    solids.extend(parallelograms.map(|(name, mesh)| Solid { name, mesh, is_inside: Box::new(|_| false) }));
    solids
}

#[test]
fn no_node_has_the_wrong_sign_however_thin_sharp_or_far_away_the_solid_is() {
    let mut random = Random::from_env();
    for Solid { name, mesh, is_inside } in solids(&mut random) {
        let largest = mesh.corners().iter().flatten().map(|corner| corner.amax()).fold(0.0, f64::max);
        // Nearer to the mesh rounding decides the side.
        let on_surface = 2.0 * THIN * oracle::diagonal(&mesh) + 64.0 * f64::EPSILON * largest;
        let triangles = mesh.baked();
        let distance = MeshDistance::new(&triangles, None);
        let surface = MeshSurface::new(mesh.baked(), distance.sign_method(), distance.is_continuous());
        for (node, signed) in Baked::from_mesh(&mesh, None, 14).nodes() {
            if signed.abs() > on_surface {
                let exact = surface.nearest(node, 0, None).distance;
                let found = [signed, exact].map(|distance| distance < 0.0);
                let reason = distance.sign_reason();
                assert_eq!(found, [is_inside(node); 2], "{name}, {reason}: {signed}, {exact} at {node:?}");
            }
        }
    }
}

/// Whoever asks for pseudo-normals gets them, but no bound that needs their signs.
#[test]
fn a_folded_solid_is_told_by_winding_numbers_and_no_solid_to_pseudo_normals() {
    for (mesh, is_certain) in [
        (meshes::cube(), true),
        (meshes::block([0.5, 0.5, 1e-6]), true),
        (meshes::block([0.5, 0.5, 1e-9]), true),
        (tetrahedron_with_a_flat_side(1e-5), false),
        (meshes::block([0.5, 0.5, 1e-15]), false),
        (meshes::cube().moved(1e6, 0.0, 0.0), false),
    ] {
        let triangles = mesh.baked();
        let chosen = MeshDistance::new(&triangles, None);
        assert_eq!(chosen.sign_method(), if is_certain { PseudoNormal } else { Winding }, "{}", chosen.sign_reason());
        assert!(chosen.is_continuous());
        let requested = MeshDistance::new(&triangles, Some(PseudoNormal));
        assert_eq!(requested.sign_method(), PseudoNormal);
        assert_eq!(requested.is_continuous(), is_certain, "{}", requested.sign_reason());
    }
}
