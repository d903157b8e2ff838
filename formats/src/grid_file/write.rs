//! Groups, datasets and attributes of a grid file, written to a path or into memory. docs/format.md lists them.

use std::io;
use std::path::Path;

use sdf_core::grid::sparse::{BRICK_SAMPLES, Scale};
use sdf_core::grid::{BlockBounds, Lattice};
use sha2::{Digest, Sha256};

use super::attributes::Attributes;
use super::coding::{BrickCoding, Coding};
use super::digests::little_endian;
use super::header::{CHECKSUM, Header};
use super::{DenseBlockSamples, GridFault, Samples, SparseSamples, StoredMesh, error_regions, kept_mesh, layout};
use crate::hdf5::{self, Compression, Element, Elements, Group, Value};

/// Writes the file at `path`.
pub(super) fn write(path: &Path, contents: Contents) -> Result<(), GridFault> {
    hdf5::create(path, |root| contents.fill(root)).map_err(GridFault::Io)
}

/// The bytes of the file.
pub(super) fn to_bytes(contents: Contents) -> Result<Vec<u8>, GridFault> {
    hdf5::to_bytes(|root| contents.fill(root)).map_err(GridFault::Io)
}

/// Samples by brick, of the precision that the grid has.
#[derive(Clone, Copy)]
pub(super) enum SamplesElsewhere<'a> {
    F32(&'a dyn Elements<f32>),
    U16(&'a dyn Elements<u16>),
    U8(&'a dyn Elements<u8>),
}

/// All that a file holds. The header's checksum of the digests is not known before it is written.
pub(super) struct Contents<'a> {
    pub samples: Samples<'a>,
    /// The samples of a sparse grid that are not in [`Self::samples`].
    pub elsewhere: Option<SamplesElsewhere<'a>>,
    pub mesh: Option<&'a StoredMesh>,
    pub header: Header,
    pub compression: Compression,
}

impl Contents<'_> {
    fn fill(mut self, root: &Group) -> io::Result<()> {
        let mut chunks = Chunks { compression: self.compression, checksums: Vec::new() };
        let lattice = self.header.lattice;
        let vtkhdf = matches!(self.samples, Samples::Dense { .. }).then(|| root.group("VTKHDF"));
        let sdf = root.group("sdf");
        match &self.samples {
            Samples::Dense { distances, bounds } => {
                if let Some(group) = vtkhdf {
                    chunks.write_vtkhdf(&group, &lattice, distances)?;
                }
                chunks.put(&sdf, "bounds", &[bounds.len(), 3], &bounds_numbers(bounds))?;
            }
            Samples::DenseU16(blocks) => chunks.write_blocks(&sdf, blocks)?,
            Samples::DenseU8(blocks) => chunks.write_blocks(&sdf, blocks)?,
            Samples::F32(bricks) => match self.elsewhere {
                Some(SamplesElsewhere::F32(samples)) => chunks.write_sparse(&sdf, &lattice, bricks, samples)?,
                _ => chunks.write_sparse(&sdf, &lattice, bricks, &bricks.samples)?,
            },
            Samples::U16(bricks) => match self.elsewhere {
                Some(SamplesElsewhere::U16(samples)) => chunks.write_sparse(&sdf, &lattice, bricks, samples)?,
                _ => chunks.write_sparse(&sdf, &lattice, bricks, &bricks.samples)?,
            },
            Samples::U8(bricks) => match self.elsewhere {
                Some(SamplesElsewhere::U8(samples)) => chunks.write_sparse(&sdf, &lattice, bricks, samples)?,
                _ => chunks.write_sparse(&sdf, &lattice, bricks, &bricks.samples)?,
            },
        }
        if let Some(StoredMesh { vertices, triangles, .. }) = self.mesh {
            chunks.put(&sdf, kept_mesh::VERTICES, &[vertices.len(), 3], vertices.as_flattened())?;
            chunks.put(&sdf, kept_mesh::TRIANGLES, &[triangles.len(), 3], triangles.as_flattened())?;
        }
        let checksums = std::mem::take(&mut chunks.checksums);
        chunks.put(&sdf, "digests", &[checksums.len()], &checksums)?;
        self.header.digests_sha256 = layout::hex(&Sha256::digest(little_endian(&checksums)));
        let attributes = self.header.attributes();
        set_attributes(&sdf, &attributes);
        sdf.set_text(CHECKSUM, &attributes.checksum());
        if let Some(found) = &self.header.about.error_regions {
            error_regions::write(&sdf, found);
        }
        Ok(())
    }
}

