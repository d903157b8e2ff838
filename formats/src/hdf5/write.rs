//! HDF5 files written through rust-hdf5, in the classic form and without times, so that equal contents give equal bytes.

use std::io;
use std::mem::ManuallyDrop;
use std::path::Path;

use rust_hdf5::{H5File, Hdf5Error, LibverBound};

use super::element::Element;
use super::group::{ChunkedDataset, Group};
use super::packing::packed_chunks;
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

/// Adds a dataset to a group. `transform` changes the elements of each chunk before they are stored; the SHA-256 of each
/// transformed chunk is appended to `digests`.
pub(crate) fn write_dataset<G: Group, T: Element>(
    group: &G,
    name: &str,
    [shape, chunk_shape]: [&[usize]; 2],
    elements: &[T],
    transform: impl Fn(&mut [T]) + Sync,
    digests: &mut Vec<u8>,
) -> Result<G::Dataset, Hdf5Error> {
    let dataset = group.dataset::<T>(name, [shape, chunk_shape])?;
    let tiling = Tiling::new(shape, chunk_shape);
    packed_chunks(elements, &tiling, transform, |chunk, packed| {
        digests.extend(packed.digest);
        dataset.put_chunk(chunk, packed.packed)
    })?;
    Ok(dataset)
}
