//! Groups, datasets and attributes of a grid file, written through rust-hdf5.
//!
//! The file has the form of HDF5 1.6 (`Earliest`). Every reader knows it, h5py and VTK write it by default, its object
//! headers hold any number of attributes, and our own reader can check all of it.

use std::path::Path;

use rust_hdf5::{H5Dataset, H5Group, Hdf5Error};
use sdf_core::grid::sparse::BRICK_SAMPLES;
use sdf_core::grid::{BlockBounds, Lattice};
use sha2::{Digest, Sha256};

use super::delta::DeltaCoding;
use super::header::{Attributes, CHECKSUM, Header};
use super::{GridFault, Samples, SparseSamples, StoredMesh, kept_mesh, layout};
use crate::hdf5::{self, DIGEST_BYTES, Element, Value};

/// Writes the file at `path`. Fills in the header's checksum of the digests, which is not known before.
pub(super) fn write(
    path: &Path,
    samples: &Samples,
    mesh: Option<&StoredMesh>,
    mut header: Header,
) -> Result<(), GridFault> {
    let written = hdf5::create(path, |file| {
        let mut digests = Vec::new();
        let vtkhdf = match samples {
            Samples::Dense { .. } => Some(file.create_group("VTKHDF")?),
            _ => None,
        };
        let sdf = file.create_group("sdf")?;
        match samples {
            Samples::Dense { distances, bounds } => {
                if let Some(group) = vtkhdf {
                    write_vtkhdf(&group, &header.lattice, distances, &mut digests)?;
                }
                put(&sdf, "bounds", &[bounds.len(), 3], &bounds_numbers(bounds), &mut digests)?;
            }
            Samples::F32(bricks) => write_sparse(&sdf, &header.lattice, bricks, &mut digests)?,
            Samples::U16(bricks) => write_sparse(&sdf, &header.lattice, bricks, &mut digests)?,
            Samples::U8(bricks) => write_sparse(&sdf, &header.lattice, bricks, &mut digests)?,
        }
        if let Some(StoredMesh { vertices, triangles, .. }) = mesh {
            put(&sdf, kept_mesh::VERTICES, &[vertices.len(), 3], vertices.as_flattened(), &mut digests)?;
            put(&sdf, kept_mesh::TRIANGLES, &[triangles.len(), 3], triangles.as_flattened(), &mut digests)?;
        }
        let shape = [digests.len() / DIGEST_BYTES, DIGEST_BYTES];
        put(&sdf, "digests", &shape, &digests, &mut Vec::new())?;
        header.digests_sha256 = layout::hex(&Sha256::digest(&digests));
        let attributes = header.attributes();
        set_attributes(&sdf, &attributes)?;
        sdf.set_attr_string(CHECKSUM, &attributes.checksum())
    });
    written.map_err(GridFault::Io)
}

/// Fills the group VTKHDF with image data: the point data `distance`.
pub(crate) fn write_vtkhdf(
    group: &H5Group,
    lattice: &Lattice,
    distances: &[f32],
    digests: &mut Vec<u8>,
) -> Result<(), Hdf5Error> {
    group.set_attr_array_numeric("Version", &layout::VTKHDF_VERSION)?;
    hdf5::set_fixed_ascii(group, "Type", "ImageData")?;
    group.set_attr_array_numeric("WholeExtent", &layout::whole_extent(lattice))?;
    group.set_attr_array_numeric("Origin", &lattice.origin())?;
    group.set_attr_array_numeric("Spacing", &[lattice.spacing(); 3])?;
    group.set_attr_array_numeric("Direction", &layout::IDENTITY)?;
    let points = group.create_group("PointData")?;
    hdf5::set_fixed_ascii(&points, "Scalars", "distance")?;
    let dataset = put(&points, "distance", &layout::dense_shape(lattice), distances, digests)?;
    dataset.set_attr_typed("Attribute", hdf5::fixed_ascii("Scalars"), "Scalars".into())
}

fn write_sparse<C: DeltaCoding>(
    sdf: &H5Group,
    lattice: &Lattice,
    bricks: &SparseSamples<C>,
    digests: &mut Vec<u8>,
) -> Result<(), Hdf5Error> {
    let count = bricks.slots.len();
    let scales: Vec<f32> = bricks.scales.iter().flat_map(|scale| [scale.base, scale.step]).collect();
    let encode = |chunk: &mut [C]| chunk.chunks_exact_mut(BRICK_SAMPLES).for_each(C::delta_encode);
    let shape = layout::bricks_shape(count);
    let shapes = [&shape[..], &layout::chunk_shape(&shape)];
    hdf5::write_dataset(sdf, "samples", shapes, bricks.samples, encode, digests)?;
    put(sdf, "bounds", &[count, 3], &bounds_numbers(bricks.bounds), digests)?;
    put(sdf, "places", &[count, 3], bricks.slots.as_flattened(), digests)?;
    put(sdf, "scales", &[count, 2], &scales, digests)?;
    put(sdf, "errors", &[count], bricks.errors, digests)?;
    put(sdf, "coarse", &layout::coarse_shape(lattice), bricks.coarse, digests)?;
    Ok(())
}

/// Adds a dataset to the group, and the digests of its chunks to `digests`.
fn put<T: Element>(
    group: &H5Group,
    name: &str,
    shape: &[usize],
    elements: &[T],
    digests: &mut Vec<u8>,
) -> Result<H5Dataset, Hdf5Error> {
    hdf5::write_dataset(group, name, [shape, &layout::chunk_shape(shape)], elements, |_| (), digests)
}

fn bounds_numbers(bounds: &[BlockBounds]) -> Vec<f32> {
    bounds.iter().flat_map(|bounds| [bounds.range.lower, bounds.range.upper, bounds.slope_bound]).collect()
}

fn set_attributes(group: &H5Group, attributes: &Attributes) -> Result<(), Hdf5Error> {
    for (name, value) in &attributes.0 {
        match value {
            Value::Text(text) => group.set_attr_string(name, text)?,
            Value::Numbers(numbers) => match numbers[..] {
                [number] => group.set_attr_numeric(name, &number)?,
                _ => group.set_attr_array_numeric(name, numbers)?,
            },
            Value::Integers(integers) => {
                let integers: Vec<u64> = integers.iter().map(|integer| *integer as u64).collect();
                match integers[..] {
                    [integer] => group.set_attr_numeric(name, &integer)?,
                    _ => group.set_attr_array_numeric(name, &integers)?,
                }
            }
        }
    }
    Ok(())
}
