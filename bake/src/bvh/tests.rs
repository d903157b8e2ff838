//! Queries of the tree, compared with all triangles one by one.

use std::ops::ControlFlow;

use super::*;
use crate::testing::random;
use crate::triangle::nearest_on_triangle;

/// `cells` by `cells` squares in the x-y plane cut in two, their corners moved by up to `height` along z.
fn sheet(cells: u32, height: f64, state: &mut u64) -> TriangleMesh {
    let (mut points, mut triangles) = (vec![], vec![]);
    for index in 0..(cells + 1) * (cells + 1) {
        let [x, y] = [index % (cells + 1), index / (cells + 1)];
        points.push([f64::from(x), f64::from(y), height * random(state)]);
        if x < cells && y < cells {
            triangles.extend([[index, index + 1, index + cells + 2], [index, index + cells + 2, index + cells + 1]]);
        }
    }
    TriangleMesh::new(&points, &triangles).unwrap()
}

fn soup(triangles: u32, thickness: f64, state: &mut u64) -> TriangleMesh {
    let mut points = vec![];
    for _ in 0..triangles {
        let [a, b] = [0, 1].map(|_| Vector3::from_fn(|_, _| random(state)));
        let c = a + (b - a) * random(state) + Vector3::from_fn(|_, _| thickness * random(state));
        points.extend([a, b, c].map(<[f64; 3]>::from));
    }
    let triangles: Vec<[u32; 3]> = (0..triangles).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    TriangleMesh::new(&points, &triangles).unwrap()
}

#[test]
fn the_nearest_triangle_is_the_first_of_the_equally_near_whatever_the_guess() {
    let mut state = 7;
    for mesh in [
        sheet(9, 0.0, &mut state),
        sheet(9, 0.4, &mut state),
        soup(150, 0.5, &mut state),
        soup(150, 1e-4, &mut state),
        soup(1, 0.5, &mut state),
    ] {
        let tree = Bvh::new(&mesh);
        let bounds = mesh.bounds();
        for round in 0..200 {
            // Half of the points stand where many triangles are equally near: on corners and above them.
            let corner = tree.corners[round % tree.corners.len()][0];
            let point = match round % 4 {
                0 => corner,
                1 => corner + Vector3::z(),
                _ => Vector3::from_fn(|axis, _| {
                    let fraction = 0.7 * random(&mut state) + 0.5;
                    bounds.min[axis] + fraction * (bounds.max[axis] - bounds.min[axis]) + 0.1 * random(&mut state)
                }),
            };
            let all = tree.corners.iter().map(|corners| nearest_on_triangle(point, *corners).distance_sq);
            let (first, min_sq) = all.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            for guess in 0..tree.corners.len() {
                let found = tree.nearest(point, guess);
                assert_eq!((found.slot, found.on_triangle.distance_sq), (first, min_sq), "{point:?} from {guess}");
            }
        }
    }
}

#[test]
fn a_triangle_nearer_to_a_point_of_a_box_than_another_point_is_a_candidate() {
    let mut state = 17;
    println!("seed {state}");
    let mut excluded = 0;
    for mesh in [sheet(20, 0.3, &mut state), soup(500, 0.1, &mut state), soup(3, 0.5, &mut state)] {
        let tree = Bvh::new(&mesh);
        let bounds = mesh.bounds();
        for _ in 0..200 {
            let anywhere = |state: &mut u64| {
                Vector3::from_fn(|axis, _| {
                    let fraction = random(state) + 0.5;
                    bounds.min[axis] + fraction * (bounds.max[axis] - bounds.min[axis]) + random(state)
                })
            };
            let near = anywhere(&mut state);
            let low = anywhere(&mut state);
            let ends = [0, 1, 2].map(|axis| [low[axis], low[axis] + 0.3 * random(&mut state).abs()]);
            let bound = PruneBound::new(ends, near);
            let (mut nodes, mut slots) = (vec![], vec![]);
            let height = tree.candidates_within(&bound, usize::MAX, &mut nodes, &mut slots);
            assert_eq!(height, 1);
            tree.expand(1, &nodes, &bound, &mut slots);
            excluded += tree.corners.len() - slots.len();
            for (slot, corners) in tree.corners.iter().enumerate() {
                let is_nearer = (0..8_usize).any(|corner| {
                    let point = Vector3::from_fn(|axis, _| ends[axis][corner >> axis & 1]);
                    nearest_on_triangle(point, *corners).distance_sq <= (point - near).norm_squared()
                });
                assert!(!is_nearer || slots.contains(&(slot as u32)), "{slot} {bound:?}");
            }
        }
    }
    assert!(excluded > 30_000, "{excluded}");
}

#[test]
fn a_box_meets_the_triangles_whose_boxes_it_meets() {
    let mut state = 11;
    let mesh = soup(200, 0.3, &mut state);
    let tree = Bvh::new(&mesh);
    for _ in 0..200 {
        let [a, b] = [0, 1].map(|_| Vector3::from_fn(|_, _| random(&mut state)));
        let (min, max) = (a.inf(&b), a.sup(&b));
        let mut found = vec![];
        tree.visit_overlapping(min, max, |slot| {
            found.push(slot);
            ControlFlow::Continue(())
        });
        found.sort_unstable();
        let meets = |corners: &[Vector3<f64>; 3]| {
            let [low, high] = box_around(corners);
            (0..3).all(|axis| low[axis] <= max[axis] && min[axis] <= high[axis])
        };
        let wanted: Vec<usize> = (0..tree.corners.len()).filter(|slot| meets(&tree.corners[*slot])).collect();
        assert_eq!(found, wanted);
    }
}

/// Two tetrahedra, one in the other.
fn nested_tetrahedra() -> TriangleMesh {
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let inner = corners.map(|corner: [f64; 3]| corner.map(|x| 0.1 * x));
    let faces = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
    let inner_faces = faces.map(|face: [u32; 3]| face.map(|corner| corner + 4));
    TriangleMesh::new(&[corners, inner].concat(), &[faces, inner_faces].concat()).unwrap()
}

#[test]
fn an_order_that_is_kept_is_that_of_the_triangles_that_are_left() {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let solid = TriangleMesh::new(&corners, &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).unwrap();
    let mut solid = solid.without_inner_faces();
    let order = solid.order.take();
    assert_eq!(order, Some(Bvh::order(&solid)));

    let mut nested = nested_tetrahedra();
    nested.order = Some(Bvh::order(&nested));
    let left = nested.without_inner_shells();
    assert_eq!((left.triangle_count(), &left.order), (4, &None));
}
