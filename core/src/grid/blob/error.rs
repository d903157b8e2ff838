use core::fmt;

/// Why bytes are not a blob that can be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum BlobError {
    /// They do not begin with `SDFB`.
    NotABlob,
    /// The version is not 1.
    Version,
    /// The layout, the type of the samples or a byte that must be zero is not known.
    Kind,
    /// Origin, spacing or counts of nodes are not those of a grid, or differ in f32 and f64.
    Lattice,
    /// There are fewer or more bytes than the head says.
    Size,
    /// A byte has changed.
    Checksum,
    /// A number is not finite, or a bound is negative or empty.
    Number,
    /// A slot names a brick that is not there.
    Brick,
}

impl fmt::Display for BlobError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotABlob => "not a blob: it does not begin with SDFB",
            Self::Version => "a blob of another version: export it anew",
            Self::Kind => "a blob of unknown layout or type of samples: export it anew",
            Self::Lattice => "the blob's origin, spacing or counts of nodes are not those of a grid: export it anew",
            Self::Size => "the blob is cut off, or has bytes behind its end: copy it again",
            Self::Checksum => "the blob is damaged, its checksum differs: copy it again",
            Self::Number => "the blob has a number that is not finite, or a bound that holds nothing: export it anew",
            Self::Brick => "the blob names a brick that it does not have: export it anew",
        })
    }
}

impl core::error::Error for BlobError {}
