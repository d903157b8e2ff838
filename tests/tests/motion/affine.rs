//! Affine placements: the scale is the smallest singular value, and so |φ| the largest that never exceeds the distance.

use nalgebra::{Matrix3, Rotation3, Vector3};
use sdf_core::placed::{Affine, Placed, Placement, Rigid, Similarity, Stretch};
use sdf_core::shapes::Sphere;
use sdf_core::{Aabb, EnclosedSdf, Sdf};
use sdf_tests::random::Random;

fn rows(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|row| [0, 1, 2].map(|column| matrix[(row, column)]))
}

fn turn(random: &mut Random) -> Matrix3<f64> {
    Rotation3::new(random.direction() * random.between(0.0, 3.0)).into_inner()
}

#[test]
fn the_scale_is_the_smallest_singular_value() {
    let mut random = Random::seeded();
    for _ in 0..2000 {
        let spread = random.between(0.0, 8.0);
        let values = [0, 1, 2].map(|_| 10.0_f64.powf(random.between(-spread, 0.0)) * random.between(0.5, 1.0));
        let unit = 10.0_f64.powf(random.between(-30.0, 30.0));
        let linear = turn(&mut random) * Matrix3::from_diagonal(&Vector3::from(values)) * turn(&mut random) * unit;
        let Some(affine) = Affine::new([0.0; 3], rows(&linear)) else { panic!("{values:?}") };
        let [smallest, largest] =
            [values.iter().fold(f64::MAX, |a, b| a.min(*b)), values.iter().fold(0.0, |a: f64, b| a.max(*b))];
        // The matrix itself is rounded, by ε of its largest value.
        let allowed = 1e-13 * smallest + 1e-14 * largest;
        assert!((affine.scale() / unit - smallest).abs() <= allowed, "{values:?}: {}", affine.scale() / unit);
        let norm = affine.pull(Vector3::<f64>::zeros()).jacobian.singular_values().max();
        assert!(affine.scale() * norm <= 1.0, "{values:?}: slope factor {}", affine.scale() * norm);
    }
}

/// φ at t + A u with |u| = 1 is s (|J A u| − 1): of the rounding of A u, some ε of the largest singular value.
#[test]
fn the_surface_is_where_the_map_takes_it_however_unlike_the_singular_values_are() {
    let mut random = Random::seeded();
    for _ in 0..1000 {
        let values = Vector3::from([0; 3].map(|_| 10.0_f64.powf(random.between(-4.0, 0.0))));
        let linear = turn(&mut random) * Matrix3::from_diagonal(&values) * turn(&mut random);
        let field =
            Placed { field: Sphere::new(1.0).unwrap(), placement: Affine::new([0.0; 3], rows(&linear)).unwrap() };
        let bounds = field.bounds(0.0);
        for _ in 0..20 {
            let point = linear * random.direction();
            let value = field.value(point).abs();
            assert!(value <= 32.0 * f64::EPSILON * values.max(), "{values:?}: {value:e}");
            assert!(bounds.inflate(1e-15).encloses(&Aabb { min: point.into(), max: point.into() }), "{values:?}");
        }
    }
}

#[test]
fn an_affine_map_that_is_a_simpler_one_is_that() {
    let mut random = Random::seeded();
    let ball = Sphere::new(0.7).unwrap();
    for _ in 0..200 {
        let (shift, rotation) = (random.point_in_cube(1.0), [0; 4].map(|_| random.between(-1.0, 1.0)));
        let factors = [0; 3].map(|_| random.between(0.3, 3.0));
        let rigid = Rigid::new(shift, rotation).unwrap();
        let linear = |push: &dyn Fn(Vector3<f64>) -> Vector3<f64>| {
            let columns = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| push(axis) - push(Vector3::zeros()));
            rows(&Matrix3::from_columns(&columns))
        };
        let similarity = Similarity::new(shift, rotation, factors[0]).unwrap();
        let stretch = Stretch::new(factors).unwrap();
        let turned = Affine::new(shift, linear(&|p| rigid.push(p))).unwrap();
        let scaled = Affine::new(shift, linear(&|p| similarity.push(p))).unwrap();
        let stretched = Affine::new([0.0; 3], rows(&Matrix3::from_diagonal(&Vector3::from(factors)))).unwrap();
        for _ in 0..20 {
            let point = random.in_cube(2.0);
            let value = |placement: Affine| Placed { field: ball, placement }.value(point);
            assert!((value(turned) - Placed { field: ball, placement: rigid }.value(point)).abs() < 1e-12);
            assert!((value(scaled) - Placed { field: ball, placement: similarity }.value(point)).abs() < 1e-12);
            assert!((value(stretched) - Placed { field: ball, placement: stretch }.value(point)).abs() < 1e-12);
        }
    }
}

#[test]
fn an_affine_field_never_exceeds_the_distance_and_reaches_it_along_the_weakest_axis() {
    let mut random = Random::seeded();
    for _ in 0..100 {
        let values = Vector3::from([0; 3].map(|_| random.between(0.2, 2.0)));
        let axes = turn(&mut random);
        let linear = axes * Matrix3::from_diagonal(&values) * turn(&mut random);
        let shift = random.in_cube(1.0);
        let affine = Affine::new(shift.into(), rows(&linear)).unwrap();
        let field = Placed { field: Sphere::new(1.0).unwrap(), placement: affine };
        // The surface is x = t + A u of all unit u.
        for _ in 0..50 {
            let (point, direction) = (random.in_cube(3.0), random.direction());
            let surface = affine.push(direction);
            assert!(field.value(surface).abs() < 1e-12);
            assert!(field.value(point).abs() <= (point - surface).norm() + 1e-12);
            let bounds = field.bounds(0.25);
            let beyond = affine.push(direction * (1.0 + 0.25 / affine.scale()));
            assert!((0..3).all(|k| bounds.min[k] <= beyond[k] + 1e-12 && beyond[k] - 1e-12 <= bounds.max[k]));
        }
        let along = axes.column(values.imin()).into_owned();
        let outside = shift + along * (values.min() + 0.5);
        assert!((field.value(outside) - 0.5).abs() < 1e-12, "{} for 0.5", field.value(outside));
        assert!(
            field.enclose_box(&sdf_core::Aabb { min: outside.into(), max: outside.into() }).slope_bound >= 1.0 - 1e-12
        );
    }
}

#[test]
fn a_singular_or_infinite_map_is_refused() {
    let flat = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]];
    assert_eq!(Affine::new([0.0; 3], flat), None);
    assert_eq!(Affine::new([0.0; 3], [[0.0; 3]; 3]), None);
    let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert_eq!(Affine::new([0.0, f64::NAN, 0.0], unit), None);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for entry in 0..9 {
            let mut linear = unit;
            linear[entry / 3][entry % 3] = bad;
            assert_eq!(Affine::new([0.0; 3], linear), None, "{bad} at {entry}");
        }
    }
    assert_eq!(Affine::new([0.0; 3], unit).map(|affine| affine.scale() > 0.999_999), Some(true));
}
