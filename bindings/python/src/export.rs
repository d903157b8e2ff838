//! Files of other programs that `Sdf.export` writes.

use std::path::PathBuf;

use pyo3::prelude::*;
use sdf_field::export::{ExportError, ExportFormat, ExportOptions};
use sdf_field::{Field, Threads};

use crate::errors::{choice, io_error, value_error};
use crate::pools;

/// What is asked of an export, and in which format.
pub struct Export {
    format: ExportFormat,
    options: ExportOptions,
}

/// Refuses what the program refuses.
pub fn check_band(cells: u32) -> PyResult<()> {
    match cells {
        1..=1000 => Ok(()),
        _ => Err(value_error(format!("band={cells}: give 1 to 1000 cells"))),
    }
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
        band.map_or(Ok(()), check_band)?;
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
