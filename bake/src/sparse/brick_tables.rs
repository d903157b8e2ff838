//! A sparse grid as the core's lookups take it while its samples are elsewhere: they find bricks, and corners of the coarse grid.

use sdf_core::grid::BlockBounds;
use sdf_core::grid::owned::Blocks;
use sdf_core::grid::sparse::{BrickData, Code, Scale};

use super::coarse_map::slot_index;

/// Stands for a sample that is kept elsewhere; takes no memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NoSample;

impl Code for NoSample {
    fn decode(self, _scale: Scale) -> f32 {
        0.0
    }
}

/// The arrays of a grid whose bricks are not bounded yet, and whose samples are elsewhere.
#[derive(Clone, Copy)]
pub(super) struct BrickTables<'a> {
    pub table: &'a Blocks<u32>,
    pub scales: &'a [Scale],
    pub coarse: &'a [f32],
}

impl BrickData for BrickTables<'_> {
    type Code = NoSample;
    fn table_entry(&self, slot: [u32; 3], _counts: [u32; 3]) -> Option<u32> {
        self.table.get(slot)
    }
    fn scale(&self, brick: usize) -> Option<Scale> {
        self.scales.get(brick).copied()
    }
    fn codes(&self) -> &[NoSample] {
        &[]
    }
    fn bounds_of_brick(&self, _brick: usize) -> Option<BlockBounds> {
        None
    }
    fn coarse_sample(&self, node: [u32; 3], counts: [u32; 3]) -> Option<f32> {
        self.coarse.get(slot_index(counts, node)).copied()
    }
    fn error_of_brick(&self, _brick: usize) -> Option<f32> {
        None
    }
}
