use sdf_core::grid::Lattice;

use super::*;
use crate::nearest::SIDE;
use crate::testing::{random, random_vector};

/// A cube with a pyramid on each face, of random height outward or inward.
fn spiky_solid(state: &mut u64) -> TriangleMesh {
    let corner = |index: u32| [0, 1, 2].map(|axis| f64::from(index >> axis & 1));
    let mut points: Vec<[f64; 3]> = (0..8).map(corner).collect();
    let mut triangles = vec![];
    for (face, corners) in
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]].into_iter().enumerate()
    {
        let mut apex = [0.5; 3];
        apex[[2, 1, 0][face / 2]] = (face % 2) as f64 + 0.3 * random(state);
        points.push(apex);
        triangles.extend((0..4).map(|side| [corners[side], corners[(side + 1) % 4], 8 + face as u32]));
    }
    TriangleMesh::new(&points, &triangles).unwrap()
}

#[test]
fn the_sign_of_a_node_does_not_depend_on_the_neighbour_it_is_measured_from_nor_on_its_distance() {
    let mut state = 11;
    println!("seed {state}");
    let [mut clear, mut bounded] = [0; 2];
    for _ in 0..20 {
        let mesh = spiky_solid(&mut state);
        let mesh = MeshDistance::new(&mesh, None);
        assert_eq!(mesh.sign_method(), SignMethod::PseudoNormal);
        let origin = (random_vector(&mut state) * 0.5).into();
        let lattice = Lattice::new(origin, 0.1, [SIDE as u32; 3]).unwrap();
        let nodes = PacketNodes::new(&lattice, [0; 3], [SIDE; 3]);
        let [mut search, mut near_search] = [0; 2].map(|_| PacketSearch::new(mesh.tree()));
        search.find(&nodes, f64::INFINITY, f64::INFINITY);
        near_search.find(&nodes, f64::INFINITY, 0.1);
        for index in 0..SIDE * SIDE * SIDE {
            let step = [index % SIDE, index / SIDE % SIDE, index / SIDE / SIDE];
            let point = nodes.position(step) + random_vector(&mut state) * 0.3;
            let neighbour = MeasuredPoint { point, nearest: mesh.nearest(point, 0) };
            let alone = mesh.nearest_to_node(&search, &nodes, step, None);
            clear += usize::from(mesh.is_segment_clear(&neighbour, nodes.position(step), alone.distance));
            let found = mesh.nearest_to_node(&search, &nodes, step, Some(neighbour));
            assert_eq!(found.is_inside, alone.is_inside, "{point:?} {:?}", nodes.position(step));
            for neighbour in [None, Some(neighbour)] {
                let found = mesh.nearest_to_node(&near_search, &nodes, step, neighbour);
                assert_eq!(found.is_inside, alone.is_inside, "{point:?} {:?}", nodes.position(step));
                assert!(found.distance == alone.distance || 0.1 < found.distance && found.distance < alone.distance);
                bounded += usize::from(found.distance < alone.distance);
            }
        }
    }
    assert!(clear > 1000 && bounded > 1000, "{clear} {bounded}");
}
