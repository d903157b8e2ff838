//! Sparse storage: bricks of 8 × 8 × 8 samples near the surface, a coarse grid of every eighth node elsewhere.
//!
//! Every node has exactly one value: the sample of its brick if its slot holds one, else the trilinear interpolant of
//! the coarse cell around it. Cells whose corners belong to different slots mix both kinds. The field is therefore
//! continuous across the faces of bricks and from fine to coarse.
//!
//! A node is found in two steps, as in the two-level grids of OpenVDB (Museth 2013): `table` maps its slot to a brick
//! number, and the node's position modulo 8 gives the sample within the brick.

mod copy;
mod error;

use nalgebra::Vector3;

use super::block_bounds::{merge_blocks, merge_slots};
pub use super::brick::{BRICK, BRICK_SAMPLES, Code, NO_BRICK, Scale, brick_counts};
use super::brick::{brick_slot, index_in};
use super::{BlockBounds, CellErrors, JumpLimits, Lattice, Storage, cell_slope, trilinear};
use crate::number::interval::Interval;
use crate::rounding::INTERPOLATION;

/// The arrays of a [`Sparse`] grid, borrowed or owned.
pub trait Bricks {
    /// Encoding of the samples.
    type Code: Code;
    /// Number of the brick in each slot, x fastest, or [`NO_BRICK`].
    fn table(&self) -> &[u32];
    /// One scale per brick.
    fn scales(&self) -> &[Scale];
    /// [`BRICK_SAMPLES`] codes per brick, x fastest.
    fn samples(&self) -> &[Self::Code];
    /// Bounds of each brick, without nodes outside the lattice.
    fn bounds(&self) -> &[BlockBounds];
    /// Samples of the coarse grid, x fastest: one more along each axis than there are slots.
    fn coarse(&self) -> &[f32];
    /// For each brick, over the cells whose first corner it holds: bound of |φ − d| where the signed distance d is within the band.
    /// Empty where nothing is known.
    fn errors(&self) -> &[f32] {
        &[]
    }
}

/// [`Bricks`] in borrowed slices, in memory or flash. Each slice is described at the trait's method of its name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrickSlices<'a, C> {
    /// [`Bricks::table`].
    pub table: &'a [u32],
    /// [`Bricks::scales`].
    pub scales: &'a [Scale],
    /// [`Bricks::samples`].
    pub samples: &'a [C],
    /// [`Bricks::bounds`].
    pub bounds: &'a [BlockBounds],
    /// [`Bricks::coarse`].
    pub coarse: &'a [f32],
}

/// Access to the arrays of a [`Sparse`] grid, number by number: of any [`Bricks`], and of those in a
/// [`Blob`](super::Blob), which are bytes. `None` beyond an array's end.
pub trait BrickData {
    /// Encoding of the samples.
    type Code: Code;
    /// See [`Bricks::table`]. `counts` are the slots along each axis.
    fn table_entry(&self, slot: [u32; 3], counts: [u32; 3]) -> Option<u32>;
    /// See [`Bricks::scales`].
    fn scale(&self, brick: usize) -> Option<Scale>;
    /// See [`Bricks::samples`].
    fn codes(&self) -> &[Self::Code];
    /// See [`Bricks::bounds`].
    fn bounds_of_brick(&self, brick: usize) -> Option<BlockBounds>;
    /// See [`Bricks::coarse`]. `counts` are the nodes of the coarse grid along each axis.
    fn coarse_sample(&self, node: [u32; 3], counts: [u32; 3]) -> Option<f32>;
    /// See [`Bricks::errors`].
    fn error_of_brick(&self, brick: usize) -> Option<f32>;
}

