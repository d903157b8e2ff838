use sdf_core::grid::Lattice;

use crate::atomic_write::temporary_bytes;
use crate::grid_file;
use crate::hdf5::{self, Group};

/// A VTKHDF file of image data with the point data `distance`, which ParaView and VTK open. The bytes pass through a temporary file,
/// as in [`crate::grid_file::to_bytes`].
pub fn vtkhdf(lattice: &Lattice, samples: &[f32]) -> std::io::Result<Vec<u8>> {
    temporary_bytes(|path| {
        hdf5::create(path, |file| {
            grid_file::write_vtkhdf(&file.root_group().add_group("VTKHDF")?, lattice, samples, &mut Vec::new())
        })
    })
}
