//! Combinations of shapes, and placements of them.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Vector3;
use sdf_core::combine::{Difference, Intersection, Offset, Shell, SmoothUnion, Union};
use sdf_core::placed::{Affine, Placed, Rigid, Similarity, Stretch};
use sdf_core::shapes::{Cone, Cuboid, Ellipsoid, Horseshoe, Sphere};

use super::membership::{distance_to_box, is_in_horseshoe, rotate_back};
use super::{Meaning, Point, Scene, shifted};
use crate::scene_field::SceneField;

pub fn combinations(s: f64) -> Vec<Scene> {
    use Meaning::Bound;
    let ball = SceneField::new(Sphere::new(0.625 * s).unwrap());
    let block = SceneField::new(Cuboid::new([0.375 * s, 0.75 * s, 0.5 * s]).unwrap());
    let in_ball = move |p: Point| p.norm() <= 0.625 * s;
    let in_block = move |p: Point| p.x.abs() <= 0.375 * s && p.y.abs() <= 0.75 * s && p.z.abs() <= 0.5 * s;
    let lifted = SceneField::new(shifted(ball.clone(), [0.0, 0.0, 0.5 * s]));
    let up = Vector3::new(0.0, 0.0, 0.5) * s;
    let creases = [0.375 * s, 0.75 * s, 0.5 * s, 0.625 * s];
    vec![
        Scene::new("union", s, Bound, Some(Union(ball.clone(), block.clone())))
            .inside(move |p| in_ball(p) || in_block(p))
            .creases(&creases),
        Scene::new("intersection", s, Bound, Some(Intersection(ball.clone(), block.clone())))
            .convex()
            .inside(move |p| in_ball(p) && in_block(p))
            .creases(&creases),
        Scene::new("difference", s, Bound, Some(Difference(block.clone(), ball.clone())))
            .inside(move |p| in_block(p) && !in_ball(p))
            .creases(&creases),
        Scene::new("smooth union", 1.25 * s, Bound, SmoothUnion::new(ball.clone(), lifted, 0.25 * s))
            .inside(move |p| {
                let (a, b) = (p.norm() - 0.625 * s, (p - up).norm() - 0.625 * s);
                let blend = (1.0 - (a - b).abs() / (0.25 * s)).max(0.0);
                a.min(b) <= blend * blend * 0.0625 * s
            })
            .creases(&[0.5 * s, 0.25 * s, 0.625 * s]),
        Scene::new("grown cuboid", 1.25 * s, Bound, Offset::new(block.clone(), 0.25 * s))
            .convex()
            .inside(move |p| distance_to_box(p, [0.375 * s, 0.75 * s, 0.5 * s]) <= 0.25 * s)
            .creases(&creases),
        Scene::new("shrunk cuboid", s, Bound, Offset::new(block.clone(), -0.125 * s))
            .convex()
            .inside(move |p| p.x.abs() <= 0.25 * s && p.y.abs() <= 0.625 * s && p.z.abs() <= 0.375 * s)
            .creases(&[0.25 * s, 0.625 * s, 0.375 * s]),
        Scene::new("shell of a cuboid", s, Bound, Shell::new(block.clone(), 0.25 * s))
            .inside(move |p| {
                let hollow = p.x.abs() < 0.25 * s && p.y.abs() < 0.625 * s && p.z.abs() < 0.375 * s;
                !hollow && distance_to_box(p, [0.375 * s, 0.75 * s, 0.5 * s]) <= 0.125 * s
            })
            .creases(&creases),
        Scene::new(
            "shell of an ellipsoid",
            s,
            Bound,
            Shell::new(SceneField::new(Ellipsoid::new([0.5 * s, 0.5 * s, s]).unwrap()), 0.25 * s),
        )
        .inside(move |p| {
            let relative = Vector3::new(2.0 * p.x, 2.0 * p.y, p.z).norm() / s;
            (0.75..=1.25).contains(&relative)
        })
        .creases(&[0.5 * s, s]),
    ]
}

