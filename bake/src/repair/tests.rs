use sdf_core::nalgebra::Vector3;
use sdf_procedural::random::{Random, test_seed};

use super::cap::Capping;
use super::weld::{is_any_near, is_within, weld_within};
use super::*;

fn area(points: &[Vector3<f64>], triangles: &[[usize; 3]]) -> f64 {
    let area = |[a, b, c]: [usize; 3]| 0.5 * (points[b] - points[a]).cross(&(points[c] - points[a])).norm();
    triangles.iter().map(|corners| area(*corners)).sum()
}

/// Every edge of the loop has one triangle in its direction, every chord two in opposite ones.
fn assert_fills(count: usize, triangles: &[[usize; 3]]) {
    assert_eq!(triangles.len(), count - 2);
    let mut directed: Vec<[usize; 2]> = triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]).collect();
    directed.sort_unstable();
    assert!(directed.windows(2).all(|pair| pair[0] != pair[1]));
    let is_there = |edge: [usize; 2]| directed.binary_search(&edge).is_ok();
    for [from, to] in &directed {
        assert!(is_there([*to, *from]) != (*to == (from + 1) % count), "{from} {to}");
    }
    assert!((0..count).all(|from| is_there([from, (from + 1) % count])));
}

#[test]
fn a_star_in_a_plane_is_filled_to_its_area() {
    for count in [3, 4, 7, 40, 127, 128] {
        let corner = |index: usize| {
            let angle = std::f64::consts::TAU * index as f64 / count as f64;
            let radius = if index.is_multiple_of(2) || count < 8 { 1.0 } else { 0.7 };
            Vector3::new(radius * angle.cos(), radius * angle.sin(), 0.5 * radius * angle.cos())
        };
        let points: Vec<_> = (0..count).map(corner).collect();
        let triangles = Capping::new().triangles(&points);
        assert_fills(count, &triangles);
        let signed: Vector3<f64> = (0..count).map(|at| points[at].cross(&points[(at + 1) % count]) * 0.5).sum();
        assert!((area(&points, &triangles) - signed.norm()).abs() < 1e-9, "{count}");
    }
}

#[test]
fn a_crack_is_filled_across_and_a_long_loop_in_pieces() {
    for edges in [18, 54, 200, 1000] {
        // There along a line, and back beside it.
        let there = (0..edges).map(|step| Vector3::new(f64::from(step), 0.0, 0.0));
        let back = (0..edges).rev().map(|step| Vector3::new(f64::from(step), 0.01, 0.3 * f64::from(step % 2)));
        let points: Vec<_> = there.chain(back).collect();
        let triangles = Capping::new().triangles(&points);
        assert_fills(points.len(), &triangles);
        let longest = triangles.iter().flat_map(|corners| {
            [0, 1, 2].map(|corner| (points[corners[corner]] - points[corners[(corner + 1) % 3]]).norm())
        });
        let longest = longest.fold(0.0, f64::max);
        assert!(edges > 60 || longest < 2.5, "{edges}: {longest}");
    }
}

#[test]
fn vertices_within_the_distance_become_one_in_any_order() {
    let seed = test_seed(71);
    let mut random = Random::new(seed);
    // The last so far out that points are compared one by one.
    for (scale, far) in [(1e-12, 0.0), (1.0, 0.0), (1e12, 0.0), (1.0, 1e12)] {
        let (count, distance) = (400, 0.08 * scale);
        let mut points: Vec<[f64; 3]> =
            (0..count).map(|_| random.point_in_cube(0.5).map(|x| x * scale + far)).collect();
        // Brute force: components of all pairs within the distance.
        let mut label: Vec<usize> = (0..count).collect();
        let near = |a: [f64; 3], b: [f64; 3]| (Vector3::from(a) - Vector3::from(b)).norm() <= distance;
        for a in 0..count {
            for b in 0..a {
                if near(points[a], points[b]) {
                    let (old, new) = (label[a].max(label[b]), label[a].min(label[b]));
                    label.iter_mut().filter(|label| **label == old).for_each(|label| *label = new);
                }
            }
        }
        let triangles: Vec<[u32; 3]> = (0..count as u32 - 2).map(|first| [first, first + 1, first + 2]).collect();
        let (welded, moved) = weld_within(&points, &triangles, distance);
        for a in 0..count {
            for b in 0..a {
                assert_eq!(welded[a] == welded[b], label[a] == label[b], "seed {seed}, {a} and {b}");
            }
            assert!(points.contains(&welded[a]));
        }
        let groups = (0..count).filter(|point| label[*point] == *point).count();
        assert!(groups < count - 50 && moved == count - groups, "seed {seed}");
        let mut sorted = welded;
        sorted.sort_by(|a, b| a.partial_cmp(b).unwrap());
        random.shuffle(&mut points);
        let mut again = weld_within(&points, &triangles, distance).0;
        again.sort_by(|a, b| a.partial_cmp(b).unwrap());
        assert_eq!(again, sorted, "seed {seed}");
    }
}

