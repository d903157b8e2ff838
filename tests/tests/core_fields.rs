//! Laws of fields: promises 1, 2 and 4, asked of every field in the table.

use nalgebra::Vector3;
use sdf_core::shapes::{Bowl, Horseshoe};
use sdf_core::{Aabb, EnclosedSdf, Float, Lanes, Real, Sample, Sdf, Simplex};
use sdf_tests::dual::Dual;
use sdf_tests::extremes::hostile_points;
use sdf_tests::lanes::{sample_of_lane, side_by_side};
use sdf_tests::oracle::{cast, lattice_weights, random_simplex, surface_points};
use sdf_tests::random::Random;
use sdf_tests::scenes::{Meaning, distance_to_bowl, in_horseshoe, scenes};

fn to<R: Real>(point: Vector3<f64>) -> Vector3<R> {
    point.map(R::from_f64)
}

fn bits<R: Float>(sample: Sample<R>) -> [u64; 4] {
    [sample.value, sample.gradient.x, sample.gradient.y, sample.gradient.z].map(|x| x.to_f64().to_bits())
}

/// The gradient and the dual number's derivative take the same branch and differ in the order of some ten operations
/// on unit vectors, so by some tens of roundings; near an axis or a centre the same small length divides both.
const GRADIENT_ROUNDINGS: f64 = 256.0;

