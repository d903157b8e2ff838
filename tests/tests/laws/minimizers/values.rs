//! The numbers of a minimum: weights, the field's own sample, evaluations, and the lowest value that the search saw.

use std::cell::Cell;
use std::rc::Rc;

use nalgebra::Vector3;
use sdf_core::combine::Union;
use sdf_core::minimize::{Certified, FrankWolfe, GoldenSection, Minimizer, Minimum, PointSampling, ProjectedGradient};
use sdf_core::shapes::Sphere;
use sdf_core::{Aabb, EnclosedSdf, Float, Real, Sample, Sdf, Simplex};
use sdf_tests::methods::{Method, methods};
use sdf_tests::oracle::{cast, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scene_field::SceneField;
use sdf_tests::scenes::{Scene, scenes, shifted};

use super::{Case, everywhere};

#[test]
fn weights_sum_to_one_and_are_never_negative() {
    fn check<R: Float, const N: usize>()
    where
        Method: Minimizer<N>,
    {
        // A step rounds each weight about twice, and 40 steps may round in the same direction.
        let tolerance = 40.0 * 2.0 * N as f64 * R::EPSILON;
        everywhere::<R, N>(40, 60, |case| {
            let weights = case.method.minimize(&case.scene.field, case.simplex).weights.map(R::to_f64);
            assert!(weights.iter().all(|weight| *weight >= 0.0), "{case}: {weights:?}");
            assert!((weights.iter().sum::<f64>() - 1.0).abs() <= tolerance, "{case}: {weights:?}");
        });
    }
    for_every_simplex!(check);
}

/// The value is neither below the truth nor invented: it is the field's own at a point of the simplex.
#[test]
fn the_sample_is_the_fields_own_at_the_point_of_the_weights() {
    fn check<R: Real<Mask = bool>, const N: usize>()
    where
        Method: Minimizer<N>,
    {
        everywhere::<R, N>(24, 40, |case| {
            let minimum = case.method.minimize(&case.scene.field, case.simplex);
            assert_eq!(minimum.point, case.simplex.point(minimum.weights), "{case}");
            let sample = case.scene.evaluate(minimum.point);
            assert!(sample.value.le(minimum.sample.value) && minimum.sample.value.le(sample.value), "{case}");
            assert_eq!(sample.status, minimum.sample.status, "{case}");
        });
    }
    for_every_simplex!(check);
}

/// The number of evaluations of a field, and its lowest value.
struct Monitor {
    evaluations: Cell<u32>,
    lowest: Cell<f64>,
}

/// A field with a monitor.
struct Monitored {
    field: SceneField,
    monitor: Rc<Monitor>,
}

impl Sdf for Monitored {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let sample = self.field.evaluate(point);
        let Monitor { evaluations, lowest } = &*self.monitor;
        evaluations.set(evaluations.get() + 1);
        lowest.set(lowest.get().min(sample.value.lane(0).to_f64()));
        sample
    }
    fn bounds(&self, level: f64) -> Aabb {
        self.field.bounds(level)
    }
    fn slope_bound(&self) -> f64 {
        self.field.slope_bound()
    }
}

impl EnclosedSdf for Monitored {}

fn monitored(scene: &Scene) -> (SceneField, Rc<Monitor>) {
    let monitor = Rc::new(Monitor { evaluations: Cell::new(0), lowest: Cell::new(f64::INFINITY) });
    (SceneField::new(Monitored { field: scene.field.clone(), monitor: monitor.clone() }), monitor)
}

#[test]
fn evaluations_count_the_points_where_the_field_was_evaluated() {
    fn check<const N: usize>()
    where
        Method: Minimizer<N>,
    {
        everywhere::<f64, N>(24, 2, |case| {
            let (field, monitor) = monitored(case.scene);
            let minimum = case.method.minimize(&field, case.simplex);
            // Point sampling evaluates the lowest of its points a second time, for the gradient.
            let repeated = u32::from(matches!(case.method, Method::PointSampling(_)));
            assert_eq!(minimum.evaluations, f64::from(monitor.evaluations.get() - repeated), "{case}");
        });
    }
    check::<1>();
    check::<2>();
    check::<3>();
}

/// Excludes certified search: it evaluates its result again at the weights in the whole simplex, which rounds.
#[test]
fn the_value_is_the_lowest_that_the_field_returned() {
    fn check<const N: usize>(budget: u32)
    where
        Method: Minimizer<N>,
    {
        everywhere::<f64, N>(budget, 2, |case| {
            if matches!(case.method, Method::Certified(_)) {
                return;
            }
            let (field, monitor) = monitored(case.scene);
            let minimum = case.method.minimize(&field, case.simplex);
            assert_eq!(minimum.sample.value, monitor.lowest.get(), "{case}");
        });
    }
    // Small budgets end before the condition for a minimum holds: often the last evaluation is the lowest.
    for budget in [0, 1, 2, 3, 24] {
        check::<1>(budget);
        check::<2>(budget);
        check::<3>(budget);
    }
}

