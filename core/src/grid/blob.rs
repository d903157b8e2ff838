//! A grid as one little-endian file, which is read where it lies: in flash, a mapped file, an asset pack. [`Blob::open`] checks it
//! once; then it is a [`Storage`] like any other, at no memory and at any address.
//!
//! ```text
//! offset  bytes
//!      0      4  "SDFB"
//!      4      1  version: 1
//!      5      1  layout: 0 dense, 1 sparse
//!      6      1  bytes of a sample: 4 (f32), 2 (u16), 1 (u8)
//!      7      1  0
//!      8     12  nodes along x, y, z                                   u32
//!     20      4  bricks of a sparse grid, else 0                       u32
//!     24     12  origin                                                f32
//!     36      8  spacing, 1 / spacing                                  f32
//!     44      8  slope bound; band, infinite where all is distances     f32
//!     52      8  dense: a code's sample is base + step · code          f32
//!     60      4  CRC-32 of all other bytes, as zlib and PNG have it    u32
//!     64     56  the numbers at 24 to 51 again, in f64
//!    120     24  error bound, error bound beyond the band, padding     f64
//!    144      …  dense:  bounds of each brick slot, samples
//!             …  sparse: brick of each slot, then for each brick its scale, bounds and error; coarse samples; samples
//! ```
//!
//! A dense grid with a scale for each block of 8 × 8 × 8 nodes is written as a sparse one with a brick in every slot and an infinite band.
//! A dense grid that was sampled from a sparse one has its band.
//! Bounds are lower and upper sample and slope, scales base and step, all f32. Arrays have the order of [`Dense`](super::Dense),
//! [`WithBlockBounds`](super::WithBlockBounds) and [`Bricks`](super::sparse::Bricks). The head alone is enough for queries in f32.

mod checksum;
mod error;
mod numbers;
mod storage;

pub use checksum::checksum;
pub use error::BlobError;
use numbers::{Numbers, split};
pub use storage::{BlobBricks, BlobCode, BlobDense, BlobStorage};

use super::brick::{BRICK_SAMPLES, NO_BRICK, Scale};
use super::sparse::{Sparse, brick_counts};
use super::{Grid, Lattice, Layout, Precision, Storage};
use crate::Parameter;

/// The first four bytes.
pub const MAGIC: [u8; 4] = *b"SDFB";

/// The version of the format.
pub const VERSION: u8 = 1;

/// Bytes of the head.
pub const HEAD_BYTES: usize = 64;

/// Bytes of the head and of the numbers in f64 behind it.
pub const NUMBERS_END: usize = 144;

/// Place of the checksum in the head.
pub const CHECKSUM_AT: usize = 60;

/// A grid in a slice of bytes, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blob<'a> {
    lattice: Lattice,
    slope_bound: Parameter,
    band: Parameter,
    /// Error bound, error bound beyond the band, padding.
    errors: [f64; 3],
    layout: Layout,
    precision: Precision,
    /// Scale of a dense grid.
    scale: Scale,
    arrays: Arrays<'a>,
}

/// The bytes of the arrays. Those that a dense grid does not have are empty.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Arrays<'a> {
    table: &'a [[u8; 4]],
    scales: &'a [[u8; 8]],
    bounds: &'a [[u8; 12]],
    errors: &'a [[u8; 4]],
    coarse: &'a [[u8; 4]],
    samples: &'a [u8],
}

