//! Files of other programs: what `Sdf.export` writes and `import_grid` reads.

use std::path::PathBuf;

use pyo3::prelude::*;
use sdf_field::export::{ExportError, ExportFormat, ExportOptions};
use sdf_field::import::ImportFormat;
use sdf_field::{Field, Source, Threads};

use crate::errors::{choice, io_error, value_error};
use crate::pools;
use crate::sdf::Sdf;

/// What is asked of an export, and in which format.
pub struct Export {
    format: ExportFormat,
    options: ExportOptions,
}

impl Export {
    /// Checks names and numbers. The format is that of the path's ending, if none is given.
    pub fn new(path: &std::path::Path, format: Option<&str>, res: Option<u32>, band: Option<u32>) -> PyResult<Self> {
        let names = ExportFormat::ALL.map(|format| (format.name(), format));
        let format = match format {
            Some(name) => choice("format", name, &names)?,
            None => ExportFormat::from_extension(path).ok_or_else(|| {
                let endings = names.map(|(name, _)| format!(".{name}")).join(", ");
                value_error(format!("{}: use a name that ends in one of {endings}, or add format=", path.display()))
            })?,
        };
        if res == Some(0) {
            return Err(value_error("res=0: give 1 cell or more"));
        }
        if band.is_some() && format != ExportFormat::Nvdb {
            return Err(value_error("band: only format=\"nvdb\" has one"));
        }
        // A file's stem names the grid in it, as on the command line.
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self {
            format,
            options: ExportOptions { cells: res, band, name, threads: Threads::ALL, ..ExportOptions::default() },
        })
    }

    /// Writes the files, and gives their paths.
    pub fn write(&self, py: Python, field: &Field, path: &PathBuf, threads: Option<usize>) -> PyResult<Vec<PathBuf>> {
        let written = py.detach(|| pools::run(threads, || field.export_to(path, self.format, &self.options)))?;
        written.map(|written| written.files).map_err(|error| match &error {
            ExportError::Unwritable(path, cause) => io_error(cause, &format!("{}: {cause}", path.display())),
            _ => value_error(&error),
        })
    }
}

/// A grid of another program, negative inside: a NanoVDB level set (.nvdb), or a NumPy array of shape (z, y, x) (.npy).
///
/// spacing, origin: distance between nodes, and position of node (0, 0, 0), of a NumPy array; a level set has its own.
/// Nothing is certified of its samples: error_bound is infinite. Values that were positive inside must be negated before.
#[pyfunction]
#[pyo3(signature = (path, *, spacing=None, origin=None))]
pub fn import_grid(py: Python, path: PathBuf, spacing: Option<f64>, origin: Option<[f64; 3]>) -> PyResult<Sdf> {
    let format = match (ImportFormat::is_npy(&path), spacing) {
        (true, Some(spacing)) => ImportFormat::Npy { origin: origin.unwrap_or_default(), spacing },
        (true, None) => return Err(value_error("spacing: a NumPy array does not say how far its nodes are apart")),
        (false, None) if origin.is_none() => ImportFormat::Nvdb,
        (false, _) => return Err(value_error("a NanoVDB file has its own place: leave out spacing and origin")),
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let imported = py.detach(|| {
        let bytes = std::fs::read(&path)?;
        Ok(Field::import(&bytes, format, Source { name, ..Source::default() }))
    });
    let imported =
        imported.map_err(|error: std::io::Error| io_error(&error, &format!("{}: {error}", path.display())))?;
    imported.map(Sdf).map_err(|error| value_error(format!("{}: {error}", path.display())))
}
