//! The page of `view` and of `--view`, as a file.

use std::path::Path;

use anyhow::{Context, Result};
use sdf_field::page::{Scene, html};
use sdf_formats::atomic_write;

use crate::mesh_input::with_path;

/// Writes the page, whole or not at all, and returns its length.
pub fn write(path: &Path, scene: &Scene) -> Result<usize> {
    let page = html(scene).with_context(|| path.display().to_string())?;
    let length = page.len();
    with_path(path, atomic_write(path, |temporary| std::fs::write(temporary, page)))?;
    Ok(length)
}