impl<'a> Blob<'a> {
    /// Checks every byte: the head, the size, the checksum, that all numbers are finite and that each slot names a brick that is
    /// there. Afterwards no query can leave the arrays or meet a NaN.
    pub fn open(bytes: &'a [u8]) -> Result<Self, BlobError> {
        let (head, after_head) = bytes.split_first_chunk::<HEAD_BYTES>().ok_or(BlobError::NotABlob)?;
        let (double, arrays) = after_head.split_first_chunk::<{ NUMBERS_END - HEAD_BYTES }>().ok_or(BlobError::Size)?;
        let [m0, m1, m2, m3, version, layout, sample_bytes, zero, ..] = *head;
        if [m0, m1, m2, m3] != MAGIC {
            return Err(BlobError::NotABlob);
        }
        if version != VERSION {
            return Err(BlobError::Version);
        }
        let layout = match layout {
            0 => Layout::Dense,
            1 => Layout::Sparse,
            _ => return Err(BlobError::Kind),
        };
        let precision = match sample_bytes {
            4 => Precision::F32,
            2 => Precision::U16,
            1 => Precision::U8,
            _ => return Err(BlobError::Kind),
        };
        if zero != 0 {
            return Err(BlobError::Kind);
        }
        let numbers = Numbers::read(head, double);
        let lattice = numbers.lattice().ok_or(BlobError::Lattice)?;
        let sizes = Sizes::new(&lattice, layout, sample_bytes, numbers.bricks).ok_or(BlobError::Size)?;
        let arrays = sizes.cut(arrays).ok_or(BlobError::Size)?;
        if checksum(bytes) != numbers.checksum {
            return Err(BlobError::Checksum);
        }
        let blob = Self {
            lattice,
            slope_bound: numbers.slope_bound,
            band: numbers.band,
            errors: numbers.errors,
            layout,
            precision,
            scale: numbers.scale,
            arrays,
        };
        if !(numbers.are_valid() && blob.arrays.are_finite(precision)) {
            return Err(BlobError::Number);
        }
        let in_range = |entry: &[u8; 4]| {
            let brick = u32::from_le_bytes(*entry);
            brick == NO_BRICK || brick < numbers.bricks
        };
        if arrays.table.iter().all(in_range) { Ok(blob) } else { Err(BlobError::Brick) }
    }

    /// Dense or sparse.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// Type of the samples.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// Least distance from the shape to the faces of the grid's box: margins up to it see distances.
    pub fn padding(&self) -> f64 {
        self.errors[2]
    }

    /// The field, of whatever layout and precision it is. A program that knows them is smaller with [`dense`](Self::dense) or
    /// [`sparse`](Self::sparse).
    #[inline]
    pub fn grid(&self) -> Grid<BlobStorage<'a>> {
        self.with(match (self.layout, self.precision) {
            (Layout::Dense, Precision::F32) => BlobStorage::DenseF32(self.dense_storage()),
            (Layout::Dense, Precision::U16) => BlobStorage::DenseU16(self.dense_storage()),
            (Layout::Dense, Precision::U8) => BlobStorage::DenseU8(self.dense_storage()),
            (Layout::Sparse, Precision::F32) => BlobStorage::SparseF32(self.sparse_storage()),
            (Layout::Sparse, Precision::U16) => BlobStorage::SparseU16(self.sparse_storage()),
            (Layout::Sparse, Precision::U8) => BlobStorage::SparseU8(self.sparse_storage()),
        })
    }

    /// The field of a dense blob: `[u8; 4]` for f32, `[u8; 2]` for u16, `u8`. `None` of another layout or precision.
    #[inline]
    pub fn dense<C: BlobCode>(&self) -> Option<Grid<BlobDense<'a, C>>> {
        let is_dense = self.layout == Layout::Dense && self.precision == C::PRECISION;
        is_dense.then(|| self.with(self.dense_storage()))
    }

    /// The field of a sparse blob, with the same codes. `None` of another layout or precision.
    #[inline]
    pub fn sparse<C: BlobCode>(&self) -> Option<Grid<Sparse<BlobBricks<'a, C>>>> {
        let is_sparse = self.layout == Layout::Sparse && self.precision == C::PRECISION;
        is_sparse.then(|| self.with(self.sparse_storage()))
    }

    fn dense_storage<C: BlobCode>(&self) -> BlobDense<'a, C> {
        BlobDense::new(&self.lattice, C::codes(self.arrays.samples), self.scale, self.arrays.bounds)
    }

    fn sparse_storage<C: BlobCode>(&self) -> Sparse<BlobBricks<'a, C>> {
        let Arrays { table, scales, bounds, errors, coarse, samples } = self.arrays;
        let bricks = BlobBricks { table, scales, bounds, errors, coarse, samples: C::codes(samples) };
        Sparse::of_checked(&self.lattice, bricks)
    }

    fn with<S: Storage>(&self, storage: S) -> Grid<S> {
        let [error_bound, deep_error, _] = self.errors;
        let (lattice, slope_bound, band) = (self.lattice, self.slope_bound, self.band);
        // A blob does not say so: where it is true, its error bound is infinite.
        let inside_reaches_box = false;
        Grid { lattice, storage, slope_bound, band, error_bound, deep_error, inside_reaches_box }
    }
}

