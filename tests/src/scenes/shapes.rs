//! All shapes in closed form, with the membership that each must have.

use nalgebra::Vector3;
use sdf_core::shapes::{
    Bowl, Capsule, Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Horseshoe, Octahedron, RoundedBox, Sphere, Torus,
};

use super::membership::{distance_to_bowl, distance_to_box, distance_to_ring, distance_to_segment, is_in_horseshoe};
use super::{Meaning, Scene};

pub fn shapes(s: f64) -> Vec<Scene> {
    use Meaning::{Bound, Exact};
    let half_extents = [0.5 * s, 0.75 * s, 0.875 * s];
    let rounded = [0.375 * s, 0.5 * s, 0.25 * s];
    let (a, b) = (Vector3::new(-0.5, 0.125, 0.25) * s, Vector3::new(0.5, -0.25, 0.625) * s);
    let upright = Vector3::new(0.0, 0.0, 0.5) * s;
    let normal = Vector3::new(1.0, -2.0, 2.0) / 3.0;
    let radii = [0.25 * s, 0.5 * s, 1.0 * s];

    let mut scenes = vec![
        Scene::new("sphere", s, Exact, Sphere::new(0.75 * s))
            .convex()
            .inside(move |p| p.norm() <= 0.75 * s)
            .creases(&[0.75 * s]),
        Scene::new("half-space", s, Exact, HalfSpace::new([2.0, -4.0, 4.0], 0.25 * s))
            .convex()
            .inside(move |p| normal.dot(&p) <= 0.25 * s)
            .creases(&[0.25 * s]),
        Scene::new("cuboid", s, Exact, Cuboid::new(half_extents))
            .convex()
            .inside(move |p| (0..3).all(|k| p[k].abs() <= half_extents[k]))
            .creases(&half_extents),
        Scene::new("rounded box", s, Exact, RoundedBox::new(rounded, 0.25 * s))
            .convex()
            .inside(move |p| distance_to_box(p, rounded) <= 0.25 * s)
            .creases(&[0.375 * s, 0.5 * s, 0.25 * s, 0.625 * s]),
        Scene::new("capsule", s, Exact, Capsule::new(a.into(), b.into(), 0.25 * s))
            .convex()
            .inside(move |p| distance_to_segment(p, a, b) <= 0.25 * s)
            .creases(&[0.5 * s, 0.125 * s, 0.25 * s, 0.625 * s]),
        Scene::new("upright capsule", s, Exact, Capsule::new((-upright).into(), upright.into(), 0.375 * s))
            .convex()
            .inside(move |p| distance_to_segment(p, -upright, upright) <= 0.375 * s)
            .creases(&[0.5 * s, 0.375 * s]),
        Scene::new("capsule with coinciding ends", s, Exact, Capsule::new(a.into(), a.into(), 0.375 * s))
            .convex()
            .inside(move |p| (p - a).norm() <= 0.375 * s)
            .creases(&[0.5 * s, 0.125 * s, 0.25 * s]),
        Scene::new("cylinder", s, Exact, Cylinder::new(0.5 * s, 0.75 * s))
            .convex()
            .inside(move |p| p.xy().norm() <= 0.5 * s && p.z.abs() <= 0.75 * s)
            .creases(&[0.5 * s, 0.75 * s, 0.25 * s]),
        Scene::new("octahedron", s, Exact, Octahedron::new(0.875 * s))
            .convex()
            .inside(move |p| p.abs().sum() <= 0.875 * s)
            .creases(&[0.875 * s, 0.4375 * s, 0.25 * s]),
        Scene::new("ellipsoid", s, Bound, Ellipsoid::new(radii))
            .convex()
            .inside(move |p| (0..3).map(|k| (p[k] / radii[k]).powi(2)).sum::<f64>() <= 1.0)
            .creases(&radii),
        Scene::new("torus", s, Exact, Torus::new(0.625 * s, 0.25 * s))
            .inside(move |p| distance_to_ring(p, 0.625 * s) <= 0.25 * s)
            .creases(&[0.625 * s, 0.25 * s, 0.375 * s, 0.875 * s]),
        Scene::new("torus without a hole", s, Exact, Torus::new(0.5 * s, 0.5 * s))
            .inside(move |p| distance_to_ring(p, 0.5 * s) <= 0.5 * s)
            .creases(&[0.5 * s]),
    ];
    for (name, degrees) in [("cone of 1°", 1.0_f64), ("cone of 10°", 10.0), ("cone of 60°", 60.0)] {
        let (angle, height) = (degrees.to_radians(), if degrees > 45.0 { 0.5 * s } else { s });
        scenes.push(
            Scene::new(name, s, Exact, Cone::new(angle, height))
                .convex()
                .inside(move |p| p.z >= -height && p.xy().norm() <= -p.z * angle.tan())
                .creases(&[height, 0.5 * height]),
        );
    }
    scenes
}

pub fn bent_shapes(s: f64) -> Vec<Scene> {
    let mut scenes = vec![];
    for (name, cut) in [("bowl cut above its centre", 0.25), ("bowl cut below its centre", -0.25), ("half bowl", 0.0)] {
        let (radius, cut, thickness) = (0.75 * s, cut * s, 0.1875 * s);
        scenes.push(
            Scene::new(name, s, Meaning::Exact, Bowl::new(radius, cut, thickness))
                .inside(move |p| distance_to_bowl(p, radius, (cut / radius).acos()) <= 0.5 * thickness)
                .creases(&[radius, 0.25 * s]),
        );
    }
    for (name, degrees, leg) in [
        ("horseshoe bent by 60° with legs", 60.0_f64, 0.25),
        ("horseshoe bent by 60° without legs", 60.0, 0.0),
        ("horseshoe bent by 90° with legs", 90.0, 0.25),
        ("horseshoe bent by 90° without legs", 90.0, 0.0),
        ("horseshoe bent by 150° with legs", 150.0, 0.125),
        ("horseshoe bent by 150° without legs", 150.0, 0.0),
        // From the far side of the arc the plane of its own end is nearer than the wall, and must be ignored.
        ("nearly closed horseshoe", 170.0, 0.0),
    ] {
        let (radius, thickness, leg, half_depth) = (0.5 * s, 0.25 * s, leg * s, 0.3125 * s);
        let bend = degrees.to_radians();
        // Only a right angle has walls at exact coordinates. Where the legs end, cos(π/2) is not exactly zero.
        let creases = match degrees == 90.0 {
            true if leg > 0.0 => vec![half_depth, 0.625 * s, radius],
            true => vec![half_depth],
            false if degrees > 90.0 => vec![half_depth, 0.25 * s, radius],
            false => vec![half_depth, 0.25 * s, 0.125 * s],
        };
        scenes.push(
            Scene::new(name, s, Meaning::Exact, Horseshoe::new(radius, thickness, bend, leg, half_depth))
                .inside(move |p| p.z.abs() <= half_depth && is_in_horseshoe(p.xy(), radius, thickness, bend, leg))
                .creases(&creases),
        );
    }
    scenes
}
