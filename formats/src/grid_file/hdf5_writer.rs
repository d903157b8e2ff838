//! What the file holds, put there by rust-hdf5.
//!
//! It is written as HDF5 1.6 had it (`Earliest`): every reader knows that form, h5py and VTK write it unless
//! told otherwise, its object headers hold any number of attributes, and [`super::classic`] can check all of it.

use std::path::Path;

use rust_hdf5::{DatatypeMessage, H5Dataset, H5Group, Hdf5Error};
use sdf_core::grid::sparse::BRICK_SAMPLES;
use sdf_core::grid::{BlockBounds, Lattice};
use sha2::{Digest, Sha256};

use super::classic::Value;
use super::differences::Differences;
use super::element::Element;
use super::head::{Attributes, CHECKSUM, Head};
use super::packing::packed_chunks;
use super::tiling::Tiling;
use super::{Fault, Samples, SparseSamples, layout};
use crate::hdf5;

/// The head's checksum of the digests is yet to be found.
pub(super) fn write(path: &Path, samples: &Samples, mut head: Head) -> Result<(), Fault> {
    let filled = hdf5::create(path, |file| {
        let mut digests = Vec::new();
        let vtkhdf = match samples {
            Samples::Dense { .. } => Some(file.create_group("VTKHDF")?),
            _ => None,
        };
        let sdf = file.create_group("sdf")?;
        match samples {
            Samples::Dense { distances, bounds } => {
                if let Some(group) = vtkhdf {
                    fill_vtkhdf(&group, &head.lattice, distances, &mut digests)?;
                }
                put(&sdf, "bounds", &[bounds.len(), 3], &flat(bounds), &mut digests)?;
            }
            Samples::F32(bricks) => fill_sparse(&sdf, &head.lattice, bricks, &mut digests)?,
            Samples::U16(bricks) => fill_sparse(&sdf, &head.lattice, bricks, &mut digests)?,
            Samples::U8(bricks) => fill_sparse(&sdf, &head.lattice, bricks, &mut digests)?,
        }
        let shape = [digests.len() / layout::DIGEST_BYTES, layout::DIGEST_BYTES];
        put(&sdf, "digests", &shape, &digests, &mut Vec::new())?;
        head.digests_sha256 = layout::hex(&Sha256::digest(&digests));
        let attributes = head.attributes();
        set_attributes(&sdf, &attributes)?;
        sdf.set_attr_string(CHECKSUM, &attributes.checksum())
    });
    filled.map_err(Fault::Io)
}

fn fill_vtkhdf(group: &H5Group, lattice: &Lattice, distances: &[f32], digests: &mut Vec<u8>) -> Result<(), Hdf5Error> {
    group.set_attr_array_numeric("Version", &layout::VTKHDF_VERSION)?;
    set_ascii(group, "Type", "ImageData")?;
    group.set_attr_array_numeric("WholeExtent", &layout::whole_extent(lattice))?;
    group.set_attr_array_numeric("Origin", &lattice.origin())?;
    group.set_attr_array_numeric("Spacing", &[lattice.spacing(); 3])?;
    group.set_attr_array_numeric("Direction", &layout::IDENTITY)?;
    let points = group.create_group("PointData")?;
    set_ascii(&points, "Scalars", "distance")?;
    let dataset = put(&points, "distance", &layout::shape(lattice), distances, digests)?;
    dataset.set_attr_typed("Attribute", ascii_type("Scalars"), "Scalars".into())
}

fn fill_sparse<C: Differences>(
    sdf: &H5Group,
    lattice: &Lattice,
    bricks: &SparseSamples<C>,
    digests: &mut Vec<u8>,
) -> Result<(), Hdf5Error> {
    let count = bricks.places.len();
    let scales: Vec<f32> = bricks.scales.iter().flat_map(|scale| [scale.base, scale.step]).collect();
    let differ = |chunk: &mut [C]| chunk.chunks_exact_mut(BRICK_SAMPLES).for_each(C::differ);
    put_changed(sdf, "samples", &layout::bricks_shape(count), bricks.samples, differ, digests)?;
    put(sdf, "bounds", &[count, 3], &flat(bricks.bounds), digests)?;
    put(sdf, "places", &[count, 3], bricks.places.as_flattened(), digests)?;
    put(sdf, "scales", &[count, 2], &scales, digests)?;
    put(sdf, "errors", &[count], bricks.errors, digests)?;
    put(sdf, "coarse", &layout::coarse_shape(lattice), bricks.coarse, digests)?;
    Ok(())
}

/// Adds a dataset to the group, and its chunks' digests to `digests`.
fn put<T: Element>(
    group: &H5Group,
    name: &str,
    shape: &[usize],
    elements: &[T],
    digests: &mut Vec<u8>,
) -> Result<H5Dataset, Hdf5Error> {
    put_changed(group, name, shape, elements, |_| (), digests)
}

/// As [`put`], but for what `change` does to the elements of each chunk.
fn put_changed<T: Element>(
    group: &H5Group,
    name: &str,
    shape: &[usize],
    elements: &[T],
    change: impl Fn(&mut [T]) + Sync,
    digests: &mut Vec<u8>,
) -> Result<H5Dataset, Hdf5Error> {
    let sides = layout::chunk_shape(shape);
    let dataset = group.new_dataset::<T>().shape(shape).chunk(&sides);
    let dataset = match T::BYTES {
        1 => dataset.deflate(layout::DEFLATE_LEVEL),
        _ => dataset.shuffle_deflate(layout::DEFLATE_LEVEL),
    };
    let dataset = dataset.create(name)?;
    let tiling = Tiling::new(shape, &sides);
    packed_chunks(elements, &tiling, change, |at, chunk| {
        digests.extend(chunk.digest);
        dataset.write_chunk_raw(at, &chunk.packed, 0)
    })?;
    Ok(dataset)
}

fn flat(bounds: &[BlockBounds]) -> Vec<f32> {
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

fn set_ascii(group: &H5Group, name: &str, text: &str) -> Result<(), Hdf5Error> {
    group.set_attr_typed(name, ascii_type(text), text.into())
}

/// Of fixed length, as VTK wants its own texts, and padded with NUL.
fn ascii_type(text: &str) -> DatatypeMessage {
    DatatypeMessage::FixedString { size: text.len() as u32, padding: 1, charset: 0 }
}
