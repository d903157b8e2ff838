//! Files of other programs that `import_grid` reads.

use std::path::PathBuf;

use pyo3::prelude::*;
use sdf_field::import::ImportFormat;
use sdf_field::{Field, Source};

use crate::errors::{io_error, value_error};
use crate::sdf::Sdf;
use crate::{arrays, files, pools};

/// A grid of another program, negative inside: a NanoVDB level set (.nvdb), or a NumPy array of shape (z, y, x) (.npy).
///
/// spacing, origin: distance between nodes, and position of node (0, 0, 0), of a NumPy array; a level set has its own.
/// Nothing is certified of its samples: error_bound is infinite. Values that were positive inside must be negated before.
#[pyfunction]
#[pyo3(signature = (path, *, spacing=None, origin=None))]
pub fn import_grid(
    py: Python,
    #[pyo3(from_py_with = files::path)] path: PathBuf,
    #[pyo3(from_py_with = arrays::optional_number)] spacing: Option<f64>,
    #[pyo3(from_py_with = arrays::optional_vector)] origin: Option<[f64; 3]>,
) -> PyResult<Sdf> {
    if std::fs::metadata(&path).is_ok_and(|there| !there.is_file() && !there.is_dir()) {
        return Err(value_error(format!(
            "{}: a device or pipe, which may have no end: give a regular file",
            path.display()
        )));
    }
    let bytes = pools::run(py, None, || std::fs::read(&path))?;
    let bytes = bytes.map_err(|error| io_error(&error, &path, &format!("{}: {error}", path.display())))?;
    let format = match (ImportFormat::is_npy(&path, &bytes), spacing) {
        (true, Some(spacing)) => ImportFormat::Npy { origin: origin.unwrap_or_default(), spacing },
        (true, None) => return Err(value_error("spacing: a NumPy array does not say how far its nodes are apart")),
        (false, None) if origin.is_none() => ImportFormat::Nvdb,
        (false, _) => return Err(value_error("a NanoVDB file has its own place: leave out spacing and origin")),
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let imported = pools::run(py, None, || Field::import(&bytes, format, Source { name, ..Source::default() }))?;
    imported.map(Sdf).map_err(|error| value_error(format!("{}: {error}", path.display())))
}