pub fn placements(s: f64) -> Vec<Scene> {
    use Meaning::Exact;
    let shift = Vector3::new(0.25, -0.125, 0.0625) * s;
    let rotation = [0.1, -0.5, 0.3, 0.8];
    let quarter = [0.0, 0.0, 1.0, 1.0];
    let half_extents = [0.25 * s, 0.5 * s, 0.375 * s];
    let cuboid = SceneField::new(Cuboid::new(half_extents).unwrap());
    let cone = SceneField::new(Cone::new(PI / 6.0, 2.0 * s).unwrap());
    let in_cone = move |p: Point| p.z >= -2.0 * s && p.xy().norm() <= -p.z * (PI / 6.0).tan();
    let bar = SceneField::new(Horseshoe::new(s, 0.5 * s, FRAC_PI_2, 0.5 * s, 0.5 * s).unwrap());
    let in_bar = move |p: Point| p.z.abs() <= 0.5 * s && is_in_horseshoe(p.xy(), s, 0.5 * s, FRAC_PI_2, 0.5 * s);
    let in_cuboid = move |p: Point| (0..3).all(|k| p[k].abs() <= half_extents[k]);
    let rigid = Rigid::new(shift.into(), rotation);
    let half = Similarity::new(shift.into(), rotation, 0.5).unwrap();
    let big = Similarity::new([0.0; 3], [0.3, 0.1, 0.0, -0.9], 3.0).unwrap();
    // Its inverse is exact: (x, y, z) = A⁻¹ (p - t) = (u - w, v/2, -w) of p - t = (u, v, w).
    let sheared = Affine::new(shift.into(), [[1.0, 0.0, -1.0], [0.0, 2.0, 0.0], [0.0, 0.0, -1.0]]);
    vec![
        Scene::new("turned cuboid", s, Exact, rigid.map(|placement| Placed { field: cuboid.clone(), placement }))
            .convex()
            .inside(move |p| in_cuboid(rotate_back(p - shift, rotation)))
            .creases(&[0.25 * s, 0.0625 * s]),
        Scene::new("small turned cone", 1.5 * s, Exact, Some(Placed { field: cone.clone(), placement: half }))
            .convex()
            .inside(move |p| in_cone(rotate_back(p - shift, rotation) / 0.5))
            .creases(&[0.25 * s, 0.0625 * s]),
        Scene::new("large cuboid", 3.0 * s, Exact, Some(Placed { field: cuboid.clone(), placement: big }))
            .convex()
            .inside(move |p| in_cuboid(rotate_back(p, [0.3, 0.1, 0.0, -0.9]) / 3.0))
            .creases(&[0.75 * s]),
        Scene::new(
            "horseshoe placed twice",
            1.5 * s,
            Exact,
            Rigid::new([0.0, 0.25 * s, 0.0], quarter)
                .map(|placement| Placed { field: SceneField::new(Placed { field: bar, placement: half }), placement }),
        )
        .inside(move |p| {
            let outer = rotate_back(p - Vector3::new(0.0, 0.25, 0.0) * s, quarter);
            in_bar(rotate_back(outer - shift, rotation) / 0.5)
        })
        .creases(&[0.25 * s, 0.5 * s]),
        Scene::new(
            "stretched and mirrored cone",
            2.5 * s,
            Meaning::Bound,
            Stretch::new([0.5, -2.0, -1.0]).map(|placement| Placed { field: cone, placement }),
        )
        .convex()
        .inside(move |p| in_cone(p.component_div(&Vector3::new(0.5, -2.0, -1.0))))
        .creases(&[2.0 * s]),
        Scene::new(
            "sheared and mirrored cuboid",
            1.5 * s,
            Meaning::Bound,
            sheared.map(|placement| Placed { field: cuboid, placement }),
        )
        .convex()
        .inside(move |p| {
            let q = p - shift;
            in_cuboid(Vector3::new(q.x - q.z, 0.5 * q.y, -q.z))
        })
        .creases(&[0.25 * s, 0.375 * s]),
    ]
}
