//! Scanned and modelled meshes, if the machine has them.

use sdf_bake::{MeshDistance, TriangleMesh};
use sdf_core::nalgebra::Vector3;

use crate::meshes::Mesh;
use crate::oracle::{self, Baked};

/// `None` if the file does not exist.
fn read(name: &str) -> Option<Mesh> {
    let path = format!("{}/../../shared/meshes/{name}.obj", env!("CARGO_MANIFEST_DIR"));
    let Ok(text) = std::fs::read_to_string(path) else {
        println!("{name}: no such file, skipped");
        return None;
    };
    let mut mesh = Mesh::default();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let mut next = || words.next().unwrap().parse::<f64>().unwrap();
                mesh.points.push(Vector3::new(next(), next(), next()));
            }
            Some("f") => {
                let index = |word: &str| word.split('/').next().unwrap().parse::<u32>().unwrap() - 1;
                let corners: Vec<u32> = words.map(index).collect();
                mesh.triangles.extend((2..corners.len()).map(|last| [corners[0], corners[last - 1], corners[last]]));
            }
            _ => {}
        }
    }
    Some(mesh)
}

#[test]
fn a_scanned_mesh_does_not_leak_and_has_the_signs_and_distances_of_brute_force() {
    for name in ["cow", "spot", "teapot", "stanford-bunny", "fandisk"] {
        let Some(mesh) = read(name) else { continue };
        let triangles: TriangleMesh = mesh.baked();
        let distance = MeshDistance::new(&triangles, None);
        println!("{name}: {}", distance.sign_reason());
        let baked = Baked::new(&distance, &triangles.bounds(), 48);
        let (corners, bounds) = (mesh.corners(), triangles.bounds());
        let is_outside = |node: &Vector3<f64>| (0..3).any(|k| node[k] < bounds.min[k] || node[k] > bounds.max[k]);
        let inside = baked.nodes().filter(|(_, signed)| *signed < 0.0).count();
        assert!(inside > 500, "{name}: {inside} nodes inside");
        for (node, signed) in baked.nodes().filter(|(node, _)| is_outside(node)) {
            assert!(signed > 0.0, "{name}: {signed} at {node:?}, outside the mesh's box");
        }
        // Brute force over all triangles is slow, so only some nodes are compared.
        let step = (baked.grid.distances.len() * corners.len() / 2_000_000).max(1);
        for (node, signed) in baked.nodes().step_by(step) {
            let exact = oracle::distance(&corners, node);
            assert!((signed.abs() - exact).abs() <= 6e-8 * exact + 1e-12, "{name}: {signed}, {exact} at {node:?}");
            let winding = oracle::winding_number(&corners, node);
            // Reoriented faces and holes change the winding number by less than a quarter.
            if (winding.abs() - 0.5).abs() > 0.25 {
                assert_eq!(signed < 0.0, winding.abs() > 0.5, "{name}: {signed}, {winding} at {node:?}");
            }
        }
    }
}
