use super::*;
use crate::testing::{random, random_vector};
use crate::{TriangleMesh, lattice_around};

/// Some tetrahedra, and some triangles that make the mesh open.
fn mesh(tetrahedra: u32, triangles: u32, state: &mut u64) -> TriangleMesh {
    let (mut points, mut corners) = (vec![], vec![]);
    for part in 0..tetrahedra + triangles {
        let (center, size) = (random_vector(state), 0.02 + 0.3 * random(state).abs());
        let first = 4 * part;
        points.extend((0..4).map(|_| <[f64; 3]>::from(center + random_vector(state) * size)));
        let tetrahedron = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|face: [u32; 3]| face.map(|c| first + c));
        corners.extend(&tetrahedron[..if part < tetrahedra { 4 } else { 1 }]);
    }
    TriangleMesh::new(&points, &corners).unwrap()
}

#[test]
fn distances_and_magnitudes_are_those_of_every_node_searched_by_itself() {
    let mut state = 47;
    println!("seed {state}");
    for (tetrahedra, triangles, cells) in [(1, 0, 20.0), (1, 0, 150.0), (9, 0, 150.0), (0, 40, 90.0), (3, 1, 200.0)] {
        let mesh = mesh(tetrahedra, triangles, &mut state);
        let lattice = lattice_around(&mesh.bounds(), mesh.bounds().longest_side() / cells, 2).unwrap();
        let mesh = MeshDistance::new(&mesh, None);
        let map = BrickMap::new(&mesh, &lattice, 3.0 * lattice.spacing());
        for index in 0..map.slot_count() {
            let at = middle(&lattice, map.slot(index).map(|n| n as usize));
            let wanted = mesh.nearest(at, 0).distance as f32;
            assert_eq!(map.distances[index].abs(), wanted, "slot {index}");
        }
        let mut tilted = 0;
        let nodes: Vec<[u32; 3]> = map.coarse_nodes().collect();
        for (index, node) in nodes.into_iter().enumerate() {
            let at = Vector3::from(lattice.node(node.map(|n| n * BRICK)));
            let distance = mesh.nearest(at, 0).distance as f32;
            let is_inside = mesh.signed_distance(at.into()).is_sign_negative();
            let wanted = if is_inside { map.inside_magnitude(distance) } else { map.magnitude(node, distance) };
            assert_eq!(map.magnitudes[index], wanted, "{node:?}");
            tilted += usize::from(!is_inside && map.magnitudes[index] > map.magnitude(node, 0.0));
            if let Some(windings) = &map.windings {
                assert!(windings.node_distances[index].abs() <= distance * (1.0 + f32::EPSILON), "{node:?}");
            }
        }
        assert!(tilted > 0, "{tetrahedra} {triangles}");
    }
}
