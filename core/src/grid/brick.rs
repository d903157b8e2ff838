//! Bricks: the blocks of 8 × 8 × 8 nodes that a sparse grid stores and that block bounds are kept for.
//!
//! Brick slot (i, j, k) covers the nodes from 8·(i, j, k) to 8·(i, j, k) + 7. A slot holds a brick of samples or is
//! empty.

use super::Lattice;

/// Nodes along a brick's side.
pub const BRICK: u32 = 8;

/// Samples in a brick.
pub const BRICK_SAMPLES: usize = (BRICK * BRICK * BRICK) as usize;

/// Marks an empty slot in the table of a [`Sparse`](super::sparse::Sparse) grid.
pub const NO_BRICK: u32 = u32::MAX;

/// Number of brick slots along each axis: ⌈nodes / 8⌉.
pub fn brick_counts(lattice: &Lattice) -> [u32; 3] {
    lattice.nodes().map(|nodes| nodes.div_ceil(BRICK))
}

/// Slot of the brick that a node belongs to.
#[inline(always)]
pub(super) fn brick_slot([x, y, z]: [u32; 3]) -> [u32; 3] {
    [x / BRICK, y / BRICK, z / BRICK]
}

/// Index of a point in a list of all points of a box, x fastest.
#[inline(always)]
pub(super) fn index_in([count_x, count_y, _]: [u32; 3], at: [u32; 3]) -> usize {
    let [x, y, z] = at.map(|index| index as usize);
    z.wrapping_mul(count_y as usize).wrapping_add(y).wrapping_mul(count_x as usize).wrapping_add(x)
}

/// Encoding of a stored sample.
pub trait Code: Copy {
    /// The sample. `scale` is that of its brick.
    fn decode(self, scale: Scale) -> f32;
}

/// Linear map from a brick's codes to samples: sample = base + step · code. Codes of type `f32` are the samples and
/// ignore it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Sample of code 0.
    pub base: f32,
    /// Difference between the samples of two consecutive codes.
    pub step: f32,
}

impl Code for f32 {
    #[inline(always)]
    fn decode(self, _scale: Scale) -> f32 {
        self
    }
}

/// The bytes of a little-endian f32.
impl Code for [u8; 4] {
    #[inline(always)]
    fn decode(self, _scale: Scale) -> f32 {
        f32::from_le_bytes(self)
    }
}

/// The bytes of a little-endian u16.
impl Code for [u8; 2] {
    #[inline(always)]
    fn decode(self, scale: Scale) -> f32 {
        u16::from_le_bytes(self).decode(scale)
    }
}

impl Code for u16 {
    #[inline(always)]
    fn decode(self, scale: Scale) -> f32 {
        scale.base + scale.step * f32::from(self)
    }
}

impl Code for u8 {
    #[inline(always)]
    fn decode(self, scale: Scale) -> f32 {
        scale.base + scale.step * f32::from(self)
    }
}
