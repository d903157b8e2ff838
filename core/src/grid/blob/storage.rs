//! The arrays of a blob as storages of samples. Numbers are read byte by byte, because the bytes lie at any address.

use crate::grid::block_bounds::merge_blocks;
use crate::grid::brick::{Code, Scale, brick_counts, index_in};
use crate::grid::sparse::{BrickData, Sparse};
use crate::grid::{BlockBounds, CellErrors, JumpLimits, Lattice, Precision, Storage};
use crate::number::interval::Interval;

/// A sample as it lies in a blob.
pub trait BlobCode: Code {
    /// The precision that it is.
    const PRECISION: Precision;
    /// The codes in an array's bytes.
    fn codes(bytes: &[u8]) -> &[Self];
}

macro_rules! blob_code {
    ($code:ty, $precision:ident) => {
        impl BlobCode for $code {
            const PRECISION: Precision = Precision::$precision;
            #[inline]
            fn codes(bytes: &[u8]) -> &[Self] {
                bytes.as_chunks().0
            }
        }
    };
}

blob_code!([u8; 4], F32);
blob_code!([u8; 2], U16);

impl BlobCode for u8 {
    const PRECISION: Precision = Precision::U8;
    #[inline]
    fn codes(bytes: &[u8]) -> &[Self] {
        bytes
    }
}

#[inline]
fn number(bytes: &[u8], index: usize) -> f32 {
    let word = bytes.get(4 * index..).and_then(|bytes| bytes.first_chunk());
    word.map_or(0.0, |word| f32::from_le_bytes(*word))
}

#[inline]
pub(super) fn scale(bytes: &[u8; 8]) -> Scale {
    Scale { base: number(bytes, 0), step: number(bytes, 1) }
}

#[inline]
pub(super) fn bounds(bytes: &[u8; 12]) -> BlockBounds {
    let range = Interval { lower: number(bytes, 0), upper: number(bytes, 1) };
    BlockBounds { range, slope_bound: number(bytes, 2) }
}

/// A sample for every node, and bounds of each brick slot. One scale serves all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlobDense<'a, C> {
    samples: &'a [C],
    scale: Scale,
    bounds: &'a [[u8; 12]],
    row: usize,
    layer: usize,
    /// Brick slots along x and y.
    slot_counts: [usize; 2],
}

impl<'a, C: BlobCode> BlobDense<'a, C> {
    pub(super) fn new(lattice: &Lattice, samples: &'a [C], scale: Scale, bounds: &'a [[u8; 12]]) -> Self {
        let [row, ny, _] = lattice.nodes().map(|n| n as usize);
        let [x, y, _] = brick_counts(lattice).map(|n| n as usize);
        Self { samples, scale, bounds, row, layer: row.wrapping_mul(ny), slot_counts: [x, y] }
    }

    /// The samples, x fastest.
    pub fn samples(&self) -> impl Iterator<Item = f32> {
        self.samples.iter().map(|code| code.decode(self.scale))
    }

    /// Bounds by brick slot, x fastest.
    pub fn bounds(&self) -> impl Iterator<Item = BlockBounds> {
        self.bounds.iter().map(bounds)
    }

    /// Two neighbours along x.
    #[inline(always)]
    fn pair(&self, index: usize) -> [f32; 2] {
        match self.samples.get(index..) {
            Some(&[a, b, ..]) => [a, b].map(|code| code.decode(self.scale)),
            _ => [0.0; 2],
        }
    }
}

impl<C: BlobCode> Storage for BlobDense<'_, C> {
    #[inline]
    fn corners(&self, [x, y, z]: [u32; 3]) -> [f32; 8] {
        let [x, y, z] = [x as usize, y as usize, z as usize];
        let first = z.wrapping_mul(self.layer).wrapping_add(y.wrapping_mul(self.row)).wrapping_add(x);
        let above = first.wrapping_add(self.layer);
        let [[a, b], [c, d]] = [first, first.wrapping_add(self.row)].map(|index| self.pair(index));
        let [[e, f], [g, h]] = [above, above.wrapping_add(self.row)].map(|index| self.pair(index));
        [a, b, c, d, e, f, g, h]
    }

    const HAS_BLOCK_BOUNDS: bool = true;

    fn block_bounds(&self, first: [u32; 3], last: [u32; 3]) -> Option<BlockBounds> {
        let [count_x, count_y] = self.slot_counts;
        merge_blocks(first, last, |slot| {
            let [x, y, z] = slot.map(|index| index as usize);
            let slot = z.wrapping_mul(count_y).wrapping_add(y).wrapping_mul(count_x).wrapping_add(x);
            self.bounds.get(slot).map(bounds)
        })
    }
}

