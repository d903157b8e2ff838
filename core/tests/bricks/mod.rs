//! Arrays of a sparse grid of u16, as tests fill them.

use sdf_core::grid::BlockBounds;
use sdf_core::grid::sparse::{BrickSlices, Scale};

#[derive(Default)]
pub struct Bricks {
    pub table: Vec<u32>,
    pub scales: Vec<Scale>,
    pub samples: Vec<u16>,
    pub bounds: Vec<BlockBounds>,
    pub coarse: Vec<f32>,
}

impl Bricks {
    pub fn slices(&self) -> BrickSlices<'_, u16> {
        let Self { table, scales, samples, bounds, coarse } = self;
        BrickSlices { table, scales, samples, bounds, coarse }
    }
}
