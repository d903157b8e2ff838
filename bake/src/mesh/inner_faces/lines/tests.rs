//! Sides and meeting points of lines, compared with whole numbers.

use super::*;
use crate::testing::{random, random_vector};

type Whole = [i128; 3];

fn whole_cross(a: Whole, b: Whole) -> Whole {
    from_fn(|axis| a[(axis + 1) % 3] * b[(axis + 2) % 3] - a[(axis + 2) % 3] * b[(axis + 1) % 3])
}

fn whole_dot(a: Whole, b: Whole) -> i128 {
    (0..3).map(|axis| a[axis] * b[axis]).sum()
}

/// Normal and offset of a plane.
fn whole_plane(points: [Whole; 3]) -> (Whole, i128) {
    let [u, v] = [1, 2].map(|corner| from_fn(|axis| points[corner][axis] - points[0][axis]));
    let normal = whole_cross(u, v);
    (normal, whole_dot(normal, points[0]))
}

/// Point of three planes by Cramer's rule: numerators and the common denominator.
fn whole_point([(a, p), (b, q), (c, r)]: [(Whole, i128); 3]) -> (Whole, i128) {
    let (bc, ca, ab) = (whole_cross(b, c), whole_cross(c, a), whole_cross(a, b));
    (from_fn(|axis| p * bc[axis] + q * ca[axis] + r * ab[axis]), whole_dot(a, bc))
}

#[test]
fn sides_are_those_of_whole_numbers_and_points_are_off_by_four_epsilon() {
    let mut state = 31;
    let (mut zeros, mut tested) = (0, 0);
    for round in 0..30_000 {
        let size = [3.0, 40.0][round % 2];
        // Far from the origin all differences cancel.
        let shift = [0.0, 1e6][round / 2 % 2];
        let scale = [1.0, 2.0_f64.powi(-400), 2.0_f64.powi(90)][round / 4 % 3];
        let mut points = || [0; 3].map(|_| random_vector(&mut state).map(|x| (x * size).round() + shift));
        let planes = [points(), points(), points(), points()];
        let wholes = planes.map(|plane| whole_plane(plane.map(|point| point.map(|x| x as i128).into())));
        let (point, divisor) = whole_point([wholes[0], wholes[1], wholes[2]]);
        if divisor == 0 {
            continue;
        }
        let [face, others @ ..] = planes.map(|plane| plane.map(|point| point * scale));
        let lines = Lines::new(face, others.to_vec());
        let above = (whole_dot(wholes[3].0, point) - wholes[3].1 * divisor) * divisor.signum();
        assert_eq!(lines.side(0, 1, 2), above.signum() as Side, "{planes:?}");
        (tested, zeros) = (tested + 1, zeros + usize::from(above == 0));
        let exact = point.map(|x| x as f64 / divisor as f64 * scale);
        let box_of_face = [Vector3::inf, Vector3::sup].map(|pick| pick(&pick(&face[0], &face[1]), &face[2]));
        let is_in_face = (0..3).all(|axis| box_of_face[0][axis] <= exact[axis] && exact[axis] <= box_of_face[1][axis]);
        if is_in_face {
            let found = lines.meeting_point(0, 1);
            let largest = face.iter().map(|corner| corner.amax()).fold(0.0, f64::max);
            // The expected point is itself rounded twice.
            let off = (found - Vector3::from(exact)).amax();
            assert!(off <= 6.0 * f64::EPSILON * largest, "{off:e} {planes:?}");
        }
    }
    assert!(tested > 20_000 && zeros > 100, "{tested} {zeros}");
}

#[test]
fn numbers_of_any_exponent_are_whole_in_the_last_bits_unit() {
    let mut state = 5;
    for round in 0..2000 {
        let scale = [1.0, 1e-310, 1e300][round % 3];
        let [x, y] = [0; 2].map(|_| (random(&mut state) - 0.5) * scale);
        let unit = last_bit(x).min(last_bit(y));
        for number in [x, y, 0.0] {
            assert_eq!(to_f64(&in_units(number, unit), unit), number);
        }
        assert_eq!(in_units(x, unit) > in_units(y, unit), x > y);
    }
}
