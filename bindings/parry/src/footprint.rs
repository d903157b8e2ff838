//! On which points does a field stand that is smaller than a triangle? On a wide level triangle φ has its lowest value at many points, and a
//! search ends at any of them, at another in each step. The corners of the part of the triangle that is in the field's box stay where they are.

use sdf_core::Aabb;
use sdf_core::nalgebra::Vector3;

/// How far the corners are moved towards their middle, away from the sides of the box: what is left of the way.
const SHRUNK: f64 = 0.9;

/// Corners of the part of a triangle that is in a box and at most `margin` beside it, each a little nearer to their middle.
pub(crate) fn corners(triangle: [Vector3<f64>; 3], bounds: &Aabb, margin: f64) -> Vec<Vector3<f64>> {
    let around = bounds.inflate(margin);
    let mut polygon = triangle.to_vec();
    for axis in 0..3 {
        polygon = clip(&polygon, |point| around.max[axis] - point[axis]);
        polygon = clip(&polygon, |point| point[axis] - around.min[axis]);
    }
    let middle = polygon.iter().sum::<Vector3<f64>>() / polygon.len().max(1) as f64;
    let size = bounds.longest_side();
    let left = SHRUNK * size / (size + 2.0 * margin);
    polygon.into_iter().map(|point| middle + (point - middle) * left).collect()
}

/// The part of a convex polygon where a linear function is not negative (Sutherland and Hodgman 1974, "Reentrant polygon clipping").
fn clip(polygon: &[Vector3<f64>], inside: impl Fn(&Vector3<f64>) -> f64) -> Vec<Vector3<f64>> {
    let mut clipped = vec![];
    for (k, a) in polygon.iter().enumerate() {
        let b = &polygon[(k + 1) % polygon.len()];
        let (at_a, at_b) = (inside(a), inside(b));
        if at_a >= 0.0 {
            clipped.push(*a);
        }
        if (at_a < 0.0) != (at_b < 0.0) {
            clipped.push(a + (b - a) * (at_a / (at_a - at_b)));
        }
    }
    clipped
}
