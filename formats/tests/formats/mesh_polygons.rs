//! Polygons cut into triangles.

use sdf_formats::mesh::Mesh;

use crate::mesh_models::{Model, area, simple_polygon, turn};
use crate::mesh_obj::{SQUARE, obj};
use crate::random::Random;

#[test]
fn a_convex_polygon_is_a_fan_from_its_first_corner() {
    let mut text = String::new();
    for i in 0..12 {
        let angle = f64::from(i) * std::f64::consts::TAU / 12.0;
        text += &format!("v {} {} {}\n", 3.0 * angle.cos(), angle.sin(), angle.sin() - angle.cos());
    }
    let mesh = obj(text + "f 3 4 5 6 7 8 9 10 11 12 1 2");
    let corner = |i: u32| (i + 2) % 12;
    assert_eq!(mesh.triangles, (1..11).map(|i| [corner(0), corner(i), corner(i + 1)]).collect::<Vec<_>>());
    assert_eq!(
        (mesh.polygon_counts.larger, mesh.polygon_counts.ear_clipped, mesh.polygon_counts.unverified),
        (1, 0, 0)
    );
}

/// The polygon in the plane `z = x / 2 - y`, its axes rotated by `axis`; exact, without rounding.
fn tilted(polygon: &[[f64; 2]], axis: usize) -> Model {
    let point = |&[x, y]: &[f64; 2]| {
        let mut point = [x, y, x / 2.0 - y];
        point.rotate_right(axis);
        point
    };
    Model { points: polygon.iter().map(point).collect(), polygons: vec![(0..polygon.len() as u32).collect()] }
}

/// The triangles tile the polygon: they keep its orientation, and their areas add up to its area.
fn assert_tiles(polygon: &[[f64; 2]], mesh: &Mesh) {
    assert_eq!(mesh.triangles.len(), polygon.len() - 2);
    let total = area(polygon);
    let areas = mesh.triangles.iter().map(|t| t.map(|i| polygon[i as usize])).map(|[a, b, c]| turn(a, b, c));
    assert!(areas.clone().all(|area| area * total > 0.0), "a triangle is inverted or flat: {polygon:?}");
    assert!((areas.sum::<f64>() - total).abs() < 1e-12, "{polygon:?}");
    assert_eq!(mesh.polygon_counts.unverified, 0);
}

#[test]
fn triangles_tile_every_simple_polygon() {
    let mut random = Random::new(2);
    let mut clipped = 0;
    for round in 0..600 {
        let corners = 4 + random.below(40);
        let polygon = simple_polygon(&mut random, corners);
        let mesh = obj(tilted(&polygon, round % 3).obj());
        assert_tiles(&polygon, &mesh);
        clipped += mesh.polygon_counts.ear_clipped;
    }
    assert!(clipped > 400, "{clipped}");
}

#[test]
fn corners_along_straight_edges_make_no_flat_triangle() {
    // A comb of unit squares, with all of its lattice corners.
    let teeth = 9;
    let mut polygon: Vec<_> = (0..2 * teeth).map(|x| [f64::from(x), 0.0]).collect();
    for tooth in (0..teeth).rev() {
        let x = f64::from(2 * tooth);
        polygon.extend([[x + 1.0, 1.0], [x + 1.0, 2.0], [x, 2.0], [x, 1.0]]);
    }
    for start in 0..polygon.len() {
        polygon.rotate_left(start);
        assert_tiles(&polygon, &obj(tilted(&polygon, start % 3).obj()));
    }
}

#[test]
fn a_hole_joined_to_the_outline_stays_open() {
    let polygon = [
        [0.0, 0.0],
        [4.0, 0.0],
        [4.0, 4.0],
        [0.0, 4.0],
        [0.0, 0.0],
        [1.0, 1.0],
        [1.0, 3.0],
        [3.0, 3.0],
        [3.0, 1.0],
        [1.0, 1.0],
    ];
    for start in 0..polygon.len() {
        let mut polygon = polygon.to_vec();
        polygon.rotate_left(start);
        let mesh = obj(tilted(&polygon, 0).obj());
        assert_eq!((mesh.triangles.len(), mesh.polygon_counts.ear_clipped), (8, 1));
        let corners = mesh.triangles.iter().map(|t| t.map(|i| polygon[i as usize]));
        let areas: Vec<_> = corners.map(|[a, b, c]| turn(a, b, c)).collect();
        assert!(areas.iter().all(|&area| area >= 0.0) && areas.iter().sum::<f64>() == 24.0, "{areas:?}");
    }
}

