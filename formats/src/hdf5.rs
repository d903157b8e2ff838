//! HDF5 files: a strict reader of the classic form, and a writer on top of rust-hdf5.
//!
//! | question | file |
//! |---|---|
//! | Which numbers may a dataset hold, and in which bytes? | `element` |
//! | Which elements lie in which chunk? | `tiling` |
//! | What does a file hold, if nothing in it can be trusted? | `read` and its folder |
//! | What does a writer need of a group? | `group` |
//! | How is a file begun, filled and ended? | `write`; where there are no files, `memory` |
//! | How are chunks compressed on several threads? | `packing` |
//!
//! Sections named in comments are those of the "HDF5 File Format Specification, version 3.0" (The HDF Group).

mod element;
mod group;
mod memory;
mod packing;
mod read;
mod tiling;
mod write;

pub(crate) use element::Element;
pub(crate) use group::{ChunkedDataset, Group};
pub(crate) use memory::to_bytes;
pub(crate) use packing::DIGEST_BYTES;
pub(crate) use read::{Dataset, Hdf5Reader, Object, ReadError, Value};
pub(crate) use tiling::Tile;
pub(crate) use write::{create, write_dataset};

/// First bytes of every HDF5 file, section II.A.
pub(crate) const SIGNATURE: &[u8; 8] = b"\x89HDF\r\n\x1a\n";

/// Longest text of an attribute, in bytes. HDF5 cannot keep more in an object header; a path or a sentence has a
/// hundredth of it.
pub(crate) const MAX_TEXT_BYTES: usize = 1 << 16;
