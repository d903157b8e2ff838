//! Points with NaN, infinite, huge or tiny coordinates.

use nalgebra::Vector3;

/// Each hostile number in one coordinate of an ordinary point, in all three, and alone on an axis.
pub fn hostile_points() -> Vec<Vector3<f64>> {
    let numbers = [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::MAX,
        f64::from(f32::MAX),
        1e30,
        -1e30,
        1e18,
        -1e18,
        1e150,
        1e-18,
        1e-20,
        2e-23,
        -4e-42,
        1e-300,
        5e-324,
        -0.0,
    ];
    let ordinary = Vector3::new(0.25, -0.5, 0.375);
    numbers
        .iter()
        .flat_map(|x| {
            let in_one = (0..3).map(|axis| {
                let mut point = ordinary;
                point[axis] = *x;
                point
            });
            in_one
                .chain([Vector3::repeat(*x), Vector3::new(*x, 0.0, 0.0), Vector3::new(0.0, 0.0, *x)])
                .collect::<Vec<_>>()
        })
        .collect()
}
