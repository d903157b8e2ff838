use super::*;
use crate::testing::random;

#[test]
fn clear_edges_reach_the_nodes_that_a_search_step_by_step_reaches() {
    let mut state = 53;
    println!("seed {state}");
    let strides = [1, SIDE + 2, (SIDE + 2) * (SIDE + 1)];
    for round in 0..200 {
        let min_sum = 0.9 + 0.4 * random(&mut state) as f32;
        let distances: Vec<f32> = (0..strides[2] * (SIDE + 1)).map(|_| random(&mut state).abs() as f32).collect();
        let start = [0, 3, 6].map(|shift| ((round * 2_654_435_761_usize) >> shift) % SIDE);
        let cube = SubCube::new(start, if round % 2 == 0 { SIDE } else { SIDE / 2 });
        let is_inside = |node: &[usize; 3]| (0..3).all(|axis| node[axis] / cube.side == start[axis] / cube.side);
        let distance = |node: [usize; 3]| distances[(0..3).map(|axis| node[axis] * strides[axis]).sum::<usize>()];
        let mut wanted = [0; SIDE];
        let mut waiting = vec![start];
        while let Some(node) = waiting.pop() {
            let [x, y, z] = node;
            wanted[z] |= 1 << (8 * y + x);
            for axis in 0..3 {
                for step in [1, usize::MAX] {
                    let mut next = node;
                    next[axis] = node[axis].wrapping_add(step);
                    let is_new = |[x, y, z]: [usize; 3]| wanted[z] >> (8 * y + x) & 1 == 0;
                    let is_in_cube = next[axis] < SIDE && is_inside(&next);
                    if is_in_cube && distance(node) + distance(next) > min_sum && is_new(next) {
                        waiting.push(next);
                    }
                }
            }
        }
        let found = ClearEdges::new(&distances, strides, min_sum).restricted_to(&cube).reachable_from(start);
        assert_eq!(found, wanted, "round {round}");
        assert_faces(&cube, &found);
    }
}

/// Every edge out of the cube from one of its nodes is visited once.
fn assert_faces(cube: &SubCube, nodes: &NodeBits) {
    let mut found = vec![];
    cube.visit_faces(nodes, |node, axis, is_last| found.push((node, axis, is_last)));
    let mut wanted = vec![];
    for index in 0..SIDE * SIDE * SIDE {
        let node = [index % SIDE, index / SIDE % SIDE, index / SIDE / SIDE];
        if nodes[node[2]] >> (index % 64) & 1 == 1 {
            let ends = |axis: usize| [cube.first[axis], cube.first[axis] + cube.side - 1].map(|end| node[axis] == end);
            wanted.extend((0..3).filter(|axis| ends(*axis)[0]).map(|axis| (node, axis, false)));
            wanted.extend((0..3).filter(|axis| ends(*axis)[1]).map(|axis| (node, axis, true)));
        }
    }
    found.sort_unstable();
    wanted.sort_unstable();
    assert_eq!(found, wanted);
}
