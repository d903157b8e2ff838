//! Points and poses between parry, which counts in f32 with glam, and the core, which is asked in f64 with nalgebra.

use parry3d::math::{Pose, Vector};
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::Rigid;

pub(crate) fn to_core(point: Vector) -> Vector3<f64> {
    Vector3::from(point.to_array().map(f64::from))
}

pub(crate) fn to_parry(point: Vector3<f64>) -> Vector {
    let [x, y, z]: [f64; 3] = point.into();
    Vector::new(x as f32, y as f32, z as f32)
}

/// `None` if the pose is not finite.
pub(crate) fn to_rigid(pose: &Pose) -> Option<Rigid> {
    Rigid::new(to_core(pose.translation).into(), pose.rotation.to_array().map(f64::from))
}
