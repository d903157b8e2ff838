//! The winding number modulo 1 and its slope bound, compared with sums over all triangles.

use super::*;
use crate::sign::winding::solid_angle;
use crate::testing::{random, random_vector};

/// A crumpled sheet of `cells` by `cells` squares cut in two, with some triangles left out, and its boundary.
fn sheet(cells: usize, state: &mut u64) -> (Vec<[Vector3<f64>; 3]>, MeshBoundary) {
    let side = cells + 1;
    let points: Vec<Vector3<f64>> = (0..side * side)
        .map(|index| Vector3::new((index % side) as f64, (index / side) as f64, 0.0) / cells as f64)
        .map(|point| point + random_vector(state) * (0.2 / cells as f64))
        .collect();
    let mut triangles = vec![];
    let mut multiplicities = std::collections::BTreeMap::new();
    for index in (0..side * cells).filter(|index| index % side < cells) {
        for corners in [[index, index + 1, index + side + 1], [index, index + side + 1, index + side]] {
            if random(state) < -0.6 {
                continue;
            }
            triangles.push(corners.map(|corner| points[corner]));
            for corner in 0..3 {
                let [from, to] = [corners[corner], corners[(corner + 1) % 3]];
                *multiplicities.entry([from.min(to), from.max(to)]).or_insert(0.0) +=
                    if from < to { 1.0 } else { -1.0 };
            }
        }
    }
    let boundary = multiplicities.into_iter().filter(|(_, multiplicity)| *multiplicity != 0.0);
    let boundary = boundary.map(|(ends, multiplicity)| (ends.map(|end| end as u32), multiplicity));
    (triangles, MeshBoundary::new(&points, boundary))
}

fn winding(triangles: &[[Vector3<f64>; 3]], point: Vector3<f64>) -> f64 {
    triangles.iter().map(|corners| solid_angle(corners.map(|corner| corner - point))).sum::<f64>() / (4.0 * PI)
}

#[test]
fn the_boundary_gives_the_winding_number_modulo_one() {
    let mut state = 41;
    for cells in [1, 4, 12] {
        let (triangles, boundary) = sheet(cells, &mut state);
        for _ in 0..1000 {
            let point = random_vector(&mut state) * 1.5;
            let fraction = boundary.winding_fraction(point).unwrap();
            let off = winding(&triangles, point) - fraction.value;
            assert!((off - off.round()).abs() < fraction.error.min(1e-9) + 1e-13, "{off} at {point}");
        }
        let edge = &boundary.edges[0];
        let middle = Vector3::from_fn(|axis, _| edge.from[axis][0] + 0.5 * edge.offset[axis][0]);
        assert!(boundary.winding_fraction(middle).is_none());
    }
}

#[test]
fn the_winding_number_changes_no_faster_than_the_slope_bound() {
    let mut state = 43;
    let mut tightest = 0.0_f64;
    for cells in [1, 4, 12, 30] {
        let (triangles, boundary) = sheet(cells, &mut state);
        for _ in 0..1000 {
            let center = random_vector(&mut state) * 1.5;
            let radius = 0.1 * random(&mut state).abs();
            let slope = boundary.slope_bound(center, radius, f64::INFINITY);
            // Up to a limit it is the same, or infinite.
            let limit = slope * (1.0 + random(&mut state));
            let limited = boundary.slope_bound(center, radius, limit);
            assert!(
                limited == slope || limited == f64::INFINITY && slope > limit * (1.0 - SUM_SLACK),
                "{limited} for {slope}, {limit}"
            );
            let [a, b] = [0, 1].map(|_| center + random_vector(&mut state).normalize() * radius);
            let change = winding(&triangles, b) - winding(&triangles, a);
            let smooth = (change - change.round()).abs();
            let max_change = slope * (b - a).norm();
            assert!(max_change > 0.5 || smooth <= max_change + 1e-12, "{smooth} > {max_change} at {center}, {radius}");
            tightest = tightest.max(smooth / max_change);
        }
    }
    assert!(tightest > 0.2, "{tightest}: the bound is too wide");
}

#[test]
fn near_the_middle_of_a_long_edge_the_slope_bound_is_hardly_more_than_the_change() {
    let mut state = 47;
    println!("seed {state}");
    let (triangles, boundary) = sheet(1, &mut state);
    let edge = &boundary.edges[0];
    let from = Vector3::from_fn(|axis, _| edge.from[axis][0]);
    let along = Vector3::from_fn(|axis, _| edge.offset[axis][0]);
    for _ in 0..1000 {
        let across = along.cross(&random_vector(&mut state)).normalize();
        let distance = 0.01 * random(&mut state).abs() * along.norm();
        let center = from + along * 0.5 + across * distance;
        let step = along.cross(&across).normalize() * (0.01 * distance);
        let change = winding(&triangles, center + step) - winding(&triangles, center - step);
        let slope = (change - change.round()).abs() / (2.0 * step.norm());
        let bound = boundary.slope_bound(center, step.norm(), f64::INFINITY);
        assert!(slope <= bound && slope > 0.9 * bound, "{slope} {bound} at {distance}");
    }
}

/// Sheets with holes, some of which share a point; an edge with three triangles on one side; and edges that are no cycle.
#[test]
fn loops_are_closed_and_have_each_edge_as_often_as_its_multiplicity_says() {
    let triangles = |corners: &[[u32; 3]]| {
        let mut multiplicities = std::collections::BTreeMap::new();
        for corner in corners.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]) {
            let [from, to] = corner;
            *multiplicities.entry([from.min(to), from.max(to)]).or_insert(0.0) += if from < to { 1.0 } else { -1.0 };
        }
        multiplicities.into_iter().filter(|(_, times)| *times != 0.0).collect::<Vec<([u32; 2], f64)>>()
    };
    let mut state = 53;
    println!("seed {state}");
    let mut grid = vec![];
    for index in (0..900_u32).filter(|index| index % 30 < 29 && *index < 870) {
        let halves = [[index, index + 1, index + 31], [index, index + 31, index + 30]];
        grid.extend(halves.into_iter().filter(|_| random(&mut state) > -0.4));
    }
    let pinwheel = [[0, 1, 2], [0, 3, 4], [0, 5, 6]];
    let book = [[0, 1, 2], [0, 1, 3], [0, 1, 4]];
    for (name, corners) in [("grid", grid.as_slice()), ("pinwheel", &pinwheel), ("book", &book)] {
        let edges = triangles(corners);
        let found = loops(900, edges.iter().copied());
        assert!(found.iter().all(|edges| is_closed(edges)), "{name}");
        let mut points: Vec<Vec<u32>> =
            found.iter().map(|edges| edges.iter().map(|[from, _]| *from).collect()).collect();
        points.iter_mut().for_each(|points| points.sort_unstable());
        assert!(
            points.iter().all(|points| points.windows(2).all(|pair| pair[0] < pair[1])),
            "{name}: a point met twice"
        );
        let mut counts = std::collections::BTreeMap::new();
        for [from, to] in found.into_iter().flatten() {
            *counts.entry([from.min(to), from.max(to)]).or_insert(0.0) += if from < to { 1.0 } else { -1.0 };
        }
        assert_eq!(counts.into_iter().collect::<Vec<_>>(), edges, "{name}");
    }
    let open = loops(5, [([0, 1], 1.0), ([1, 2], 1.0), ([3, 4], -1.0)].into_iter());
    assert_eq!(open.iter().map(Vec::len).collect::<Vec<_>>(), [3]);
    assert!(!is_closed(&open[0]));
}
