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
/// `what`: the argument's name, for errors.
fn rigid(pose: &Bound<PyAny>, what: &str) -> PyResult<Rigid> {
    if let Ok([translation, rotation]) = pose.extract::<[Bound<PyAny>; 2]>() {
        let translation = numbers(&translation, &format!("{what}[0]"))?;
        return motion(translation, numbers(&rotation, &format!("{what}[1]"))?, what);
    }
    let array = as_array(pose, what)?;
    if array.shape() != [4, 4] {
        return Err(type_error(format!(
            "{what}: give a matrix of shape (4, 4), or a translation (3,) and a quaternion (x, y, z, w)"
        )));
    }
    let wanted = |_| type_error(format!("{what}: not a matrix of numbers"));
    let rows: Vec<Vec<f64>> = array.call_method0("tolist")?.extract().map_err(wanted)?;
    let rotation = Matrix3::from_fn(|row, column| rows[row][column]);
    let skew = (rotation.transpose() * rotation - Matrix3::identity()).amax();
    let is_rigid = skew <= MAX_SKEW && rotation.determinant() > 0.0 && rows[3] == [0.0, 0.0, 0.0, 1.0];
    if !is_rigid {
        return Err(value_error(format!(
            "{what}: not a rigid motion: a scale, a mirror, a shear or a NaN is in the matrix"
        )));
    }
    let quaternion = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    motion([0, 1, 2].map(|row| rows[row][3]), quaternion.coords.into(), what)
}

/// The same, or `None`.
pub fn optional(pose: Option<&Bound<PyAny>>, what: &str) -> PyResult<Option<Rigid>> {
    pose.map(|pose| rigid(pose, what)).transpose()
}

fn motion(translation: [f64; 3], rotation: [f64; 4], what: &str) -> PyResult<Rigid> {
    let wrong = || value_error(format!("{what}: the quaternion is zero, or a number is NaN or infinite"));
    Rigid::new(translation, rotation).ok_or_else(wrong)
}
