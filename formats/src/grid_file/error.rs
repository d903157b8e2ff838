//! Errors of grid files: which file, what is wrong, what to do.

use std::io;
use std::path::{Path, PathBuf};

use crate::hdf5::ReadError;

/// Why a grid was not read or not written. Prints as one line: which file, what is wrong, what to do.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", path.display())]
pub struct GridFileError {
    /// The file, or the name given for its bytes.
    pub path: PathBuf,
    /// The cause.
    #[source]
    pub fault: GridFault,
}

/// Cause of a [`GridFileError`].
#[derive(Debug, thiserror::Error)]
pub enum GridFault {
    /// The file cannot be opened, read or written.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The HDF5 signature is missing.
    #[error("not an HDF5 file; give a grid that `sdftool bake` wrote")]
    NotHdf5,
    /// Valid HDF5 perhaps, but not a file that docs/format.md describes.
    #[error("an HDF5 file, but not an sdftool grid: {0}; give a grid that `sdftool bake` wrote")]
    NotAGrid(String),
    /// The format is newer than this program.
    #[error("format version {found}, and this program reads up to {known}; update sdftool")]
    LaterVersion {
        /// Version of the file.
        found: i128,
        /// Version that this program reads and writes.
        known: i128,
    },
    /// The format is no longer read.
    #[error("format version {found}, and this program reads versions from {known} on; bake it again")]
    EarlierVersion {
        /// Version of the file.
        found: i128,
        /// Oldest version that this program reads.
        known: i128,
    },
    /// The file contradicts itself, its length or a checksum.
    #[error("{0}: the file is damaged; bake it again")]
    Damaged(String),
    /// Contents of the file that are larger than the memory that can be allocated.
    #[error("its {what} needs {bytes} bytes, more than can be allocated")]
    OutOfMemory {
        /// The array.
        what: String,
        /// Its size.
        bytes: u64,
    },
    /// The file is a part of a bake: see [`super::part`].
    #[error("part {index}/{count} of a bake, not a whole grid; join all {count} parts by `sdftool merge`")]
    IsPart {
        /// Counted from 0.
        index: u32,
        /// Number of parts.
        count: u32,
    },
    /// Parts do not make one grid.
    #[error("{0}")]
    DoesNotJoin(String),
    /// The grid to be written would be refused by [`super::read`].
    #[error("cannot be written: {0}")]
    Refused(String),
}

impl GridFault {
    pub(super) fn damaged(what: impl Into<String>) -> Self {
        Self::Damaged(what.into())
    }

    pub(super) fn not_a_grid(what: impl Into<String>) -> Self {
        Self::NotAGrid(what.into())
    }

    pub(super) fn with_path(self, path: &Path) -> GridFileError {
        GridFileError { path: path.to_owned(), fault: self }
    }
}

impl From<ReadError> for GridFault {
    fn from(error: ReadError) -> Self {
        match error {
            ReadError::Io(error) => Self::Io(error),
            ReadError::NotHdf5 => Self::NotHdf5,
            ReadError::Unexpected(what) => Self::NotAGrid(what),
            ReadError::Damaged(what) => Self::Damaged(what),
            ReadError::OutOfMemory(what, bytes) => Self::OutOfMemory { what, bytes },
        }
    }
}
