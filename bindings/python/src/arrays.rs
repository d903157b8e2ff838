//! How do arrays become slices of rows? Contiguous float64 points and uint32 faces are lent, all else is converted in one pass.

use numpy::{Element, PyArray1, PyArrayMethods, PyReadonlyArray2, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyMemoryError, PyOverflowError, PyValueError};
use pyo3::prelude::*;

use crate::errors::{type_error, value_error};

/// The attribute of an array that is on a card.
pub const CUDA_ARRAY_INTERFACE: &str = "__cuda_array_interface__";

/// Rows of three numbers, lent by numpy or converted.
pub enum Rows<'py, T: Element> {
    Lent(PyReadonlyArray2<'py, T>),
    Owned(Vec<[T; 3]>),
}

impl<T: Element> Rows<'_, T> {
    pub fn as_slice(&self) -> &[[T; 3]] {
        match self {
            Self::Owned(rows) => rows,
            // Checked when it was lent.
            Self::Lent(array) => array.as_slice().map_or(&[], |numbers| numbers.as_chunks::<3>().0),
        }
    }
}

/// Points of shape (n, 3), of any integer or float type.
pub fn points<'py>(given: &Bound<'py, PyAny>, what: &str) -> PyResult<Rows<'py, f64>> {
    let array = rows_of_three(given, what, "(n, 3)", "biuf", "numbers")?;
    if let Some(lent) = lend::<f64>(&array) {
        return Ok(Rows::Lent(lent));
    }
    if let Some(single) = lend::<f32>(&array) {
        let rows = single.as_slice().map_or(&[][..], |numbers| numbers.as_chunks::<3>().0);
        require_memory::<[f64; 3]>(rows.len(), what)?;
        return Ok(Rows::Owned(rows.iter().map(|row| row.map(f64::from)).collect()));
    }
    let converted = contiguous(&array, "float64")?;
    lend(&converted).map(Rows::Lent).ok_or_else(|| type_error(format!("{what}: not an array of shape (n, 3)")))
}

/// Faces of shape (m, 3), of any integer type; each index is one of `vertex_count` vertices.
pub fn faces<'py>(given: &Bound<'py, PyAny>, vertex_count: usize) -> PyResult<Rows<'py, u32>> {
    let array = rows_of_three(given, "faces", "(m, 3): triangulate first", "iu", "integers")?;
    if let Some(lent) = lend::<u32>(&array) {
        check_indices(lent.as_slice().unwrap_or(&[]), vertex_count)?;
        return Ok(Rows::Lent(lent));
    }
    if let Some(narrow) = lend::<i32>(&array) {
        return converted_faces(&narrow, vertex_count);
    }
    let wanted = || type_error("faces: not an array of shape (m, 3)");
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if kind == "u" {
        return converted_faces(&lend::<u64>(&contiguous(&array, "uint64")?).ok_or_else(wanted)?, vertex_count);
    }
    converted_faces(&lend::<i64>(&contiguous(&array, "int64")?).ok_or_else(wanted)?, vertex_count)
}

fn converted_faces<'py, T: Element + Copy + Into<i128>>(
    array: &PyReadonlyArray2<T>,
    vertex_count: usize,
) -> PyResult<Rows<'py, u32>> {
    let indices = array.as_slice().unwrap_or(&[]);
    check_indices(indices, vertex_count)?;
    require_memory::<u32>(indices.len(), "faces")?;
    Ok(Rows::Owned(indices.as_chunks::<3>().0.iter().map(|face| face.map(|index| index.into() as u32)).collect()))
}

fn check_indices<T: Copy + Into<i128>>(indices: &[T], vertex_count: usize) -> PyResult<()> {
    let valid = 0..(vertex_count as i128).min(1 << 32);
    match indices.iter().position(|index| !valid.contains(&(*index).into())) {
        None => Ok(()),
        Some(at) => {
            let (face, vertex): (usize, i128) = (at / 3, indices[at].into());
            Err(value_error(format!(
                "faces: face {face} refers to vertex {vertex}, but there are {vertex_count} vertices"
            )))
        }
    }
}

/// A number. An integer beyond the range of f64 becomes infinite, which each argument then refuses with its own name; anything that is not
/// a number keeps its TypeError.
pub fn number(given: &Bound<PyAny>) -> PyResult<f64> {
    match given.extract::<f64>() {
        Err(error) if error.is_instance_of::<PyOverflowError>(given.py()) => {
            Ok(if given.lt(0)? { f64::NEG_INFINITY } else { f64::INFINITY })
        }
        extracted => extracted,
    }
}

/// The same, or None.
pub fn optional_number(given: &Bound<PyAny>) -> PyResult<Option<f64>> {
    if given.is_none() { Ok(None) } else { number(given).map(Some) }
}

/// A vector or a quaternion: so many numbers, else a TypeError, to which the argument's name is added.
pub fn vector<const N: usize>(given: &Bound<PyAny>) -> PyResult<[f64; N]> {
    let (py, given) = (given.py(), given.extract::<[f64; N]>());
    given.map_err(|error| match error {
        error if error.is_instance_of::<PyValueError>(py) || error.is_instance_of::<PyOverflowError>(py) => {
            type_error(format!("{N} finite numbers are needed"))
        }
        error => error,
    })
}

