//! Elements without area, and elements on creases and apexes of a field.

use nalgebra::Vector3;
use sdf_core::placed::Similarity;
use sdf_core::shapes::Cone;

use super::{all_with, random};
use crate::random::Random;
use crate::scenes::{cube_lattice, sampled, scenes, shifted};
use crate::stability::bodies::{Body, all_bodies};

type Point = Vector3<f64>;

pub fn slivers() -> Vec<Body> {
    all_with(1.5, |corners, random| {
        let height = random.pick(&[1e-3, 1e-6, 1e-12]);
        corners[2] = corners[0] + (corners[1] - corners[0]) * random.unit() + random.in_cube(height);
    })
}

pub fn points_and_lines() -> Vec<Body> {
    all_with(1.5, |corners, random| match random.below(4) {
        0 => corners[2] = corners[0] + (corners[1] - corners[0]) * random.between(-0.5, 1.5),
        1 => corners[2] = corners[random.below(2)],
        2 => *corners = [corners[0]; 3],
        _ => *corners = [corners[0], corners[0], corners[2]],
    })
}

/// Triangles with edges of about 1 that the apex `at` pierces, or ends just below.
fn pierced(count: usize, at: Point, random: &mut Random) -> Vec<[Point; 3]> {
    let mut all = vec![];
    for _ in 0..count {
        let height = random.pick(&[-1e-2, -1e-3, 1e-4, 1e-2]);
        let turn = random.between(0.0, 6.0);
        all.push(std::array::from_fn(|k| {
            let angle = turn + k as f64 * 2.1;
            let tilt = random.between(-0.02, 0.02);
            at + Vector3::new(
                angle.cos() * random.between(0.2, 1.0),
                angle.sin() * random.between(0.2, 1.0),
                height + tilt,
            )
        }));
    }
    all
}

pub fn needles() -> Vec<Body> {
    let mut random = random();
    let cone = |degrees: f64| Cone::new(degrees.to_radians(), 2.0).unwrap();
    let apex = Vector3::zeros();
    let needle = |elements| Body::new("needle of 1°", cone(0.5), 2.0).convex().with(elements);
    let fine = sampled(&shifted(cone(0.5), [0.0, 0.0, 0.3]), cube_lattice(0.75, 48), 1.0);
    let turned = Similarity::new([0.3, -0.2, 0.1], [0.3, 0.5, -0.2, 0.8], 1.0).unwrap();
    vec![
        needle(pierced(40, apex, &mut random)),
        Body::new("cone of 1° half angle", cone(1.0), 2.0).convex().with(pierced(40, apex, &mut random)),
        needle(pierced(40, apex, &mut random)).turned(turned),
        Body::new("needle of 1° in a grid", fine, 2.0).with(pierced(40, Vector3::new(0.0, 0.0, 0.25), &mut random)),
    ]
}

pub fn creases() -> Vec<Body> {
    let mut random = random();
    let mut bodies = all_bodies(1.0, 1, &mut random);
    for (body, scene) in bodies.iter_mut().zip(scenes(1.0)) {
        let points = scene.crease_points();
        // Four with corners on creases, and two with the middle of an edge on one.
        body.elements = (0..4).map(|_| [(); 3].map(|()| random.pick(&points))).collect();
        for _ in 0..2 {
            let (middle, a, b) = (random.pick(&points), random.in_cube(1.0), random.in_cube(1.0));
            body.elements.push([middle + a, middle - a, middle + b]);
        }
    }
    bodies
}