impl<B: Bricks> BrickData for B {
    type Code = B::Code;
    #[inline(always)]
    fn table_entry(&self, slot: [u32; 3], counts: [u32; 3]) -> Option<u32> {
        self.table().get(index_in(counts, slot)).copied()
    }
    #[inline(always)]
    fn scale(&self, brick: usize) -> Option<Scale> {
        self.scales().get(brick).copied()
    }
    #[inline(always)]
    fn codes(&self) -> &[B::Code] {
        self.samples()
    }
    #[inline(always)]
    fn bounds_of_brick(&self, brick: usize) -> Option<BlockBounds> {
        self.bounds().get(brick).copied()
    }
    #[inline(always)]
    fn coarse_sample(&self, node: [u32; 3], counts: [u32; 3]) -> Option<f32> {
        self.coarse().get(index_in(counts, node)).copied()
    }
    #[inline(always)]
    fn error_of_brick(&self, brick: usize) -> Option<f32> {
        self.errors().get(brick).copied()
    }
}

impl<C: Code> Bricks for BrickSlices<'_, C> {
    type Code = C;
    fn table(&self) -> &[u32] {
        self.table
    }
    fn scales(&self) -> &[Scale] {
        self.scales
    }
    fn samples(&self) -> &[C] {
        self.samples
    }
    fn bounds(&self) -> &[BlockBounds] {
        self.bounds
    }
    fn coarse(&self) -> &[f32] {
        self.coarse
    }
}

impl<B: Bricks> Bricks for &B {
    type Code = B::Code;
    fn table(&self) -> &[u32] {
        (**self).table()
    }
    fn scales(&self) -> &[Scale] {
        (**self).scales()
    }
    fn samples(&self) -> &[B::Code] {
        (**self).samples()
    }
    fn bounds(&self) -> &[BlockBounds] {
        (**self).bounds()
    }
    fn coarse(&self) -> &[f32] {
        (**self).coarse()
    }
    fn errors(&self) -> &[f32] {
        (**self).errors()
    }
}

/// 4.5 √3, rounded up: error bound of a coarse grid that holds distances where they are negative, in spacings. See
/// docs/error-bounds.md.
pub const DEEP_ERROR: f64 = 7.795;

/// Storage of samples in bricks, with a coarse grid in the empty slots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sparse<B> {
    /// Slots along each axis.
    slot_counts: [u32; 3],
    spacing: f64,
    bricks: B,
}

impl<B: Bricks> Sparse<B> {
    /// `None` unless the arrays fit the lattice and each other: one table entry per slot, one coarse sample more than
    /// slots along each axis, every entry [`NO_BRICK`] or the number of a brick, and one scale, one bound and
    /// [`BRICK_SAMPLES`] samples per brick.
    pub fn new(lattice: &Lattice, bricks: B) -> Option<Self> {
        let slot_counts = brick_counts(lattice);
        let count =
            |more: usize| slot_counts.iter().try_fold(1, |n: usize, slots| n.checked_mul(*slots as usize + more));
        let scales = bricks.scales().len();
        let in_range = |brick: &u32| *brick == NO_BRICK || (*brick as usize) < scales;
        let fits = Some(bricks.table().len()) == count(0)
            && scales.checked_mul(BRICK_SAMPLES) == Some(bricks.samples().len())
            && Some(bricks.coarse().len()) == count(1)
            && bricks.bounds().len() == scales
            && bricks.table().iter().all(in_range);
        fits.then(|| Self::of_checked(lattice, bricks))
    }
}

impl<B: BrickData> Sparse<B> {
    /// The storage of arrays that fit the lattice and each other: see [`Sparse::new`]. Of others, values mean nothing.
    pub fn of_checked(lattice: &Lattice, bricks: B) -> Self {
        Self { slot_counts: brick_counts(lattice), spacing: lattice.spacing(), bricks }
    }

    /// The arrays.
    pub fn bricks(&self) -> &B {
        &self.bricks
    }

    /// The arrays, taken out.
    pub fn into_bricks(self) -> B {
        self.bricks
    }

    /// Number of the brick in a slot; `None` where the slot is empty or outside the lattice.
    pub fn brick_at(&self, slot: [u32; 3]) -> Option<usize> {
        let is_slot = (0..3).all(|axis| slot[axis] < self.slot_counts[axis]);
        if is_slot { self.brick_in_slot(slot) } else { None }
    }