/// Cells so far out that their numbers overflow, and some that are only coarse.
#[test]
fn points_far_from_the_origin_are_merged_only_within_the_distance() {
    for far in [1.0_f64, 1e10, 1e29] {
        let step = far * f64::EPSILON;
        let points: Vec<[f64; 3]> =
            (0..6).map(|index| [far + f64::from(index / 2 * 1000 + index % 2) * step, far, 0.0]).collect();
        let triangles = [[0, 1, 2], [3, 4, 5]];
        let count = |distance: f64| weld_within(&points, &triangles, distance).1;
        assert_eq!([1e-12, 0.4, 1.9, 2000.0].map(|steps| count(steps * step)), [0, 0, 3, 5], "{far}");
    }
}

/// Points of two bent sheets, one above the other, here and there a little farther apart than the distance.
#[test]
fn few_points_are_compared_where_dense_sets_are_nearly_or_hardly_within_the_distance() {
    let seed = test_seed(72);
    let mut random = Random::new(seed);
    let mut answers = [0; 2];
    for (round, count) in [20, 70, 3000].into_iter().cycle().take(120).enumerate() {
        let normal = Vector3::from(random.point_in_cube(1.0)).normalize();
        let side = normal.cross(&Vector3::new(0.3, 0.5, 0.8)).normalize();
        let across = normal.cross(&side);
        let (bend, gap) = (random.between(-0.2, 0.2), random.between(0.99, 1.03));
        let mut sheet = |height: f64| -> Vec<[f64; 3]> {
            let point = |[u, v, _]: [f64; 3]| normal * (height + bend * (u * u + v * v)) + side * u + across * v;
            (0..count).map(|_| point(random.point_in_cube(0.2)).into()).collect()
        };
        let positions = [sheet(0.0), sheet(gap)].concat();
        let mut own: Vec<u32> = (0..count).collect();
        let mut other: Vec<u32> = (count..2 * count).collect();
        let mut compared = 0_u32;
        let mut is_near = |a, b| {
            compared += 1;
            is_within(&positions, a, b, 1.0)
        };
        let found = is_any_near(&positions, &mut own, &mut other, 1.0, &mut is_near);
        let wanted = own.iter().any(|a| other.iter().any(|b| is_within(&positions, *a, *b, 1.0)));
        assert_eq!(found, wanted, "seed {seed}, round {round}");
        // All pairs of the largest sets are 9,000,000.
        assert!(compared < 30_000, "seed {seed}, round {round}: {compared}");
        answers[usize::from(found)] += 1;
    }
    assert!(answers.iter().all(|count| *count > 20), "{answers:?}");
}

#[test]
fn repairs_are_read_from_the_words_that_they_write() {
    for repairs in [
        Repairs::default(),
        Repairs { weld: Some(0.1), close: None },
        Repairs { weld: None, close: Some(1e-7) },
        Repairs { weld: Some(1.0 / 3.0), close: Some(2e9) },
    ] {
        assert_eq!(Repairs::from_words(&format!("--res 8 --sign auto{} --layout sparse", repairs.words())), repairs);
    }
    assert_eq!(Repairs::from_words("--res 8 --weld"), Repairs::default());
}
