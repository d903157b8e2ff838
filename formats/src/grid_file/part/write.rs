//! A part written while it is baked: samples first, as they come, then the tables, which are known at the end.

use std::io;
use std::path::Path;

use sdf_core::grid::owned::Precision;
use sdf_core::grid::sparse::BRICK_SAMPLES;
use sha2::{Digest, Sha256};

use super::read::{CHUNK_BRICKS, PART_ONLY, PartHeader};
use super::{Codes, GROUP, PartInfo, PartTables, share};
use crate::grid_file::digests::little_endian;
use crate::grid_file::header::CHECKSUM;
use crate::grid_file::write::set_attributes;
use crate::grid_file::{Chunks, GridFault, StoredMesh, kept_mesh, layout};
use crate::hdf5::{self, Appended, Compression, Element, Group};

/// Writes a part at `path`. `bake` calls the function that it receives with the codes of bricks, in their order, and returns their
/// tables: of the coarse grid and the sides all, of which the part's share is written. Only the first part keeps the mesh.
pub fn write<E: From<GridFault>>(
    path: &Path,
    info: &PartInfo,
    mesh: Option<&StoredMesh>,
    bake: impl FnOnce(&mut dyn FnMut(Codes) -> io::Result<()>) -> Result<PartTables, E>,
) -> Result<(), E> {
    let mut failure = None;
    let fill = |root: &Group| {
        let part = root.group(GROUP);
        let mut samples = Samples::new(&part, info.precision);
        match bake(&mut |codes| samples.append(codes)) {
            Ok(tables) => end(&part, info, mesh, samples, tables),
            Err(error) => {
                failure = Some(error);
                Err(io::Error::other("the bake failed"))
            }
        }
    };
    let written = hdf5::create(path, fill);
    match failure {
        Some(error) => Err(error),
        None => written.map_err(|error| GridFault::Io(error).into()),
    }
}

/// The samples so far.
enum Samples<'f> {
    F32(Appended<'f, f32>),
    U16(Appended<'f, u16>),
    U8(Appended<'f, u8>),
}

impl<'f> Samples<'f> {
    fn new(part: &Group<'f>, precision: Precision) -> Self {
        match precision {
            Precision::F32 => Self::F32(part.appended(BRICK_SAMPLES, CHUNK_BRICKS)),
            Precision::U16 => Self::U16(part.appended(BRICK_SAMPLES, CHUNK_BRICKS)),
            Precision::U8 => Self::U8(part.appended(BRICK_SAMPLES, CHUNK_BRICKS)),
        }
    }

    fn append(&mut self, codes: Codes) -> io::Result<()> {
        match (self, codes) {
            (Self::F32(samples), Codes::F32(codes)) => samples.append(&codes),
            (Self::U16(samples), Codes::U16(codes)) => samples.append(&codes),
            (Self::U8(samples), Codes::U8(codes)) => samples.append(&codes),
            _ => Err(io::Error::other("samples of another precision than the part has")),
        }
    }

    fn end(self, part: &Group<'f>, checksums: &mut Vec<u32>) -> io::Result<()> {
        match self {
            Self::F32(samples) => part.end_appended("samples", samples, checksums),
            Self::U16(samples) => part.end_appended("samples", samples, checksums),
            Self::U8(samples) => part.end_appended("samples", samples, checksums),
        }
    }
}

fn end<'f>(
    part: &Group<'f>,
    info: &PartInfo,
    mesh: Option<&StoredMesh>,
    samples: Samples<'f>,
    tables: PartTables,
) -> io::Result<()> {
    let mut chunks = Chunks { compression: Compression::None, checksums: vec![] };
    samples.end(part, &mut chunks.checksums)?;
    let PartTables { near, slots, scales, roundings, interpolations, coarse, sides, slot_sides } = tables;
    let bytes = |sides: &[bool]| -> Vec<u8> {
        let PartInfo { index, count, .. } = *info;
        sides[share(sides.len(), index, count)].iter().map(|is_inside| u8::from(*is_inside)).collect()
    };
    let scales: Vec<f32> = scales.iter().flat_map(|scale| [scale.base, scale.step]).collect();
    let mut put = Tables { chunks: &mut chunks, part };
    put.table("places", 3, slots.as_flattened())?;
    put.table("scales", 2, &scales)?;
    put.table("roundings", 1, &roundings)?;
    put.table("interpolations", 1, &interpolations)?;
    put.table("coarse", 1, &coarse[share(coarse.len(), info.index, info.count)])?;
    put.table("slot_sides", 1, &bytes(&slot_sides))?;
    if let Some(StoredMesh { vertices, triangles, .. }) = mesh.filter(|_| info.index == 0) {
        put.table(kept_mesh::VERTICES, 3, vertices.as_flattened())?;
        put.table(kept_mesh::TRIANGLES, 3, triangles.as_flattened())?;
    }
    let checksums = std::mem::take(&mut chunks.checksums);
    if !checksums.is_empty() {
        chunks.put(part, "digests", &[checksums.len()], &checksums)?;
    }
    let digests_sha256 = layout::hex(&Sha256::digest(little_endian(&checksums)));
    let bricks = [near, slots.len() - near];
    let attributes = PartHeader::attributes(info, mesh, bricks, sides, digests_sha256);
    debug_assert!(PART_ONLY.iter().all(|name| attributes.0.iter().any(|(known, _)| known == name)));
    set_attributes(part, &attributes);
    part.set_text(CHECKSUM, &attributes.checksum());
    Ok(())
}

/// The tables of a part; an empty one is left out, as HDF5 has no dataset without elements that our reader takes.
struct Tables<'a, 'f> {
    chunks: &'a mut Chunks,
    part: &'a Group<'f>,
}

impl Tables<'_, '_> {
    fn table<T: Element>(&mut self, name: &str, columns: usize, numbers: &[T]) -> io::Result<()> {
        if numbers.is_empty() {
            return Ok(());
        }
        let rows = numbers.len() / columns;
        let shape = if columns == 1 { vec![rows] } else { vec![rows, columns] };
        self.chunks.put(self.part, name, &shape, numbers).map(|_| ())
    }
}