/// How chunks are written, and the checksums of those that were.
pub(crate) struct Chunks {
    pub compression: Compression,
    pub checksums: Vec<u32>,
}

impl Chunks {
    /// Fills the group VTKHDF with image data: the point data `distance`.
    pub(crate) fn write_vtkhdf(&mut self, group: &Group, lattice: &Lattice, distances: &[f32]) -> io::Result<()> {
        group.set_numbers("Version", &layout::VTKHDF_VERSION);
        group.set_ascii("Type", "ImageData");
        group.set_numbers("WholeExtent", &layout::whole_extent(lattice));
        group.set_numbers("Origin", &lattice.origin());
        group.set_numbers("Spacing", &[lattice.spacing(); 3]);
        group.set_numbers("Direction", &layout::IDENTITY);
        let points = group.group("PointData");
        points.set_ascii("Scalars", "distance");
        let dataset = self.put(&points, "distance", &layout::dense_shape(lattice), distances)?;
        dataset.set_ascii("Attribute", "Scalars");
        Ok(())
    }

    fn write_sparse<C: BrickCoding>(
        &mut self,
        sdf: &Group,
        lattice: &Lattice,
        bricks: &SparseSamples<C>,
        samples: &(dyn Elements<C> + '_),
    ) -> io::Result<()> {
        let count = bricks.slots.len();
        self.write_codes(sdf, count, samples)?;
        self.put(sdf, "bounds", &[count, 3], &bounds_numbers(bricks.bounds))?;
        self.put(sdf, "places", &[count, 3], bricks.slots.as_flattened())?;
        self.put(sdf, "scales", &[count, 2], &scales_numbers(bricks.scales))?;
        self.put(sdf, "errors", &[count], bricks.errors)?;
        self.put(sdf, "coarse", &layout::coarse_shape(lattice), bricks.coarse)?;
        Ok(())
    }

    fn write_blocks<C: BrickCoding>(&mut self, sdf: &Group, blocks: &DenseBlockSamples<C>) -> io::Result<()> {
        let count = blocks.slots.len();
        self.write_codes(sdf, count, &blocks.samples)?;
        self.put(sdf, "bounds", &[count, 3], &bounds_numbers(blocks.bounds))?;
        self.put(sdf, "places", &[count, 3], blocks.slots.as_flattened())?;
        self.put(sdf, "scales", &[count, 2], &scales_numbers(blocks.scales))?;
        Ok(())
    }

    /// The samples of so many bricks.
    fn write_codes<C: BrickCoding>(
        &mut self,
        sdf: &Group,
        count: usize,
        samples: &(dyn Elements<C> + '_),
    ) -> io::Result<()> {
        let coding = Coding::of(self.compression);
        let encode = |chunk: &mut [C]| {
            chunk.chunks_exact_mut(BRICK_SAMPLES).for_each(|brick| C::encode_brick(brick, coding));
        };
        let shape = layout::bricks_shape(count);
        let shapes = [&shape[..], &layout::chunk_shape(&shape)];
        sdf.chunked_from("samples", shapes, self.compression, samples, encode, &mut self.checksums)?;
        Ok(())
    }

    /// Adds a dataset to the group, and the checksums of its chunks to the others.
    pub(crate) fn put<'f, T: Element>(
        &mut self,
        group: &Group<'f>,
        name: &str,
        shape: &[usize],
        elements: &[T],
    ) -> io::Result<Group<'f>> {
        let shapes = [shape, &layout::chunk_shape(shape)];
        group.chunked(name, shapes, self.compression, elements, |_| (), &mut self.checksums)
    }
}

fn bounds_numbers(bounds: &[BlockBounds]) -> Vec<f32> {
    bounds.iter().flat_map(|bounds| [bounds.range.lower, bounds.range.upper, bounds.slope_bound]).collect()
}

fn scales_numbers(scales: &[Scale]) -> Vec<f32> {
    scales.iter().flat_map(|scale| [scale.base, scale.step]).collect()
}

pub(super) fn set_attributes(group: &Group, attributes: &Attributes) {
    for (name, value) in &attributes.0 {
        match value {
            Value::Text(text) => group.set_text(name, text),
            Value::Numbers(numbers) => match numbers[..] {
                [number] => group.set_number(name, number),
                _ => group.set_numbers(name, numbers),
            },
            Value::Integers(integers) => {
                let integers: Vec<u64> = integers.iter().map(|integer| *integer as u64).collect();
                match integers[..] {
                    [integer] => group.set_number(name, integer),
                    _ => group.set_numbers(name, &integers),
                }
            }
        }
    }
}
