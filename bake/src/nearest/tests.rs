//! Nearest triangles of packets of nodes, compared with all triangles and with searches node by node.

use sdf_core::nalgebra::Vector3;

use super::*;
use crate::TriangleMesh;
use crate::bvh::PruneBound;
use crate::testing::{instruction_sets, random, random_vector};
use crate::triangle::nearest_on_triangle;

/// Squares in the x-y plane cut in two, their corners moved by up to `height` along z.
fn sheet(cells: u32, height: f64, state: &mut u64) -> Vec<[Vector3<f64>; 3]> {
    let row = cells + 1;
    let corners: Vec<Vector3<f64>> = (0..row * row)
        .map(|index| Vector3::new(f64::from(index % row), f64::from(index / row), height * random(state)))
        .collect();
    let at = |x: u32, y: u32| corners[(y * row + x) as usize];
    let squares = (0..cells).flat_map(|y| (0..cells).map(move |x| (x, y)));
    squares
        .flat_map(|(x, y)| {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}

/// Random triangles of any winding and length; their width is about `thickness` of their length.
fn soup(triangles: usize, size: f64, thickness: f64, state: &mut u64) -> Vec<[Vector3<f64>; 3]> {
    let triangle = |_| {
        let a = random_vector(state) * 4.0;
        let b = a + random_vector(state) * size;
        let c = a + (b - a) * random(state) + random_vector(state) * (size * thickness);
        [a, b, c]
    };
    (0..triangles).map(triangle).collect()
}

fn meshes(state: &mut u64) -> Vec<Vec<[Vector3<f64>; 3]>> {
    let one = soup(1, 1.0, 1.0, state);
    let mut without_area = soup(40, 1.0, 0.0, state);
    without_area.extend(soup(10, 0.0, 0.0, state));
    without_area.extend(one.clone());
    let mut twice = soup(60, 1.0, 1.0, state);
    // The same positions with the other winding: equally near, but another triangle.
    twice.extend(twice.clone().into_iter().map(|[a, b, c]| [a, c, b]));
    vec![
        sheet(9, 0.0, state),
        sheet(9, 0.5, state),
        soup(200, 1.0, 1.0, state),
        soup(200, 0.05, 1.0, state),
        soup(50, 30.0, 1.0, state),
        soup(100, 1.0, 1e-3, state),
        soup(100, 1.0, 1e-9, state),
        one,
        without_area,
        twice,
    ]
}

fn mesh_of(triangles: &[[Vector3<f64>; 3]], scale: f64) -> TriangleMesh {
    let points: Vec<[f64; 3]> = triangles.iter().flatten().map(|corner| (corner * scale).into()).collect();
    let indices: Vec<[u32; 3]> = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    TriangleMesh::new(&points, &indices).unwrap()
}

fn nodes(first: Vector3<f64>, spacing: f64, counts: [usize; 3]) -> PacketNodes {
    let axes = [0, 1, 2].map(|axis| std::array::from_fn(|step| first[axis] + spacing * step as f64));
    PacketNodes { axes, spacing, counts }
}

/// Slot and squared distance of the nearest triangle, by exhaustive search; among equally near ones the first.
fn nearest_of_all(tree: &Bvh, point: Vector3<f64>) -> (usize, f64) {
    let all = tree.corners.iter().map(|corners| nearest_on_triangle(point, *corners).distance_sq);
    all.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
}

fn steps_of(counts: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let [x, y, z] = counts;
    (0..x * y * z).map(move |index| [index % x, index / x % y, index / x / y])
}

#[test]
fn each_node_of_a_packet_has_the_first_of_the_nearest_of_all_triangles_on_any_instruction_set() {
    let mut state = 3;
    println!("seed {state}");
    for triangles in meshes(&mut state) {
        for scale in [1.0, 2.0_f64.powi(-90), 1e25] {
            let mesh = mesh_of(&triangles, scale);
            for spacing in [1.0, 0.25, 0.03, 5.0] {
                // On the corners of the sheets, or anywhere; the last far away.
                let first = random_vector(&mut state) * 4.0;
                let rounded = (first / spacing).map(|x| x.round() * spacing);
                let first = [first, rounded, first * 60.0][(random(&mut state).abs() * 2.3) as usize];
                let counts = [8, 3, 5].map(|count| if spacing == 1.0 { SIDE } else { count });
                let nodes = nodes(first * scale, spacing * scale, counts);
                let wanted: Vec<_> = {
                    let tree = Bvh::new(&mesh);
                    steps_of(counts).map(|step| nearest_of_all(&tree, nodes.position(step))).collect()
                };
                for (arch, max_expanded) in
                    instruction_sets().into_iter().flat_map(|arch| [(arch, MAX_EXPANDED), (arch, 0)])
                {
                    let mut tree = Bvh::with_discs_above(&mesh, 0);
                    tree.arch = arch;
                    let mut packet = PacketSearch { max_expanded, ..PacketSearch::new(&tree) };
                    assert!(packet.find(&nodes, f64::INFINITY, f64::INFINITY));
                    for (step, wanted) in steps_of(counts).zip(&wanted) {
                        let found = packet.nearest(step);
                        let found = (found.slot.unwrap() as usize, found.distance_sq);
                        assert_eq!(found, *wanted, "{arch:?} {nodes:?} {step:?} of {} at {scale}", triangles.len());
                        let alone = tree.nearest(nodes.position(step), 0);
                        assert_eq!((alone.slot, alone.on_triangle.distance_sq), *wanted);
                    }
                }
            }
        }
    }
}

/// Sphere of triangles much smaller than a packet, its radius changed at random by up to `bumps`.
fn fine_ball(rings: u32, bumps: f64, state: &mut u64) -> Vec<[Vector3<f64>; 3]> {
    let row = rings + 1;
    let corner = |index: u32| {
        let [along, down] = [index % row, index / row].map(|n| f64::from(n) / f64::from(rings));
        let (sin, cos) = (down * std::f64::consts::PI).sin_cos();
        let around = (along * std::f64::consts::TAU).sin_cos();
        Vector3::new(sin * around.1, sin * around.0, cos) * (1.0 + bumps * random(state))
    };
    let corners: Vec<Vector3<f64>> = (0..row * row).map(corner).collect();
    let at = |x: u32, y: u32| corners[(y * row + x) as usize];
    let squares = (0..rings).flat_map(|y| (0..rings).map(move |x| (x, y)));
    squares
        .flat_map(|(x, y)| {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}

/// Meshes of so many triangles that octants get nodes of the tree, and expand them later.
fn fine_meshes(state: &mut u64) -> Vec<Vec<[Vector3<f64>; 3]>> {
    let one = soup(1, 1.0, 1.0, state);
    let many_times = vec![one[0]; 3000];
    let mut at_one_point = soup(20_000, 1e-7, 1.0, state);
    at_one_point.iter_mut().flatten().for_each(|corner| *corner *= 1e-6);
    at_one_point.extend(one);
    let far_off = fine_ball(60, 0.01, state).into_iter();
    let far_off = far_off.map(|corners| corners.map(|corner| corner + Vector3::new(1e6, -1e6, 3e5))).collect();
    vec![
        fine_ball(100, 0.0, state),
        fine_ball(100, 0.02, state),
        sheet(130, 0.0, state),
        sheet(130, 0.5, state),
        soup(40_000, 0.02, 1.0, state),
        soup(20_000, 0.02, 1e-6, state),
        many_times,
        at_one_point,
        far_off,
    ]
}

#[test]
fn each_node_of_a_packet_has_the_nearest_triangle_of_a_search_by_itself_on_meshes_much_finer_than_the_packet() {
    let mut state = 5;
    println!("seed {state}");
    let mut heights = [0; 8];
    for triangles in fine_meshes(&mut state) {
        let mesh = mesh_of(&triangles, 1.0);
        let bounds = mesh.bounds();
        let side = bounds.longest_side();
        let center = Vector3::from_fn(|axis, _| 0.5 * (bounds.min[axis] + bounds.max[axis]));
        let mut tree = Bvh::with_discs_above(&mesh, 0);
        for round in 0..12 {
            let spacing = side * [0.3, 0.02, 0.05, 0.15][round % 4];
            // Around the center, across the surface, and far away.
            let first = center + random_vector(&mut state) * (side * [0.1, 0.6, 4.0][round % 3]);
            let counts = if round % 2 == 0 { [SIDE; 3] } else { [3, 8, 5] };
            let nodes = nodes(first - Vector3::repeat(3.5 * spacing), spacing, counts);
            let on_mesh = tree.nearest(nodes.center([0; 3], SIDE), 0).on_triangle.point;
            let bound = PruneBound::new(nodes.ends([0; 3], SIDE), on_mesh);
            let wanted: Vec<_> = steps_of(counts).map(|step| tree.nearest(nodes.position(step), 0)).collect();
            let (slot, distance_sq) = nearest_of_all(&tree, nodes.position([0; 3]));
            assert_eq!((wanted[0].slot, wanted[0].on_triangle.distance_sq), (slot, distance_sq));
            for (arch, max_expanded) in instruction_sets().into_iter().cycle().zip([MAX_EXPANDED, 20, 0]) {
                heights[tree.candidates_within(&bound, max_expanded, &mut vec![], &mut vec![])] += 1;
                tree.arch = arch;
                let mut packet = PacketSearch { max_expanded, ..PacketSearch::new(&tree) };
                assert!(packet.find(&nodes, f64::INFINITY, f64::INFINITY));
                for (step, wanted) in steps_of(counts).zip(&wanted) {
                    let found = packet.nearest(step);
                    let wanted = (wanted.slot, wanted.on_triangle.distance_sq);
                    assert_eq!(
                        (found.slot.unwrap() as usize, found.distance_sq),
                        wanted,
                        "{arch:?} {nodes:?} {step:?}"
                    );
                }
            }
        }
    }
    assert!(heights[1..4].iter().all(|count| *count > 10), "{heights:?}");
}

#[test]
fn a_packet_finds_the_same_whatever_was_searched_before_it() {
    let mut state = 9;
    println!("seed {state}");
    let mesh = mesh_of(&fine_ball(40, 0.1, &mut state), 1.0);
    let tree = Bvh::new(&mesh);
    let mut packet = PacketSearch::new(&tree);
    for _ in 0..100 {
        let counts = [0; 3].map(|_| 1 + (random(&mut state).abs() * 7.9) as usize);
        let nodes = nodes(random_vector(&mut state) * 1.5, 0.04, counts);
        assert!(packet.find(&nodes, f64::INFINITY, f64::INFINITY));
        for step in steps_of(counts) {
            let (found, alone) = (packet.nearest(step), tree.nearest(nodes.position(step), 0));
            assert_eq!((found.slot.unwrap() as usize, found.distance_sq), (alone.slot, alone.on_triangle.distance_sq));
        }
    }
}

#[test]
fn a_packet_is_beyond_only_if_no_node_is_within_the_required_distance() {
    let mut state = 7;
    let mesh = mesh_of(&soup(100, 1.0, 1.0, &mut state), 1.0);
    let tree = Bvh::new(&mesh);
    let mut packet = PacketSearch::new(&tree);
    let mut beyond = 0;
    for _ in 0..200 {
        let nodes = nodes(random_vector(&mut state) * 6.0, 0.3, [SIDE; 3]);
        let distances =
            steps_of([SIDE; 3]).map(|step| tree.nearest(nodes.position(step), 0).on_triangle.distance_sq.sqrt());
        let nearest = distances.fold(f64::INFINITY, f64::min);
        assert!(packet.find(&nodes, nearest, f64::INFINITY), "{nodes:?}");
        beyond += u32::from(!packet.find(&nodes, 0.5 * nearest, f64::INFINITY));
    }
    assert!(beyond > 20, "{beyond}");
}

#[test]
fn a_packet_measures_nodes_within_the_maximum_distance_and_bounds_the_others_from_below() {
    let mut state = 15;
    println!("seed {state}");
    let [mut measured, mut bounded] = [0; 2];
    for triangles in meshes(&mut state).into_iter().chain([fine_ball(60, 0.02, &mut state)]) {
        let mesh = mesh_of(&triangles, 1.0);
        let mut tree = Bvh::new(&mesh);
        for (round, arch) in instruction_sets().into_iter().cycle().take(12).enumerate() {
            tree.arch = arch;
            // Also so far out that squares overflow f32.
            let wide = [1.0, 1.0, 1e20][round % 3];
            let far = [0.0, 0.1, 0.5, 2.0][round % 4] * wide;
            let nodes = nodes(random_vector(&mut state) * 3.0 * wide, [0.2, 0.05][round % 2] * wide, [SIDE; 3]);
            let mut packet = PacketSearch::new(&tree);
            assert!(packet.find(&nodes, f64::INFINITY, far));
            for step in steps_of([SIDE; 3]) {
                let (found, alone) = (packet.nearest(step), tree.nearest(nodes.position(step), 0));
                let distance = alone.on_triangle.distance_sq.sqrt();
                let Some(slot) = found.slot else {
                    let lower = found.distance_sq.sqrt();
                    assert!(far < lower && lower <= distance, "{arch:?} {nodes:?} {step:?}: {lower} {distance}");
                    bounded += 1;
                    continue;
                };
                assert_eq!((slot as usize, found.distance_sq), (alone.slot, alone.on_triangle.distance_sq));
                measured += 1;
            }
        }
    }
    assert!(measured > 1000 && bounded > 10_000, "{measured} {bounded}");
}

#[test]
fn the_ends_of_a_cube_enclose_its_nodes_that_belong_to_the_packet() {
    let nodes = nodes(Vector3::new(-3.0, 0.1, 7.0), 0.3, [8, 3, 6]);
    for side in [2, 4, 8] {
        for first in steps_of([SIDE / side; 3]).map(|part| part.map(|n| n * side)) {
            let ends = nodes.ends(first, side);
            for step in steps_of([side; 3]).map(|step| [0, 1, 2].map(|axis| first[axis] + step[axis])) {
                let (is_in_packet, node) = (nodes.contains(step), nodes.position(step));
                assert!(!is_in_packet || (0..3).all(|axis| (ends[axis][0]..=ends[axis][1]).contains(&node[axis])));
            }
        }
    }
}
