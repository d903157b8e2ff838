//! Parts of a sparse bake: the bricks of a stretch of the Hilbert curve before they are bounded, in a file of their own.
//!
//! docs/format.md describes the file. Samples are written as they come and read brick by brick, so that neither needs them all in
//! memory; tables are read whole. All parts of one bake make a grid: [`JoinedParts`].
//!
//! | question | file |
//! |---|---|
//! | How is a part written while it is baked? | `write` |
//! | What does a part hold, if nothing in it can be trusted? | `read` |
//! | Do parts belong together, and which samples do their bricks have? | `join` |

mod join;
mod read;
mod write;

use std::ops::Range;

use sdf_core::grid::Lattice;
use sdf_core::grid::owned::Precision;
use sdf_core::grid::sparse::{Scale, brick_counts};

use super::{About, Compression, GridFault};
use crate::hdf5::Hdf5Reader;

pub use join::{JoinedParts, write_joined};
pub use write::write;

/// The group that stands in place of a grid's `sdf`.
const GROUP: &str = "sdf_part";

/// Facts of a bake that are known before its bricks, and which part this is.
#[derive(Clone, Debug, PartialEq)]
pub struct PartInfo {
    /// Index of the part, counted from 0.
    pub index: u32,
    /// Number of parts.
    pub count: u32,
    /// Nodes of the full resolution.
    pub lattice: Lattice,
    /// See [`SparseInfo::band`](super::SparseInfo::band).
    pub band: f64,
    /// The type of a sample.
    pub precision: Precision,
    /// Metadata of the grid; its bounds of slope and error are not known yet, and zero.
    pub about: About,
    /// Packing of the grid's chunks. Those of parts are not packed.
    pub compression: Compression,
    /// Does the sign of the distance change at triangles alone?
    pub is_sign_continuous: bool,
}

/// Bricks without their samples, and what they need of the map of all slots.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartTables {
    /// Number of bricks near the surface, which come first. The others may close an open mesh.
    pub near: usize,
    /// Slot of each brick.
    pub slots: Vec<[u32; 3]>,
    /// Decoding of each brick's codes.
    pub scales: Vec<Scale>,
    /// Largest error of each brick's samples.
    pub roundings: Vec<f64>,
    /// Error of interpolating exact distances in each brick.
    pub interpolations: Vec<f64>,
    /// Magnitudes of the coarse grid, x fastest, negative inside. A file has a share of them, a slice.
    pub coarse: Vec<f32>,
    /// Where the sides of slots are found.
    pub sides: Sides,
    /// For each slot: is its middle inside? Empty with [`Sides::FirstNodes`]. A file has a share.
    pub slot_sides: Vec<bool>,
}

/// Source of the sides of slots without a brick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sides {
    /// The sign of a slot's first node of the coarse grid.
    #[default]
    FirstNodes,
    /// The side of a slot's middle alone.
    Slots,
    /// The same, and nodes of the coarse grid on another side are at a jump of the sign.
    SlotsAndNodes,
}

impl Sides {
    const ALL: [Self; 3] = [Self::FirstNodes, Self::Slots, Self::SlotsAndNodes];

    fn name(self) -> &'static str {
        match self {
            Self::FirstNodes => "first nodes",
            Self::Slots => "slots",
            Self::SlotsAndNodes => "slots and nodes",
        }
    }

    fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|sides| sides.name() == name)
    }
}

/// Codes of bricks, of any precision.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "a variant is named as the precision that it has")]
pub enum Codes {
    F32(Vec<f32>),
    U16(Vec<u16>),
    U8(Vec<u8>),
}

impl From<Vec<f32>> for Codes {
    fn from(codes: Vec<f32>) -> Self {
        Self::F32(codes)
    }
}

impl From<Vec<u16>> for Codes {
    fn from(codes: Vec<u16>) -> Self {
        Self::U16(codes)
    }
}

impl From<Vec<u8>> for Codes {
    fn from(codes: Vec<u8>) -> Self {
        Self::U8(codes)
    }
}

/// The share of a part in `len` elements that all parts know.
fn share(len: usize, index: u32, count: u32) -> Range<usize> {
    let cut = |part: u32| (len as u128 * u128::from(part) / u128::from(count)) as usize;
    cut(index)..cut(index + 1)
}

/// Numbers of slots and of coarse nodes; `None` on overflow.
fn map_sizes(lattice: &Lattice) -> Option<[usize; 2]> {
    let count = |more: usize| {
        brick_counts(lattice).iter().try_fold(1_usize, |count, slots| count.checked_mul(*slots as usize + more))
    };
    Some([count(0)?, count(1)?])
}

/// Fault of a file that is a part in place of a grid; `None` where it is not a part.
pub(super) fn fault(file: &Hdf5Reader) -> Option<GridFault> {
    let part = file.member(None, GROUP).ok()?;
    let (index, count) = read::part_and_count(file, &part).unwrap_or_default();
    Some(GridFault::IsPart { index, count })
}
