//! Baked grids on disk: HDF5 that h5py and h5dump open as it is, and ParaView and VTK where it is dense. docs/format.md
//! describes the file.
//!
//! ```no_run
//! let stored = sdf_formats::grid_file::read("dragon.sdf.h5".as_ref())?;
//! println!("{:?} nodes, within {} of the mesh", stored.grid.lattice().nodes(), stored.about.error_bound);
//! # Ok::<(), sdf_formats::grid_file::GridFileError>(())
//! ```

mod atomic_write;
mod check;
mod classic;
mod differences;
mod element;
mod error;
mod hdf5_writer;
mod head;
mod layout;
mod owned;
mod packing;
mod reached;
mod reader;
mod tiling;

use std::path::Path;

use sdf_core::grid::sparse::Scale;
use sdf_core::grid::{BlockBounds, Lattice};

pub use atomic_write::{Removed, atomic_write, remove_temporaries};
pub use error::{Fault, GridFileError};
pub use owned::{OwnedBricks, OwnedGrid, OwnedSamples};
pub use reader::{GridReader, open, read};

/// A grid from a file, and what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredGrid {
    pub grid: OwnedGrid,
    pub layout: Layout,
    pub about: About,
    pub read: ReadCount,
}

/// What was read of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadCount {
    /// All told, of attributes, tables and samples; what is read twice counts twice.
    pub bytes: u64,
    /// How many bricks of a sparse grid, or chunks of a dense one, have their samples.
    pub blocks: usize,
    pub of_blocks: usize,
}

/// How a grid keeps its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layout {
    /// One for every node.
    Dense,
    /// In bricks near the surface, over a coarse grid.
    Sparse {
        /// Wherever the surface is no farther than this, the grid interpolates samples of bricks alone.
        band: f64,
        precision: Precision,
        bricks: usize,
    },
}

/// What number a sample is stored as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    F32,
    U16,
    U8,
}

impl Precision {
    const ALL: [Self; 3] = [Self::F32, Self::U16, Self::U8];

    /// `f32`, `u16` or `u8`.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::U16 => "u16",
            Self::U8 => "u8",
        }
    }

    fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|precision| precision.name() == name)
    }
}

/// What the file says without its samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    pub lattice: Lattice,
    pub layout: Layout,
    pub about: About,
    /// The samples first, then what stands beside them.
    pub parts: Vec<Part>,
    pub file_bytes: u64,
}

/// A dataset of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    pub name: &'static str,
    /// Packed.
    pub stored_bytes: u64,
}

/// All that the file says of a grid of either layout beside the samples.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// `pseudo-normal` or `winding`.
    pub sign_method: String,
    /// In words: what the mesh looked like, and why this method.
    pub sign_verdict: String,
    /// The most that the interpolated value changes over a unit of distance.
    pub slope_bound: f64,
    /// Certified: the interpolated value is no further from the true distance, in a dense grid nowhere in the box, in a
    /// sparse one nowhere in the band. In the unit of the mesh.
    pub error_bound: f64,
    /// The mesh lies at least this far inside the box, on every side. In the unit of the mesh.
    pub padding: f64,
    pub source: Source,
    /// The program and its version, `sdftool 0.1.0`.
    pub tool: String,
    /// The options that shaped the result, `--res 256 --padding 2 --sign auto`.
    pub options: String,
}

/// The mesh that was baked.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    pub name: String,
    /// Of the mesh file's bytes.
    pub sha256: [u8; 32],
    pub triangles: u64,
}

/// The samples of a grid that is to be written.
#[derive(Clone, Copy, Debug)]
pub enum Samples<'a> {
    Dense {
        /// One for every node, x fastest: negative inside, in the unit of the mesh.
        distances: &'a [f32],
        /// One for each place of 8 × 8 × 8 nodes, x fastest.
        bounds: &'a [BlockBounds],
    },
    F32(SparseSamples<'a, f32>),
    U16(SparseSamples<'a, u16>),
    U8(SparseSamples<'a, u8>),
}

/// Bricks and a coarse grid: what [`OwnedBricks`] holds, but for the table, which follows from the places.
#[derive(Clone, Copy, Debug)]
pub struct SparseSamples<'a, C> {
    /// See [`Layout::Sparse`].
    pub band: f64,
    pub places: &'a [[u32; 3]],
    pub scales: &'a [Scale],
    pub samples: &'a [C],
    pub bounds: &'a [BlockBounds],
    pub errors: &'a [f32],
    pub coarse: &'a [f32],
}

impl<'a> From<SparseSamples<'a, f32>> for Samples<'a> {
    fn from(samples: SparseSamples<'a, f32>) -> Self {
        Self::F32(samples)
    }
}

impl<'a> From<SparseSamples<'a, u16>> for Samples<'a> {
    fn from(samples: SparseSamples<'a, u16>) -> Self {
        Self::U16(samples)
    }
}

impl<'a> From<SparseSamples<'a, u8>> for Samples<'a> {
    fn from(samples: SparseSamples<'a, u8>) -> Self {
        Self::U8(samples)
    }
}

/// Writes a grid whole or not at all, see [`atomic_write`]. The same input gives the same bytes.
///
/// What [`read`] would refuse is refused here: counts that do not fit, a number that is not finite, a bound below zero, a
/// brick outside of the lattice or in the place of another, no brick at all, an unknown sign method, a text with a NUL or
/// of more than 64 KiB.
pub fn write<'a>(
    path: &Path,
    lattice: &Lattice,
    samples: impl Into<Samples<'a>>,
    about: &About,
) -> Result<(), GridFileError> {
    let samples = samples.into();
    let head = check::head(lattice, &samples, about).map_err(|flaw| Fault::Refused(flaw).at(path))?;
    atomic_write(path, |temporary| hdf5_writer::write(temporary, &samples, head)).map_err(|fault| fault.at(path))
}
