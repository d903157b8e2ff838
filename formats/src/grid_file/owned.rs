//! Grids that own their samples, of either layout and any precision.

use sdf_core::Float;
use sdf_core::grid::sparse::{Bricks, Code, Scale, Sparse};
use sdf_core::grid::{BlockBounds, Dense, Grid, Storage, WithBlockBounds};

/// A grid read from a file.
pub type OwnedGrid = Grid<OwnedSamples>;

/// Samples of either layout and any precision.
#[derive(Clone, Debug, PartialEq)]
pub enum OwnedSamples {
    Dense(WithBlockBounds<Dense<Vec<f32>>, Vec<BlockBounds>>),
    SparseF32(Sparse<OwnedBricks<f32>>),
    SparseU16(Sparse<OwnedBricks<u16>>),
    SparseU8(Sparse<OwnedBricks<u8>>),
}

impl Storage for OwnedSamples {
    #[inline]
    fn corners(&self, cell: [u32; 3]) -> [f32; 8] {
        match self {
            Self::Dense(samples) => samples.corners(cell),
            Self::SparseF32(samples) => samples.corners(cell),
            Self::SparseU16(samples) => samples.corners(cell),
            Self::SparseU8(samples) => samples.corners(cell),
        }
    }

    // Vectors gain nothing here, and inlining would compile this again for each minimizer and instruction set.
    #[inline(never)]
    fn corners_of<R: Float, const N: usize>(&self, cells: [[R; N]; 3]) -> [[R; N]; 8] {
        match self {
            Self::Dense(samples) => samples.corners_of(cells),
            Self::SparseF32(samples) => samples.corners_of(cells),
            Self::SparseU16(samples) => samples.corners_of(cells),
            Self::SparseU8(samples) => samples.corners_of(cells),
        }
    }

    const HAS_BLOCK_BOUNDS: bool = true;

    #[inline(always)]
    fn block_bounds(&self, first: [u32; 3], last: [u32; 3]) -> Option<BlockBounds> {
        match self {
            Self::Dense(samples) => samples.block_bounds(first, last),
            Self::SparseF32(samples) => samples.block_bounds(first, last),
            Self::SparseU16(samples) => samples.block_bounds(first, last),
            Self::SparseU8(samples) => samples.block_bounds(first, last),
        }
    }
}

/// The bricks of a sparse grid.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnedBricks<C> {
    /// For each brick slot, x fastest, the index of its brick, or [`sdf_core::grid::sparse::NO_BRICK`].
    pub table: Vec<u32>,
    /// Slot of each brick, counted in bricks from the first node.
    pub places: Vec<[u32; 3]>,
    pub scales: Vec<Scale>,
    /// Codes of all nodes, brick after brick, x fastest.
    pub samples: Vec<C>,
    /// Bounds of each brick.
    pub bounds: Vec<BlockBounds>,
    /// For each brick, over the cells whose first corner it holds: a bound on |interpolated value − signed distance|
    /// where the distance is within the band.
    pub errors: Vec<f32>,
    /// Samples of the coarse grid, x fastest: one more along each axis than there are brick slots.
    pub coarse: Vec<f32>,
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
}
