//! Sign, magnitude, slope bound and bounding boxes of fields.

use nalgebra::Vector3;
use sdf_core::shapes::{Bowl, Capsule, Horseshoe};
use sdf_core::{EnclosedSdf, Sample, Sdf};
use sdf_tests::oracle::surface_points;
use sdf_tests::random::Random;
use sdf_tests::scenes::{Meaning, distance_to_bowl, is_in_horseshoe, scenes};

#[test]
fn sign_and_magnitude_are_those_of_the_true_distance() {
    let mut random = Random::seeded();
    for scene in scenes(1.0).iter().filter(|scene| scene.meaning != Meaning::Samples) {
        let is_inside = |point| scene.contains(point).unwrap();
        let mut points = scene.crease_points();
        points.extend(scene.random_points(&mut random, 700));
        let is_exact = scene.meaning == Meaning::Exact;
        assert_distance(&scene.field, scene.name, is_inside, scene.size, is_exact, &points, &mut random);
    }
}

/// Bent shapes have the most cases, which depend on their parameters.
#[test]
fn bent_shapes_are_exact_whatever_their_parameters() {
    let mut random = Random::seeded();
    for _ in 0..30 {
        let points: Vec<_> = (0..100).map(|_| random.in_cube(2.0)).collect();

        let cut = random.between(-0.95, 0.95);
        let opening = if cut > 0.0 { (1.0 - cut * cut).sqrt() } else { 1.0 };
        let thickness = random.between(0.1, 1.9) * opening;
        let name = format!("bowl cut at {cut} of thickness {thickness}");
        let is_inside = |point| distance_to_bowl(point, 1.0, cut.acos()) <= 0.5 * thickness;
        let bowl = Bowl::new(1.0, cut, thickness).unwrap();
        assert_distance(&bowl, &name, is_inside, 2.0, true, &points, &mut random);
        // A wall that closes the opening: below the distance inside.
        let thickness = random.between(2.1, 3.0) * opening;
        let name = format!("bowl cut at {cut} of thickness {thickness}");
        let is_inside = |point| distance_to_bowl(point, 1.0, cut.acos()) <= 0.5 * thickness;
        let bowl = Bowl::new(1.0, cut, thickness).unwrap();
        assert_distance(&bowl, &name, is_inside, 1.0 + thickness, false, &points, &mut random);

        let (bend, thickness, leg) = (random.between(0.1, 3.1), random.between(0.1, 1.0), random.between(0.0, 1.0));
        let half_depth = random.between(0.1, 1.0);
        // A horseshoe with crossing legs is refused.
        let Some(horseshoe) = Horseshoe::new(1.0, thickness, bend, leg, half_depth) else { continue };
        let name = format!("horseshoe of thickness {thickness} bent by {bend} with legs of {leg}");
        let is_inside = |p: Vector3<f64>| p.z.abs() <= half_depth && is_in_horseshoe(p.xy(), 1.0, thickness, bend, leg);
        assert_distance(&horseshoe, &name, is_inside, 2.5, true, &points, &mut random);
    }
}

/// Checks (a) that no point of the surface is nearer than |φ|, on a cloud of points that membership alone gives; and (b), if φ is
/// exact, that some point is at that distance: a step of φ against the gradient ends within 1e-7 of both sides.
fn assert_distance(
    field: &impl EnclosedSdf,
    name: &str,
    is_inside: impl Fn(Vector3<f64>) -> bool + Copy,
    size: f64,
    is_exact: bool,
    points: &[Vector3<f64>],
    random: &mut Random,
) {
    let cloud = surface_points(is_inside, size, 2000, random);
    assert!(cloud.len() > 20, "{name}: {} points", cloud.len());
    for point in &cloud {
        let value = field.value(*point);
        assert!(value.abs() < 1e-9, "{name}: {value} on the surface at {point:?}");
    }
    for point in points {
        let Sample { value, gradient, .. } = field.evaluate(*point);
        if value.abs() > 1e-9 {
            assert_eq!(value < 0.0, is_inside(*point), "{name}: the sign of {value} at {point:?}");
        }
        let nearest = cloud.iter().map(|at| (at - point).norm_squared()).fold(f64::INFINITY, f64::min).sqrt();
        assert!(value.abs() <= nearest + 1e-9, "{name}: {value} at {point:?}, but {nearest} away");
        if is_exact {
            assert!((gradient.norm() - 1.0).abs() < 1e-9, "{name} at {point:?}: {gradient:?}");
            let foot = point - gradient * value;
            assert!(
                is_at_surface(is_inside, foot, 1e-7, random),
                "{name}: no surface at distance {value} from {point:?} against {gradient:?}"
            );
        }
    }
}

