//! Checksums of chunks: whoever reads part of a file can trust what it read.
//!
//! The dataset `digests` has the SHA-256 of each chunk of each other dataset, in the order of docs/format.md, and an
//! attribute has the SHA-256 of all digests.

use sha2::{Digest, Sha256};

use super::header::Header;
use super::{GridFault, Part, layout};
use crate::hdf5::{DIGEST_BYTES, Dataset, Element, Hdf5Reader, Object, ReadError, Tile};

/// Piece sides for [`Digests::elements_in`] that keep each chunk whole.
pub(super) const WHOLE_CHUNKS: [usize; 3] = [usize::MAX; 3];

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
        let dataset = open_dataset::<u8>(file, sdf, "digests", &[self.chunk_count, DIGEST_BYTES])?;
        self.add(&dataset);
        // Datasets that share chunks would inflate to more than the file could hold.
        if self.parts.iter().map(|part| part.stored_bytes).sum::<u64>() > file.file_bytes() {
            return Err(GridFault::damaged("its datasets share their chunks"));
        }
        let digests = file.elements(&dataset, WHOLE_CHUNKS, |_| true, |_, _| Ok(()))?;
        if layout::hex(&Sha256::digest(&digests)) != header.digests_sha256 {
            return Err(GridFault::damaged("checksum of the digests does not match"));
        }
        Ok(Digests { parts: self.parts, digests })
    }
}

/// The SHA-256 of each chunk, and the datasets that they belong to.
pub(super) struct Digests {
    /// Samples first, digests last.
    pub parts: Vec<Part>,
    digests: Vec<u8>,
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
        file.elements(dataset, piece, is_needed, |chunk, bytes| {
            let digest = &self.digests[(first + chunk) * DIGEST_BYTES..][..DIGEST_BYTES];
            if Sha256::digest(bytes)[..] == *digest {
                return Ok(());
            }
            Err(ReadError::damaged(format!("checksum of a chunk of {} does not match", dataset.name())))
        })
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
