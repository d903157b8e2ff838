//! Files: meshes in, grids in and out.
