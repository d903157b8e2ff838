//! Grids that own their samples, of either layout and any precision.
//!
//! A dense grid of codes has a scale for each block of 8 × 8 × 8 nodes, and is held as a sparse grid with a brick in every slot: its
//! codes are read where they lie, by the code that reads bricks. So it takes a half or a quarter of the memory, and no search is compiled
//! for it.

use alloc::vec::Vec;

pub use super::error_regions::{ErrorRegion, ErrorRegions};
pub use super::kind::{Layout, Precision};
use super::sparse::{Bricks, Code, NO_BRICK, Scale, Sparse, brick_counts};
use super::{BlockBounds, Dense, Grid, Lattice, Sampling, Storage, WithBlockBounds};
use crate::ErrorBound;
use crate::number::Float;

/// A grid in memory, of either layout and any precision.
pub type OwnedGrid = Grid<OwnedStorage>;

/// Samples of either layout and any precision.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "a variant is named as the layout and precision that it has")]
pub enum OwnedStorage {
    Dense(WithBlockBounds<Dense<Vec<f32>>, Vec<BlockBounds>>),
    DenseU16(Sparse<OwnedBricks<u16>>),
    DenseU8(Sparse<OwnedBricks<u8>>),
    SparseF32(Sparse<OwnedBricks<f32>>),
    SparseU16(Sparse<OwnedBricks<u16>>),
    SparseU8(Sparse<OwnedBricks<u8>>),
}

/// The same expression for whatever storage it is: samples of all nodes, or bricks.
macro_rules! for_each_storage {
    ($storage:expr, $dense:ident => $of_dense:expr, $sparse:ident => $of_sparse:expr) => {
        match $storage {
            OwnedStorage::Dense($dense) => $of_dense,
            OwnedStorage::SparseF32($sparse) => $of_sparse,
            OwnedStorage::DenseU16($sparse) | OwnedStorage::SparseU16($sparse) => $of_sparse,
            OwnedStorage::DenseU8($sparse) | OwnedStorage::SparseU8($sparse) => $of_sparse,
        }
    };
}

impl OwnedStorage {
    /// Samples at every node, x fastest, and bounds of each block of 8 × 8 × 8 nodes. `None` unless there are as many of
    /// either as the lattice asks for.
    pub fn dense(lattice: &Lattice, samples: Vec<f32>, bounds: Vec<BlockBounds>) -> Option<Self> {
        WithBlockBounds::new(lattice, Dense::new(lattice, samples)?, bounds).map(Self::Dense)
    }

    /// Codes at every node. `None` unless they fit the lattice, and each slot has one block.
    pub fn dense_blocks<C: BlockCode>(lattice: &Lattice, blocks: DenseBlocks<C>) -> Option<Self> {
        let DenseBlocks { slots, scales, samples, bounds } = blocks;
        let counts = brick_counts(lattice);
        let count = |more: usize| counts.iter().try_fold(1, |n: usize, along| n.checked_mul(*along as usize + more));
        // Before memory is taken for what follows from their number.
        if Some(slots.len()) != count(0) || slots.len() != scales.len() {
            return None;
        }
        let (table, errors) = (OwnedBricks::<C>::table_of(counts, &slots), Vec::new());
        let coarse = alloc::vec![0.0; count(1)?];
        let bricks = OwnedBricks { table, slots, scales, samples, bounds, errors, coarse };
        Self::dense_bricks(Sparse::new(lattice, bricks)?)
    }

    /// Codes at every node, in bricks. `None` unless each slot has one.
    pub fn dense_bricks<C: BlockCode>(bricks: Sparse<OwnedBricks<C>>) -> Option<Self> {
        let is_full = bricks.bricks().table.iter().all(|brick| *brick != NO_BRICK);
        is_full.then(|| C::dense_storage(bricks))
    }

    /// Bricks of any precision. `None` unless they fit together as [`Sparse::new`] asks.
    pub fn sparse<C: OwnedCode>(lattice: &Lattice, bricks: OwnedBricks<C>) -> Option<Self> {
        Sparse::new(lattice, bricks).map(C::storage)
    }

