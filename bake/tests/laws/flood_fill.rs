//! Signs by flood fill: those of each node's own winding number.

use sdf_bake::{MeshDistance, SignMethod};
use sdf_core::nalgebra::Vector3;

use crate::meshes;
use crate::oracle::Baked;
use crate::random::Random;

#[test]
fn every_node_has_the_sign_of_its_own_winding_number() {
    let mut random = Random::from_env();
    let turn = random.rotation();
    let holed = meshes::icosphere(3).without(&[3, 17, 18, 19, 20, 400, 401, 402, 403]);
    let lidless = meshes::cube().without(&[10, 11]).refined().refined();
    for (name, mesh) in [
        ("closed", meshes::star(1, 3, 1.5).turned(&turn)),
        ("thin", meshes::block([1.0, 0.8, 0.01]).turned(&turn)),
        ("on the nodes", meshes::cube().refined()),
        ("spindle", meshes::torus(0.5, 0.8, 20, 14)),
        ("nested", meshes::icosphere(2).and(meshes::icosphere(2).scaled(0.6)).and(meshes::cube().scaled(0.2))),
        ("overlapping", meshes::icosphere(2).and(meshes::icosphere(2).moved(0.7, 0.3, 0.2))),
        ("one inward", meshes::icosphere(2).and(meshes::icosphere(1).flipped().moved(0.7, 0.3, 0.2))),
        ("holed", holed.clone()),
        ("holed and flipped", holed.clone().flipped()),
        ("lidless", lidless.clone()),
        ("lidless, turned", lidless.clone().turned(&turn)),
        ("two lidless", lidless.clone().and(lidless.scaled(0.5).turned(&turn))),
        ("sheet", meshes::sheet(9).turned(&turn)),
        ("strip", meshes::moebius_strip(30)),
        ("a few triangles", meshes::soup(12, 0.8, &mut random)),
        ("many boundaries", meshes::soup(300, 0.5, &mut random)),
        ("needles", meshes::needles(100, 0.01, &mut random)),
    ] {
        let mesh = mesh.baked();
        let distance = MeshDistance::new(&mesh, Some(SignMethod::Winding));
        let is_inside = |node: Vector3<f64>| distance.winding_number(node.into()).abs() >= 0.5;
        // Of a node on an open mesh rounding may decide, and then it is outside: its distance is zero on either side.
        let is_free = |signed: f64, rounding: f64| signed.abs() <= rounding && !distance.is_continuous();
        let dense = Baked::new(&distance, &mesh.bounds(), 16);
        for (node, signed) in dense.nodes() {
            assert!(
                is_free(signed, 1e-12) || signed.is_sign_negative() == is_inside(node),
                "{name}: {signed} at {node:?}"
            );
        }
        let sparse =
            sdf_bake::sparse::bake::<f32>(&distance, &dense.lattice, 3.0 * dense.lattice.spacing(), &|_| ()).unwrap();
        // Bricks are measured in f32, coordinates are up to 2.
        let single = 2.0 * f64::from(f32::EPSILON);
        for (brick, samples) in sparse.slots.iter().zip(sparse.samples.chunks(512)) {
            for (index, signed) in (0..).zip(samples) {
                let step = [index % 8, index / 8 % 8, index / 64];
                let node = dense.lattice.node(std::array::from_fn(|axis| brick[axis] * 8 + step[axis]));
                assert!(
                    is_free((*signed).into(), single) || signed.is_sign_negative() == is_inside(node.into()),
                    "{name}: {signed} at {node:?}, sparse"
                );
            }
        }
    }
}

/// Many shells have the largest errors of the sum, and far from the origin nodes are rounded most.
#[test]
fn no_sign_leaks_through_many_shells_nor_far_from_the_origin() {
    let shell = |k: u32| meshes::icosphere(1).scaled(1.0 - 0.0003 * f64::from(k));
    let far = meshes::cube().and(meshes::cube().scaled(0.6)).moved(1e9, 3e8, -1e9);
    for (name, mesh) in [("many shells", (1..16).fold(shell(0), |shells, k| shells.and(shell(k)))), ("far", far)] {
        let mesh = mesh.baked();
        let distance = MeshDistance::new(&mesh, Some(SignMethod::Winding));
        for cells in (9..30).step_by(2) {
            for (node, signed) in Baked::new(&distance, &mesh.bounds(), cells).nodes() {
                let is_inside = distance.winding_number(node.into()).abs() >= 0.5;
                assert_eq!(signed.is_sign_negative(), is_inside, "{name}, {cells} cells: {signed} at {node:?}");
            }
        }
    }
}
