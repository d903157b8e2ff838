//! HDF5 files of the classic form: a strict reader, and a writer of the little that our files have.
//!
//! | question | file |
//! |---|---|
//! | Which numbers may a dataset hold, and in which bytes? | `element` |
//! | Which elements lie in which chunk? | `tiling` |
//! | What does a file hold, if nothing in it can be trusted? | `read` and its folder |
//! | How is a file begun, filled and ended, on disk or in memory? | `write`, in bytes: `write/records` |
//! | How are chunks compressed on several threads? | `packing`, each by `deflate` |
//!
//! Sections named in comments are those of the "HDF5 File Format Specification, version 3.0" (The HDF Group).

mod checksum;
mod deflate;
mod element;
mod packing;
mod read;
mod tiling;
mod write;

pub(crate) use checksum::crc32;
pub(crate) use element::Element;
pub(crate) use packing::Elements;
pub(crate) use read::{Dataset, Hdf5Reader, Object, ReadError, Value};
pub(crate) use tiling::{Tile, Tiling};
pub(crate) use write::{Appended, Contiguous, Group, create, to_bytes};

/// Packing of a file's chunks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Shuffled and deflated: the smallest file.
    #[default]
    Deflate,
    /// Nothing: the file is written and read as fast as the disk goes.
    None,
}

impl Compression {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Deflate, Self::None];

    /// The compression of this [`name`](Self::name).
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// `deflate` or `none`, as the command line has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Deflate => "deflate",
            Self::None => "none",
        }
    }
}

/// First bytes of every HDF5 file, section II.A.
pub(crate) const SIGNATURE: &[u8; 8] = b"\x89HDF\r\n\x1a\n";

/// An address that is none.
const UNDEFINED: u64 = u64::MAX;

/// Longest text of an attribute, in bytes. HDF5 cannot keep more in an object header; a path or a sentence has a
/// hundredth of it.
pub(crate) const MAX_TEXT_BYTES: usize = 1 << 16;
