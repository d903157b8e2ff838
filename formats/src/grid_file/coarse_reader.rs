//! The coarse grid of a sparse file: all of it, or the chunks that regions reach.

use sdf_core::Aabb;
use sdf_core::grid::Lattice;
use sdf_core::grid::owned::Blocks;
use sdf_core::grid::sparse::{BRICK, UNREAD, brick_counts};

use super::GridFault;
use super::block_mask::nodes_needed;
use super::digests::Digests;
use crate::hdf5::{Dataset, Hdf5Reader};

/// Chunks that are in memory beside the nodes that come of them.
const CHUNKS_AT_A_TIME: usize = 256;

/// A coarse grid in a file, and as much of it as was read.
pub(super) struct CoarseReader {
    dataset: Dataset<f32>,
    first_digest: usize,
    /// Nodes that were not read are [`UNREAD`].
    nodes: Blocks<f32>,
    is_read: bool,
}

impl CoarseReader {
    /// Reads nothing yet. The dataset has the lattice's shape.
    pub(super) fn new(lattice: &Lattice, dataset: Dataset<f32>, first_digest: usize) -> Result<Self, GridFault> {
        let counts = brick_counts(lattice).map(|slots| slots + 1);
        let nodes = Blocks::new(counts, UNREAD).ok_or_else(|| GridFault::damaged("too many brick slots"))?;
        Ok(Self { dataset, first_digest, nodes, is_read: false })
    }

    pub(super) fn read_all(&mut self, file: &Hdf5Reader, digests: &Digests) -> Result<(), GridFault> {
        if !self.is_read {
            self.read_chunks(file, digests, &(0..self.dataset.chunk_count()).collect::<Vec<_>>())?;
            self.is_read = true;
        }
        Ok(())
    }

    /// Checks the checksums of all chunks.
    pub(super) fn check(&self, file: &Hdf5Reader, digests: &Digests) -> Result<(), GridFault> {
        Ok(digests.check_all(file, &self.dataset, self.first_digest)?)
    }

    /// Reads the chunks of all slots that queries in some regions reach.
    pub(super) fn read_near(
        &mut self,
        file: &Hdf5Reader,
        digests: &Digests,
        lattice: &Lattice,
        regions: &[Aabb],
    ) -> Result<(), GridFault> {
        if self.is_read {
            return Ok(());
        }
        let (counts, sides) = (self.dataset.tiling().counts(), self.dataset.tiling().sides());
        let mut is_needed = vec![false; self.dataset.chunk_count()];
        let mut last = None;
        for region in regions {
            let Some([first, end]) = nodes_needed(lattice, region) else {
                return self.read_all(file, digests);
            };
            // From the first node of the first slot to the last of the last; axes in the file's order.
            let chunk = |node: [u32; 3], more: u32| -> [usize; 3] {
                std::array::from_fn(|axis| (node[2 - axis] / BRICK + more) as usize / sides[axis])
            };
            let chunks = [chunk(first, 0), chunk(end, 1)];
            if last.replace(chunks) == Some(chunks) {
                continue;
            }
            let along = |axis: usize| chunks[0][axis]..=chunks[1][axis];
            for z in along(0) {
                for y in along(1) {
                    let row = (z * counts[1] + y) * counts[2];
                    is_needed[row + chunks[0][2]..=row + chunks[1][2]].fill(true);
                }
            }
        }
        let needed: Vec<usize> = (0..is_needed.len()).filter(|chunk| is_needed[*chunk]).collect();
        self.is_read = needed.len() == is_needed.len();
        self.read_chunks(file, digests, &needed)
    }

    fn read_chunks(&mut self, file: &Hdf5Reader, digests: &Digests, chunks: &[usize]) -> Result<(), GridFault> {
        for chunks in chunks.chunks(CHUNKS_AT_A_TIME) {
            for (tile, numbers) in digests.chunks(file, &self.dataset, self.first_digest, chunks)? {
                let mut numbers = numbers.into_iter();
                let along = |axis: usize| tile.first[axis] as u32..(tile.first[axis] + tile.size[axis]) as u32;
                for z in along(0) {
                    for y in along(1) {
                        for (x, number) in along(2).zip(&mut numbers) {
                            self.nodes.set([x, y, z], number);
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// As much as was read.
    pub(super) fn into_nodes(self) -> Blocks<f32> {
        self.nodes
    }

    /// As much as was read, lent out.
    pub(super) fn lend_nodes(&mut self) -> Blocks<f32> {
        let nothing = Blocks::new([0; 3], UNREAD).expect("no blocks at all");
        std::mem::replace(&mut self.nodes, nothing)
    }

    /// Takes nodes back that were lent out.
    pub(super) fn take_back(&mut self, nodes: Blocks<f32>) {
        self.nodes = nodes;
    }
}
