//! `verify --tight`: error bounds of a sparse grid's bricks by all of their cells, whatever the file was certified by.

use std::path::Path;

use anyhow::Result;
use sdf_bake::sparse::{SparseBaker, code_step, node_rounding};
use sdf_bake::{MeshDistance, TriangleMesh};
use sdf_core::grid::owned::OwnedGrid;
use serde::Serialize;

use super::Subject;
use crate::failure::misuse;

/// Tight error bounds over all bricks, lengths.
#[derive(Clone, Copy, Serialize)]
pub struct TightBound {
    pub median: f64,
    pub max: f64,
}

/// Refuses fields that have no bricks, and blobs.
pub fn require_bricks(path: &Path, subject: &Subject) -> Result<()> {
    let shown = path.display();
    match subject {
        Subject::Grid(stored) if stored.sparse.is_some() => Ok(()),
        Subject::Blob(_) => {
            misuse!(
                "{shown}: --tight needs to know how often samples were rounded, which a blob does not say: remove it"
            )
        }
        _ => misuse!("{shown}: --tight is for sparse grids, whose bricks have bounds of their own: remove it"),
    }
}

/// Bounds of all bricks, no wider than those in the file. `None` unless the mesh bounds one solid.
pub fn tight_bound(grid: &OwnedGrid, band: f64, mesh: &TriangleMesh) -> Option<TightBound> {
    let (lattice, storage) = (grid.lattice(), grid.storage());
    let truth = MeshDistance::new(mesh, None);
    let interpolations = SparseBaker::new(&truth, lattice, band).ok()?.tight_errors(storage.slots())?;
    let rounding = node_rounding(&truth, lattice, band);
    let known = storage.brick_errors().iter().map(|error| f64::from(*error));
    let with_rounding = |(brick, (interpolation, known)): (usize, (f64, f64))| {
        let step = code_step(storage.precision(), &storage.scales()[brick..=brick]);
        known.min(interpolation + rounding + 0.5 * f64::from(step))
    };
    let mut errors: Vec<f64> = interpolations.into_iter().zip(known).enumerate().map(with_rounding).collect();
    errors.sort_unstable_by(f64::total_cmp);
    let (median, max) = (*errors.get(errors.len() / 2)?, *errors.last()?);
    Some(TightBound { median, max })
}
