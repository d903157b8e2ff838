use alloc::vec::Vec;

use crate::Aabb;

/// Error of an open mesh's grid, cell by cell: how many cells are as good as a closed mesh's, and where the others are.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorRegions {
    /// Cells of a dense grid, or of a sparse grid's band.
    pub cells: u64,
    /// Cells whose certified error is at most [`Self::error_bound`], but where a jump of the sign cuts no edge of a cell and goes unseen
    /// (docs/error-bounds.md).
    pub cells_within: u64,
    /// √3/2 of a cell's side, and the rounding of samples: the bound of a closed mesh.
    pub error_bound: f64,
    /// The other cells, joined where they share a corner: those with the most cells first; of very many, the first few.
    pub regions: Vec<ErrorRegion>,
    /// Number of all such regions.
    pub region_count: usize,
}

/// Cells next to each other in which the sign of the distance may jump.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorRegion {
    /// The box around the cells.
    pub bounds: Aabb,
    /// How many cells.
    pub cells: u64,
    /// Certified bound of the error in them.
    pub error_bound: f64,
}