/// The bricks of a sparse grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlobBricks<'a, C> {
    pub(super) table: &'a [[u8; 4]],
    pub(super) scales: &'a [[u8; 8]],
    pub(super) bounds: &'a [[u8; 12]],
    pub(super) errors: &'a [[u8; 4]],
    pub(super) coarse: &'a [[u8; 4]],
    pub(super) samples: &'a [C],
}

impl<C: BlobCode> BlobBricks<'_, C> {
    /// The brick of each slot: see [`Bricks::table`](crate::grid::sparse::Bricks::table).
    pub fn table(&self) -> impl Iterator<Item = u32> {
        self.table.iter().map(|entry| u32::from_le_bytes(*entry))
    }

    /// Number of bricks.
    pub fn count(&self) -> usize {
        self.scales.len()
    }

    /// Samples of the coarse grid: see [`Bricks::coarse`](crate::grid::sparse::Bricks::coarse).
    pub fn coarse(&self) -> impl Iterator<Item = f32> {
        self.coarse.iter().map(|sample| f32::from_le_bytes(*sample))
    }
}

impl<C: BlobCode> BrickData for BlobBricks<'_, C> {
    type Code = C;
    #[inline]
    fn table_entry(&self, slot: [u32; 3], counts: [u32; 3]) -> Option<u32> {
        self.table.get(index_in(counts, slot)).map(|entry| u32::from_le_bytes(*entry))
    }
    #[inline]
    fn scale(&self, brick: usize) -> Option<Scale> {
        self.scales.get(brick).map(scale)
    }
    #[inline]
    fn codes(&self) -> &[C] {
        self.samples
    }
    #[inline]
    fn bounds_of_brick(&self, brick: usize) -> Option<BlockBounds> {
        self.bounds.get(brick).map(bounds)
    }
    #[inline]
    fn coarse_sample(&self, node: [u32; 3], counts: [u32; 3]) -> Option<f32> {
        self.coarse.get(index_in(counts, node)).map(|sample| f32::from_le_bytes(*sample))
    }
    /// `None` where it is infinite: nothing is known.
    #[inline]
    fn error_of_brick(&self, brick: usize) -> Option<f32> {
        self.errors.get(brick).map(|error| f32::from_le_bytes(*error)).filter(|error| error.is_finite())
    }
}

/// A blob's arrays of any layout and precision.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "a variant is named as the layout and precision that it has")]
pub enum BlobStorage<'a> {
    DenseF32(BlobDense<'a, [u8; 4]>),
    DenseU16(BlobDense<'a, [u8; 2]>),
    DenseU8(BlobDense<'a, u8>),
    SparseF32(Sparse<BlobBricks<'a, [u8; 4]>>),
    SparseU16(Sparse<BlobBricks<'a, [u8; 2]>>),
    SparseU8(Sparse<BlobBricks<'a, u8>>),
}

/// The same expression for whatever storage it is.
macro_rules! for_each_storage {
    ($storage:expr, $inner:ident => $of_inner:expr) => {
        match $storage {
            BlobStorage::DenseF32($inner) => $of_inner,
            BlobStorage::DenseU16($inner) => $of_inner,
            BlobStorage::DenseU8($inner) => $of_inner,
            BlobStorage::SparseF32($inner) => $of_inner,
            BlobStorage::SparseU16($inner) => $of_inner,
            BlobStorage::SparseU8($inner) => $of_inner,
        }
    };
}

impl Storage for BlobStorage<'_> {
    fn corners(&self, cell: [u32; 3]) -> [f32; 8] {
        for_each_storage!(self, storage => storage.corners(cell))
    }

    const HAS_BLOCK_BOUNDS: bool = true;

    const HAS_CELL_ERRORS: bool = true;

    fn cell_errors(&self, first: [u32; 3], last: [u32; 3], limits: JumpLimits) -> Option<CellErrors> {
        for_each_storage!(self, storage => storage.cell_errors(first, last, limits))
    }

    fn block_bounds(&self, first: [u32; 3], last: [u32; 3]) -> Option<BlockBounds> {
        for_each_storage!(self, storage => storage.block_bounds(first, last))
    }
}
