use super::*;
use crate::testing::{random, random_vector};
use crate::triangle::nearest_on_triangle;

#[test]
fn a_triangle_is_between_its_bounds_from_all_points_around() {
    let mut state = 23;
    println!("seed {state}");
    let frame = UnitFrame { center: Vector3::zeros(), inv_length: 1.0 };
    for round in 0..20_000 {
        let size = [1.0, 0.1, 1e-3, 0.0][round % 4];
        let thickness = [1.0, 1e-3, 1e-6, 0.0][round / 4 % 4];
        let distance = [0.001, 1.0, 50.0, 1e4][round / 16 % 4];
        let a = random_vector(&mut state) * 0.5;
        let b = a + random_vector(&mut state) * (0.5 * size);
        let c = a + (b - a) * random(&mut state) + random_vector(&mut state) * (0.1 * size * thickness);
        let corners = [a, b, c];
        let points: [Vector3<f64>; LANES] =
            std::array::from_fn(|_| (a + random_vector(&mut state) * distance).map(|x| f64::from(x as f32)));
        let lanes = [0, 1, 2].map(|axis| points.map(|point| point[axis] as f32));
        let distances = ApproxTriangle::new(corners, &frame).distances_from(&lanes);
        for (lane, point) in points.into_iter().enumerate() {
            let step = random_vector(&mut state) * (0.3 * distance);
            let rounding = f64::from(UnitFrame::rounding((point.abs() + step.abs()).max() as f32));
            let exact = nearest_on_triangle(point, corners).distance_sq.sqrt();
            let length = f64::from(distances.distance_sq[lane]).sqrt();
            assert!(length + rounding >= exact, "{corners:?} {point:?}");
            let exact_after_step = nearest_on_triangle(point + step, corners).distance_sq.sqrt();
            let offset = Vector3::from(lane_of(&distances.offset, lane)).map(f64::from);
            let lower = (f64::from(distances.gap[lane]) + offset.dot(&step)) / length;
            assert!(
                length < 1e-18 || lower - rounding <= exact_after_step,
                "{corners:?} {point:?} {step:?}: {lower} > {exact_after_step}"
            );
        }
    }
}
