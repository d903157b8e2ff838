//! HDF5 files written through rust-hdf5, in the classic form and without times, so that equal contents give equal bytes.

use std::io;
use std::mem::ManuallyDrop;
use std::path::Path;

use rust_hdf5::{DatatypeMessage, H5Dataset, H5File, H5Group, Hdf5Error, LibverBound};

use super::element::Element;
use super::packing::{DEFLATE_LEVEL, packed_chunks};
use super::tiling::Tiling;

/// Creates an HDF5 file and lets `fill` write its objects. The file records no times and has the classic form, which
/// every reader knows. Nothing is synced to the disk.
pub(crate) fn create(path: &Path, fill: impl FnOnce(&H5File) -> Result<(), Hdf5Error>) -> io::Result<()> {
    create_and_fill(path, fill).map_err(|error| match error {
        Hdf5Error::Io(error) => error,
        error => io::Error::other(error.to_string()),
    })
}

fn create_and_fill(path: &Path, fill: impl FnOnce(&H5File) -> Result<(), Hdf5Error>) -> Result<(), Hdf5Error> {
    // The file is temporary, so nobody else opens it; and some network disks have no locks.
    let file = H5File::options().libver(LibverBound::Earliest).track_times(false).no_locking().create(path)?;
    // Dropped after an error, rust-hdf5 0.7.9 would finish the file, and print if it cannot. The file is about to be
    // removed, so it is left as it is; only its handle leaks.
    let file = ManuallyDrop::new(file);
    fill(&file)?;
    file.flush()?;
    ManuallyDrop::into_inner(file).close_no_sync()
}

/// Adds a deflated dataset to a group, its bytes shuffled if elements have several. `transform` changes the elements of
/// each chunk before they are stored; the SHA-256 of each transformed chunk is appended to `digests`.
pub(crate) fn write_dataset<T: Element>(
    group: &H5Group,
    name: &str,
    [shape, chunk_shape]: [&[usize]; 2],
    elements: &[T],
    transform: impl Fn(&mut [T]) + Sync,
    digests: &mut Vec<u8>,
) -> Result<H5Dataset, Hdf5Error> {
    let dataset = group.new_dataset::<T>().shape(shape).chunk(chunk_shape);
    let dataset = match T::BYTES {
        1 => dataset.deflate(DEFLATE_LEVEL),
        _ => dataset.shuffle_deflate(DEFLATE_LEVEL),
    };
    let dataset = dataset.create(name)?;
    let tiling = Tiling::new(shape, chunk_shape);
    packed_chunks(elements, &tiling, transform, |chunk, packed| {
        digests.extend(packed.digest);
        dataset.write_chunk_raw(chunk, &packed.packed, 0)
    })?;
    Ok(dataset)
}

/// Sets an attribute to an ASCII text of fixed length.
pub(crate) fn set_fixed_ascii(group: &H5Group, name: &str, text: &str) -> Result<(), Hdf5Error> {
    group.set_attr_typed(name, fixed_ascii(text), text.into())
}

/// Type of an ASCII text of fixed length, padded with NUL.
pub(crate) fn fixed_ascii(text: &str) -> DatatypeMessage {
    DatatypeMessage::FixedString { size: text.len() as u32, padding: 1, charset: 0 }
}
