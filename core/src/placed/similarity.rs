//! Rotation, uniform scale and translation: x = t + s R p.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::{LocalPoint, Placement};
use crate::Aabb;
use crate::number::{Parameter, Real};
use crate::vector::{largest_component, times};

/// A similarity: x = t + s R p. J = Rᵀ/s, so s ‖J‖ = 1: distances stay exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// s R.
    world_from_local: Matrix3<f64>,
    /// The quaternion as given.
    rotation: [f64; 4],
    double: PullNumbers<f64>,
    single: PullNumbers<f32>,
}

/// The numbers of p(x) in one precision, side by side, so that a processor loads several at once.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PullNumbers<T> {
    /// Rᵀ / s.
    local_from_world: Matrix3<T>,
    translation: Vector3<T>,
    scale: T,
    /// Largest component of t.
    largest_translation: T,
}

impl Similarity {
    /// `rotation` is a quaternion x, y, z, w; it is normalized. `None` if it is zero, `scale` is not positive, or
    /// anything is not finite.
    pub fn new(translation: [f64; 3], rotation: [f64; 4], scale: f64) -> Option<Self> {
        let is_valid = rotation.iter().chain(&translation).all(|x| x.is_finite())
            && rotation.iter().any(|x| *x != 0.0)
            && scale.is_finite()
            && scale > 0.0;
        let inv_scale = 1.0 / scale;
        if !is_valid || !inv_scale.is_finite() {
            return None;
        }
        let matrix = UnitQuaternion::new_unchecked(normalize(rotation)).to_rotation_matrix().into_inner();
        let double = PullNumbers {
            local_from_world: matrix.transpose() * inv_scale,
            translation: translation.into(),
            scale,
            largest_translation: largest_component::<f64>(translation.into()),
        };
        Some(Self {
            world_from_local: matrix * scale,
            rotation,
            single: PullNumbers {
                local_from_world: double.local_from_world.map(|x| x as f32),
                translation: double.translation.map(|x| x as f32),
                scale: scale as f32,
                largest_translation: double.largest_translation as f32,
            },
            double,
        })
    }

    /// t.
    pub fn translation(&self) -> [f64; 3] {
        self.double.translation.into()
    }

    /// The quaternion x, y, z, w as it was given, of any length.
    pub fn rotation(&self) -> [f64; 4] {
        self.rotation
    }

    /// The rotation as a quaternion of length 1.
    pub(crate) fn unit_quaternion(&self) -> Quaternion<f64> {
        normalize(self.rotation)
    }

    /// World point of a local point.
    pub fn push(&self, local: Vector3<f64>) -> Vector3<f64> {
        self.push_vector(local) + self.double.translation
    }

    /// World vector of a local vector, as many times as long as the scale says: what [`push`](Self::push) does to differences of points.
    pub fn push_vector(&self, local: Vector3<f64>) -> Vector3<f64> {
        self.world_from_local * local
    }
}

impl Placement for Similarity {
    #[inline(always)]
    fn pull<R: Real>(&self, world_point: Vector3<R>) -> LocalPoint<R> {
        let Self { double, single, .. } = self;
        let jacobian = double.local_from_world.zip_map(&single.local_from_world, known);
        let point = times(&jacobian, world_point - double.translation.zip_map(&single.translation, known));
        LocalPoint { point, jacobian, scale: known(double.scale, single.scale) }
    }

    fn push_bounds(&self, local: Aabb) -> Aabb {
        map_bounds(local, &self.world_from_local, |center| self.push(center))
    }

    fn pull_bounds(&self, world: Aabb) -> Aabb {
        map_bounds(world, &self.double.local_from_world, |center| self.pull(center).point)
    }

    fn slope_factor(&self) -> f64 {
        1.0
    }

    fn scale(&self) -> f64 {
        self.double.scale
    }

    fn largest_scale(&self) -> f64 {
        self.scale()
    }

    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        known(self.double.largest_translation, self.single.largest_translation)
    }
}

/// A number that is known in both precisions.
#[inline(always)]
fn known<R: Real>(double: f64, single: f32) -> R {
    R::from_parameter(Parameter { double, single })
}

/// A quaternion x, y, z, w of length 1. Divided by the largest component first, so that no square underflows or overflows.
fn normalize(rotation: [f64; 4]) -> Quaternion<f64> {
    let largest = rotation.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    let [x, y, z, w] = rotation.map(|x| x / largest);
    let length = libm::sqrt(x * x + y * y + z * z + w * w);
    Quaternion::new(w / length, x / length, y / length, z / length)
}

/// The box around the image of `bounds` by the affine `map`, whose linear part is A: its centre is the image of the
/// centre, its half extents are |A| h (Arvo 1990, "Transforming Axis-Aligned Bounding Boxes"). [`Aabb::EVERYWHERE`]
/// if that is not finite.
pub(super) fn map_bounds(bounds: Aabb, linear: &Matrix3<f64>, map: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Aabb {
    let [min, max] = [bounds.min, bounds.max].map(Vector3::from);
    let center = map((min + max) * 0.5);
    let half_extents = linear.abs() * ((max - min) * 0.5);
    let mapped = Aabb { min: (center - half_extents).into(), max: (center + half_extents).into() };
    let is_bounded = mapped.min.iter().chain(&mapped.max).all(|x| x.is_finite());
    if is_bounded { mapped } else { Aabb::EVERYWHERE }
}
