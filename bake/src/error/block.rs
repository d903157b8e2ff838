use sdf_core::nalgebra::Vector3;

/// A cube of 2 × 2 × 2 cells of a grid, or one cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorBlock {
    pub center: Vector3<f64>,
    pub half_side: f64,
}

/// A block, the distance at its center, and a triangle of the tree at that distance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Query {
    pub block: ErrorBlock,
    pub distance: f64,
    pub slot: usize,
}