/// Excludes point sampling on segments: more samples are other points, possibly worse ones.
#[test]
fn more_iterations_never_make_it_worse() {
    fn check<R: Float, const N: usize>()
    where
        Method: Minimizer<N>,
    {
        let mut random = Random::seeded();
        for scene in &scenes(1.0) {
            for _ in 0..10 {
                let simplex = &cast::<R, N>(&random_simplex(&mut random, scene.size));
                let corners = simplex.corners.map(|corner| scene.value(corner));
                for index in 0..methods(N, 0).len() {
                    let mut last: Option<Minimum<R, N>> = None;
                    for budget in 0..40 {
                        let method = &methods(N, budget)[index];
                        let is_sampling = matches!(method, Method::PointSampling(_));
                        if is_sampling && N == 2 {
                            continue;
                        }
                        let minimum = method.minimize(&scene.field, simplex);
                        let case = Case { scene, method, simplex };
                        let has_corners = !matches!(method, Method::Certified(Certified { evaluations, .. })
                            if *evaluations < N as u32);
                        if !is_sampling && has_corners {
                            // A corner is evaluated at first + (corner − first), which rounds.
                            let rounding = R::EPSILON * 8.0 * scene.size * scene.slope_bound();
                            let value = minimum.sample.value.to_f64() - rounding;
                            assert!(corners.iter().all(|corner| value <= corner.to_f64()), "{case}");
                        }
                        if let Some(last) = last {
                            assert!(minimum.sample.value <= last.sample.value, "{case}");
                            assert!(minimum.evaluations >= last.evaluations, "{case}");
                            // A certified search divides its budget between local steps and bounds: a larger one can end
                            // short where a smaller one was lucky.
                            let is_certified = matches!(method, Method::Certified(_));
                            let keeps = is_certified || minimum.converged >= last.converged;
                            assert!(keeps, "{case}: converged, and then no longer");
                        }
                        last = Some(minimum);
                    }
                }
            }
        }
    }
    check::<f32, 2>();
    check::<f32, 3>();
    check::<f64, 1>();
    check::<f64, 2>();
    check::<f64, 3>();
}

/// §3.2 of the paper with i from 0 goes to a corner first, whatever the start: after one step only the three corners are
/// possible results.
#[test]
fn frank_wolfe_does_not_forget_where_it_started() {
    let mut random = Random::seeded();
    let once = FrankWolfe { iterations: 1, ..FrankWolfe::default() };
    let mut results: Vec<[f64; 3]> = vec![];
    for scene in scenes(1.0) {
        for _ in 0..100 {
            let weights = once.minimize(&scene.field, &random_simplex::<3>(&mut random, scene.size)).weights;
            if !results.contains(&weights) {
                results.push(weights);
            }
        }
    }
    assert!(results.len() > 3, "only {results:?}");
}

/// Several minima on one element, which the paper leaves open. Corners are evaluated first, so the ends are not lost.
#[test]
fn three_spheres_under_an_edge_do_not_hide_its_ends() {
    let ball = |x: f64, radius: f64| shifted(Sphere::new(radius).unwrap(), [x, 0.0, 0.0]);
    let spheres = Union(Union(ball(0.0, 0.3), ball(2.0, 0.1)), ball(4.0, 0.3));
    let edge = Simplex { corners: [Vector3::zeros(), Vector3::new(4.0, 0.0, 0.0)] };
    let minimum = GoldenSection::default().minimize(&spheres, &edge);
    assert_eq!(minimum.sample.value, -0.3);
}

#[test]
fn a_budget_of_zero_still_returns_a_point() {
    let sphere = Sphere::new(1.0).unwrap();
    let edge = Simplex { corners: [Vector3::new(2.0, 0.0, 0.0), Vector3::new(3.0, 0.0, 0.0)] };
    let minima = [
        FrankWolfe { iterations: 0, ..FrankWolfe::default() }.minimize(&sphere, &edge),
        ProjectedGradient { iterations: 0, ..ProjectedGradient::default() }.minimize(&sphere, &edge),
        GoldenSection { iterations: 0, ..GoldenSection::default() }.minimize(&sphere, &edge),
    ];
    for minimum in minima {
        assert_eq!((minimum.weights, minimum.sample.value, minimum.converged), ([1.0, 0.0], 1.0, false));
    }
    assert_eq!(PointSampling { samples: 0, corners: false }.minimize(&sphere, &edge).sample.value, 1.5);
}
