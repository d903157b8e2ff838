//! Files of other programs that `Sdf.export` writes.

use std::path::PathBuf;

use pyo3::prelude::*;
use sdf_field::export::{ExportError, ExportFormat, ExportOptions};
use sdf_field::{Field, Threads};

use crate::errors::{choice, io_error, value_error, warn};
use crate::{integers, pools};

/// What is asked of an export, and in which format.
pub struct Export {
    format: ExportFormat,
    options: ExportOptions,
}

impl Export {
    /// Checks names and numbers. The format is that of the path's ending, if none is given.
    pub fn new(path: &std::path::Path, format: Option<&str>, res: Option<i64>, band: Option<i64>) -> PyResult<Self> {
        let names = ExportFormat::ALL.map(|format| (format.name(), format));
        let format = match format {
            Some(name) => choice("format", name, &names)?,
            None => ExportFormat::from_extension(path).ok_or_else(|| {
                let endings = ExportFormat::ALL.map(|format| format!(".{}", format.extension())).join(", ");
                value_error(format!("{}: use a name that ends in one of {endings}, or add format=", path.display()))
            })?,
        };
        let [cells, band] = [res.map(integers::res).transpose()?, band.map(integers::band).transpose()?];
        if band.is_some() && format != ExportFormat::Nvdb {
            return Err(value_error("band: only format=\"nvdb\" has one"));
        }
        // The output's stem names the grid in it. On the command line that of the field's file does, which a field does not remember.
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self {
            format,
            options: ExportOptions { cells, band, name, threads: Threads::ALL, ..ExportOptions::default() },
        })
    }

    /// Writes the files, and gives their paths. Warns of a shape that no sample is inside of.
    pub fn write(&self, py: Python, field: &Field, path: &PathBuf, threads: Option<i64>) -> PyResult<Vec<PathBuf>> {
        let written = pools::run(py, threads, || field.export_to(path, self.format, &self.options))?;
        let written = written.map_err(|error| match &error {
            ExportError::Unwritable(path, cause) => io_error(cause, path, &format!("{}: {cause}", path.display())),
            _ => value_error(&error),
        })?;
        if written.has_lost_surface {
            let empty = ExportError::NoSurface { nodes: written.lattice.nodes() };
            warn(py, &format!("{}: the shape is thinner than the cells: {empty}", path.display()))?;
        }
        Ok(written.files)
    }
}
