//! Values beyond a grid's box: continuous, never above the distance, and within the slope bound.

use nalgebra::Vector3;
use sdf_core::contact::{Outcome, contact};
use sdf_core::minimize::{FrankWolfe, ProjectedGradient};
use sdf_core::shapes::{HalfSpace, Sphere};
use sdf_core::{Aabb, Float, Sdf, Simplex};
use sdf_tests::oracle::element;
use sdf_tests::random::Random;
use sdf_tests::scenes::{Meaning, Scene, cube_lattice, sampled, scenes};

fn nearest_point(bounds: &Aabb, point: Vector3<f64>) -> Vector3<f64> {
    Vector3::from_fn(|k, _| point[k].clamp(bounds.min[k], bounds.max[k]))
}

#[test]
fn across_the_box_the_value_is_continuous_and_outside_the_status_says_so() {
    let mut random = Random::seeded();
    const STEP: f64 = 1e-9;
    // Grids around the origin, without placement or combination.
    let is_grid = |scene: &&Scene| {
        let is_composed = scene.name.starts_with("turned") || scene.name.starts_with("union");
        scene.meaning == Meaning::Samples && !is_composed
    };
    for scene in scenes(1.0).iter().filter(is_grid) {
        let half = if scene.name == "grid of a piece of a cuboid" { 0.4375 } else { 0.75 };
        for _ in 0..3000 {
            let mut on_box = random.in_cube(half);
            for _ in 0..=random.below(3) {
                on_box[random.below(3)] = random.pick(&[-half, half]);
            }
            let inward = on_box * (1.0 - STEP);
            let outward = on_box * (1.0 + STEP);
            let (inside, outside) = (scene.evaluate(inward), scene.evaluate(outward));
            let allowed = scene.slope_bound() * (outward - inward).norm() + 1e-14;
            assert!(
                (inside.value - outside.value).abs() <= allowed,
                "{} at {on_box:?}: {inside:?} {outside:?}",
                scene.name
            );
            assert!(!inside.status.outside_grid && outside.status.outside_grid, "{} at {on_box:?}", scene.name);
        }
    }
}

/// The surface is inside the box. With d the distance to the box and P its nearest point, hypot(d, φ(P)) exceeds the distance
/// only by the interpolation error. A sphere's distance is convex along each axis, with curvature at most 1/|x|, so its
/// interpolant exceeds it by at most 3·spacing²/8 over the radius at the box.
#[test]
fn outside_the_value_is_never_more_than_the_distance() {
    let mut random = Random::seeded();
    let sphere = Sphere::new(0.5).unwrap();
    for (half, cells) in [(0.55, 11), (0.75, 24), (0.51, 32)] {
        let grid = sampled(&sphere, cube_lattice(half, cells), 1.0);
        let spacing = grid.lattice().spacing();
        let excess = 3.0 / 8.0 * spacing * spacing / half + 1e-6;
        let mut worst: f64 = 0.0;
        for _ in 0..20_000 {
            let half_side = random.pick(&[1.0, 3.0, 30.0]);
            let point = random.in_cube(half_side);
            let sample = grid.evaluate(point);
            let outside = point.amax() > half;
            assert_eq!(sample.status.outside_grid, outside, "{point:?}");
            if outside {
                let distance = sphere.value(point);
                assert!(sample.value <= distance + excess, "{point:?}: {} of {distance}", sample.value);
                worst = worst.max((distance - sample.value) / distance);
                let box_distance = (point - nearest_point(&grid.lattice().bounds(), point)).norm();
                assert!(sample.value >= box_distance, "{point:?}: {} is below the distance to the box", sample.value);
            }
        }
        // The bound is useful: far away it is nearly the distance.
        assert!(worst < 0.6, "{worst}");
    }
}

/// Regression: straight outward from where the solid reaches the box the slope bound was once broken. There the value rises with
/// the distance and, along the box, with the samples' own slope.
#[test]
fn where_the_solid_reaches_the_box_the_slope_bound_holds_beyond_it() {
    let mut random = Random::seeded();
    let plane = HalfSpace::new([1.0, 0.0, 0.0], 0.5).unwrap();
    let grid = sampled(&plane, cube_lattice(1.0, 4), 1.0);
    for _ in 0..10_000 {
        let point = random.in_cube(2.0);
        let gradient = grid.evaluate(point).gradient;
        assert!(gradient.norm() <= grid.slope_bound() + 1e-12, "{point:?}: {}", gradient.norm());
    }
    let below = grid.bounds(0.0);
    assert!(grid.value(Vector3::new(-0.5, 0.0, 1.75)) < 0.0 && below.max[2] >= 1.75, "{below:?}");
}

/// A sphere that nearly fills its box, and a triangle with one corner 0.1 deep and two far outside. An extrapolation above the
/// distance would cull it.
#[test]
fn a_triangle_far_outside_with_one_corner_inside_is_found() {
    fn check<R: Float>() {
        let grid = sampled(&Sphere::new(0.5).unwrap(), cube_lattice(0.55, 44), 1.0);
        let corners = [[0.37280, 0.10252, 0.10252], [2.81360, 1.12729, 0.42019], [2.81360, 0.42019, 1.12729]];
        let corners = corners.map(|corner| Vector3::from(corner).map(R::from_f64));
        let element = element(0, Simplex { corners });
        let depth = |outcome: Outcome<R, 3>| match outcome {
            Outcome::Contact(contact) => contact.distance.to_f64(),
            other => panic!("{other:?}"),
        };
        for margin in [0.0, -0.05] {
            let margin = R::from_f64(margin);
            // The corner is 0.1 deep; the grid's error is below 3·spacing²/8 over the corner's radius of 0.4.
            assert!((depth(contact(&grid, &FrankWolfe::default(), margin, &element)) + 0.1).abs() < 2e-3);
            assert!((depth(contact(&grid, &ProjectedGradient::default(), margin, &element)) + 0.1).abs() < 2e-3);
        }
    }
    check::<f32>();
    check::<f64>();
}
