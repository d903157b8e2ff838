//! Where does a field stand? A pose as a matrix of 4 × 4 or as a translation and a quaternion.

use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use sdf_field::core::nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use sdf_field::core::placed::Rigid;

use crate::arrays::{as_array, numbers};
use crate::errors::{type_error, value_error};

/// Largest entry of RᵀR − 1 of a matrix that counts as a rotation: what matrices of float32 come to.
const MAX_SKEW: f64 = 1e-5;

/// The motion x = R p + t from a matrix ((R, t), (0, 1)), or from (t, q), a tuple or a list, with q = (x, y, z, w) of any length but zero.
pub fn rigid(pose: &Bound<PyAny>) -> PyResult<Rigid> {
    if let Ok([translation, rotation]) = pose.extract::<[Bound<PyAny>; 2]>() {
        let (translation, rotation) = (numbers(&translation, "pose[0]")?, numbers(&rotation, "pose[1]")?);
        return motion(translation, rotation);
    }
    let array = as_array(pose, "pose")?;
    if array.shape() != [4, 4] {
        return Err(type_error(
            "pose: give a matrix of shape (4, 4), or a translation (3,) and a quaternion (x, y, z, w)",
        ));
    }
    let rows: Vec<Vec<f64>> =
        array.call_method0("tolist")?.extract().map_err(|_| type_error("pose: not a matrix of numbers"))?;
    let rotation = Matrix3::from_fn(|row, column| rows[row][column]);
    let skew = (rotation.transpose() * rotation - Matrix3::identity()).amax();
    let is_rigid = skew <= MAX_SKEW && rotation.determinant() > 0.0 && rows[3] == [0.0, 0.0, 0.0, 1.0];
    if !is_rigid {
        return Err(value_error("pose: not a rigid motion: a scale, a mirror, a shear or a NaN is in the matrix"));
    }
    let quaternion = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    motion([0, 1, 2].map(|row| rows[row][3]), quaternion.coords.into())
}

fn motion(translation: [f64; 3], rotation: [f64; 4]) -> PyResult<Rigid> {
    Rigid::new(translation, rotation)
        .ok_or_else(|| value_error("pose: the quaternion is zero, or a number is NaN or infinite"))
}
