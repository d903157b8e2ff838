use std::path::PathBuf;

use pyo3::prelude::*;
use sdf_field::Field;

use crate::errors::file_error;
use crate::pools;
use crate::sdf::Sdf;

/// A path as Python's own functions take it: str, bytes, or an os.PathLike of either.
pub fn path(given: &Bound<PyAny>) -> PyResult<PathBuf> {
    given.py().import("os")?.call_method1("fsdecode", (given,))?.extract()
}

/// The same, or None.
pub fn optional_path(given: &Bound<PyAny>) -> PyResult<Option<PathBuf>> {
    if given.is_none() { Ok(None) } else { path(given).map(Some) }
}

/// Opens a baked grid (.sdf.h5) or shapes in closed form (.sdf.toml), by content. Negative inside.
#[pyfunction]
pub fn load(py: Python, #[pyo3(from_py_with = self::path)] path: PathBuf) -> PyResult<Sdf> {
    pools::run(py, None, || Field::open(path))?.map(Sdf).map_err(|error| file_error(&error))
}

/// Removes the temporary folders that killed processes left beside path by save. A save of path does so too: this is for
/// programs that find the file there and keep it.
#[pyfunction]
pub fn clear_leftovers(py: Python, #[pyo3(from_py_with = self::path)] path: PathBuf) {
    py.detach(|| sdf_field::clear_leftovers(&path));
}

/// The field of the bytes of a file, as to_bytes gives them. Negative inside.
#[pyfunction]
pub fn from_bytes(py: Python, data: &[u8]) -> PyResult<Sdf> {
    pools::run(py, None, || Field::from_bytes(data, "data"))?.map(Sdf).map_err(|error| file_error(&error))
}
