//! Groups, datasets and attributes of a grid file, written through rust-hdf5, to a path or into memory.
//!
//! The file has the form of HDF5 1.6 (`Earliest`). Every reader knows it, h5py and VTK write it by default, its object
//! headers hold any number of attributes, and our own reader can check all of it.

use std::io;
use std::path::Path;

use rust_hdf5::Hdf5Error;
use sdf_core::grid::sparse::BRICK_SAMPLES;
use sdf_core::grid::{BlockBounds, Lattice};
use sha2::{Digest, Sha256};

use super::delta::DeltaCoding;
use super::header::{Attributes, CHECKSUM, Header};
use super::{GridFault, Samples, SparseSamples, StoredMesh, kept_mesh, layout};
use crate::hdf5::{self, ChunkedDataset, DIGEST_BYTES, Element, Group, Value};

/// Writes the file at `path`.
pub(super) fn write(
    path: &Path,
    samples: &Samples,
    mesh: Option<&StoredMesh>,
    header: Header,
) -> Result<(), GridFault> {
    let written = hdf5::create(path, |file| fill(&file.root_group(), samples, mesh, header));
    written.map_err(GridFault::Io)
}

/// The bytes of a file, without one.
pub(super) fn to_bytes(samples: &Samples, mesh: Option<&StoredMesh>, header: Header) -> Result<Vec<u8>, GridFault> {
    let written = hdf5::to_bytes(|root| fill(root, samples, mesh, header));
    written.map_err(|error: Hdf5Error| GridFault::Io(io::Error::other(error.to_string())))
}

/// Fills the root of a file. The header's checksum of the digests is not known before.
fn fill<G: Group>(root: &G, samples: &Samples, mesh: Option<&StoredMesh>, mut header: Header) -> Result<(), Hdf5Error> {
    let mut digests = Vec::new();
    let vtkhdf = match samples {
        Samples::Dense { .. } => Some(root.add_group("VTKHDF")?),
        _ => None,
    };
    let sdf = root.add_group("sdf")?;
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
    sdf.set_text(CHECKSUM, &attributes.checksum())
}

/// Fills the group VTKHDF with image data: the point data `distance`.
pub(crate) fn write_vtkhdf<G: Group>(
    group: &G,
    lattice: &Lattice,
    distances: &[f32],
    digests: &mut Vec<u8>,
) -> Result<(), Hdf5Error> {
    group.set_numbers("Version", &layout::VTKHDF_VERSION)?;
    group.set_ascii("Type", "ImageData")?;
    group.set_numbers("WholeExtent", &layout::whole_extent(lattice))?;
    group.set_numbers("Origin", &lattice.origin())?;
    group.set_numbers("Spacing", &[lattice.spacing(); 3])?;
    group.set_numbers("Direction", &layout::IDENTITY)?;
    let points = group.add_group("PointData")?;
    points.set_ascii("Scalars", "distance")?;
    let dataset = put(&points, "distance", &layout::dense_shape(lattice), distances, digests)?;
    dataset.label("Attribute", "Scalars")
}

fn write_sparse<G: Group, C: DeltaCoding>(
    sdf: &G,
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
fn put<G: Group, T: Element>(
    group: &G,
    name: &str,
    shape: &[usize],
    elements: &[T],
    digests: &mut Vec<u8>,
) -> Result<G::Dataset, Hdf5Error> {
    hdf5::write_dataset(group, name, [shape, &layout::chunk_shape(shape)], elements, |_| (), digests)
}

fn bounds_numbers(bounds: &[BlockBounds]) -> Vec<f32> {
    bounds.iter().flat_map(|bounds| [bounds.range.lower, bounds.range.upper, bounds.slope_bound]).collect()
}

fn set_attributes(group: &impl Group, attributes: &Attributes) -> Result<(), Hdf5Error> {
    for (name, value) in &attributes.0 {
        match value {
            Value::Text(text) => group.set_text(name, text)?,
            Value::Numbers(numbers) => match numbers[..] {
                [number] => group.set_number(name, number)?,
                _ => group.set_numbers(name, numbers)?,
            },
            Value::Integers(integers) => {
                let integers: Vec<u64> = integers.iter().map(|integer| *integer as u64).collect();
                match integers[..] {
                    [integer] => group.set_number(name, integer)?,
                    _ => group.set_numbers(name, &integers)?,
                }
            }
        }
    }
    Ok(())
}
