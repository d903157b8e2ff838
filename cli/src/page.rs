//! The page of `view` and of `--view`, as a file.

use std::path::Path;

use anyhow::Result;
use sdf_field::Field;
use sdf_field::page::{self, Page, PageError, Scene};
use sdf_formats::atomic_write;

use crate::commands::surface::empty_between;
use crate::mesh_input::{shown, with_path};
use crate::report::warn;

/// A page in its file.
pub struct Written {
    pub bytes: usize,
    /// Why the page shows no surface.
    pub warning: Option<String>,
}

/// Writes the page, whole or not at all, and warns where it shows no surface. `field` is the file of the scene's field.
pub fn write(path: &Path, field: &Path, scene: &Scene) -> Result<Written> {
    let Page { html, empty_between } = page::page(scene).map_err(|error| {
        let is_of_field = matches!(error, PageError::Unbounded | PageError::NoCells | PageError::BeyondGrids);
        anyhow::Error::new(error).context(shown(if is_of_field { field } else { path }))
    })?;
    let bytes = html.len();
    with_path(path, atomic_write(path, |temporary| std::fs::write(temporary, html)))?;
    let warning = empty_between.map(|nodes| no_surface(scene.field, nodes));
    if let Some(warning) = &warning {
        warn(&format!("{}: {warning}", shown(field)));
    }
    Ok(Written { bytes, warning })
}

/// Says that the page shows no surface, and where there is one.
fn no_surface(field: &Field, nodes: [u32; 3]) -> String {
    let advice = match field.grid() {
        Some(grid) if grid.lattice().nodes() == nodes => {
            "bake with a larger --res, or take `surface --level`: an open mesh without an inside has a surface at distances above 0 alone"
        }
        _ => "the shape is thinner than these cells, take `surface` with a larger --res",
    };
    format!("{}, {advice}", empty_between(nodes, 0.0))
}
