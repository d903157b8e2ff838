//! Values and gradients: the gradient is the derivative, kinks are reported, lanes equal scalars.

use nalgebra::Vector3;
use sdf_core::{Float, Lanes, Real, Sample, Sdf};
use sdf_tests::dual::Dual;
use sdf_tests::extremes::hostile_points;
use sdf_tests::lanes::{lane_sample, pack_points};
use sdf_tests::random::Random;
use sdf_tests::scenes::{Meaning, scenes};

fn cast<R: Real>(point: Vector3<f64>) -> Vector3<R> {
    point.map(R::from_f64)
}

fn bits<R: Float>(sample: Sample<R>) -> [u64; 4] {
    [sample.value, sample.gradient.x, sample.gradient.y, sample.gradient.z].map(|x| x.to_f64().to_bits())
}

/// Tolerance of a gradient, in ε · slope bound.
///
/// The gradient and the dual number's derivative take the same branch and differ in the order of some ten operations on unit
/// vectors, so by some tens of roundings. Near an axis or a centre the same small length divides both.
const GRADIENT_ROUNDINGS: f64 = 256.0;

fn gradient_is_the_derivative<R: Float>()
where
    Dual<R>: Real<Mask = bool>,
{
    let mut random = Random::seeded();
    for scene in scenes(1.0) {
        let tolerance = R::EPSILON * GRADIENT_ROUNDINGS * scene.slope_bound();
        for point in scene.random_points(&mut random, 2000) {
            let point = cast::<R>(point);
            let sample = scene.evaluate(point);
            let dual = scene.evaluate(Dual::variables(point));
            assert_eq!(sample.status, dual.status, "{} at {point:?}", scene.name);
            assert_eq!(sample.value, dual.value.value, "{} at {point:?}", scene.name);
            if sample.status.degenerate_gradient {
                continue;
            }
            // Two parts that round to one value in f32 can differ in f64: then the dual number in f32 takes a side of the tie.
            let finer = scene.evaluate(Dual::variables(point.map(R::to_f64))).value.gradient;
            let gradient = sample.gradient.map(R::to_f64);
            let is_near = |slope: [f64; 3]| (gradient - Vector3::from(slope)).amax() <= tolerance;
            assert!(
                is_near(dual.value.gradient.map(R::to_f64)) || is_near(finer),
                "{} at {point:?}: gradient {gradient:?}, derivative {:?}",
                scene.name,
                dual.value.gradient
            );
        }
    }
}

#[test]
fn the_gradient_is_the_derivative_of_the_value_in_f64() {
    gradient_is_the_derivative::<f64>();
}

#[test]
fn the_gradient_is_the_derivative_of_the_value_in_f32() {
    gradient_is_the_derivative::<f32>();
}

/// Creases have measure zero: a random point that is called degenerate shows that the flag is set too often.
#[test]
fn no_random_point_is_degenerate() {
    let mut random = Random::seeded();
    for scene in scenes(1.0) {
        for point in scene.random_points(&mut random, 2000) {
            let status = scene.evaluate(point).status;
            assert!(!status.degenerate_gradient && !status.not_finite, "{} at {point:?}", scene.name);
        }
    }
}

/// Either the status reports that there is no derivative, or the value has one: on axes, centres, edges and ties. Grids are left
/// out: their gradient is one-sided on the faces of cells, as documented.
#[test]
fn where_the_value_has_a_kink_the_status_says_so() {
    const STEP: f64 = 1e-6;
    // Where a scene is smooth its radius of curvature is at least 1/64, so a difference quotient is off by at most STEP · 32.
    const TOLERANCE: f64 = 1e-4;
    for scene in scenes(1.0).iter().filter(|scene| scene.meaning != Meaning::Samples) {
        for point in scene.crease_points() {
            let sample = scene.evaluate(point);
            if sample.status.degenerate_gradient {
                continue;
            }
            for (axis, slope) in sample.gradient.iter().enumerate() {
                for step in [-STEP, STEP] {
                    let mut beside = point;
                    beside[axis] += step;
                    let difference = (scene.value(beside) - sample.value) / step;
                    assert!(
                        (difference - slope).abs() < TOLERANCE,
                        "{} at {point:?}: by axis {axis} {slope}, measured {difference} by {step}",
                        scene.name
                    );
                }
            }
        }
    }
}

#[test]
fn on_creases_nothing_is_nan_and_no_gradient_is_steeper_than_the_bound() {
    fn check<R: Float>() {
        for scene in scenes(1.0) {
            // A slope is off by some ten roundings.
            let steepest = scene.slope_bound() * (1.0 + 32.0 * R::EPSILON);
            for point in scene.crease_points() {
                let sample = scene.evaluate(cast::<R>(point));
                let gradient = sample.gradient.map(Float::to_f64);
                assert!(sample.value.to_f64().is_finite(), "{} at {point:?}: {sample:?}", scene.name);
                assert!(gradient.norm() <= steepest, "{} at {point:?}: {sample:?}", scene.name);
            }
        }
    }
    check::<f32>();
    check::<f64>();
}

#[test]
fn value_is_bit_for_bit_the_value_of_evaluate() {
    fn check<R: Real + PartialEq>(random: &mut Random, pack: impl Fn(&mut dyn FnMut() -> Vector3<f64>) -> Vector3<R>) {
        for scene in scenes(1.0) {
            let mut points = scene.crease_points();
            points.extend(scene.random_points(random, 400));
            for _ in 0..400 {
                let point = pack(&mut || random.pick(&points));
                assert_eq!(scene.value(point), scene.evaluate(point).value, "{} at {point:?}", scene.name);
            }
        }
    }
    let random = &mut Random::seeded();
    check::<f32>(random, |next| cast(next()));
    check::<f64>(random, |next| cast(next()));
    check::<Lanes<f32, 8>>(random, |next| pack_points(&std::array::from_fn(|_| cast(next()))));
    check::<Lanes<f64, 4>>(random, |next| pack_points(&std::array::from_fn(|_| cast(next()))));
}

#[test]
fn one_lane_of_a_sample_equals_the_scalar_bit_for_bit() {
    fn check<R: Float, const N: usize>() {
        let mut random = Random::seeded();
        for scene in scenes(1.0) {
            let mut points = scene.crease_points();
            points.extend(scene.random_points(&mut random, 400));
            points.extend(hostile_points());
            for _ in 0..points.len() {
                let scalar: [Vector3<R>; N] = std::array::from_fn(|_| cast(random.pick(&points)));
                let packed = scene.sample(pack_points(&scalar));
                for (i, point) in scalar.iter().enumerate() {
                    let (sample, lane) = (scene.sample(*point), lane_sample(&packed, i));
                    assert_eq!(sample.status, lane.status, "{} at {point:?}", scene.name);
                    assert_eq!(bits(sample), bits(lane), "{} at {point:?}", scene.name);
                }
            }
        }
    }
    check::<f32, 8>();
    check::<f64, 4>();
}
