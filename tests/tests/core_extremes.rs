//! Promise 5: no panic, and nothing that is not finite is answered with NaN.

use nalgebra::Vector3;
use sdf_core::contact::{Element, Outcome, contact};
use sdf_core::grid::{Dense, Grid, measure_slope_bound};
use sdf_core::minimize::{FrankWolfe, Minimizer};
use sdf_core::placed::{Placed, Similarity};
use sdf_core::shapes::{Cone, Cylinder, Horseshoe, Sphere, Torus};
use sdf_core::{Aabb, EnclosedSdf, Float, Real, Sample, Sdf, Simplex};
use sdf_tests::any_field::AnyField;
use sdf_tests::extremes::hostile_points;
use sdf_tests::methods::{Method, methods};
use sdf_tests::random::Random;
use sdf_tests::scenes::{bounded, cube_lattice, scenes};
use sdf_tests::stability::answer::{Fate, Number, ask};

fn element<R: Real, const N: usize>(id: u32, simplex: Simplex<R, N>) -> Element<R, N> {
    Element { id, vertices: std::array::from_fn(|corner| 10 * id + corner as u32), simplex }
}

#[test]
fn sample_answers_every_point_without_nan_and_says_which_it_refuses() {
    fn check<R: Float>() {
        for scene in scenes(1.0) {
            for point in hostile_points() {
                let point = point.map(R::from_f64);
                let sample = scene.sample(point);
                let told = format!("{} at {point:?}: {sample:?}", scene.name);
                assert!(sample.value.to_f64().is_finite(), "{told}");
                assert!(sample.gradient.iter().all(|x| x.to_f64().is_finite()), "{told}");
                // No scene carries a point so much farther that its squares overflow.
                assert_eq!(sample.status.not_finite, !point.iter().all(|x| x.is_representable()), "{told}");
                if sample.status.not_finite {
                    assert_eq!(
                        (sample.value, sample.gradient),
                        (R::from_f64(R::MAX_COORDINATE), Vector3::zeros()),
                        "{told}"
                    );
                } else {
                    // Gradients of points that lie closer to a centre than a square can tell are choices, and unit.
                    let steepest = scene.slope_bound() * (1.0 + 32.0 * R::EPSILON);
                    assert!(sample.gradient.map(Float::to_f64).norm() <= steepest, "{told}");
                }
            }
        }
    }
    check::<f32>();
    check::<f64>();
}

/// Reach is asked of the point. A placement or a parameter can carry it farther, where squares overflow: that too must
/// come back as a status.
#[test]
fn a_point_that_leaves_reach_in_the_fields_own_frame_is_refused() {
    fn check<R: Float>(field: &impl EnclosedSdf) {
        for point in [[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [1e-3, 1.0, 0.0]] {
            let point = Vector3::from(point).map(|x| R::from_f64(x * R::MAX_COORDINATE));
            let sample = field.sample(point);
            assert!(sample.value.to_f64().is_finite(), "{point:?}: {sample:?}");
            assert!(sample.gradient.iter().all(|x| x.to_f64().is_finite()), "{point:?}: {sample:?}");
        }
    }
    for scale in [1e-10, 1e-30, 1e-200, 1e30] {
        let placement = Similarity::new([0.0; 3], [0.0, 0.0, 0.0, 1.0], scale).unwrap();
        let torus = Placed { field: Torus::new(2.0, 1.0).unwrap(), placement };
        let cone = Placed { field: Cone::new(0.5, 1.0).unwrap(), placement };
        let cylinder = Placed { field: Cylinder::new(0.5, 1.0).unwrap(), placement };
        let horseshoe = Placed { field: Horseshoe::new(1.0, 0.5, 1.0, 1.0, 1.0).unwrap(), placement };
        check::<f32>(&torus);
        check::<f64>(&torus);
        check::<f32>(&cone);
        check::<f64>(&cone);
        check::<f32>(&cylinder);
        check::<f64>(&cylinder);
        check::<f32>(&horseshoe);
        check::<f64>(&horseshoe);
    }
}

/// Fields of every make: a closed form, a combination, each storage, one placed.
fn some_fields() -> Vec<AnyField> {
    let names =
        ["sphere", "smooth union", "grid of a cuboid", "sparse grid of a sphere", "turned sparse grid less a sphere"];
    scenes(1.0).into_iter().filter(|scene| names.contains(&scene.name)).map(AnyField::new).collect()
}

const TRIANGLE: [Vector3<f64>; 3] =
    [Vector3::new(0.1, 0.2, 0.3), Vector3::new(0.6, 0.1, 0.2), Vector3::new(0.1, 0.7, -0.2)];

/// Calls the law with every field, method, number type and kind of element.
fn with_all(law: impl Fn(&AnyField, &Method, &[Vector3<f64>], Number)) {
    for field in some_fields() {
        for count in 1..=3 {
            for method in methods(count, 8) {
                Number::BOTH.into_iter().for_each(|number| law(&field, &method, &TRIANGLE[..count], number));
            }
        }
    }
}

#[test]
fn a_corner_that_is_not_finite_or_out_of_reach_is_answered_as_such() {
    with_all(|field, method, corners, number| {
        let beyond = if number == Number::Single { [f64::from(f32::MAX), -1.001e18] } else { [f64::MAX, -1.001e150] };
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY].into_iter().chain(beyond) {
            for at in 0..3 * corners.len() {
                let mut corners = corners.to_vec();
                corners[at / 3][at % 3] = x;
                for margin in [0.0, f64::INFINITY] {
                    let answer = ask(field, method, margin, &corners, number);
                    assert_eq!(answer.fate, Fate::NotFinite, "{x:e} at {at} by {method:?} in {number:?}");
                }
            }
        }
    });
}