#[test]
fn every_polygon_gives_two_triangles_fewer_than_corners() {
    let mut random = Random::new(3);
    let model = Model::random(&mut random, 9, 3000, 12);
    let mesh = obj(model.obj());
    assert_eq!(mesh.polygon_counts.total, model.polygons.len());
    let mut given = mesh.polygons.iter().zip(&mesh.triangles);
    for (i, polygon) in model.polygons.iter().enumerate() {
        for _ in 2..polygon.len() {
            let (&source, triangle) = given.next().unwrap();
            assert_eq!(source as usize, i);
            assert!(triangle.iter().all(|corner| polygon.contains(corner)));
        }
    }
    assert!(given.next().is_none());
    for (face, unverified) in [("f 1 1 2", 0), ("f 1 1 1 1", 1), ("f 1 2 1 2 1", 1), ("f 1 2 2 3", 0), ("f 1 1 2 3", 0)]
    {
        let mesh = obj(format!("{SQUARE}{face}"));
        assert_eq!(mesh.triangles.len(), face.split(' ').count() - 3, "{face}");
        assert_eq!(mesh.polygon_counts.unverified, unverified, "{face}");
    }
}

/// Corners of a comb: teeth of unequal length side by side.
fn comb(teeth: u32) -> Vec<[f64; 2]> {
    let tooth = |tooth: u32| {
        let [x, shift] = [f64::from(4 * tooth), f64::from(tooth % 7)];
        [[x, 100.0 + shift], [x + 1.0, 100.0], [x + 1.5, 1.0], [x + 3.5, 1.0 + 0.1 * f64::from(tooth % 3)]]
    };
    let end = [[f64::from(4 * teeth), 0.0], [0.0, 0.0]];
    (0..teeth).flat_map(tooth).chain(end).collect()
}

/// Half of its corners are reflex.
#[test]
fn a_polygon_of_20000_corners_is_tiled() {
    let polygon = comb(5000);
    let mesh = obj(tilted(&polygon, 0).obj());
    let counts = mesh.polygon_counts;
    assert_eq!((mesh.triangles.len(), counts.ear_clipped, counts.unverified), (20_000, 1, 0));
    let areas = mesh.triangles.iter().map(|t| t.map(|i| polygon[i as usize])).map(|[a, b, c]| turn(a, b, c));
    let total = area(&polygon);
    assert!(areas.clone().all(|area| area * total >= 0.0));
    assert!((areas.sum::<f64>() / total - 1.0).abs() < 1e-12);
}

#[test]
fn a_self_crossing_polygon_of_20000_corners_is_a_fan() {
    let corner = |index: u32| {
        let angle = f64::from(index * 7919 % 20_000) * std::f64::consts::TAU / 20_000.0;
        [angle.cos(), angle.sin()]
    };
    let polygon: Vec<[f64; 2]> = (0..20_000).map(corner).collect();
    let mesh = obj(tilted(&polygon, 0).obj());
    assert_eq!((mesh.polygon_counts.ear_clipped, mesh.polygon_counts.unverified), (0, 1));
    assert!(mesh.triangles.iter().enumerate().all(|(index, t)| *t == [0, index as u32 + 1, index as u32 + 2]));
}

/// All triangles of its fan are positive.
#[test]
fn a_spiral_that_winds_twice_is_unverified() {
    let corner = |i: u32| {
        let (angle, radius) = (f64::from(i) * std::f64::consts::TAU / 10.0, 1.0 + 0.02 * f64::from(i));
        [radius * angle.cos(), radius * angle.sin()]
    };
    let polygon: Vec<[f64; 2]> = (0..20).map(corner).collect();
    assert!((1..19).all(|i| turn(polygon[0], polygon[i], polygon[i + 1]) > 0.0));
    let counts = obj(tilted(&polygon, 0).obj()).polygon_counts;
    assert_eq!(counts.unverified, 1);
    // One turn is simple, and a fan.
    let counts = obj(tilted(&polygon[..10], 0).obj()).polygon_counts;
    assert_eq!((counts.ear_clipped, counts.unverified), (0, 0));
}
