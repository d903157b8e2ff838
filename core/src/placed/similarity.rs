use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::{Placement, Pulled};
use crate::Aabb;
use crate::number::Real;
use crate::vector::{from_f64, times};

/// A turn, then a uniform scale, then a shift: world = translation + scale · rotation · local.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    world_from_local: Matrix3<f64>,
    local_from_world: Matrix3<f64>,
    translation: [f64; 3],
    scale: f64,
}

impl Similarity {
    /// `rotation` is a quaternion x, y, z, w of any length but zero. `None` unless all is finite and `scale` positive.
    pub fn new(translation: [f64; 3], rotation: [f64; 4], scale: f64) -> Option<Self> {
        let largest = rotation.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let sound = rotation.iter().chain(&translation).all(|x| x.is_finite())
            && largest > 0.0
            && scale.is_finite()
            && scale > 0.0;
        let inverse_scale = 1.0 / scale;
        if !sound || !inverse_scale.is_finite() {
            return None;
        }
        // Divided by the largest first, so that no square is lost to under- or overflow.
        let [x, y, z, w] = rotation.map(|x| x / largest);
        let length = libm::sqrt(x * x + y * y + z * z + w * w);
        let unit = Quaternion::new(w / length, x / length, y / length, z / length);
        let rotation = UnitQuaternion::new_unchecked(unit).to_rotation_matrix().into_inner();
        Some(Self {
            world_from_local: rotation * scale,
            local_from_world: rotation.transpose() * inverse_scale,
            translation,
            scale,
        })
    }

    /// The world point of a point in the field's own frame.
    pub fn push(&self, local: Vector3<f64>) -> Vector3<f64> {
        self.world_from_local * local + Vector3::from(self.translation)
    }
}

impl Placement for Similarity {
    #[inline(always)]
    fn pull<R: Real>(&self, world_point: Vector3<R>) -> Pulled<R> {
        let jacobian = self.local_from_world.map(R::from_f64);
        let point = times(&jacobian, world_point - from_f64(self.translation));
        Pulled { point, jacobian, scale: R::from_f64(self.scale) }
    }

    fn push_bounds(&self, local: Aabb) -> Aabb {
        map_bounds(local, &self.world_from_local, |center| self.push(center))
    }

    fn pull_bounds(&self, world: Aabb) -> Aabb {
        map_bounds(world, &self.local_from_world, |center| self.pull(center).point)
    }

    fn slope_factor(&self) -> f64 {
        1.0
    }

    fn scale(&self) -> f64 {
        self.scale
    }
}

/// A box around the image of a box by a linear map and a shift, which together are `map`.
fn map_bounds(bounds: Aabb, linear: &Matrix3<f64>, map: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Aabb {
    let [min, max] = [bounds.min, bounds.max].map(Vector3::from);
    let center = map((min + max) * 0.5);
    let reach = linear.abs() * ((max - min) * 0.5);
    let mapped = Aabb { min: (center - reach).into(), max: (center + reach).into() };
    let is_bounded = mapped.min.iter().chain(&mapped.max).all(|x| x.is_finite());
    if is_bounded { mapped } else { Aabb::EVERYWHERE }
}