/// Corners at the end of reach, as small as numbers go, and anything between: no panic, and nothing that is not finite
/// in a contact.
#[test]
fn extreme_elements_make_no_nan() {
    fn check<R: Float, const N: usize>()
    where
        Method: Minimizer<N>,
    {
        let mut random = Random::of_test();
        let sizes = [R::MAX_COORDINATE, 0.9 * R::MAX_COORDINATE, 1e9, 1.0, 1e-9, 1e-18, 1e-22, 1e-42, 1e-300, 0.0];
        for scene in scenes(1.0) {
            for id in 0..150 {
                let corners = [(); N].map(|()| {
                    Vector3::from_fn(|_, _| R::from_f64(random.pick(&sizes) * random.pick(&[-1.0, 1.0, 0.5])))
                });
                let element = element(id, Simplex { corners });
                for method in methods(N, 8) {
                    let margin = R::from_f64(random.pick(&[0.0, 1.0, 1e9, R::MAX_COORDINATE]));
                    let outcome = contact(&scene, &method, margin, &element);
                    let told = format!("{} by {method:?}: {outcome:?} of {element:?}", scene.name);
                    match outcome {
                        Outcome::Contact(contact) => {
                            let numbers =
                                contact.weights.iter().chain(contact.point.iter()).chain(contact.normal.iter());
                            let mut numbers = numbers.chain(contact.surface_point.iter()).chain([&contact.distance]);
                            assert!(numbers.all(|x| x.to_f64().is_finite()), "{told}");
                            assert!(!contact.lower_bound.to_f64().is_nan(), "{told}");
                        }
                        Outcome::Separated(minimum) => assert!(minimum.sample.value.to_f64().is_finite(), "{told}"),
                        Outcome::Culled | Outcome::NotFinite => {}
                    }
                }
            }
        }
    }
    check::<f32, 1>();
    check::<f32, 2>();
    check::<f32, 3>();
    check::<f64, 3>();
}

/// What overflows or is not finite inside the field is told as well, and not dropped as if it were far.
#[test]
fn a_field_that_answers_nan_is_told_and_not_culled() {
    let lattice = cube_lattice(1.0, 2);
    let storage = Dense::new(&lattice, vec![f32::NAN; lattice.node_count()]).unwrap();
    let broken = Grid::new(lattice, storage, 1.0).unwrap();
    let triangle = element(0, Simplex { corners: [Vector3::zeros(), Vector3::x(), Vector3::y()] });
    assert_eq!(contact(&broken, &FrankWolfe::default(), 0.0, &triangle), Outcome::NotFinite);

    // Sound at the centroid, broken at the first corner.
    let lattice = cube_lattice(1.0, 8);
    let mut samples = vec![-0.5; lattice.node_count()];
    samples[lattice.index([0, 0, 0])] = f32::NAN;
    let torn = Grid::new(lattice, Dense::new(&lattice, samples).unwrap(), 1.0).unwrap();
    let corners = [Vector3::new(-1.0, -1.0, -1.0), Vector3::new(1.0, -1.0, -1.0), Vector3::new(-1.0, 1.0, -1.0)];
    assert_eq!(contact(&torn, &FrankWolfe::default(), 0.0, &element(0, Simplex { corners })), Outcome::NotFinite);
}

