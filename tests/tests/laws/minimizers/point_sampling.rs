//! The points that point sampling evaluates.

use std::cell::RefCell;

use nalgebra::Vector3;
use sdf_core::minimize::{Minimizer, PointSampling};
use sdf_core::{Aabb, EnclosedSdf, Float, Real, Sample, Sdf, Simplex};
use sdf_tests::oracle::random_simplex;
use sdf_tests::random::Random;
use sdf_tests::scene_field::same_type;
use sdf_tests::scenes::{Meaning, scenes};

/// A field that records where it is evaluated in numbers of one type.
struct Recorder<T>(RefCell<Vec<Vector3<T>>>);

impl<T: Real> Sdf for Recorder<T> {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        self.0.borrow_mut().extend(same_type::<_, Vector3<T>>(point));
        Sample::new(R::zero(), Vector3::zeros())
    }
    fn bounds(&self, _level: f64) -> Aabb {
        Aabb::EVERYWHERE
    }
    fn slope_bound(&self) -> f64 {
        0.0
    }
}

impl<T: Real> EnclosedSdf for Recorder<T> {}

/// Weights of the points inside a triangle where it is sampled.
fn sampled_weights(samples: u32) -> Vec<[f64; 3]> {
    weights_of(PointSampling { samples, corners: false })
}

fn weights_of(sampling: PointSampling) -> Vec<[f64; 3]> {
    points_of(sampling).into_iter().map(|point: Vector3<f64>| [1.0 - point.x - point.y, point.x, point.y]).collect()
}

/// Points on a triangle whose second and third weight are x and y.
fn points_of<T: Float>(sampling: PointSampling) -> Vec<Vector3<T>> {
    let recorder = Recorder(RefCell::default());
    let axis = |axis: usize| Vector3::from_fn(|row, _| if row == axis { T::one() } else { T::zero() });
    let triangle = Simplex { corners: [Vector3::zeros(), axis(0), axis(1)] };
    sampling.minimize(&recorder, &triangle);
    let mut points = recorder.0.into_inner();
    // The lowest point is evaluated a second time, for the gradient.
    let repeated = points.pop().expect("an evaluation");
    assert!(points.contains(&repeated));
    points
}

/// With and without a table: it has the first 64.
#[test]
fn points_in_f32_are_those_in_f64_rounded() {
    for corners in [false, true] {
        let sampling = PointSampling { samples: 5000, corners };
        let rounded: Vec<_> = points_of::<f64>(sampling).into_iter().map(|point| point.map(|x| x as f32)).collect();
        assert_eq!(points_of::<f32>(sampling), rounded);
    }
}

fn is_within(weights: [f64; 3], triangle: &[[f64; 3]; 3]) -> bool {
    // On every edge of a quarter, of a quarter's quarter, … one barycentric weight is constant.
    (0..3).all(|k| {
        let (low, high) = triangle.iter().fold((1.0_f64, 0.0_f64), |(low, high), at| (low.min(at[k]), high.max(at[k])));
        (low..=high).contains(&weights[k])
    })
}

fn quarters(triangles: Vec<[[f64; 3]; 3]>) -> Vec<[[f64; 3]; 3]> {
    let middle = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|k| (a[k] + b[k]) / 2.0);
    triangles
        .into_iter()
        .flat_map(|[a, b, c]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[bc, ca, ab], [a, ab, ca], [ab, b, bc], [ca, bc, c]]
        })
        .collect()
}

/// Basu and Owen 2015, §3: the first point is the centroid, the next three are those of the corner quarters, and each of the
/// 4ᵏ equal parts contains one of the first 4ᵏ points.
#[test]
fn sampled_points_cover_a_triangle_as_published() {
    let sixths: Vec<_> = sampled_weights(4).into_iter().map(|w| w.map(|w| (w * 6e12).round() / 1e12)).collect();
    assert_eq!(sixths, [[2.0, 2.0, 2.0], [4.0, 1.0, 1.0], [1.0, 4.0, 1.0], [1.0, 1.0, 4.0]]);

    let mut parts = vec![[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]];
    for count in [4, 16, 64, 256] {
        parts = quarters(parts);
        let points = sampled_weights(count);
        assert_eq!(points.len(), count as usize);
        for (i, point) in points.iter().enumerate() {
            assert!(point.iter().all(|weight| *weight > 0.0), "{point:?}");
            assert!(!points[..i].contains(point), "{point:?} occurs twice");
        }
        for part in &parts {
            let inside = points.iter().filter(|point| is_within(**point, part)).count();
            assert_eq!(inside, 1, "{inside} of {count} points in {part:?}");
        }
    }
}

#[test]
fn point_sampling_returns_the_lowest_of_exactly_these_points() {
    let mut random = Random::seeded();
    for scene in scenes(1.0).iter().filter(|scene| scene.meaning != Meaning::Samples) {
        let simplex = random_simplex::<3>(&mut random, scene.size);
        for samples in [1, 4, 16, 64] {
            let values = sampled_weights(samples).into_iter().map(|weights| scene.value(simplex.point(weights)));
            let lowest = values.fold(f64::INFINITY, f64::min);
            let minimum = PointSampling { samples, corners: false }.minimize(&scene.field, &simplex);
            assert_eq!((minimum.sample.value, minimum.evaluations), (lowest, f64::from(samples)), "{}", scene.name);
            assert!(!minimum.converged);
        }
    }
}

/// Point sampling as programs have it: the corners before the points, or alone.
#[test]
fn with_corners_it_takes_the_corners_before_the_same_points() {
    let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for samples in [0, 1, 4, 64] {
        let weights = weights_of(PointSampling { samples, corners: true });
        assert_eq!(weights[..3], corners);
        assert_eq!(weights[3..], if samples == 0 { vec![] } else { sampled_weights(samples) });
    }
}
