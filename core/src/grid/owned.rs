//! Grids that own their samples, of either layout and any precision.
//!
//! A dense grid of codes has a scale for each block of 8 × 8 × 8 nodes, and is held as a sparse grid with a brick in every slot: its
//! codes are read where they lie, by the code that reads bricks. So it takes a half or a quarter of the memory, and no search is compiled
//! for it.

use alloc::vec::Vec;

pub use super::blocks::Blocks;
pub use super::error_regions::{ErrorRegion, ErrorRegions};
pub use super::kind::{Layout, Precision};
use super::sparse::{BRICK_SAMPLES, BrickData, Code, NO_BRICK, Scale, Sparse, UNREAD, brick_counts};
use super::{BlockBounds, CellErrors, Dense, Grid, JumpLimits, Lattice, Storage, WithBlockBounds};
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
        let slot_count = counts.iter().try_fold(1, |count: usize, along| count.checked_mul(*along as usize))?;
        // Before memory is taken for what follows from their number.
        if slots.len() != slot_count || slots.len() != scales.len() {
            return None;
        }
        let (table, coarse, errors) =
            (OwnedBricks::<C>::table_of(counts, &slots)?, no_coarse_grid(lattice)?, Vec::new());
        let bricks = OwnedBricks { table, slots, scales, samples, bounds, errors, coarse };
        Self::dense_bricks(bricks.into_storage(lattice)?)
    }

    /// Codes at every node, in bricks. `None` unless each slot has one.
    pub fn dense_bricks<C: BlockCode>(bricks: Sparse<OwnedBricks<C>>) -> Option<Self> {
        let is_full = bricks.bricks().table.iter().all(|brick| brick != NO_BRICK);
        is_full.then(|| C::dense_storage(bricks))
    }

    /// Bricks of any precision. `None` unless they fit together as [`Sparse::new`] asks.
    pub fn sparse<C: OwnedCode>(lattice: &Lattice, bricks: OwnedBricks<C>) -> Option<Self> {
        bricks.into_storage(lattice).map(C::storage)
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

    const SLOPES_TAKE_LONG: bool = true;

    const HAS_LOWEST: bool = true;

    #[inline]
    fn lowest(&self, first: [u32; 3], last: [u32; 3]) -> Option<f32> {
        for_each_storage!(self, dense => dense.lowest(first, last), sparse => sparse.lowest(first, last))
    }

    const HAS_BLOCK_BOUNDS: bool = true;

    const HAS_CELL_ERRORS: bool = true;

    fn cell_errors(&self, first: [u32; 3], last: [u32; 3], limits: JumpLimits) -> Option<CellErrors> {
        for_each_storage!(
            self,
            dense => dense.cell_errors(first, last, limits),
            sparse => sparse.cell_errors(first, last, limits)
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
    /// For each brick slot of the lattice: the index of its brick, or [`NO_BRICK`].
    pub table: Blocks<u32>,
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
    /// The coarse grid: one node more along each axis than there are slots. Nodes that were not read are [`UNREAD`].
    pub coarse: Blocks<f32>,
}

impl<C: Code> OwnedBricks<C> {
    /// The table of slots for bricks that stand in these slots, in this order. `counts` are the slots along each axis. `None` if there
    /// are too many.
    pub fn table_of(counts: [u32; 3], slots: &[[u32; 3]]) -> Option<Blocks<u32>> {
        let mut table = Blocks::new(counts, NO_BRICK)?;
        (0..).zip(slots).for_each(|(brick, slot)| table.set(*slot, brick));
        Some(table)
    }

    /// The coarse grid of samples at all of its nodes, x fastest. `counts` are the slots along each axis. `None` unless they fit.
    pub fn coarse_of(counts: [u32; 3], samples: &[f32]) -> Option<Blocks<f32>> {
        Blocks::from_dense(coarse_counts(counts)?, UNREAD, samples)
    }

    /// The storage of these arrays. `None` unless they fit the lattice and each other: as [`Sparse::new`] asks of slices.
    pub fn into_storage(self, lattice: &Lattice) -> Option<Sparse<Self>> {
        let samples = self.scales.len().checked_mul(BRICK_SAMPLES);
        if samples == Some(self.samples.len()) { self.into_storage_of_first_samples(lattice) } else { None }
    }

    /// As [`into_storage`](Self::into_storage), but only the first bricks need have samples: the others have bounds, and a meaningless
    /// value.
    pub fn into_storage_of_first_samples(self, lattice: &Lattice) -> Option<Sparse<Self>> {
        let (slots, scales) = (brick_counts(lattice), self.scales.len());
        let in_range = |brick: &u32| *brick == NO_BRICK || (*brick as usize) < scales;
        let fits = self.table.counts() == slots
            && Some(self.coarse.counts()) == coarse_counts(slots)
            && self.bounds.len() == scales
            && self.table.common() == Some(NO_BRICK)
            && self.table.kept().iter().all(in_range);
        fits.then(|| Sparse::of_checked(lattice, self))
    }
}

/// The coarse grid of a dense one, which nothing reads. `None` if there are too many slots.
pub fn no_coarse_grid(lattice: &Lattice) -> Option<Blocks<f32>> {
    Blocks::new(coarse_counts(brick_counts(lattice))?, 0.0)
}

/// Nodes of the coarse grid along each axis, one more than slots; `None` on overflow.
fn coarse_counts(slots: [u32; 3]) -> Option<[u32; 3]> {
    let [x, y, z] = slots.map(|count| count.checked_add(1));
    Some([x?, y?, z?])
}

impl<C: Code> BrickData for OwnedBricks<C> {
    type Code = C;
    #[inline(always)]
    fn table_entry(&self, slot: [u32; 3], _counts: [u32; 3]) -> Option<u32> {
        self.table.get(slot)
    }
    #[inline(always)]
    fn scale(&self, brick: usize) -> Option<Scale> {
        self.scales.get(brick).copied()
    }
    #[inline(always)]
    fn codes(&self) -> &[C] {
        &self.samples
    }
    #[inline(always)]
    fn bounds_of_brick(&self, brick: usize) -> Option<BlockBounds> {
        self.bounds.get(brick).copied()
    }
    #[inline(always)]
    fn coarse_sample(&self, node: [u32; 3], _counts: [u32; 3]) -> Option<f32> {
        self.coarse.get(node)
    }
    #[inline(always)]
    fn error_of_brick(&self, brick: usize) -> Option<f32> {
        self.errors.get(brick).copied()
    }
}
