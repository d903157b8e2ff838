//! Compression of chunks on all threads, with the same bytes on any number of them.
//!
//! Each chunk is cut out of the dataset, transformed, hashed, padded to whole chunks with zeros, shuffled and deflated.

use std::io;

use super::Compression;
use super::checksum::crc32;
use super::deflate::Deflater;
use super::element::Element;
use super::tiling::{Tile, Tiling};

/// Chunks that each thread packs before they are written. With fewer, threads wait for each other; more take more
/// memory. Four of 128 KiB take half a megabyte a thread.
const CHUNKS_PER_THREAD: usize = 4;

/// The elements of a dataset, in memory or elsewhere.
pub(crate) trait Elements<T>: Sync {
    /// Appends the elements of a tile of the dataset.
    fn read(&self, tiling: &Tiling, tile: Tile, elements: &mut Vec<T>) -> io::Result<()>;
}

impl<T: Element> Elements<T> for &[T] {
    fn read(&self, tiling: &Tiling, tile: Tile, elements: &mut Vec<T>) -> io::Result<()> {
        tiling.rows(tile).for_each(|row| elements.extend_from_slice(&self[row..][..tile.size[2]]));
        Ok(())
    }
}

/// A chunk as it stands in the file.
pub(super) struct PackedChunk {
    pub packed: Vec<u8>,
    /// CRC-32 of the transformed elements, cut to the dataset, before padding and compression.
    pub checksum: u32,
}

/// Calls `emit` with each chunk of a dataset, in order, after `transform` has changed its elements. Holds only a few
/// chunks at a time. The bytes do not depend on the number of threads.
pub(super) fn packed_chunks<T: Element>(
    elements: &(dyn Elements<T> + '_),
    tiling: &Tiling,
    compression: Compression,
    transform: impl Fn(&mut [T]) + Sync,
    mut emit: impl FnMut(PackedChunk) -> io::Result<()>,
) -> io::Result<()> {
    let count = tiling.count().unwrap_or(0);
    let batch = CHUNKS_PER_THREAD * sdf_parallel::thread_count();
    for first in (0..count).step_by(batch) {
        let chunks = first..count.min(first + batch);
        let packer = || Packer { tiling, compression, deflater: Deflater::new(), elements: Vec::new() };
        let pack = |packer: &mut Packer<T>, chunk| packer.pack(elements, chunk, &transform);
        let packed = sdf_parallel::map_items(chunks.collect(), packer, pack);
        packed.into_iter().try_for_each(|packed| emit(packed?))?;
    }
    Ok(())
}

/// Packs one chunk after the other.
struct Packer<'a, T> {
    tiling: &'a Tiling,
    compression: Compression,
    deflater: Deflater,
    /// Scratch: the elements of a chunk.
    elements: Vec<T>,
}

impl<T: Element> Packer<'_, T> {
    fn pack(
        &mut self,
        elements: &(dyn Elements<T> + '_),
        chunk: usize,
        transform: impl Fn(&mut [T]),
    ) -> io::Result<PackedChunk> {
        let (tile, sides) = (self.tiling.tile(chunk), self.tiling.sides());
        self.elements.clear();
        elements.read(self.tiling, tile, &mut self.elements)?;
        transform(&mut self.elements);
        let [_, sy, sx] = sides;
        let mut bytes = vec![0; self.elements.len() * T::BYTES];
        T::copy_to_le(&self.elements, &mut bytes);
        let checksum = crc32(&bytes);
        if tile.size != sides {
            bytes = padded(&bytes, tile.size, sides, T::BYTES);
        }
        let packed = match self.compression {
            Compression::Deflate => self.deflater.chunk(&shuffled(bytes, T::BYTES), T::BYTES, &[1, sx, sx * sy])?,
            Compression::None => bytes,
        };
        Ok(PackedChunk { packed, checksum })
    }
}

/// All first bytes of the elements, then all second bytes, and so on.
fn shuffled(bytes: Vec<u8>, element_bytes: usize) -> Vec<u8> {
    fn planes<const N: usize>(bytes: &[u8]) -> Vec<u8> {
        let (elements, _) = bytes.as_chunks::<N>();
        let mut planes = Vec::with_capacity(bytes.len());
        (0..N).for_each(|plane| planes.extend(elements.iter().map(|element| element[plane])));
        planes
    }
    match element_bytes {
        2 => planes::<2>(&bytes),
        4 => planes::<4>(&bytes),
        8 => planes::<8>(&bytes),
        _ => bytes,
    }
}

/// A chunk that sticks out of the dataset, filled up with zeros: HDF5 stores whole chunks.
fn padded(bytes: &[u8], size: [usize; 3], sides: [usize; 3], element_bytes: usize) -> Vec<u8> {
    let mut whole = vec![0; sides.iter().product::<usize>() * element_bytes];
    let rows = (0..size[0]).flat_map(|z| (0..size[1]).map(move |y| (z * sides[1] + y) * sides[2] * element_bytes));
    for (offset, row) in rows.zip(bytes.chunks_exact(size[2] * element_bytes)) {
        whole[offset..][..row.len()].copy_from_slice(row);
    }
    whole
}
