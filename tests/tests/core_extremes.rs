//! Promise 5: no panic, and nothing that is not finite is answered with NaN.

use nalgebra::Vector3;
use sdf_core::contact::{Element, Outcome, contact};
use sdf_core::grid::{Dense, Grid};
use sdf_core::minimize::{FrankWolfe, Minimizer};
use sdf_core::placed::{Placed, Similarity};
use sdf_core::shapes::{Cone, Cylinder, Horseshoe, Sphere, Torus};
use sdf_core::{Float, Real, Sdf, Simplex};
use sdf_tests::extremes::hostile_points;
use sdf_tests::methods::{Method, methods};
use sdf_tests::random::Random;
use sdf_tests::scenes::{cube_lattice, scenes};

fn element<R: Real, const N: usize>(id: u32, simplex: Simplex<R, N>) -> Element<R, N> {
    Element { id, vertices: std::array::from_fn(|corner| 10 * id + corner as u32), simplex }
}

#[test]
fn sample_answers_every_point_without_nan_and_says_which_it_refuses() {
    fn check<R: Float>() {
        for scene in scenes(1.0) {
            for point in hostile_points() {
                let point = point.map(R::lift);
                let sample = scene.sample(point);
                let told = format!("{} at {point:?}: {sample:?}", scene.name);
                assert!(sample.value.to_f64().is_finite(), "{told}");
                assert!(sample.gradient.iter().all(|x| x.to_f64().is_finite()), "{told}");
                // No scene carries a point so much farther that its squares overflow.
                assert_eq!(sample.status.not_finite, !point.iter().all(|x| x.is_in_reach()), "{told}");
                if sample.status.not_finite {
                    assert_eq!((sample.value, sample.gradient), (R::lift(R::REACH), Vector3::zeros()), "{told}");
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
    fn check<R: Float>(field: &impl Sdf) {
        for point in [[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [1e-3, 1.0, 0.0]] {
            let point = Vector3::from(point).map(|x| R::lift(x * R::REACH));
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

#[test]
fn a_corner_that_is_not_finite_or_out_of_reach_is_answered_as_such() {
    fn check<R: Float>(bad: &[R]) {
        let sphere = Sphere::new(1.0).unwrap();
        for x in bad {
            for corner in 0..3 {
                for axis in 0..3 {
                    let mut simplex = Simplex { corners: [Vector3::zeros(), Vector3::x(), Vector3::y()] };
                    simplex.corners[corner][axis] = *x;
                    let outcome = contact(&sphere, &FrankWolfe::default(), R::zero(), &element(0, simplex));
                    assert_eq!(outcome, Outcome::NotFinite, "{x:?}");
                }
            }
        }
    }
    check(&[f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1e30, 1.001e18]);
    check(&[f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, -1e200, 1.001e150]);
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
        let sizes = [R::REACH, 0.9 * R::REACH, 1e9, 1.0, 1e-9, 1e-18, 1e-22, 1e-42, 1e-300, 0.0];
        for scene in scenes(1.0) {
            for id in 0..150 {
                let corners = [(); N]
                    .map(|()| Vector3::from_fn(|_, _| R::lift(random.pick(&sizes) * random.pick(&[-1.0, 1.0, 0.5]))));
                let element = element(id, Simplex { corners });
                for method in methods(N, 8) {
                    let margin = R::lift(random.pick(&[0.0, 1.0, 1e9, R::REACH]));
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
                        Outcome::Apart(minimum) => assert!(minimum.sample.value.to_f64().is_finite(), "{told}"),
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
    let sphere = Sphere::new(1.0).unwrap();
    let point = element(0, Simplex { corners: [Vector3::<f64>::zeros()] });
    assert_eq!(contact(&sphere, &FrankWolfe::default(), f64::NAN, &point), Outcome::NotFinite);
    assert!(matches!(contact(&sphere, &FrankWolfe::default(), f64::INFINITY, &point), Outcome::Contact(_)));
    assert_eq!(contact(&sphere, &FrankWolfe::default(), f64::NEG_INFINITY, &point), Outcome::Culled);
}
