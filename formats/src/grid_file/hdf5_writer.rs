//! What the file holds, put there by rust-hdf5.
//!
//! It is written as HDF5 1.6 had it (`Earliest`): every reader knows that form, h5py and VTK write it unless
//! told otherwise, its object headers hold any number of attributes, and [`super::classic`] can check all of it.

use std::path::Path;

use rust_hdf5::{DatatypeMessage, H5Group, Hdf5Error};
use sdf_core::grid::Lattice;

use super::{About, Fault, layout};
use crate::hdf5;

pub(super) fn write(path: &Path, lattice: &Lattice, distances: &[f32], about: &About) -> Result<(), Fault> {
    let filled = hdf5::create(path, |file| {
        vtkhdf(&file.create_group("VTKHDF")?, lattice, distances)?;
        sdf(&file.create_group("sdf")?, lattice, distances, about)
    });
    filled.map_err(Fault::Io)
}

fn vtkhdf(group: &H5Group, lattice: &Lattice, distances: &[f32]) -> Result<(), Hdf5Error> {
    group.set_attr_array_numeric("Version", &layout::VTKHDF_VERSION)?;
    set_ascii(group, "Type", "ImageData")?;
    group.set_attr_array_numeric("WholeExtent", &layout::whole_extent(lattice))?;
    group.set_attr_array_numeric("Origin", &lattice.origin())?;
    group.set_attr_array_numeric("Spacing", &[lattice.spacing(); 3])?;
    group.set_attr_array_numeric("Direction", &layout::IDENTITY)?;
    let points = group.create_group("PointData")?;
    set_ascii(&points, "Scalars", "distance")?;
    let dataset = points
        .new_dataset::<f32>()
        .shape(layout::shape(lattice))
        .chunk(&layout::chunk_shape(lattice))
        .shuffle_deflate(layout::DEFLATE_LEVEL)
        .create("distance")?;
    dataset.set_attr_typed("Attribute", ascii_type("Scalars"), "Scalars".into())?;
    dataset.write_raw(distances)
}

fn sdf(group: &H5Group, lattice: &Lattice, distances: &[f32], about: &About) -> Result<(), Hdf5Error> {
    let samples_sha256 = layout::samples_sha256(distances);
    group.set_attr_numeric("format_version", &(layout::FORMAT_VERSION as i64))?;
    group.set_attr_string("layout", "dense")?;
    group.set_attr_array_numeric("origin", &lattice.origin())?;
    group.set_attr_numeric("spacing", &lattice.spacing())?;
    group.set_attr_array_numeric("counts", &lattice.nodes())?;
    group.set_attr_string("sign_method", &about.sign_method)?;
    group.set_attr_string("sign_verdict", &about.sign_verdict)?;
    group.set_attr_numeric("slope_bound", &about.slope_bound)?;
    group.set_attr_numeric("error_bound", &about.error_bound)?;
    group.set_attr_string("source_name", &about.source.name)?;
    group.set_attr_string("source_sha256", &layout::hex(&about.source.sha256))?;
    group.set_attr_numeric("source_triangles", &about.source.triangles)?;
    group.set_attr_string("tool", &about.tool)?;
    group.set_attr_string("options", &about.options)?;
    group.set_attr_string("samples_sha256", &samples_sha256)?;
    group.set_attr_string("attributes_sha256", &layout::attributes_sha256(lattice, about, &samples_sha256))
}

fn set_ascii(group: &H5Group, name: &str, text: &str) -> Result<(), Hdf5Error> {
    group.set_attr_typed(name, ascii_type(text), text.into())
}

/// Of fixed length, as VTK wants its own texts, and padded with NUL.
fn ascii_type(text: &str) -> DatatypeMessage {
    DatatypeMessage::FixedString { size: text.len() as u32, padding: 1, charset: 0 }
}
