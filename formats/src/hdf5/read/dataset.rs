//! Elements of a dataset: chunks read, inflated, unshuffled and checked, on all threads.

use std::marker::PhantomData;

use flate2::{Decompress, FlushDecompress, Status};

use super::ReadError;
use super::chunk_index::{ChunkIndex, Packing};
use super::object::Object;
use super::source::ByteSource;
use crate::hdf5::element::Element;
use crate::hdf5::tiling::{Tile, Tiling};

/// A dataset of one to three axes, chunked, deflated or not, whose chunks all lie in the file.
pub(crate) struct Dataset<T> {
    name: &'static str,
    index: ChunkIndex,
    element: PhantomData<T>,
}

impl<T: Element> Dataset<T> {
    /// Reads the index of chunks, not the elements.
    pub(super) fn open(
        source: &ByteSource,
        object: &Object,
        name: &'static str,
        shape: &[usize],
    ) -> Result<Self, ReadError> {
        let index = ChunkIndex::read::<T>(source, object, name, shape)?;
        Ok(Self { name, index, element: PhantomData })
    }

    pub(crate) fn name(&self) -> &'static str {
        self.name
    }

    pub(crate) fn tiling(&self) -> &Tiling {
        &self.index.tiling
    }

    pub(crate) fn chunk_count(&self) -> usize {
        self.index.chunks.len()
    }

    /// Compressed size of all chunks.
    pub(crate) fn stored_bytes(&self) -> u64 {
        self.index.stored_bytes
    }

    /// All elements, the last axis fastest; zero outside the needed pieces.
    ///
    /// Chunks of which nothing is needed are not read; of the others, only the needed pieces are copied. A piece has at
    /// most `piece` elements along each axis. Memory that is never written to need not be provided by the system.
    /// Chunks of different slabs are read in parallel; of several errors, that of the first slab is returned.
    ///
    /// `check` is called with the index and the elements of each chunk that is read, decompressed and cut to the
    /// dataset.
    pub(super) fn read(
        &self,
        source: &ByteSource,
        piece: [usize; 3],
        is_needed: impl Fn(Tile) -> bool + Sync,
        check: impl Fn(usize, &[u8]) -> Result<(), ReadError> + Sync,
    ) -> Result<Vec<T>, ReadError> {
        let tiling = self.tiling();
        let mut elements = zeros(tiling.shape(), self.name)?;
        let read_slab = |unpacker: &mut Unpacker, (slab, elements): (usize, &mut [T])| {
            let first = slab * tiling.slab_elements();
            tiling.slab(slab).filter(|chunk| is_needed(tiling.tile(*chunk))).try_for_each(|chunk| {
                self.unpack(source, chunk, unpacker)?;
                check(chunk, &unpacker.unpacked)?;
                let tile = tiling.tile(chunk);
                let mut needed = tile.runs(piece, &is_needed);
                needed.try_for_each(|run| self.copy_run(tile, run, &unpacker.unpacked, first, elements))
            })
        };
        if self.chunk_count() == 1 {
            // A single chunk is not worth another thread.
            read_slab(&mut Unpacker::new(), (0, &mut elements))?;
            return Ok(elements);
        }
        let slabs = elements.chunks_mut(tiling.slab_elements()).enumerate().collect();
        sdf_parallel::map_items(slabs, Unpacker::new, read_slab).into_iter().collect::<Result<(), ReadError>>()?;
        Ok(elements)
    }

    /// Some rows of a dataset of two axes whose chunks hold whole rows, in ascending order, one after the other; on all threads.
    /// `check`: as of [`read`](Self::read).
    pub(super) fn read_rows(
        &self,
        source: &ByteSource,
        rows: &[u32],
        check: impl Fn(usize, &[u8]) -> Result<(), ReadError> + Sync,
    ) -> Result<Vec<T>, ReadError> {
        let ([_, count, columns], [_, chunk_rows, chunk_columns]) = (self.tiling().shape(), self.tiling().sides());
        if chunk_columns != columns || rows.last().is_some_and(|row| *row as usize >= count) {
            return Err(ReadError::damaged(format!("rows of {} are not where they are declared", self.name)));
        }
        let chunk = |row: &u32| *row as usize / chunk_rows;
        let mut elements = zeros([1, rows.len(), columns], self.name)?;
        let mut free = &mut elements[..];
        let groups = rows.chunk_by(|a, b| chunk(a) == chunk(b)).map(|rows| {
            let (own, rest) = std::mem::take(&mut free).split_at_mut(rows.len() * columns);
            free = rest;
            (rows, own)
        });
        let groups: Vec<(&[u32], &mut [T])> = groups.collect();
        let read = |unpacker: &mut Unpacker, (rows, own): (&[u32], &mut [T])| {
            let chunk = chunk(&rows[0]);
            self.unpack(source, chunk, unpacker)?;
            check(chunk, &unpacker.unpacked)?;
            let mut is_finite = true;
            for (row, own) in rows.iter().zip(own.chunks_exact_mut(columns)) {
                let first = (*row as usize - chunk * chunk_rows) * columns * T::BYTES;
                T::copy_from_le(own, &unpacker.unpacked[first..][..columns * T::BYTES]);
                is_finite &= own.iter().all(|element| element.is_finite());
            }
            if is_finite { Ok(()) } else { Err(ReadError::damaged(format!("a number of {} is not finite", self.name))) }
        };
        sdf_parallel::map_items(groups, Unpacker::new, read).into_iter().collect::<Result<(), ReadError>>()?;
        Ok(elements)
    }

    /// The elements of some chunks, each cut to the dataset; on all threads. `check`: as of [`read`](Self::read).
    pub(super) fn read_chunks(
        &self,
        source: &ByteSource,
        chunks: &[usize],
        check: impl Fn(usize, &[u8]) -> Result<(), ReadError> + Sync,
    ) -> Result<Vec<(Tile, Vec<T>)>, ReadError> {
        let read = |unpacker: &mut Unpacker, chunk: usize| {
            self.unpack(source, chunk, unpacker)?;
            check(chunk, &unpacker.unpacked)?;
            let tile = self.tiling().tile(chunk);
            let mut elements = zeros(tile.size, self.name)?;
            T::copy_from_le(&mut elements, &unpacker.unpacked);
            if elements.iter().all(|element| element.is_finite()) {
                return Ok((tile, elements));
            }
            Err(ReadError::damaged(format!("a number of {} is not finite", self.name)))
        };
        sdf_parallel::map_items(chunks.to_vec(), Unpacker::new, read).into_iter().collect()
    }

    /// Leaves the chunk's little-endian elements in `unpacked`, cut to the dataset. A whole chunk that is not packed is read into
    /// its place.
    fn unpack(&self, source: &ByteSource, chunk: usize, unpacker: &mut Unpacker) -> Result<(), ReadError> {
        let Unpacker { inflater, stored, packed, unpacked } = unpacker;
        let tile = self.tiling().tile(chunk);
        let chunk = &self.index.chunks[chunk];
        let [sz, sy, sx] = self.tiling().sides();
        let Packing { is_shuffled, is_deflated } = self.index.packing;
        if is_deflated {
            source.read_into(chunk.address, chunk.stored_bytes, stored)?;
            packed.resize(sz * sy * sx * T::BYTES, 0);
            self.inflate(inflater, stored, packed)?;
        } else if !is_shuffled && tile.size == [sz, sy, sx] {
            return source.read_into(chunk.address, chunk.stored_bytes, unpacked);
        } else {
            source.read_into(chunk.address, chunk.stored_bytes, packed)?;
        }
        let [size_z, size_y, size_x] = tile.size;
        unpacked.resize(size_z * size_y * size_x * T::BYTES, 0);
        let rows = (0..size_z).flat_map(|z| (0..size_y).map(move |y| (z * sy + y) * sx));
        for (first, row) in rows.zip(unpacked.chunks_exact_mut(size_x * T::BYTES)) {
            if is_shuffled {
                unshuffle::<T>(packed, first, row);
            } else {
                row.copy_from_slice(&packed[first * T::BYTES..][..size_x * T::BYTES]);
            }
        }
        Ok(())
    }

    /// Copies a part of a tile into `elements`, which begin with the dataset's element `first`.
    fn copy_run(
        &self,
        tile: Tile,
        run: Tile,
        unpacked: &[u8],
        first: usize,
        elements: &mut [T],
    ) -> Result<(), ReadError> {
        let count = run.size[2];
        let mut is_finite = true;
        for (from, to) in tile.rows(run).zip(self.tiling().rows(run)) {
            let elements = &mut elements[to - first..][..count];
            T::copy_from_le(elements, &unpacked[from * T::BYTES..][..count * T::BYTES]);
            is_finite &= elements.iter().fold(true, |is_finite, element| is_finite & element.is_finite());
        }
        if is_finite { Ok(()) } else { Err(ReadError::damaged(format!("a number of {} is not finite", self.name))) }
    }

    /// Fills `out` exactly or fails; never writes past it, whatever the stream would inflate to.
    fn inflate(&self, inflater: &mut Decompress, stored: &[u8], out: &mut [u8]) -> Result<(), ReadError> {
        inflater.reset(true);
        let status = inflater.decompress(stored, out, FlushDecompress::Finish);
        // Nothing is left over on either side: a size that the index gives wrong is damage.
        let is_full = inflater.total_out() == out.len() as u64 && inflater.total_in() == stored.len() as u64;
        match status {
            Ok(Status::StreamEnd) if is_full => Ok(()),
            _ => Err(ReadError::damaged(format!("a chunk of {} does not inflate to its size", self.name))),
        }
    }
}