fn gradient_is_the_derivative<R: Float>()
where
    Dual<R>: Real<Mask = bool>,
{
    let mut random = Random::of_test();
    for scene in scenes(1.0) {
        let tolerance = R::EPSILON * GRADIENT_ROUNDINGS * scene.slope_bound();
        for point in scene.random_points(&mut random, 2000) {
            let point = to::<R>(point);
            let sample = scene.evaluate(point);
            let dual = scene.evaluate(Dual::variables(point));
            assert_eq!(sample.status, dual.status, "{} at {point:?}", scene.name);
            assert_eq!(sample.value, dual.value.value, "{} at {point:?}", scene.name);
            if sample.status.degenerate_gradient {
                continue;
            }
            // Where two parts round to the same value in f32, the dual number takes one side of a tie that is none in f64.
            let finer = scene.evaluate(Dual::variables(point.map(R::to_f64))).value.slope;
            let gradient = sample.gradient.map(R::to_f64);
            let is_near = |slope: [f64; 3]| (gradient - Vector3::from(slope)).amax() <= tolerance;
            assert!(
                is_near(dual.value.slope.map(R::to_f64)) || is_near(finer),
                "{} at {point:?}: gradient {gradient:?}, derivative {:?}",
                scene.name,
                dual.value.slope
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

/// Creases are of measure zero: where random points are called degenerate, the flag is set too often.
#[test]
fn no_random_point_is_degenerate() {
    let mut random = Random::of_test();
    for scene in scenes(1.0) {
        for point in scene.random_points(&mut random, 2000) {
            let status = scene.evaluate(point).status;
            assert!(!status.degenerate_gradient && !status.not_finite, "{} at {point:?}", scene.name);
        }
    }
}

/// On axes, centres, edges and ties: either the status says that there is no derivative, or the value has one. The
/// grid is left out, whose gradient is one-sided on the faces of its cells and says so in its documentation.
#[test]
fn where_the_value_has_a_kink_the_status_says_so() {
    const STEP: f64 = 1e-6;
    // The curvature radius of no scene is below 1/64 where it is smooth, so that a difference is off by STEP · 32.
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
            // A slope is some ten operations from exact.
            let steepest = scene.slope_bound() * (1.0 + 32.0 * R::EPSILON);
            for point in scene.crease_points() {
                let sample = scene.evaluate(to::<R>(point));
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
    fn check<R: Real + PartialEq>(
        random: &mut Random,
        spread: impl Fn(&mut dyn FnMut() -> Vector3<f64>) -> Vector3<R>,
    ) {
        for scene in scenes(1.0) {
            let mut points = scene.crease_points();
            points.extend(scene.random_points(random, 400));
            for _ in 0..400 {
                let point = spread(&mut || random.pick(&points));
                assert_eq!(scene.value(point), scene.evaluate(point).value, "{} at {point:?}", scene.name);
            }
        }
    }
    let random = &mut Random::of_test();
    check::<f32>(random, |next| to(next()));
    check::<f64>(random, |next| to(next()));
    check::<Lanes<f32, 8>>(random, |next| side_by_side(&std::array::from_fn(|_| to(next()))));
    check::<Lanes<f64, 4>>(random, |next| side_by_side(&std::array::from_fn(|_| to(next()))));
}

#[test]
fn one_lane_of_a_sample_equals_the_scalar_bit_for_bit() {
    fn check<R: Float, const N: usize>() {
        let mut random = Random::of_test();
        for scene in scenes(1.0) {
            let mut points = scene.crease_points();
            points.extend(scene.random_points(&mut random, 400));
            points.extend(hostile_points());
            for _ in 0..points.len() {
                let batch: [Vector3<R>; N] = std::array::from_fn(|_| to(random.pick(&points)));
                let samples = scene.sample(side_by_side(&batch));
                for (i, point) in batch.iter().enumerate() {
                    let (alone, beside) = (scene.sample(*point), sample_of_lane(&samples, i));
                    assert_eq!(alone.status, beside.status, "{} at {point:?}", scene.name);
                    assert_eq!(bits(alone), bits(beside), "{} at {point:?}", scene.name);
                }
            }
        }
    }
    check::<f32, 8>();
    check::<f64, 4>();
}

#[test]
fn no_pair_of_points_is_steeper_than_the_slope_bound() {
    let mut random = Random::of_test();
    for scene in scenes(1.0) {
        let steepest = scene.slope_bound();
        let mut points = scene.crease_points();
        points.extend(scene.random_points(&mut random, 3000));
        for (i, a) in points.iter().enumerate() {
            let apart = random.pick(&[1e-9, 1e-6, 1e-3, 0.03, 0.3]) * scene.size;
            let uphill = a + scene.evaluate(*a).gradient * apart;
            for b in [uphill, a + random.direction() * apart, points[(i * 7 + 1) % points.len()]] {
                let rise = (scene.value(*a) - scene.value(b)).abs();
                // An evaluation is some thirty roundings of numbers no larger than the point, the value and the size.
                let rounding = 32.0 * f64::EPSILON * steepest * (a.norm() + b.norm() + scene.size);
                assert!(
                    rise <= steepest * (a - b).norm() + rounding,
                    "{}: {a:?} {b:?} slope {} of {steepest}",
                    scene.name,
                    rise / (a - b).norm()
                );
            }
        }
    }
}

#[test]
fn sign_and_magnitude_are_those_of_the_true_distance() {
    let mut random = Random::of_test();
    for scene in scenes(1.0).iter().filter(|scene| scene.meaning != Meaning::Samples) {
        let holds = |point| scene.holds(point).unwrap();
        let mut points = scene.crease_points();
        points.extend(scene.random_points(&mut random, 700));
        let is_exact = scene.meaning == Meaning::Exact;
        assert_distance(scene, scene.name, holds, scene.size, is_exact, &points, &mut random);
    }
}

/// The bent shapes have the most cases, and other cases for other parameters.
#[test]
fn bent_shapes_are_exact_whatever_their_parameters() {
    let mut random = Random::of_test();
    for _ in 0..30 {
        let points: Vec<_> = (0..100).map(|_| random.in_cube(2.0)).collect();

        let cut = random.between(-0.95, 0.95);
        let opening = if cut > 0.0 { (1.0 - cut * cut).sqrt() } else { 1.0 };
        let thickness = random.between(0.1, 1.9) * opening;
        let name = format!("bowl cut at {cut} of thickness {thickness}");
        let holds = |point| distance_to_bowl(point, 1.0, cut.acos()) <= 0.5 * thickness;
        let bowl = Bowl::new(1.0, cut, thickness).unwrap();
        assert_distance(&bowl, &name, holds, 2.0, true, &points, &mut random);

        let (bend, thickness, leg) = (random.between(0.1, 3.1), random.between(0.1, 1.0), random.between(0.0, 1.0));
        let half_depth = random.between(0.1, 1.0);
        // Legs that would cross are refused.
        let Some(horseshoe) = Horseshoe::new(1.0, thickness, bend, leg, half_depth) else { continue };
        let name = format!("horseshoe of thickness {thickness} bent by {bend} with legs of {leg}");
        let holds = |p: Vector3<f64>| p.z.abs() <= half_depth && in_horseshoe(p.xy(), 1.0, thickness, bend, leg);
        assert_distance(&horseshoe, &name, holds, 2.5, true, &points, &mut random);
    }
}

/// (a) No point of the surface is nearer than |φ|: asked of a cloud of points that membership alone gives. (b) One lies
/// just that far, if φ is exact: where a step of φ against the gradient ends, members and others are both within 1e-7.
fn assert_distance(
    field: &impl EnclosedSdf,
    name: &str,
    holds: impl Fn(Vector3<f64>) -> bool + Copy,
    size: f64,
    is_exact: bool,
    points: &[Vector3<f64>],
    random: &mut Random,
) {
    let cloud = surface_points(holds, size, 2000, random);
    assert!(cloud.len() > 20, "{name}: {} points", cloud.len());
    for point in &cloud {
        let value = field.value(*point);
        assert!(value.abs() < 1e-9, "{name}: {value} on the surface at {point:?}");
    }
    for point in points {
        let Sample { value, gradient, .. } = field.evaluate(*point);
        if value.abs() > 1e-9 {
            assert_eq!(value < 0.0, holds(*point), "{name}: the sign of {value} at {point:?}");
        }
        let nearest = cloud.iter().map(|at| (at - point).norm_squared()).fold(f64::INFINITY, f64::min).sqrt();
        assert!(value.abs() <= nearest + 1e-9, "{name}: {value} at {point:?}, but {nearest} away");
        if is_exact {
            assert!((gradient.norm() - 1.0).abs() < 1e-9, "{name} at {point:?}: {gradient:?}");
            let foot = point - gradient * value;
            let told = format!("{name}: no surface {value} from {point:?} against {gradient:?}");
            assert!(is_at_surface(holds, foot, 1e-7, random), "{told}");
        }
    }
}

/// Along the axes first: random directions seldom meet the inside of a needle's tip.
fn is_at_surface(holds: impl Fn(Vector3<f64>) -> bool, at: Vector3<f64>, within: f64, random: &mut Random) -> bool {
    let side = holds(at);
    let axes = (0..6).map(|k| Vector3::ith(k / 2, if k % 2 == 0 { within } else { -within }));
    axes.chain((0..500).map(|_| random.direction() * within)).any(|step| holds(at + step) != side)
}

#[test]
fn bounds_hold_every_point_up_to_their_level() {
    let mut random = Random::of_test();
    for scene in scenes(1.0) {
        for level in [-0.3, -0.1, -0.01, 0.0, 0.01, 0.2, 1.0] {
            let bounds = scene.bounds(level);
            let mut points = scene.crease_points();
            points.extend((0..4000).map(|_| random.in_cube(2.2 * scene.size)));
            for point in points.iter().filter(|point| scene.value(**point) <= level) {
                for axis in 0..3 {
                    // The box and the value are rounded differently.
                    let slack = 1e-12 * scene.size;
                    let within = (bounds.min[axis] - slack..=bounds.max[axis] + slack).contains(&point[axis]);
                    assert!(within, "{}: {} at {point:?}, beyond {bounds:?}", scene.name, scene.value(*point));
                }
            }
        }
    }
}

/// Bounds are of use: no shape that is bounded has an unbounded box, and it is not many times too large.
#[test]
fn bounds_of_bounded_shapes_are_bounded() {
    for scene in scenes(1.0).iter().filter(|scene| scene.name != "half-space") {
        assert!(scene.bounds(0.0).diagonal() < 8.0 * scene.size, "{}: {:?}", scene.name, scene.bounds(0.0));
    }
}

/// Boxes from the size of a point to larger than the shape, some of them reaching out of a grid.
#[test]
fn what_is_certain_of_a_box_holds_at_all_of_its_points() {
    let mut random = Random::of_test();
    for scene in scenes(1.0) {
        let mut informed = 0;
        for _ in 0..200 {
            let center = random.in_cube(1.5 * scene.size);
            let reach = scene.size * 10.0_f64.powf(random.between(-4.0, 0.5));
            let region = Aabb { min: center.into(), max: center.into() }.inflate(reach);
            let certain = scene.enclose_box(&region);
            informed += u32::from(certain.range.lower.is_finite());
            assert!(certain.slope_bound <= scene.slope_bound(), "{}: {certain:?}", scene.name);
            let points: Vec<_> = (0..40).map(|_| center + random.in_cube(reach)).collect();
            let values: Vec<f64> = points.iter().map(|point| scene.value(*point)).collect();
            // Interpolation in f64 of f32 samples, whose bounds are f32 too.
            let rounding = 4.0 * f64::from(f32::EPSILON) * scene.slope_bound() * scene.size;
            for (a, pair) in values.iter().enumerate() {
                assert!(
                    certain.range.lower <= pair + rounding,
                    "{}: {certain:?}, but {pair} in {region:?}",
                    scene.name
                );
                assert!(
                    *pair <= certain.range.upper + rounding,
                    "{}: {certain:?}, but {pair} in {region:?}",
                    scene.name
                );
                for b in 0..a {
                    let most = certain.slope_bound * (points[a] - points[b]).norm() + rounding;
                    let change = (pair - values[b]).abs();
                    assert!(change <= most, "{}: {change} > {most} in {region:?}: {certain:?}", scene.name);
                }
            }
        }
        if scene.name.starts_with("sparse") || scene.name.starts_with("bounded") {
            assert!(informed > 50, "{}: nothing is known of {} of 200 boxes", scene.name, 200 - informed);
        }
    }
}

#[test]
fn a_survey_holds_on_the_whole_hull() {
    fn check<R: Float, const N: usize>(random: &mut Random) {
        for scene in scenes(1.0) {
            for _ in 0..150 {
                let simplex = cast::<R, N>(&random_simplex(random, 1.5 * scene.size));
                let enclosure = scene.enclosure(simplex.centroid(), &simplex.corners);
                let told = || format!("{}: {enclosure:?} of {simplex:?}", scene.name);
                assert!(
                    enclosure.range.lower <= enclosure.value && enclosure.value <= enclosure.range.upper,
                    "{}",
                    told()
                );
                for weights in lattice_weights::<N>(if N == 4 { 6 } else { 12 }) {
                    let value = scene.value(simplex.point(weights.map(R::from_f64)));
                    assert!(
                        enclosure.range.lower <= value && value <= enclosure.range.upper,
                        "{value:?} at {weights:?}, {}",
                        told()
                    );
                    let gradient = scene.evaluate(simplex.point(weights.map(R::from_f64))).gradient;
                    let rounding = R::from_f64(1e3 * R::EPSILON * scene.slope_bound());
                    let is_within =
                        gradient.iter().zip(&enclosure.gradients.lower).all(|(g, least)| *least - rounding <= *g)
                            && gradient.iter().zip(&enclosure.gradients.upper).all(|(g, most)| *g <= *most + rounding);
                    assert!(is_within, "{gradient:?} at {weights:?}, {}", told());
                }
            }
        }
    }
    let mut random = Random::of_test();
    check::<f64, 1>(&mut random);
    check::<f64, 2>(&mut random);
    check::<f64, 3>(&mut random);
    check::<f64, 4>(&mut random);
    check::<f32, 2>(&mut random);
    check::<f32, 3>(&mut random);
}

#[test]
fn no_way_to_a_corner_rises_by_more_than_is_certain() {
    fn check<R: Float, const N: usize>(random: &mut Random) {
        for scene in scenes(1.0) {
            for _ in 0..60 {
                let simplex = cast::<R, N>(&random_simplex(random, 1.5 * scene.size));
                let rises = scene.max_rise_to_corners(&simplex.corners);
                let edge = simplex.longest_edge().to_f64() * scene.slope_bound();
                let rounding = 1e3 * R::EPSILON * (scene.size + edge);
                for weights in lattice_weights::<N>(5) {
                    for (corner, rise) in simplex.corners.iter().zip(rises) {
                        let from = simplex.point(weights.map(R::from_f64));
                        let values: Vec<f64> = (0..=24)
                            .map(|step| {
                                scene.value(from + (corner - from) * R::from_f64(f64::from(step) / 24.0)).to_f64()
                            })
                            .collect();
                        let risen: f64 = values.windows(2).map(|pair| (pair[1] - pair[0]).max(0.0)).sum();
                        let told = || format!("{} from {weights:?} to {corner:?} of {simplex:?}", scene.name);
                        assert!(risen <= rise.to_f64() + rounding, "{risen} > {rise:?}: {}", told());
                    }
                }
            }
        }
    }
    let mut random = Random::of_test();
    check::<f64, 2>(&mut random);
    check::<f64, 3>(&mut random);
    check::<f32, 3>(&mut random);
}

/// What makes a search by surveys fast: halving a hull brings the bounds together by more than half.
#[test]
fn surveys_of_convex_shapes_close_in_faster_than_the_hull_shrinks() {
    let mut random = Random::of_test();
    for scene in scenes(1.0).iter().filter(|scene| scene.convex) {
        let mut ratios: Vec<f64> = vec![];
        for _ in 0..200 {
            let corners = [0, 1, 2].map(|_| random.in_cube(1.0));
            let middle = random.in_cube(0.6 * scene.size);
            let of_size = |size: f64| Simplex { corners: corners.map(|corner| middle + corner * size * scene.size) };
            let [large, small] = [of_size(1e-2), of_size(1e-3)].map(|simplex| {
                // Apart from how the value falls along the hull, which no bound may hide.
                let lattice = lattice_weights::<3>(8).into_iter().map(|w| scene.value(simplex.point(w)));
                let enclosure = scene.enclosure(simplex.centroid(), &simplex.corners);
                lattice.fold(f64::INFINITY, f64::min) - enclosure.range.lower
            });
            ratios.push(small / large.max(1e-12));
        }
        ratios.sort_by(f64::total_cmp);
        assert!(ratios[ratios.len() / 2] < 0.05, "{}: {}", scene.name, ratios[ratios.len() / 2]);
    }
}
