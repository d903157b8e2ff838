use std::path::PathBuf;

use thiserror::Error;

use crate::grid_file::GridFileError;

/// Why a field could not be read, or a closed form not be written.
#[derive(Debug, Error)]
pub enum FieldError {
    /// The file cannot be opened or read.
    #[error("{}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The file cannot be written.
    #[error("{}: {source}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The content does not describe a field.
    #[error("{}: {}{}{what}", path.display(), table, if table.is_empty() { "" } else { ": " })]
    Refused {
        /// The file, or the name given for its text.
        path: PathBuf,
        /// The table that is wrong, such as `field.of[1]`; empty for the whole file.
        table: String,
        /// The fault, and what was expected.
        what: String,
    },
    /// A grid file was refused.
    #[error(transparent)]
    Grid(#[from] GridFileError),
}
