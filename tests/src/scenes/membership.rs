use nalgebra::{Vector2, Vector3};

use super::Point;

pub fn distance_to_box(p: Point, half_extents: [f64; 3]) -> f64 {
    (p - Vector3::from_fn(|k, _| p[k].clamp(-half_extents[k], half_extents[k]))).norm()
}

pub fn distance_to_segment(p: Point, a: Point, b: Point) -> f64 {
    let t = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
    (p - (a + (b - a) * t)).norm()
}

pub fn distance_to_ring(p: Point, radius: f64) -> f64 {
    (p.xy().norm() - radius).hypot(p.z)
}

/// Distance to the middle surface of a bowl's wall, which covers the polar angles from `opening` to π.
pub fn distance_to_bowl(p: Point, radius: f64, opening: f64) -> f64 {
    let angle = p.xy().norm().atan2(p.z).max(opening);
    Vector2::new(p.xy().norm() - radius * angle.sin(), p.z - radius * angle.cos()).norm()
}

/// Is a point of the xy plane inside a bar bent as [`Horseshoe::new`](sdf_core::shapes::Horseshoe::new) says?
pub fn is_in_horseshoe(p: Vector2<f64>, radius: f64, thickness: f64, bend: f64, leg: f64) -> bool {
    let angle = p.x.abs().atan2(-p.y);
    if angle <= bend && (p.norm() - radius).abs() <= 0.5 * thickness {
        return true;
    }
    let (outward, along) = (Vector2::new(bend.sin(), -bend.cos()), Vector2::new(bend.cos(), bend.sin()));
    let folded = Vector2::new(p.x.abs(), p.y);
    (0.0..=leg).contains(&folded.dot(&along)) && (folded.dot(&outward) - radius).abs() <= 0.5 * thickness
}

/// Rotates by the inverse of a quaternion x, y, z, w of any length.
pub fn rotate_back(p: Point, [x, y, z, w]: [f64; 4]) -> Point {
    let length = (x * x + y * y + z * z + w * w).sqrt();
    let (axis, w) = (-Vector3::new(x, y, z) / length, w / length);
    p + axis.cross(&(axis.cross(&p) + p * w)) * 2.0
}