/// The same, or None.
pub fn optional_vector<const N: usize>(given: &Bound<PyAny>) -> PyResult<Option<[f64; N]>> {
    if given.is_none() { Ok(None) } else { vector(given).map(Some) }
}

/// Numbers of a fixed count, such as a vector or a quaternion.
pub fn numbers<const N: usize>(given: &Bound<PyAny>, what: &str) -> PyResult<[f64; N]> {
    let wanted = || type_error(format!("{what}: {N} numbers are needed"));
    let array = as_array(given, what)?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if array.shape() != [N] || !"iuf".contains(&kind) {
        return Err(wanted());
    }
    let list: Vec<f64> = array.call_method0("tolist")?.extract().map_err(|_| wanted())?;
    list.try_into().map_err(|_| wanted())
}

/// Lengths of shape (m,), of any integer or float type.
pub fn lengths(given: &Bound<PyAny>, what: &str) -> PyResult<Vec<f64>> {
    let array = as_array(given, what)?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if array.shape().len() != 1 || !"iuf".contains(&kind) {
        return Err(type_error(format!("{what}: an array of shape (m,) of numbers is needed")));
    }
    let array = contiguous(&array, "float64")?;
    let array = array.cast::<PyArray1<f64>>().map_err(|_| type_error(format!("{what}: not an array of shape (m,)")))?;
    Ok(array.try_readonly().map_err(type_error)?.as_slice().map_err(type_error)?.to_vec())
}

/// The numpy array of anything that numpy takes for one.
pub fn as_array<'py>(given: &Bound<'py, PyAny>, what: &str) -> PyResult<Bound<'py, PyUntypedArray>> {
    if let Ok(array) = given.cast::<PyUntypedArray>() {
        return check_mask(array, what).map(|()| array.clone());
    }
    // Numpy would make an object of some, and say of others that it does not know them.
    if given.getattr_opt(CUDA_ARRAY_INTERFACE)?.is_some() && !given.hasattr("__array_interface__")? {
        let advice = if what == "points" { "" } else { "add device=\"cuda\", or " };
        return Err(type_error(format!("{what}: an array on a card: {advice}copy it to the host")));
    }
    let array = given.py().import("numpy")?.call_method1("asarray", (given,));
    let array = array.map_err(|error| type_error(format!("{what}: not an array ({error})")))?;
    array.cast_into::<PyUntypedArray>().map_err(|_| type_error(format!("{what}: not an array")))
}

/// Refuses masked entries: nothing is known of them.
pub fn check_mask(array: &Bound<PyUntypedArray>, what: &str) -> PyResult<()> {
    let is_plain = array.get_type().is(array.py().get_type::<PyUntypedArray>());
    if is_plain {
        return Ok(());
    }
    // Bytes, as a mask of records has a column for each of theirs. Without a mask it is one False.
    let mask = array.py().import("numpy.ma")?.call_method1("getmask", (array,))?.call_method0("tobytes")?;
    if mask.extract::<&[u8]>()?.iter().any(|byte| *byte != 0) {
        return Err(value_error(format!("{what}: some entries are masked: leave their rows out, or fill them")));
    }
    Ok(())
}

/// Refuses what needs more memory than can be allocated: the process would be aborted.
pub fn require_memory<T>(count: usize, what: &str) -> PyResult<()> {
    let bytes = count.saturating_mul(size_of::<T>());
    Vec::<u8>::new()
        .try_reserve_exact(bytes)
        .map_err(|_| PyMemoryError::new_err(format!("{what}: {bytes} bytes, more than can be allocated")))
}

fn rows_of_three<'py>(
    given: &Bound<'py, PyAny>,
    what: &str,
    wanted: &str,
    kinds: &str,
    numbers: &str,
) -> PyResult<Bound<'py, PyUntypedArray>> {
    let array = as_array(given, what)?;
    let dtype = array.getattr("dtype")?;
    let kind: String = dtype.getattr("kind")?.extract()?;
    let shape = array.shape().to_vec();
    // An empty list has floats, whatever it stands for.
    if shape == [0] {
        let numpy = array.py().import("numpy")?;
        return Ok(numpy.call_method1("zeros", ((0, 3), "int64"))?.cast_into::<PyUntypedArray>()?);
    }
    if !kinds.contains(&kind) {
        return Err(type_error(format!("{what}: an array of {dtype}, not of {numbers}")));
    }
    match shape[..] {
        [_, 3] => Ok(array),
        _ => {
            let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
            Err(type_error(format!("{what}: an array of shape ({}), not {wanted}", shape.join(", "))))
        }
    }
}

/// The array itself, if it is of this type, aligned, and its rows lie one after the other.
fn lend<'py, T: Element>(array: &Bound<'py, PyUntypedArray>) -> Option<PyReadonlyArray2<'py, T>> {
    let array = array.cast::<numpy::PyArray2<T>>().ok()?.try_readonly().ok()?;
    let is_slice = array.is_c_contiguous() && array.as_slice().is_ok();
    is_slice.then_some(array)
}

fn contiguous<'py>(array: &Bound<'py, PyUntypedArray>, dtype: &str) -> PyResult<Bound<'py, PyUntypedArray>> {
    let numpy = array.py().import("numpy")?;
    Ok(numpy.call_method1("require", (array, dtype, ("C", "A")))?.cast_into::<PyUntypedArray>()?)
}