/// Bytes of each array.
struct Sizes {
    table: usize,
    bricks: usize,
    bounds: usize,
    coarse: usize,
    samples: usize,
}

impl Sizes {
    /// `None` if they do not fit `usize`.
    fn new(lattice: &Lattice, layout: Layout, sample_bytes: u8, bricks: u32) -> Option<Self> {
        let slots = brick_counts(lattice);
        let count = |more: usize| {
            slots.iter().try_fold(1_usize, |n, slots| n.checked_mul((*slots as usize).checked_add(more)?))
        };
        let (bricks, sample_bytes) = (bricks as usize, usize::from(sample_bytes));
        let [nx, ny, nz] = lattice.nodes().map(|n| n as usize);
        match layout {
            Layout::Dense if bricks == 0 => Some(Self {
                table: 0,
                bricks,
                bounds: count(0)?.checked_mul(12)?,
                coarse: 0,
                samples: nx.checked_mul(ny)?.checked_mul(nz)?.checked_mul(sample_bytes)?,
            }),
            Layout::Dense => None,
            Layout::Sparse => Some(Self {
                table: count(0)?.checked_mul(4)?,
                bricks,
                bounds: bricks.checked_mul(12)?,
                coarse: count(1)?.checked_mul(4)?,
                samples: bricks.checked_mul(BRICK_SAMPLES)?.checked_mul(sample_bytes)?,
            }),
        }
    }

    /// `None` unless the bytes are those of all arrays, and no more.
    fn cut<'a>(&self, mut bytes: &'a [u8]) -> Option<Arrays<'a>> {
        let arrays = Arrays {
            table: split(&mut bytes, self.table)?.as_chunks().0,
            scales: split(&mut bytes, self.bricks.checked_mul(8)?)?.as_chunks().0,
            bounds: split(&mut bytes, self.bounds)?.as_chunks().0,
            errors: split(&mut bytes, self.bricks.checked_mul(4)?)?.as_chunks().0,
            coarse: split(&mut bytes, self.coarse)?.as_chunks().0,
            samples: split(&mut bytes, self.samples)?,
        };
        bytes.is_empty().then_some(arrays)
    }
}

impl Arrays<'_> {
    /// Is every number finite, and does every bound hold something? Only an error bound may be infinite.
    fn are_finite(&self, precision: Precision) -> bool {
        let finite = |bytes: &[u8; 4]| f32::from_le_bytes(*bytes).is_finite();
        let scales = self.scales.iter().all(|bytes| numbers::is_valid_scale(storage::scale(bytes), precision));
        let bounds = self.bounds.iter().all(|bytes| {
            let bounds = storage::bounds(bytes);
            let is_finite = bounds.range.lower.is_finite() && bounds.range.upper.is_finite();
            is_finite && bounds.range.lower <= bounds.range.upper && (0.0..f32::INFINITY).contains(&bounds.slope_bound)
        });
        let errors = self.errors.iter().all(|bytes| f32::from_le_bytes(*bytes) >= 0.0);
        let samples = precision != Precision::F32 || self.samples.as_chunks().0.iter().all(finite);
        scales && bounds && errors && self.coarse.iter().all(finite) && samples
    }
}
