use std::io;

/// Why an HDF5 file was refused.
#[derive(Debug)]
pub(crate) enum ReadError {
    Io(io::Error),
    /// The signature is missing.
    NotHdf5,
    /// Valid HDF5 perhaps, but not what the caller expects, or of a form that this reader does not know.
    Unexpected(String),
    /// Contradicts itself, the file's length or a checksum.
    Damaged(String),
    /// So many bytes of this are more than can be allocated.
    OutOfMemory(String, u64),
}

impl ReadError {
    pub(crate) fn unexpected(what: impl Into<String>) -> Self {
        Self::Unexpected(what.into())
    }

    pub(crate) fn damaged(what: impl Into<String>) -> Self {
        Self::Damaged(what.into())
    }
}

impl From<io::Error> for ReadError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}