    #[inline(always)]
    fn brick_in_slot(&self, slot: [u32; 3]) -> Option<usize> {
        let brick = self.bricks.table_entry(slot, self.slot_counts).unwrap_or(NO_BRICK);
        (brick != NO_BRICK).then_some(brick as usize)
    }

    /// The brick that holds a node; `None` if its slot is empty.
    #[inline(always)]
    fn brick_of_node(&self, node: [u32; 3]) -> Option<usize> {
        self.brick_in_slot(brick_slot(node))
    }

    /// A node's sample in its brick.
    #[inline(always)]
    fn brick_sample(&self, brick: usize, [x, y, z]: [u32; 3]) -> f32 {
        let local = ((z % BRICK) * BRICK + y % BRICK) * BRICK + x % BRICK;
        let index = brick.wrapping_mul(BRICK_SAMPLES).wrapping_add(local as usize);
        match (self.bricks.codes().get(index), self.bricks.scale(brick)) {
            (Some(code), Some(scale)) => code.decode(scale),
            _ => 0.0,
        }
    }

    /// Corners of a cell that lies in one brick: the first and last of them are 73 samples apart.
    #[inline]
    fn corners_in_brick(&self, brick: usize, [x, y, z]: [u32; 3]) -> [f32; 8] {
        let first = (((z % BRICK) * BRICK + y % BRICK) * BRICK + x % BRICK) as usize;
        let first = brick.wrapping_mul(BRICK_SAMPLES).wrapping_add(first);
        let codes = self.bricks.codes().get(first..).and_then(|codes| codes.first_chunk::<74>());
        let (Some(codes), Some(scale)) = (codes, self.bricks.scale(brick)) else { return [0.0; 8] };
        let corners = [codes[0], codes[1], codes[8], codes[9], codes[64], codes[65], codes[72], codes[73]];
        corners.map(|code| code.decode(scale))
    }

    /// Corners of the coarse cell that covers a slot, in the order of [`Storage::corners`].
    pub fn coarse_corners(&self, slot: [u32; 3]) -> [f32; 8] {
        let counts = self.slot_counts.map(|n| n.wrapping_add(1));
        let [x, y, z] = slot;
        core::array::from_fn(|corner| {
            let corner = corner as u32;
            let node = [x.wrapping_add(corner & 1), y.wrapping_add(corner >> 1 & 1), z.wrapping_add(corner >> 2)];
            self.bricks.coarse_sample(node, counts).unwrap_or(0.0)
        })
    }

    /// Corners of a cell that lies in one empty slot, and so in one coarse cell.
    fn corners_in_coarse_cell(&self, cell: [u32; 3]) -> [f32; 8] {
        let coarse = self.coarse_corners(brick_slot(cell));
        core::array::from_fn(|corner| {
            let fraction = |axis: usize| (cell[axis] % BRICK + (corner >> axis & 1) as u32) as f32 / BRICK as f32;
            trilinear::interpolate(coarse, Vector3::new(fraction(0), fraction(1), fraction(2))).0
        })
    }

    /// Interpolant of the coarse grid at a node.
    fn coarse_value(&self, node: [u32; 3]) -> f32 {
        let fraction = node.map(|index| (index % BRICK) as f32 / BRICK as f32);
        trilinear::interpolate(self.coarse_corners(brick_slot(node)), Vector3::from(fraction)).0
    }

    /// The value at a node.
    #[inline(always)]
    pub fn node(&self, node: [u32; 3]) -> f32 {
        match self.brick_of_node(node) {
            Some(brick) => self.brick_sample(brick, node),
            None => self.coarse_value(node),
        }
    }

    /// Interval of the samples at the nodes of a slot: that of [`slot_bounds`](Self::slot_bounds).
    #[inline(always)]
    fn slot_range(&self, slot: [u32; 3]) -> Interval<f32> {
        let stored = self.brick_in_slot(slot).and_then(|brick| self.bricks.bounds_of_brick(brick));
        stored.map_or_else(|| range_of(self.coarse_corners(slot)), |bounds| bounds.range)
    }

