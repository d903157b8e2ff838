//! Promise 5: no panic, and NaN, infinite and extreme inputs are answered with a status, never with a NaN.

use nalgebra::Vector3;
use sdf_core::combine::{Compound, Difference, Intersection, SmoothUnion, Union};
use sdf_core::contact::{Outcome, contact};
use sdf_core::grid::{Dense, measure_slope_bound};
use sdf_core::minimize::{FrankWolfe, Minimizer};
use sdf_core::placed::{Placed, Similarity};
use sdf_core::shapes::{Cone, Cylinder, Horseshoe, Sphere, Torus};
use sdf_core::{Aabb, DynSdf, EnclosedSdf, Float, Lanes, Real, Sample, Sdf, Simplex};
use sdf_tests::extremes::hostile_points;
use sdf_tests::methods::{Method, methods};
use sdf_tests::oracle::{element, random_triangle};
use sdf_tests::random::Random;
use sdf_tests::scene_field::SceneField;
use sdf_tests::scenes::{IDENTITY, cube_lattice, dense_grid, node_indices, scenes, with_block_bounds};
use sdf_tests::stability::answer::{Fate, Number, query};

#[test]
fn a_sample_is_never_nan_and_its_status_says_which_points_are_refused() {
    fn check<R: Float>() {
        for scene in scenes(1.0) {
            for point in hostile_points() {
                let point = point.map(R::from_f64);
                let sample = scene.sample(point);
                let context = || format!("{} at {point:?}: {sample:?}", scene.name);
                assert!(sample.value.to_f64().is_finite(), "{}", context());
                assert!(sample.gradient.iter().all(|x| x.to_f64().is_finite()), "{}", context());
                // No scene's placement moves a point so far that its squares overflow.
                assert_eq!(sample.status.not_finite, !point.iter().all(|x| x.is_representable()), "{}", context());
                if sample.status.not_finite {
                    assert_eq!(
                        (sample.value, sample.gradient),
                        (R::from_f64(R::MAX_COORDINATE), Vector3::zeros()),
                        "{}",
                        context()
                    );
                } else {
                    // Where the squared distance to a centre underflows the gradient is an arbitrary unit vector.
                    let steepest = scene.slope_bound() * (1.0 + 32.0 * R::EPSILON);
                    assert!(sample.gradient.map(Float::to_f64).norm() <= steepest, "{}", context());
                }
            }
        }
    }
    check::<f32>();
    check::<f64>();
}