#[test]
fn a_margin_that_is_no_number_culls_nothing_silently() {
    with_all(|field, method, corners, number| {
        let fate = |margin| ask(field, method, margin, corners, number).fate;
        assert_eq!(fate(f64::NAN), Fate::NotFinite, "{method:?} in {number:?}");
        assert!(matches!(fate(f64::INFINITY), Fate::Contact(_)), "{method:?} in {number:?}");
        assert_eq!(fate(f64::NEG_INFINITY), Fate::Culled, "{method:?} in {number:?}");
    });
}

/// Of elements around a point: that nothing is NaN, that an element which holds a sound value within the margin is not culled,
/// and that one without any is not answered.
fn is_answered_honestly(field: &AnyField, around: Vector3<f64>, random: &mut Random, told: &str) {
    for round in 0..30 {
        let spread = random.pick(&[0.05, 0.3, 1.5]);
        let first = around + random.in_cube(0.5 * spread);
        let corners = [first, first + random.in_cube(spread), first + random.in_cube(spread)];
        let corners = &corners[..round % 3 + 1];
        // In either type a lattice point may round into an unsound cell; those well within one are few, and enough.
        let at = |a: f64, b: f64| match *corners {
            [only] => only,
            [from, to] => from + (to - from) * a,
            [from, to, third] => from + (to - from) * a + (third - from) * (b * (1.0 - a)),
            _ => unreachable!(),
        };
        let steps =
            (0..16).flat_map(|i| (0..16).map(move |j| [(f64::from(i) + 0.5) / 16.0, (f64::from(j) + 0.5) / 16.0]));
        let values: Vec<f64> = steps.map(|[a, b]| field.value(at(a, b))).collect();
        let least_sound = values.iter().copied().filter(|value| value.is_finite()).fold(f64::INFINITY, f64::min);
        for method in methods(corners.len(), 32) {
            for number in Number::BOTH {
                for margin in [0.0, 0.2, 10.0] {
                    let answer = ask(field, &method, margin, corners, number);
                    let told = format!("{told} by {method:?} in {number:?}: {answer:?} of {corners:?}, {least_sound}");
                    assert!(answer.found.as_ref().is_none_or(|found| found.is_finite()), "{told}");
                    assert!(answer.fate != Fate::Culled || least_sound > margin - 1e-5, "{told}");
                    assert!(least_sound.is_finite() || answer.found.is_none(), "{told}");
                }
            }
        }
    }
}

#[test]
fn stored_samples_that_are_not_finite_are_answered_honestly() {
    let mut random = Random::of_test();
    let sphere = Sphere::new(0.5).unwrap();
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
        for round in 0..12 {
            let lattice = cube_lattice(0.75, 10);
            let node = |index: usize| lattice.node([index % 11, index / 11 % 11, index / 121].map(|step| step as u32));
            let mut samples: Vec<f32> =
                (0..lattice.node_count()).map(|index| sphere.value(Vector3::from(node(index))) as f32).collect();
            let at = random.below(samples.len());
            samples[at] = bad;
            let storage = Dense::new(&lattice, samples).unwrap();
            let steepest = measure_slope_bound(&lattice, &storage);
            let dense = Grid::new(lattice, storage, if steepest.is_finite() { steepest } else { 1.8 }).unwrap();
            let field = if round % 2 == 0 { AnyField::new(dense) } else { AnyField::new(bounded(dense)) };
            is_answered_honestly(&field, Vector3::from(node(at)), &mut random, &format!("{bad} at {at}"));
        }
    }
}

/// A sphere whose answer is another beyond x = 0; without a value, only its gradient is.
struct Broken {
    value: Option<f64>,
    slope: f64,
}

impl Sdf for Broken {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let sound = Sphere::new(0.5).unwrap().evaluate(point);
        let value = self.value.map_or(sound.value, R::from_f64);
        let broken = Sample::new(value, Vector3::repeat(R::from_f64(self.slope)));
        Sample::select(R::zero().lt(point.x), broken, sound)
    }
    fn bounds(&self, level: f64) -> Aabb {
        Sphere::new(0.5).unwrap().bounds(level)
    }
    fn slope_bound(&self) -> f64 {
        1.0
    }
}

impl EnclosedSdf for Broken {}

#[test]
fn answers_of_a_field_that_are_not_finite_are_answered_honestly() {
    let mut random = Random::of_test();
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    for value in bad.map(Some).into_iter().chain([None]) {
        for slope in bad.into_iter().chain([1e30, 1e300, 0.0]) {
            let field = AnyField::new(Broken { value, slope });
            is_answered_honestly(&field, Vector3::zeros(), &mut random, &format!("{value:?}, {slope}"));
        }
    }
}
