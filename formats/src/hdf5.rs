//! How this crate begins and ends an HDF5 file.

use std::io;
use std::mem::ManuallyDrop;
use std::path::Path;

use rust_hdf5::{H5File, Hdf5Error, LibverBound};

/// Makes a file of what `fill` puts into it, without times, in the classic form that every reader knows. Not synced.
pub(crate) fn create(path: &Path, fill: impl FnOnce(&H5File) -> Result<(), Hdf5Error>) -> io::Result<()> {
    create_and_fill(path, fill).map_err(|error| match error {
        Hdf5Error::Io(error) => error,
        error => io::Error::other(error.to_string()),
    })
}

fn create_and_fill(path: &Path, fill: impl FnOnce(&H5File) -> Result<(), Hdf5Error>) -> Result<(), Hdf5Error> {
    // Nobody else knows the temporary file, and some network disks have no locks.
    let file = H5File::options().libver(LibverBound::Earliest).track_times(false).no_locking().create(path)?;
    // Dropped unfinished, rust-hdf5 0.7.9 finishes the file, and prints if it cannot. One that is to be removed is
    // better left as it is: what leaks is its handle.
    let file = ManuallyDrop::new(file);
    fill(&file)?;
    file.flush()?;
    ManuallyDrop::into_inner(file).close_no_sync()
}
