//! Files: meshes in and out, grids in and out, fields in closed form in and out, contacts out.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

mod atomic_write;
pub mod blob_file;
pub mod contact_file;
pub mod export;
pub mod field_file;
pub mod grid_file;
mod hdf5;
pub mod import;
pub mod mesh;

pub use atomic_write::{
    FolderWriter, WriteLock, atomic_write, atomic_write_both, clear_leftovers, remove_temporaries, try_to_write,
};
