use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use sdf_core::AnyField;
use sdf_field::{ContactOptions, Field};
use sdf_formats::blob_file::StoredBlob;
use sdf_formats::field_file::{self, OpenField};

use crate::mesh_input::{bytes, is_device, is_standard_input, shown};

/// `true` for a file that is a field and not a mesh. What standard input has is not known yet.
pub fn is_field(path: &Path) -> bool {
    !is_standard_input(path) && field_file::is_field(path)
}

/// The field of a file, or of standard input; of a grid, the samples are not read yet.
pub fn open(path: &Path) -> Result<OpenField<'static>> {
    if is_standard_input(path) {
        return Ok(field_file::open_bytes(bytes(path)?, &shown(path))?);
    }
    // What was read of a pipe to know its kind would be lost. Folders and devices have errors of their own.
    if path.exists() && !path.is_file() && !path.is_dir() && !is_device(path) {
        bail!("{}: not a regular file: give `-` and the field on standard input", shown(path));
    }
    Ok(field_file::open(path)?)
}

/// The field of a file, or of standard input, as queries take it: with all of its samples.
pub fn read_whole(path: &Path) -> Result<Field> {
    Ok(match open(path)? {
        OpenField::Grid(reader) => Field::from_stored(reader.read()?),
        OpenField::Blob(blob) => Field::from_blob(blob),
        OpenField::Analytic(field) => Field::new(field),
    })
}

/// Refuses a margin at which contacts would be false, or left out.
pub fn check_margin(path: &Path, field: &Field, options: &ContactOptions) -> Result<()> {
    options.check_margin(field).map_err(|error| {
        let advice =
            if error.is_too_deep() { ", or find contacts of a mesh by `contacts` with --complete" } else { "" };
        anyhow!("{}: {error}{advice}", shown(path))
    })
}

/// Shapes in closed form, if the margin leaves out nothing of the grids in them.
pub fn from_shapes(path: &Path, shapes: AnyField, options: &ContactOptions) -> Result<Field> {
    let field = Field::new(shapes);
    check_margin(path, &field, options)?;
    Ok(field)
}

/// The field of a blob, if it has distances as far as the margin.
pub fn from_blob(path: &Path, blob: StoredBlob, margin: f64) -> Result<Field> {
    let field = Field::from_blob(blob);
    let checked = field.info().map_or(Ok(()), |info| info.check_margin(margin));
    checked.with_context(|| shown(path))?;
    Ok(field)
}
