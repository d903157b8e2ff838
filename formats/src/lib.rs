//! Files: meshes in, grids in and out.

pub mod contact_file;
pub mod field_file;
pub mod grid_file;
mod hdf5;
pub mod mesh;