    /// Dense or sparse.
    pub fn layout(&self) -> Layout {
        match self {
            Self::Dense(_) | Self::DenseU16(_) | Self::DenseU8(_) => Layout::Dense,
            Self::SparseF32(_) | Self::SparseU16(_) | Self::SparseU8(_) => Layout::Sparse,
        }
    }

    /// The type of a sample.
    pub fn precision(&self) -> Precision {
        match self {
            Self::Dense(_) | Self::SparseF32(_) => Precision::F32,
            Self::DenseU16(_) | Self::SparseU16(_) => Precision::U16,
            Self::DenseU8(_) | Self::SparseU8(_) => Precision::U8,
        }
    }

    /// Bricks that are stored; `None` of a dense grid.
    pub fn brick_count(&self) -> Option<usize> {
        (self.layout() == Layout::Sparse).then(|| self.slots().len())
    }

    /// For each brick its slot: see [`OwnedBricks::slots`]. Empty of a dense grid.
    pub fn slots(&self) -> &[[u32; 3]] {
        match self.layout() {
            Layout::Dense => &[],
            Layout::Sparse => for_each_storage!(self, _dense => &[], sparse => &sparse.bricks().slots),
        }
    }

    /// For each brick or block of a dense grid its scale. Empty of a dense grid of f32.
    pub fn scales(&self) -> &[Scale] {
        for_each_storage!(self, _dense => &[], sparse => &sparse.bricks().scales)
    }

    /// The brick in a slot, or the block of a dense grid. `None` where there is none, and of a dense grid of f32.
    pub fn brick_at(&self, slot: [u32; 3]) -> Option<usize> {
        for_each_storage!(self, _dense => None, sparse => sparse.brick_at(slot))
    }

    /// For each brick its error bound: see [`OwnedBricks::errors`]. Empty of a dense grid.
    pub fn brick_errors(&self) -> &[f32] {
        for_each_storage!(self, _dense => &[], sparse => &sparse.bricks().errors)
    }
}

/// Codes of a dense grid, block by block of 8 × 8 × 8 nodes, of which those beyond the lattice have no meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct DenseBlocks<C> {
    /// For each block its slot, counted in blocks from the first node; in any order.
    pub slots: Vec<[u32; 3]>,
    /// For each block.
    pub scales: Vec<Scale>,
    /// Codes of one block after the other, x fastest.
    pub samples: Vec<C>,
    /// Bounds of the decoded samples of each block.
    pub bounds: Vec<BlockBounds>,
}

/// A [`Code`] of dense grids that have a scale for each block.
pub trait BlockCode: OwnedCode {
    /// The variant of this code, of bricks that fill all slots.
    fn dense_storage(blocks: Sparse<OwnedBricks<Self>>) -> OwnedStorage;
}

impl BlockCode for u16 {
    fn dense_storage(blocks: Sparse<OwnedBricks<Self>>) -> OwnedStorage {
        OwnedStorage::DenseU16(blocks)
    }
}

impl BlockCode for u8 {
    fn dense_storage(blocks: Sparse<OwnedBricks<Self>>) -> OwnedStorage {
        OwnedStorage::DenseU8(blocks)
    }
}

/// A [`Code`] that [`OwnedStorage`] has a variant for.
pub trait OwnedCode: Code {
    /// The variant of this code.
    fn storage(sparse: Sparse<OwnedBricks<Self>>) -> OwnedStorage;
}

impl OwnedCode for f32 {
    fn storage(sparse: Sparse<OwnedBricks<Self>>) -> OwnedStorage {
        OwnedStorage::SparseF32(sparse)
    }
}

impl OwnedCode for u16 {
    fn storage(sparse: Sparse<OwnedBricks<Self>>) -> OwnedStorage {
        OwnedStorage::SparseU16(sparse)
    }
}

impl OwnedCode for u8 {
    fn storage(sparse: Sparse<OwnedBricks<Self>>) -> OwnedStorage {
        OwnedStorage::SparseU8(sparse)
    }
}

