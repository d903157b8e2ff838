//! A strict reader of as much HDF5 as a grid file needs: the classic form, which h5py and VTK write by default and
//! [`super::hdf5_writer`] asks for.
//!
//! rust-hdf5 0.7.9 writes the file but does not read it. It gives no number that is an attribute of a group; on opening
//! it walks everything in the file and follows links into other files; and it walks a chunk tree without noticing that
//! it comes by the same node again, so that 22 KB of tree make it take memory until there is none. Here only what was
//! asked for is visited, every size is held against the file's before memory is taken, and every walk is bounded by
//! what the file has room for.
//!
//! Names and numbers are those of the "HDF5 File Format Specification, version 3.0".

mod attribute;
mod bytes;
mod chunks;
mod group;
mod object;

use std::path::Path;

pub(super) use attribute::Value;
use bytes::Bytes;
pub(super) use chunks::Dataset;
pub(super) use object::Object;

use super::Fault;
use super::element::Element;
use super::tiling::Tile;

const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
const SUPERBLOCK_BYTES: usize = 96;

/// An open file and its root group.
pub(super) struct Classic {
    bytes: Bytes,
    root: Object,
}

impl Classic {
    pub(super) fn open(path: &Path) -> Result<Self, Fault> {
        let mut bytes = Bytes::open(path)?;
        let address = root_address(&mut bytes)?;
        let root = Object::read(&mut bytes, address)?;
        Ok(Self { bytes, root })
    }

    pub(super) fn file_bytes(&self) -> u64 {
        self.bytes.length()
    }

    /// What has been read of the file so far.
    pub(super) fn bytes_read(&self) -> u64 {
        self.bytes.taken()
    }

    /// Of the root where no group is given.
    pub(super) fn member(&mut self, group: Option<&Object>, name: &str) -> Result<Object, Fault> {
        group::member(&mut self.bytes, group.unwrap_or(&self.root), name)
    }

    pub(super) fn attribute(&mut self, object: &Object, name: &str) -> Result<Value, Fault> {
        attribute::read(&mut self.bytes, object, name)
    }

    /// Refused unless it is of this type and shape.
    pub(super) fn dataset<T: Element>(
        &mut self,
        object: &Object,
        name: &'static str,
        shape: &[usize],
    ) -> Result<Dataset<T>, Fault> {
        Dataset::open(&mut self.bytes, object, name, shape)
    }

    /// See [`Dataset::read`].
    pub(super) fn elements<T: Element>(
        &mut self,
        dataset: &Dataset<T>,
        piece: [usize; 3],
        is_wanted: impl Fn(Tile) -> bool + Sync,
        check: impl Fn(usize, &[u8]) -> Result<(), Fault> + Sync,
    ) -> Result<Vec<T>, Fault> {
        dataset.read(&self.bytes, piece, is_wanted, check)
    }
}

/// Section II.A, version 0.
fn root_address(bytes: &mut Bytes) -> Result<u64, Fault> {
    if bytes.length() < SIGNATURE.len() as u64 || bytes.at(0, SIGNATURE.len())? != SIGNATURE {
        return Err(Fault::NotHdf5);
    }
    let [version] = bytes.at(SIGNATURE.len() as u64, 1)?[..] else { return Err(Fault::NotHdf5) };
    if version != 0 {
        return Err(Fault::not_a_grid(format!("its superblock has version {version}, a grid's has 0")));
    }
    let superblock = bytes.at(0, SUPERBLOCK_BYTES)?;
    let mut fields = bytes::Fields(&superblock[SIGNATURE.len() + 1..]);
    fields.skip(4)?;
    let [offset_bytes, length_bytes] = [fields.u8()?, fields.u8()?];
    fields.skip(9)?;
    let [base, _free_space, end] = [fields.u64()?, fields.u64()?, fields.u64()?];
    if (offset_bytes, length_bytes, base) != (8, 8, 0) {
        return Err(Fault::not_a_grid("its addresses are not plain 8-byte ones"));
    }
    if end > bytes.length() {
        return Err(Fault::damaged(format!("only {} of {end} bytes are there", bytes.length())));
    }
    // The driver's block and the name of the root.
    fields.skip(16)?;
    fields.u64()
}
