//! Which exception has an error? Arguments of a wrong kind: TypeError. Of a wrong value: ValueError. Files: OSError. A card that is
//! missing or fails: RuntimeError. What cannot be allocated of a file: MemoryError. A result that is likely not what was wanted: UserWarning.

use std::ffi::CString;
use std::fmt::Display;
use std::io;
use std::path::Path;

use pyo3::exceptions::{
    PyFileNotFoundError, PyMemoryError, PyOSError, PyPermissionError, PyRuntimeError, PyTypeError, PyUserWarning,
    PyValueError,
};
use pyo3::prelude::*;
use sdf_field::cuda::{CudaError, GpuError};
use sdf_field::file::{FieldError, GridFault, GridFileError};

pub fn value_error(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

pub fn type_error(error: impl Display) -> PyErr {
    PyTypeError::new_err(error.to_string())
}

/// Calls `warnings.warn` for the caller's line; an error where the caller makes one of warnings.
pub fn warn(py: Python, text: &str) -> PyResult<()> {
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &CString::new(text)?, 1)
}

/// OSError where the system refused, else ValueError: the file is not what it should be.
pub fn file_error(error: &FieldError) -> PyErr {
    match error {
        FieldError::Unreadable { path, source } | FieldError::Unwritable { path, source } => {
            io_error(source, path, error)
        }
        FieldError::Grid(grid) => grid_error(grid),
        FieldError::Refused { .. } => value_error(error),
    }
}

/// The same of a grid file.
pub fn grid_error(error: &GridFileError) -> PyErr {
    match &error.fault {
        GridFault::OutOfMemory { .. } => PyMemoryError::new_err(error.to_string()),
        GridFault::Io(cause) => io_error(cause, &error.path, error),
        _ => value_error(error),
    }
}

/// Exception of a query on a card that fails.
pub fn cuda_error(error: CudaError) -> PyErr {
    match &error {
        CudaError::NoKernels(_) => PyFileNotFoundError::new_err(error.to_string()),
        CudaError::Card(GpuError::Kernels(path, _)) if !path.exists() => {
            PyFileNotFoundError::new_err(error.to_string())
        }
        CudaError::Card(
            GpuError::NoDriver | GpuError::IncompleteDriver(_) | GpuError::NoCard | GpuError::Driver(_),
        ) => PyRuntimeError::new_err(error.to_string()),
        _ => value_error(error),
    }
}

/// The kind of OSError that the system's refusal of the file is, with the text of `error`, and with errno and filename where the system
/// gave a number.
pub fn io_error(cause: &io::Error, path: &Path, error: &dyn Display) -> PyErr {
    let text = error.to_string();
    match (cause.raw_os_error(), cause.kind()) {
        // OSError makes the kind of the number. The last is Windows', and ignored elsewhere.
        (Some(number), _) => PyOSError::new_err((number, text, path.as_os_str().to_owned(), number)),
        (None, io::ErrorKind::NotFound) => PyFileNotFoundError::new_err(text),
        (None, io::ErrorKind::PermissionDenied) => PyPermissionError::new_err(text),
        _ => PyOSError::new_err(text),
    }
}

/// The choice with this name, or a ValueError that lists all.
pub fn choice<T: Copy>(what: &str, name: &str, choices: &[(&str, T)]) -> PyResult<T> {
    let found = choices.iter().find(|(known, _)| *known == name).map(|(_, choice)| *choice);
    found.ok_or_else(|| {
        let known: Vec<&str> = choices.iter().map(|(known, _)| *known).collect();
        value_error(format!("{what}={name:?}: give one of {}", known.join(", ")))
    })
}
