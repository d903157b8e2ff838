use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};

use super::{LocalPoint, Placement, Similarity};
use crate::Aabb;
use crate::number::Real;

/// A rigid motion: x = t + R p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rigid(Similarity);

impl Rigid {
    /// `rotation` is a quaternion x, y, z, w; it is normalized. `None` if it is zero or anything is not finite.
    pub fn new(translation: [f64; 3], rotation: [f64; 4]) -> Option<Self> {
        Similarity::new(translation, rotation, 1.0).map(Self)
    }

    /// t.
    pub fn translation(&self) -> [f64; 3] {
        self.0.translation()
    }

    /// The quaternion x, y, z, w as it was given, of any length.
    pub fn rotation(&self) -> [f64; 4] {
        self.0.rotation()
    }

    /// World from local, as nalgebra has it.
    pub fn isometry(&self) -> Isometry3<f64> {
        let rotation = UnitQuaternion::new_unchecked(self.unit_quaternion());
        Isometry3::from_parts(self.translation().into(), rotation)
    }

    /// The rotation as a quaternion of length 1.
    pub(crate) fn unit_quaternion(&self) -> Quaternion<f64> {
        self.0.unit_quaternion()
    }

    /// World point of a local point.
    pub fn push(&self, local: Vector3<f64>) -> Vector3<f64> {
        self.0.push(local)
    }

    /// World vector of a local vector, of the same length.
    pub fn push_vector(&self, local: Vector3<f64>) -> Vector3<f64> {
        self.0.push_vector(local)
    }
}

/// A rigid motion is a similarity of scale 1.
impl From<Rigid> for Similarity {
    fn from(Rigid(similarity): Rigid) -> Self {
        similarity
    }
}

impl Placement for Rigid {
    #[inline(always)]
    fn pull<R: Real>(&self, world_point: Vector3<R>) -> LocalPoint<R> {
        LocalPoint { scale: R::one(), ..self.0.pull(world_point) }
    }

    fn push_bounds(&self, local: Aabb) -> Aabb {
        self.0.push_bounds(local)
    }

    fn pull_bounds(&self, world: Aabb) -> Aabb {
        self.0.pull_bounds(world)
    }

    fn slope_factor(&self) -> f64 {
        1.0
    }

    fn scale(&self) -> f64 {
        1.0
    }

    fn largest_scale(&self) -> f64 {
        self.scale()
    }

    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        self.0.magnitude()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rigid_motion_is_the_similarity_of_scale_one() {
        let (translation, rotation) = ([1.0, -2.0, 0.5], [0.1, 0.2, 0.3, 2.0]);
        let similarity = Similarity::from(Rigid::new(translation, rotation).unwrap());
        assert_eq!(similarity, Similarity::new(translation, rotation, 1.0).unwrap());
    }
}