impl Storage for OwnedStorage {
    #[inline]
    fn corners(&self, cell: [u32; 3]) -> [f32; 8] {
        for_each_storage!(self, dense => dense.corners(cell), sparse => sparse.corners(cell))
    }

    // Vectors do not help here, and inlined it would be compiled again for each minimizer and instruction set.
    #[inline(never)]
    fn corners_in_lanes<R: Float, const N: usize>(&self, cells: [[R; N]; 3]) -> [[R; N]; 8] {
        for_each_storage!(self, dense => dense.corners_in_lanes(cells), sparse => sparse.corners_in_lanes(cells))
    }

    // Dense samples are copied too: the search is so compiled once for all kinds.
    const IS_COPIED: bool = true;

    #[inline]
    fn copy_row(&self, first: [u32; 3], count: u32, row: &mut [f32]) {
        for_each_storage!(self, dense => dense.copy_row(first, count, row), sparse => sparse.copy_row(first, count, row));
    }

    fn copy_box(&self, first: [u32; 3], counts: [u32; 3], to: &mut [f32]) {
        for_each_storage!(self, dense => dense.copy_box(first, counts, to), sparse => sparse.copy_box(first, counts, to));
    }

    const HAS_LOWEST: bool = true;

    #[inline]
    fn lowest(&self, first: [u32; 3], last: [u32; 3]) -> Option<f32> {
        for_each_storage!(self, dense => dense.lowest(first, last), sparse => sparse.lowest(first, last))
    }

    const HAS_BLOCK_BOUNDS: bool = true;

    fn error_bound(&self, first: [u32; 3], last: [u32; 3], at: Sampling) -> Option<ErrorBound> {
        for_each_storage!(
            self,
            dense => dense.error_bound(first, last, at),
            sparse => sparse.error_bound(first, last, at)
        )
    }

    #[inline(always)]
    fn block_bounds(&self, first: [u32; 3], last: [u32; 3]) -> Option<BlockBounds> {
        for_each_storage!(self, dense => dense.block_bounds(first, last), sparse => sparse.block_bounds(first, last))
    }
}

/// The bricks of a sparse grid.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnedBricks<C> {
    /// For each brick slot of the lattice, x fastest: the index of its brick, or [`NO_BRICK`].
    pub table: Vec<u32>,
    /// For each brick its slot, counted in bricks from the first node.
    pub slots: Vec<[u32; 3]>,
    /// For each brick.
    pub scales: Vec<Scale>,
    /// Codes of one brick after the other, x fastest.
    pub samples: Vec<C>,
    /// For each brick.
    pub bounds: Vec<BlockBounds>,
    /// For each brick, over the cells whose first corner it holds: bound of |interpolant − signed distance| where the
    /// distance is within the band.
    pub errors: Vec<f32>,
    /// The coarse grid, x fastest: one node more along each axis than there are slots.
    pub coarse: Vec<f32>,
}

impl<C: Code> OwnedBricks<C> {
    /// The table of slots for bricks that stand in these slots, in this order. `counts` are the slots along each axis.
    pub fn table_of(counts: [u32; 3], slots: &[[u32; 3]]) -> Vec<u32> {
        let [x, y, z] = counts.map(|n| n as usize);
        let mut table = alloc::vec![NO_BRICK; x * y * z];
        for (brick, slot) in slots.iter().enumerate() {
            let [i, j, k] = slot.map(|index| index as usize);
            if let Some(entry) = table.get_mut((k * y + j) * x + i) {
                *entry = brick as u32;
            }
        }
        table
    }
}

impl<C: Code> Bricks for OwnedBricks<C> {
    type Code = C;
    #[inline]
    fn table(&self) -> &[u32] {
        &self.table
    }
    #[inline]
    fn scales(&self) -> &[Scale] {
        &self.scales
    }
    #[inline]
    fn samples(&self) -> &[C] {
        &self.samples
    }
    #[inline]
    fn bounds(&self) -> &[BlockBounds] {
        &self.bounds
    }
    #[inline]
    fn coarse(&self) -> &[f32] {
        &self.coarse
    }
    #[inline]
    fn errors(&self) -> &[f32] {
        &self.errors
    }
}