/// Buffers for reading a chunk, reused from one to the next.
struct Unpacker {
    inflater: Decompress,
    stored: Vec<u8>,
    packed: Vec<u8>,
    unpacked: Vec<u8>,
}

impl Unpacker {
    fn new() -> Self {
        Self { inflater: Decompress::new(true), stored: Vec::new(), packed: Vec::new(), unpacked: Vec::new() }
    }
}

fn zeros<T: Element>(shape: [usize; 3], name: &str) -> Result<Vec<T>, ReadError> {
    let count = shape.iter().product();
    let too_large = |_| ReadError::OutOfMemory(name.to_owned(), count as u64 * T::BYTES as u64);
    // Tried first, because `vec!` would abort; only `vec!` takes zeroed memory from the system.
    Vec::<T>::new().try_reserve_exact(count).map_err(too_large)?;
    Ok(vec![T::default(); count])
}

/// A row of elements from a shuffled chunk: all first bytes, then all second bytes, and so on.
fn unshuffle<T: Element>(shuffled: &[u8], first: usize, row: &mut [u8]) {
    let count = row.len() / T::BYTES;
    let mut planes = shuffled.chunks_exact(shuffled.len() / T::BYTES).map(|plane| &plane[first..][..count]);
    let mut plane = || planes.next().unwrap_or_default();
    // Sums of words compile to a few wide instructions.
    match T::BYTES {
        4 => {
            let planes = plane().iter().zip(plane()).zip(plane()).zip(plane());
            for (element, (((a, b), c), d)) in row.as_chunks_mut().0.iter_mut().zip(planes) {
                let [a, b, c, d] = [*a, *b, *c, *d].map(u32::from);
                *element = (a | b << 8 | c << 16 | d << 24).to_le_bytes();
            }
        }
        2 => {
            for (element, (a, b)) in row.as_chunks_mut().0.iter_mut().zip(plane().iter().zip(plane())) {
                let [a, b] = [*a, *b].map(u16::from);
                *element = (a | b << 8).to_le_bytes();
            }
        }
        1 => row.copy_from_slice(plane()),
        bytes => {
            for at in 0..bytes {
                let elements = row.chunks_exact_mut(bytes).zip(plane());
                elements.for_each(|(element, byte)| element[at] = *byte);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_allocated_is_not_called_damaged() {
        // 2⁶² bytes: no processor addresses so many, and the count does not overflow.
        match zeros::<f32>([1 << 20; 3], "bounds") {
            Err(ReadError::OutOfMemory(name, bytes)) => assert_eq!((&*name, bytes), ("bounds", 1 << 62)),
            other => panic!("{other:?}"),
        }
    }
}
