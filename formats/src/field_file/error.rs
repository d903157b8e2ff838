use std::path::PathBuf;

use thiserror::Error;

use crate::grid_file::GridFileError;

/// Why a field could not be read, or a closed form not be written.
#[derive(Debug, Error)]
pub enum FieldError {
    #[error("{}: {source}", path.display())]
    Unreadable { path: PathBuf, source: std::io::Error },
    #[error("{}: {source}", path.display())]
    Unwritable { path: PathBuf, source: std::io::Error },
    /// `table` is the name of the table that is wrong, such as `field.of[1]`; empty for the whole file.
    #[error("{}: {}{}{what}", path.display(), table, if table.is_empty() { "" } else { ": " })]
    Refused { path: PathBuf, table: String, what: String },
    #[error(transparent)]
    Grid(#[from] GridFileError),
}