/// The limit on coordinates applies to the point. A placement or a parameter can move it farther, where squares overflow: the
/// status must report that too.
#[test]
fn a_point_that_overflows_in_the_fields_own_frame_is_refused() {
    fn check<R: Float>(field: &impl EnclosedSdf) {
        for point in [[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [1e-3, 1.0, 0.0]] {
            let point = Vector3::from(point).map(|x| R::from_f64(x * R::MAX_COORDINATE));
            let sample = field.sample(point);
            assert!(sample.value.to_f64().is_finite(), "{point:?}: {sample:?}");
            assert!(sample.gradient.iter().all(|x| x.to_f64().is_finite()), "{point:?}: {sample:?}");
        }
    }
    for scale in [1e-10, 1e-30, 1e-200, 1e30] {
        let placement = Similarity::new([0.0; 3], IDENTITY, scale).unwrap();
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

/// A closed form, a combination, each storage, and a placed grid.
fn some_fields() -> Vec<SceneField> {
    let names =
        ["sphere", "smooth union", "grid of a cuboid", "sparse grid of a sphere", "turned sparse grid less a sphere"];
    scenes(1.0).into_iter().filter(|scene| names.contains(&scene.name)).map(|scene| scene.field).collect()
}

const TRIANGLE: [Vector3<f64>; 3] =
    [Vector3::new(0.1, 0.2, 0.3), Vector3::new(0.6, 0.1, 0.2), Vector3::new(0.1, 0.7, -0.2)];

/// Checks the law with every field, method, number type and kind of element.
fn check_all(law: impl Fn(&SceneField, &Method, &[Vector3<f64>], Number)) {
    for field in some_fields() {
        for count in 1..=3 {
            for method in methods(count, 8) {
                Number::BOTH.into_iter().for_each(|number| law(&field, &method, &TRIANGLE[..count], number));
            }
        }
    }
}

#[test]
fn a_corner_that_is_not_finite_or_too_large_is_reported() {
    check_all(|field, method, corners, number| {
        let beyond = if number == Number::Single { [f64::from(f32::MAX), -1.001e18] } else { [f64::MAX, -1.001e150] };
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY].into_iter().chain(beyond) {
            for at in 0..3 * corners.len() {
                let mut corners = corners.to_vec();
                corners[at / 3][at % 3] = x;
                for margin in [0.0, f64::INFINITY] {
                    let answer = query(field, method, margin, &corners, number);
                    assert_eq!(answer.fate, Fate::NotFinite, "{x:e} at {at} by {method:?} in {number:?}");
                }
            }
        }
    });
}

/// Corners at the largest coordinate, at the smallest numbers, and between: no panic, and every number of a contact is finite.
#[test]
fn extreme_elements_never_give_nan() {
    fn check<R: Float, const N: usize>()
    where
        Method: Minimizer<N>,
    {
        let mut random = Random::seeded();
        let sizes = [R::MAX_COORDINATE, 0.9 * R::MAX_COORDINATE, 1e9, 1.0, 1e-9, 1e-18, 1e-22, 1e-42, 1e-300, 0.0];
        for scene in scenes(1.0) {
            for id in 0..150 {
                let corners = [(); N].map(|()| {
                    Vector3::from_fn(|_, _| R::from_f64(random.pick(&sizes) * random.pick(&[-1.0, 1.0, 0.5])))
                });
                let element = element(id, Simplex { corners });
                for method in methods(N, 8) {
                    let margin = R::from_f64(random.pick(&[0.0, 1.0, 1e9, R::MAX_COORDINATE]));
                    let outcome = contact(&scene.field, &method, margin, &element);
                    let context = || format!("{} by {method:?}: {outcome:?} of {element:?}", scene.name);
                    match outcome {
                        Outcome::Contact(contact) => {
                            let numbers =
                                contact.weights.iter().chain(contact.point.iter()).chain(contact.normal.iter());
                            let mut numbers = numbers.chain(contact.surface_point.iter()).chain([&contact.distance]);
                            assert!(numbers.all(|x| x.to_f64().is_finite()), "{}", context());
                            assert!(!contact.lower_bound.to_f64().is_nan(), "{}", context());
                        }
                        Outcome::Separated(minimum) => {
                            assert!(minimum.sample.value.to_f64().is_finite(), "{}", context())
                        }
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

/// An overflow or NaN inside the field is reported too, and not culled as if it were far.
#[test]
fn a_field_that_returns_nan_is_reported_and_not_culled() {
    let lattice = cube_lattice(1.0, 2);
    let broken = dense_grid(lattice, vec![f32::NAN; lattice.node_count()], 1.0);
    let triangle = element(0, Simplex { corners: [Vector3::zeros(), Vector3::x(), Vector3::y()] });
    assert_eq!(contact(&broken, &FrankWolfe::default(), 0.0, &triangle), Outcome::NotFinite);

    // Finite at the centroid, NaN at the first corner.
    let lattice = cube_lattice(1.0, 8);
    let mut samples = vec![-0.5; lattice.node_count()];
    samples[lattice.index([0, 0, 0])] = f32::NAN;
    let partly_broken = dense_grid(lattice, samples, 1.0);
    let corners = [Vector3::new(-1.0, -1.0, -1.0), Vector3::new(1.0, -1.0, -1.0), Vector3::new(-1.0, 1.0, -1.0)];
    assert_eq!(
        contact(&partly_broken, &FrankWolfe::default(), 0.0, &element(0, Simplex { corners })),
        Outcome::NotFinite
    );
}

#[test]
fn a_nan_margin_culls_nothing_silently() {
    check_all(|field, method, corners, number| {
        let fate = |margin| query(field, method, margin, corners, number).fate;
        assert_eq!(fate(f64::NAN), Fate::NotFinite, "{method:?} in {number:?}");
        assert!(matches!(fate(f64::INFINITY), Fate::Contact(_)), "{method:?} in {number:?}");
        assert_eq!(fate(f64::NEG_INFINITY), Fate::Culled, "{method:?} in {number:?}");
    });
}

/// Checks elements around a point: no number is NaN, an element with a finite value within the margin is not culled, and one
/// without finite values has no minimum.
fn check_around(field: &SceneField, point: Vector3<f64>, random: &mut Random, name: &str) {
    for round in 0..30 {
        let spread = random.pick(&[0.05, 0.3, 1.5]);
        let first = point + random.in_cube(0.5 * spread);
        let corners = random_triangle(first, spread, random);
        let corners = &corners[..round % 3 + 1];
        // In either type a lattice point may round into a cell with a broken sample.
        let at = |a: f64, b: f64| match *corners {
            [only] => only,
            [from, to] => from + (to - from) * a,
            [from, to, third] => from + (to - from) * a + (third - from) * (b * (1.0 - a)),
            _ => unreachable!(),
        };
        let steps =
            (0..16).flat_map(|i| (0..16).map(move |j| [(f64::from(i) + 0.5) / 16.0, (f64::from(j) + 0.5) / 16.0]));
        let values: Vec<f64> = steps.map(|[a, b]| field.value(at(a, b))).collect();
        let lowest = values.iter().copied().filter(|value| value.is_finite()).fold(f64::INFINITY, f64::min);
        for method in methods(corners.len(), 32) {
            for number in Number::BOTH {
                for margin in [0.0, 0.2, 10.0] {
                    let answer = query(field, &method, margin, corners, number);
                    let context =
                        || format!("{name} by {method:?} in {number:?}: {answer:?} of {corners:?}, lowest {lowest}");
                    assert!(answer.minimum.as_ref().is_none_or(|found| found.is_finite()), "{}", context());
                    assert!(answer.fate != Fate::Culled || lowest > margin - 1e-5, "{}", context());
                    assert!(lowest.is_finite() || answer.minimum.is_none(), "{}", context());
                }
            }
        }
    }
}

#[test]
fn samples_that_are_not_finite_hide_no_contact() {
    let mut random = Random::seeded();
    let sphere = Sphere::new(0.5).unwrap();
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
        for round in 0..12 {
            let lattice = cube_lattice(0.75, 10);
            let nodes: Vec<_> = node_indices(lattice.nodes()).map(|node| Vector3::from(lattice.node(node))).collect();
            let mut samples: Vec<f32> = nodes.iter().map(|node| sphere.value(*node) as f32).collect();
            let at = random.below(samples.len());
            samples[at] = bad;
            let slope_bound = measure_slope_bound(&lattice, &Dense::new(&lattice, &samples[..]).unwrap());
            let dense = dense_grid(lattice, samples, if slope_bound.is_finite() { slope_bound } else { 1.8 });
            let field = if round % 2 == 0 { SceneField::new(dense) } else { SceneField::new(with_block_bounds(dense)) };
            check_around(&field, nodes[at], &mut random, &format!("{bad} at {at}"));
        }
    }
}

/// A sphere with another value and gradient beyond x = 0, or only another gradient.
struct Broken {
    value: Option<f64>,
    slope: f64,
}

impl Sdf for Broken {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let intact = Sphere::new(0.5).unwrap().evaluate(point);
        let value = self.value.map_or(intact.value, R::from_f64);
        let broken = Sample::new(value, Vector3::repeat(R::from_f64(self.slope)));
        Sample::select(R::zero().lt(point.x), broken, intact)
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
fn values_that_are_not_finite_hide_no_contact() {
    let mut random = Random::seeded();
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    for value in bad.map(Some).into_iter().chain([None]) {
        for slope in bad.into_iter().chain([1e30, 1e300, 0.0]) {
            let field = SceneField::new(Broken { value, slope });
            check_around(&field, Vector3::zeros(), &mut random, &format!("{value:?}, {slope}"));
        }
    }
}

/// Where one part of a combination is NaN, so is the combination, whichever part comes first.
#[test]
fn a_part_that_is_nan_is_not_hidden_by_another() {
    fn check<F: EnclosedSdf>(name: &str, field: F) {
        fn is_nan<R: Real, F: EnclosedSdf>(field: &F, point: Vector3<R>) -> bool {
            let numbers = [field.evaluate(point).value, field.value(point)];
            numbers.into_iter().all(|number| (0..R::LANES).all(|lane| number.lane(lane).to_f64().is_nan()))
        }
        let broken = Vector3::new(0.5_f64, 0.25, 0.125);
        assert!(is_nan(&field, broken) && Float::to_f64(field.evaluate_smooth(broken).value).is_nan(), "{name}");
        assert!(is_nan(&field, broken.map(|x| x as f32)), "{name}");
        assert!(is_nan(&field, broken.map(Lanes::<f64, 4>::from_f64)), "{name} in lanes");
        assert!(is_nan(&field, broken.map(Lanes::<f32, 8>::from_f64)), "{name} in lanes");
        assert!(f64::is_finite(field.value(Vector3::new(-0.5, 0.25, 0.125))), "{name}");
        let triangle = element(0, Simplex { corners: [broken, broken * 2.0, broken + Vector3::x()] });
        for method in methods(3, 8) {
            assert_eq!(contact(&field, &method, 0.0, &triangle), Outcome::NotFinite, "{name} by {method:?}");
        }
    }
    let broken = Broken { value: Some(f64::NAN), slope: 0.0 };
    for radius in [0.01, 8.0] {
        let intact = Sphere::new(radius).unwrap();
        check("union", Union(&intact, &broken));
        check("union", Union(&broken, &intact));
        check("intersection", Intersection(&intact, &broken));
        check("intersection", Intersection(&broken, &intact));
        check("difference", Difference(&intact, &broken));
        check("difference", Difference(&broken, &intact));
        check("smooth union", SmoothUnion::new(&intact, &broken, 0.1).unwrap());
        check("smooth union", SmoothUnion::new(&broken, &intact, 0.1).unwrap());
        let parts: [&dyn DynSdf; 3] = [&intact, &broken, &intact];
        check("compound", Compound::new(&parts[..2]).unwrap());
        check("compound", Compound::new(&parts[1..]).unwrap());
        check("compound", Compound::new(&parts[..]).unwrap());
    }
}