/// Is a point on the other side within `radius`? Tries the axes first: random directions seldom hit a needle's tip.
fn is_at_surface(
    is_inside: impl Fn(Vector3<f64>) -> bool,
    point: Vector3<f64>,
    radius: f64,
    random: &mut Random,
) -> bool {
    let side = is_inside(point);
    let axes = (0..6).map(|k| Vector3::ith(k / 2, if k % 2 == 0 { radius } else { -radius }));
    axes.chain((0..500).map(|_| random.direction() * radius)).any(|step| is_inside(point + step) != side)
}

#[test]
fn no_pair_of_points_is_steeper_than_the_slope_bound() {
    let mut random = Random::seeded();
    for scene in scenes(1.0) {
        let slope_bound = scene.slope_bound();
        let mut points = scene.crease_points();
        points.extend(scene.random_points(&mut random, 3000));
        for (i, a) in points.iter().enumerate() {
            let length = random.pick(&[1e-9, 1e-6, 1e-3, 0.03, 0.3]) * scene.size;
            let uphill = a + scene.evaluate(*a).gradient * length;
            for b in [uphill, a + random.direction() * length, points[(i * 7 + 1) % points.len()]] {
                let rise = (scene.value(*a) - scene.value(b)).abs();
                // An evaluation has some thirty roundings of numbers no larger than the point, the value and the size.
                let rounding = 32.0 * f64::EPSILON * slope_bound * (a.norm() + b.norm() + scene.size);
                assert!(
                    rise <= slope_bound * (a - b).norm() + rounding,
                    "{}: {a:?} {b:?} slope {} > {slope_bound}",
                    scene.name,
                    rise / (a - b).norm()
                );
            }
        }
    }
}

#[test]
fn bounds_contain_every_point_up_to_their_level() {
    let mut random = Random::seeded();
    for scene in scenes(1.0) {
        for level in [-0.3, -0.1, -0.01, 0.0, 0.01, 0.2, 1.0] {
            let bounds = scene.bounds(level);
            let mut points = scene.crease_points();
            points.extend((0..4000).map(|_| random.in_cube(2.2 * scene.size)));
            for point in points.iter().filter(|point| scene.value(**point) <= level) {
                for axis in 0..3 {
                    // The box and the value round differently.
                    let slack = 1e-12 * scene.size;
                    let is_inside = (bounds.min[axis] - slack..=bounds.max[axis] + slack).contains(&point[axis]);
                    assert!(is_inside, "{}: {} at {point:?}, outside {bounds:?}", scene.name, scene.value(*point));
                }
            }
        }
    }
}

/// Bounds are useful: the box of a bounded shape is bounded, and not many times too large.
#[test]
fn bounds_of_bounded_shapes_are_bounded() {
    for scene in scenes(1.0).iter().filter(|scene| scene.name != "half-space") {
        assert!(scene.bounds(0.0).diagonal() < 8.0 * scene.size, "{}: {:?}", scene.name, scene.bounds(0.0));
    }
}

/// Gradients on the axis of a capsule, where the offset from it is mere rounding, are normal to it, and a step of φ along one
/// ends on the surface.
#[test]
fn gradients_on_the_axis_of_a_capsule_are_normal_to_it() {
    let mut random = Random::seeded();
    for _ in 0..2000 {
        let [a, b] = [(); 2].map(|()| random.in_cube(3.0));
        let capsule = Capsule::new(a.into(), b.into(), 0.2).unwrap();
        let point = a + (b - a) * random.between(0.05, 0.95);
        let Sample { value, gradient, .. } = capsule.evaluate(point);
        let along = gradient.dot(&(b - a).normalize());
        assert!(along.abs() < 1e-9, "{along} at {point} between {a} and {b}");
        let at_surface = capsule.value(point - gradient * value);
        assert!(at_surface.abs() < 1e-9, "{at_surface} at {point} between {a} and {b}");
    }
}
