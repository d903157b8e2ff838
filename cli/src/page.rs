//! The page of `view` and of `--view`, as a file.

use std::path::Path;

use anyhow::Result;
use sdf_field::page::{PageError, Scene, html};
use sdf_formats::atomic_write;

use crate::mesh_input::{shown, with_path};

/// Writes the page, whole or not at all, and returns its length. `field` is the file of the scene's field.
pub fn write(path: &Path, field: &Path, scene: &Scene) -> Result<usize> {
    let page = html(scene).map_err(|error| {
        let is_of_field = matches!(error, PageError::Unbounded | PageError::NoCells | PageError::BeyondGrids);
        anyhow::Error::new(error).context(shown(if is_of_field { field } else { path }))
    })?;
    let length = page.len();
    with_path(path, atomic_write(path, |temporary| std::fs::write(temporary, page)))?;
    Ok(length)
}