    /// Bounds of the nodes of a slot.
    ///
    /// An empty slot has those of its coarse cell: a cell with all corners in empty slots lies in one coarse cell,
    /// and any other has a corner in a brick, whose bounds cover it.
    fn slot_bounds(&self, slot: [u32; 3]) -> BlockBounds {
        let stored = self.brick_in_slot(slot).and_then(|brick| self.bricks.bounds_of_brick(brick));
        stored.unwrap_or_else(|| {
            let corners = self.coarse_corners(slot);
            let Interval { lower, upper } = range_of(corners);
            if lower == UNREAD {
                return BlockBounds { range: Interval { lower, upper }, slope_bound: f32::INFINITY };
            }
            let Self { spacing, .. } = *self;
            let rounding = INTERPOLATION * f64::from(f32::EPSILON) * f64::from(upper.max(-lower)) / spacing;
            let slope_bound = (cell_slope(corners, spacing * f64::from(BRICK)) + rounding) as f32;
            BlockBounds { range: Interval { lower, upper }, slope_bound }
        })
    }
}

/// A coarse node that was not read from its file. Slots around it have bounds that hold for any value.
pub const UNREAD: f32 = f32::NEG_INFINITY;

/// The lowest and the highest of the samples at the corners of a cell.
#[inline(always)]
fn range_of(corners: [f32; 8]) -> Interval<f32> {
    // As `min` and `max` for what is not NaN, in one instruction each.
    let lower = corners.into_iter().fold(f32::INFINITY, |lower, x| if x < lower { x } else { lower });
    let upper = corners.into_iter().fold(f32::NEG_INFINITY, |upper, x| if upper < x { x } else { upper });
    Interval { lower, upper: if lower == UNREAD { f32::INFINITY } else { upper } }
}

impl<B: BrickData> Storage for Sparse<B> {
    const HAS_CELL_ERRORS: bool = true;

    fn cell_errors(&self, first: [u32; 3], last: [u32; 3], limits: JumpLimits) -> Option<CellErrors> {
        self.errors_between(first, last, limits)
    }

    #[inline(always)]
    fn corners(&self, cell: [u32; 3]) -> [f32; 8] {
        let [x, y, z] = cell;
        let corner =
            |corner: u32| [x.wrapping_add(corner & 1), y.wrapping_add(corner >> 1 & 1), z.wrapping_add(corner >> 2)];
        let is_in_one_slot = cell.iter().all(|index| index % BRICK != BRICK - 1);
        match self.brick_of_node(cell) {
            Some(brick) if is_in_one_slot => self.corners_in_brick(brick, cell),
            None if is_in_one_slot => self.corners_in_coarse_cell(cell),
            _ => {
                let mut corners = [0.0; 8];
                for index in 0..8 {
                    corners[index] = self.node(corner(index as u32));
                }
                corners
            }
        }
    }

    const IS_COPIED: bool = true;

    #[inline]
    fn copy_row(&self, first: [u32; 3], count: u32, row: &mut [f32]) {
        self.copy_slots_along_row(first, count, row);
    }

    #[inline]
    fn copy_box(&self, first: [u32; 3], counts: [u32; 3], samples: &mut [f32]) {
        self.copy_slots_of_box(first, counts, samples);
    }

    // Slopes of empty slots are computed.
    const SLOPES_TAKE_LONG: bool = true;

    const HAS_LOWEST: bool = true;

    #[inline(always)]
    fn lowest(&self, first: [u32; 3], last: [u32; 3]) -> Option<f32> {
        merge_slots(first, last, f32::INFINITY, |slot| Some(self.slot_range(slot).lower), f32::min)
    }

    const HAS_BLOCK_BOUNDS: bool = true;

    fn block_bounds(&self, first: [u32; 3], last: [u32; 3]) -> Option<BlockBounds> {
        merge_blocks(first, last, |slot| Some(self.slot_bounds(slot)))
    }
}
