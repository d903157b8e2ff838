use std::path::Path;

use anyhow::Result;
use sdf_formats::field_file::{self, Field, OpenField};

use crate::mesh_input::{bytes, is_standard_input, shown};

/// The field of a file, or of standard input; of a grid, the samples are not read yet.
pub fn open(path: &Path) -> Result<OpenField<'static>> {
    if is_standard_input(path) {
        return Ok(field_file::open_bytes(bytes(path)?, &shown(path))?);
    }
    Ok(field_file::open(path)?)
}

/// The field of a file, or of standard input.
pub fn read(path: &Path) -> Result<Field> {
    Ok(match open(path)? {
        OpenField::Grid(reader) => Field::Grid(reader.read()?),
        OpenField::Analytic(field) => Field::Analytic(field),
    })
}
