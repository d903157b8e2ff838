//! A strict reader of as much HDF5 as a grid file needs: the classic form, which h5py and VTK write by default and
//! [`super::create`] chooses.
//!
//! Our own, because rust-hdf5 0.7.9 cannot be trusted with a file of anybody. On opening, it walks everything in the file and
//! follows links into other files. It walks a chunk tree without noticing that a node repeats, so that 22 KB of tree exhaust all
//! memory. Here only the requested objects are
//! visited, every size is checked against the file's length before memory is taken, and every walk is bounded by the
//! size of the file.
//!
//! | step | question | file | section |
//! |---|---|---|---|
//! | 1 | Which bytes lie at an address, in a file or in memory? | `source` | |
//! | 2 | What comes next in a record? | `fields` | |
//! | 3 | Where does the root group lie? | here | II.A |
//! | 4 | Which object has this name in a group? | `group` | III.A.1, III.B to III.D |
//! | 5 | Which messages does an object header hold? | `object` | IV.A.1.a |
//! | 6 | What is the value of an attribute? | `attribute` | IV.A.2.m, III.E |
//! | 7 | Where do a dataset's chunks lie? | `chunk_index` | III.A.1, IV.A.2 |
//! | 8 | What are the elements of its chunks? | `dataset` | |

mod attribute;
mod chunk_index;
mod dataset;
mod error;
mod fields;
mod group;
mod object;
mod source;

use std::borrow::Cow;
use std::path::Path;

pub(crate) use attribute::Value;
pub(crate) use dataset::Dataset;
pub(crate) use error::ReadError;
pub(crate) use object::Object;

use super::element::Element;
use super::tiling::Tile;
use super::{MAX_TEXT_BYTES, SIGNATURE, UNDEFINED};
use fields::Fields;
use source::ByteSource;

const SUPERBLOCK_BYTES: usize = 96;

/// An open HDF5 file and its root group.
pub(crate) struct Hdf5Reader<'a> {
    source: ByteSource<'a>,
    root: Object,
}

impl<'a> Hdf5Reader<'a> {
    pub(crate) fn open(path: &Path) -> Result<Self, ReadError> {
        Self::new(ByteSource::open(path)?)
    }

    pub(crate) fn open_bytes(bytes: Cow<'a, [u8]>) -> Result<Self, ReadError> {
        Self::new(ByteSource::new(bytes))
    }

    fn new(source: ByteSource<'a>) -> Result<Self, ReadError> {
        let address = root_address(&source)?;
        let root = Object::read(&source, address)?;
        Ok(Self { source, root })
    }

    pub(crate) fn file_bytes(&self) -> u64 {
        self.source.length()
    }

    /// Bytes read so far; bytes read twice count twice.
    pub(crate) fn bytes_read(&self) -> u64 {
        self.source.bytes_read()
    }

    /// The member of a group, or of the root if `group` is `None`.
    pub(crate) fn member(&self, group: Option<&Object>, name: &str) -> Result<Object, ReadError> {
        group::member(&self.source, group.unwrap_or(&self.root), name)
    }

    pub(crate) fn attribute(&self, object: &Object, name: &str) -> Result<Value, ReadError> {
        attribute::read(&self.source, object, name)
    }

    pub(crate) fn has_attribute(&self, object: &Object, name: &str) -> Result<bool, ReadError> {
        attribute::exists(object, name)
    }

    /// The dataset of an object; an error unless it has this type and shape.
    pub(crate) fn dataset<T: Element>(
        &self,
        object: &Object,
        name: &'static str,
        shape: &[usize],
    ) -> Result<Dataset<T>, ReadError> {
        Dataset::open(&self.source, object, name, shape)
    }

    /// See [`Dataset::read`].
    pub(crate) fn elements<T: Element>(
        &self,
        dataset: &Dataset<T>,
        piece: [usize; 3],
        is_needed: impl Fn(Tile) -> bool + Sync,
        check: impl Fn(usize, &[u8]) -> Result<(), ReadError> + Sync,
    ) -> Result<Vec<T>, ReadError> {
        dataset.read(&self.source, piece, is_needed, check)
    }

    /// See [`Dataset::read_rows`].
    pub(crate) fn rows<T: Element>(
        &self,
        dataset: &Dataset<T>,
        rows: &[u32],
        check: impl Fn(usize, &[u8]) -> Result<(), ReadError> + Sync,
    ) -> Result<Vec<T>, ReadError> {
        dataset.read_rows(&self.source, rows, check)
    }

    /// See [`Dataset::read_chunks`].
    pub(crate) fn chunks<T: Element>(
        &self,
        dataset: &Dataset<T>,
        chunks: &[usize],
        check: impl Fn(usize, &[u8]) -> Result<(), ReadError> + Sync,
    ) -> Result<Vec<(Tile, Vec<T>)>, ReadError> {
        dataset.read_chunks(&self.source, chunks, check)
    }
}

/// Address of the root group's object header: section II.A, version 0.
fn root_address(source: &ByteSource) -> Result<u64, ReadError> {
    if source.length() < SIGNATURE.len() as u64 || source.read(0, SIGNATURE.len())? != SIGNATURE {
        return Err(ReadError::NotHdf5);
    }
    let [version] = source.read(SIGNATURE.len() as u64, 1)?[..] else { return Err(ReadError::NotHdf5) };
    if version != 0 {
        return Err(ReadError::unexpected(format!("its superblock has version {version}, a grid's has 0")));
    }
    let superblock = source.read(0, SUPERBLOCK_BYTES)?;
    let mut fields = Fields(&superblock[SIGNATURE.len() + 1..]);
    // Versions of free space, root entry and shared messages, with a byte between that is not used.
    let versions = [fields.u8()?, fields.u8()?, fields.u8()?, fields.u8()?];
    let sizes = [fields.u8()?, fields.u8()?];
    let unused = fields.u8()?;
    // Ranks of the trees of groups.
    fields.skip(4)?;
    let flags = fields.u32()?;
    let [base, free_space, end, driver] = [fields.u64()?, fields.u64()?, fields.u64()?, fields.u64()?];
    if sizes != [8, 8] || base != 0 {
        return Err(ReadError::unexpected("its addresses do not take 8 bytes from the file's beginning"));
    }
    if end != source.length() {
        return Err(ReadError::damaged(format!("the file has {} bytes, its header says {end}", source.length())));
    }
    let has_known_parts = versions == [0; 4] && unused == 0 && flags == 0 && [free_space, driver] == [UNDEFINED; 2];
    let (_name, root, cached) = (fields.u64()?, fields.u64()?, fields.u32()?);
    if !has_known_parts || cached > 1 {
        return Err(ReadError::damaged("its superblock holds what no grid's does"));
    }
    Ok(root)
}
