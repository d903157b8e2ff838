//! Pieces cover their face, do not overlap, and are entered by no other triangle.

use sdf_core::nalgebra::Matrix3;

use super::*;
use crate::testing::random_vector;

fn area(corners: &[Vector3<f64>]) -> f64 {
    corners[1..].windows(2).map(|fan| area_vector([corners[0], fan[0], fan[1]]).norm()).sum()
}

/// Does an edge of one triangle pass through the inside of the other, by more than `margin` of each weight?
fn is_crossed(a: Triangle, b: Triangle, margin: f64) -> bool {
    let passes = |from: Vector3<f64>, to: Vector3<f64>, [p, q, r]: Triangle| {
        let columns = Matrix3::from_columns(&[q - p, r - p, from - to]);
        let inverse = columns.try_inverse().filter(|_| columns.determinant().abs() > 1e-9);
        let Some(inverse) = inverse else { return false };
        let [u, v, t]: [f64; 3] = (inverse * (from - p)).into();
        u > margin && v > margin && 1.0 - u - v > margin && t > margin && t < 1.0 - margin
    };
    (0..3).any(|edge| {
        let next = (edge + 1) % 3;
        passes(a[edge], a[next], b) || passes(b[edge], b[next], a)
    })
}

/// Is a point of a triangle's plane inside of it? `None` near an edge.
fn is_in_triangle(point: Vector3<f64>, triangle: Triangle) -> Option<bool> {
    let normal = area_vector(triangle).normalize();
    let heights = [0, 1, 2].map(|edge| {
        let [from, to] = [triangle[edge], triangle[(edge + 1) % 3]];
        (to - from).cross(&(point - from)).dot(&normal)
    });
    let is_clear = heights.iter().all(|height| height.abs() > 1e-9);
    is_clear.then(|| heights.iter().all(|height| *height > 0.0))
}

#[test]
fn pieces_cover_their_face_and_no_other_triangle_enters_them() {
    let mut state = 77;
    let (mut cut, mut flat) = (0, 0);
    for round in 0..3000 {
        // Small whole numbers touch, and lie in one plane, most of the time.
        let is_coarse = round % 2 == 0;
        let mut triangle = |is_flat: bool| {
            let mut corner = || {
                let point = random_vector(&mut state);
                if is_coarse { point.map(|x| (x * 2.0).round()) } else { point }
            };
            let corners = [corner(), corner(), corner()];
            if is_flat { corners.map(|corner| Vector3::new(corner.x, corner.y, 0.0)) } else { corners }
        };
        let is_flat = round % 5 == 0;
        let face = triangle(is_flat);
        let others: Vec<Triangle> = (0..1 + round % 7).map(|_| triangle(is_flat && round % 2 == 0)).collect();
        let have_areas = others.iter().chain([&face]).all(|corners| area_vector(*corners).norm() > 1e-3);
        if !have_areas {
            continue;
        }
        let pieces = pieces(face, &others);
        let sum: f64 = pieces.iter().map(|piece| area(&piece.corners)).sum();
        assert!((sum - area(&face)).abs() < 1e-12 * sum, "round {round}: {sum} of {}", area(&face));
        for piece in &pieces {
            let middle = piece.corners.iter().sum::<Vector3<f64>>() / piece.corners.len() as f64;
            let normal = area_vector(face);
            for fan in piece.corners[1..].windows(2) {
                let part = [piece.corners[0], fan[0], fan[1]];
                assert!(area_vector(part).dot(&normal) >= -1e-15, "round {round}: wound another way");
                assert!(!others.iter().any(|other| is_crossed(part, *other, 1e-9)), "round {round}: {part:?}");
            }
            let is_inside = |(plane, side): &(Triangle, Side)| side_of(*plane, middle) == *side;
            for other in others.iter().filter(|other| other.iter().all(|corner| side_of(face, *corner) == 0)) {
                let near = |corner: &Vector3<f64>| is_in_triangle(middle + (corner - middle) * 0.999, *other);
                let sides: Vec<bool> = piece.corners.iter().filter_map(near).collect();
                assert!(sides.windows(2).all(|pair| pair[0] == pair[1]), "round {round}: {:?}", piece.corners);
            }
            let is_wide = area(&piece.corners) > 1e-9;
            assert!(!is_wide || piece.planes.iter().all(is_inside), "round {round}: {:?}", piece.corners);
        }
        cut += usize::from(pieces.len() > 1);
        flat += usize::from(pieces.len() > 1 && is_flat);
    }
    assert!(cut > 1000 && flat > 200, "{cut} {flat}");
}

/// A ring of segments on a large face: as many pieces as a partition in random order has, not the square of it.
#[test]
fn a_ring_of_many_triangles_makes_few_pieces() {
    let face = [[-9.0, -9.0, 0.0], [9.0, -9.0, 0.1], [0.0, 9.0, -0.1]].map(Vector3::from);
    let count = 1000;
    let on_ring = |index: usize, z: f64| {
        let angle = std::f64::consts::TAU * (index % count) as f64 / count as f64;
        Vector3::new(angle.cos(), angle.sin(), z)
    };
    let triangle = |index: usize| [on_ring(index, -1.0), on_ring(index + 1, -1.0), on_ring(index, 1.0)];
    let others: Vec<Triangle> = (0..count).map(|index| triangle(index * 617 % count)).collect();
    let pieces = pieces(face, &others);
    assert!(pieces.len() > count && pieces.len() < 8 * count, "{}", pieces.len());
}
