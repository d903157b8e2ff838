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

/// Segments anywhere, along axes and in planes of the triangles' boxes, near the origin and far off.
#[test]
fn a_segment_meets_all_triangles_whose_boxes_it_enters_and_few_others() {
    let mut state = 19;
    println!("seed {state}");
    let (mut entered, mut visited) = (0, 0);
    for round in 0..40 {
        let far_off = Vector3::repeat([0.0, 1e3, -1e9][round % 3]);
        let mut mesh = soup(400, 0.05, &mut state);
        let shrink = |point: &mut Vector3<f64>| *point = *point * 0.5 + far_off;
        mesh.points.iter_mut().for_each(shrink);
        mesh.bounds = sdf_core::Aabb::from_points(mesh.points.iter().map(|point| (*point).into())).unwrap();
        let tree = Bvh::new(&mesh);
        for along in 0..40 {
            let [mut from, mut to] = [0, 1].map(|_| Vector3::from_fn(|_, _| random(&mut state)) + far_off);
            if along % 4 == 0 {
                from = tree.corners[along][0];
            }
            if along % 4 < 3 {
                (0..along % 3).for_each(|axis| to[axis] = from[axis]);
            }
            let mut found = vec![false; tree.corners.len()];
            tree.visit_along([from, to], |slot| {
                assert!(!std::mem::replace(&mut found[slot], true));
                ControlFlow::Continue(())
            });
            for (slot, corners) in tree.corners.iter().enumerate() {
                // Points of the segment, rounded inward, in the box.
                let [low, high] = box_around(corners);
                let is_in = |step: usize| {
                    let point = from + (to - from) * (step as f64 / 256.0);
                    (0..3).all(|axis| low[axis] <= point[axis] && point[axis] <= high[axis])
                };
                let is_entered = (0..=256).any(is_in);
                assert!(found[slot] || !is_entered, "{from:?} {to:?} {corners:?}");
                entered += usize::from(is_entered);
                visited += usize::from(found[slot]);
            }
        }
    }
    assert!(entered > 10_000 && visited < entered + entered / 5, "{entered} of {visited}");
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
