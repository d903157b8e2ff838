//! Checksums of chunks: whoever reads part of a file can trust what it read.
//!
//! The dataset `digests` has the CRC-32 of each chunk of each other dataset, in the order of docs/format.md, and an
//! attribute has the SHA-256 of all of them. Files of version 2 and 3 have a SHA-256 of each chunk. Checksums are against damage, not
//! against forgery, and SHA-256 took an eighth of a query of a part.

use sha2::{Digest, Sha256};

use super::header::Header;
use super::{GridFault, Part, layout};
use crate::hdf5::{Dataset, Element, Hdf5Reader, Object, ReadError, Tile, crc32};

/// Bytes of a SHA-256 digest.
const SHA256_BYTES: usize = 32;

/// Piece sides for [`Digests::elements_in`] that keep each chunk whole.
pub(super) const WHOLE_CHUNKS: [usize; 3] = [usize::MAX; 3];

/// Chunks that are in memory while all are checked.
const CHECKED_AT_A_TIME: usize = 256;

/// The datasets opened so far, in the order of their digests.
#[derive(Default)]
pub(super) struct DatasetList {
    parts: Vec<Part>,
    chunk_count: usize,
}

impl DatasetList {
    /// Adds a dataset; returns the index of the digest of its first chunk.
    pub(super) fn add<T: Element>(&mut self, dataset: &Dataset<T>) -> usize {
        self.parts.push(Part { name: dataset.name(), stored_bytes: dataset.stored_bytes() });
        let first = self.chunk_count;
        self.chunk_count += dataset.chunk_count();
        first
    }

    /// Reads the digests and checks them against the header.
    pub(super) fn read_digests(
        mut self,
        file: &Hdf5Reader,
        sdf: &Object,
        header: &Header,
    ) -> Result<Digests, GridFault> {
        let count = self.chunk_count;
        let (checksums, bytes) = if header.version < layout::CRC_VERSION {
            let digests = self.read_all::<u8>(file, sdf, &[count, SHA256_BYTES])?;
            (Checksums::Sha256(digests.as_chunks().0.to_vec()), digests)
        } else {
            // Only a part of a bake can be empty.
            let checksums = if count == 0 { vec![] } else { self.read_all::<u32>(file, sdf, &[count])? };
            let bytes = little_endian(&checksums);
            (Checksums::Crc32(checksums), bytes)
        };
        if layout::hex(&Sha256::digest(&bytes)) != header.digests_sha256 {
            return Err(GridFault::damaged("checksum of the digests does not match"));
        }
        Ok(Digests { parts: self.parts, checksums })
    }

    fn read_all<T: Element>(&mut self, file: &Hdf5Reader, sdf: &Object, shape: &[usize]) -> Result<Vec<T>, GridFault> {
        let dataset = open_dataset::<T>(file, sdf, "digests", shape)?;
        self.add(&dataset);
        // Datasets that share chunks would inflate to more than the file could hold.
        if self.parts.iter().map(|part| part.stored_bytes).sum::<u64>() > file.file_bytes() {
            return Err(GridFault::damaged("its datasets share their chunks"));
        }
        Ok(file.elements(&dataset, WHOLE_CHUNKS, |_| true, |_, _| Ok(()))?)
    }
}

/// The checksum of each chunk, and the datasets that they belong to.
pub(super) struct Digests {
    /// Samples first, digests last.
    pub parts: Vec<Part>,
    checksums: Checksums,
}

/// The bytes of checksums, of which the header has the SHA-256.
pub(super) fn little_endian(checksums: &[u32]) -> Vec<u8> {
    checksums.iter().copied().flat_map(u32::to_le_bytes).collect()
}

enum Checksums {
    Crc32(Vec<u32>),
    /// Before version 4.
    Sha256(Vec<[u8; SHA256_BYTES]>),
}

impl Checksums {
    fn matches(&self, chunk: usize, bytes: &[u8]) -> bool {
        match self {
            Self::Crc32(checksums) => checksums.get(chunk) == Some(&crc32(bytes)),
            Self::Sha256(digests) => digests.get(chunk) == Some(&Sha256::digest(bytes).into()),
        }
    }
}

impl Digests {
    /// All elements of a dataset, checked. `first` is the index of the digest of its first chunk.
    pub(super) fn elements<T: Element>(
        &self,
        file: &Hdf5Reader,
        dataset: &Dataset<T>,
        first: usize,
    ) -> Result<Vec<T>, ReadError> {
        self.elements_in(file, dataset, first, WHOLE_CHUNKS, |_| true)
    }

    /// The elements of the needed pieces, checked; zero elsewhere. See [`Hdf5Reader::elements`].
    pub(super) fn elements_in<T: Element>(
        &self,
        file: &Hdf5Reader,
        dataset: &Dataset<T>,
        first: usize,
        piece: [usize; 3],
        is_needed: impl Fn(Tile) -> bool + Sync,
    ) -> Result<Vec<T>, ReadError> {
        file.elements(dataset, piece, is_needed, |chunk, bytes| self.check(dataset.name(), first + chunk, bytes))
    }
}

impl Digests {
    /// Some rows of a dataset, checked. See [`Hdf5Reader::rows`].
    pub(super) fn rows<T: Element>(
        &self,
        file: &Hdf5Reader,
        dataset: &Dataset<T>,
        first: usize,
        rows: &[u32],
    ) -> Result<Vec<T>, ReadError> {
        file.rows(dataset, rows, |chunk, bytes| self.check(dataset.name(), first + chunk, bytes))
    }

    /// The elements of some chunks, checked. See [`Hdf5Reader::chunks`].
    pub(super) fn chunks<T: Element>(
        &self,
        file: &Hdf5Reader,
        dataset: &Dataset<T>,
        first: usize,
        chunks: &[usize],
    ) -> Result<Vec<(Tile, Vec<T>)>, ReadError> {
        file.chunks(dataset, chunks, |chunk, bytes| self.check(dataset.name(), first + chunk, bytes))
    }

    /// Checks all chunks of a dataset, and holds some of them at a time.
    pub(super) fn check_all<T: Element>(
        &self,
        file: &Hdf5Reader,
        dataset: &Dataset<T>,
        first: usize,
    ) -> Result<(), ReadError> {
        let chunks: Vec<usize> = (0..dataset.chunk_count()).collect();
        chunks.chunks(CHECKED_AT_A_TIME).try_for_each(|chunks| self.chunks(file, dataset, first, chunks).map(drop))
    }

    fn check(&self, name: &str, chunk: usize, bytes: &[u8]) -> Result<(), ReadError> {
        if self.checksums.matches(chunk, bytes) {
            return Ok(());
        }
        Err(ReadError::damaged(format!("checksum of a chunk of {name} does not match")))
    }
}

pub(super) fn open_dataset<T: Element>(
    file: &Hdf5Reader,
    group: &Object,
    name: &'static str,
    shape: &[usize],
) -> Result<Dataset<T>, ReadError> {
    let object = file.member(Some(group), name)?;
    file.dataset(&object, name, shape)
}
