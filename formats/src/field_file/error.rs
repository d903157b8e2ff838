use std::path::PathBuf;

use thiserror::Error;

use crate::grid_file::GridFileError;

/// Why a field could not be read.
#[derive(Debug, Error)]
pub enum FieldError {
    #[error("{}: {source}", path.display())]
    Unreadable { path: PathBuf, source: std::io::Error },
    /// `place` names the table, as `field.of[1]`; empty for the file as a whole.
    #[error("{}: {}{}{what}", path.display(), place, if place.is_empty() { "" } else { ": " })]
    Refused { path: PathBuf, place: String, what: String },
    #[error(transparent)]
    Grid(#[from] GridFileError),
}
