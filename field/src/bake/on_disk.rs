//! Facts about a grid that is in a file and not in memory, and why it may not get there.

use std::io;
use std::path::Path;

use sdf_core::grid::Lattice;
use sdf_core::grid::owned::Precision;
use sdf_formats::grid_file::{GridFault, GridFileError};

use super::{BakeError, inside};
use crate::info::GridInfo;

/// Bricks whose samples are in memory at a time: 2 MiB of u16, of which three copies may be there, and more of their neighbours. With
/// fewer, neighbours are read so often that it takes time.
pub(super) const BRICKS_AT_A_TIME: usize = 2048;

/// Facts about a sparse grid in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct GridOnDisk {
    /// Nodes of the full resolution.
    pub lattice: Lattice,
    /// Facts beside the samples.
    pub info: GridInfo,
    /// The type of a sample.
    pub precision: Precision,
    /// Lipschitz constant of the interpolant.
    pub slope_bound: f64,
    /// Slot of each brick.
    pub slots: Vec<[u32; 3]>,
    /// Error bound of each brick.
    pub errors: Vec<f32>,
    /// Does the sign change at triangles alone? Not so at the holes of an open mesh: the error there is that of a distance with the sign of a
    /// cell's corners where they agree.
    pub is_sign_continuous: bool,
    /// Is a node inside? As [`Baked::has_inside`](super::Baked::has_inside); `true` of a part, which does not tell.
    pub has_inside: bool,
}

impl GridOnDisk {
    /// As [`Baked::thin_voxel`](super::Baked::thin_voxel).
    pub fn thin_voxel(&self) -> Option<f64> {
        inside::thin_voxel(self.is_sign_continuous, self.has_inside, &self.lattice)
    }
}

/// Why a mesh is not in its file.
#[derive(Debug)]
#[non_exhaustive]
pub enum BakeFileError {
    /// The mesh cannot be baked.
    Bake(BakeError),
    /// A file cannot be read or written, or parts do not join.
    File(GridFileError),
    /// Parts are of sparse grids of a given size: not of dense ones, nor of [`GridSize::MaxError`](crate::GridSize::MaxError).
    NotInParts,
}

impl std::fmt::Display for BakeFileError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Bake(error) => error.fmt(f),
            Self::File(error) => error.fmt(f),
            Self::NotInParts => f.write_str("only sparse grids of a given cell size are baked in parts"),
        }
    }
}

impl std::error::Error for BakeFileError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Bake(error) => Some(error),
            Self::File(error) => Some(error),
            Self::NotInParts => None,
        }
    }
}

impl From<BakeError> for BakeFileError {
    fn from(error: BakeError) -> Self {
        Self::Bake(error)
    }
}

/// Why a file was not written.
pub(super) enum Failure {
    Fault(GridFault),
    File(GridFileError),
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Fault(error.into())
    }
}

impl From<GridFault> for Failure {
    fn from(fault: GridFault) -> Self {
        Self::Fault(fault)
    }
}

impl From<GridFileError> for Failure {
    fn from(error: GridFileError) -> Self {
        Self::File(error)
    }
}

impl Failure {
    pub(super) fn at(self, path: &Path) -> BakeFileError {
        BakeFileError::File(match self {
            Self::Fault(fault) => GridFileError { path: path.to_owned(), fault },
            Self::File(error) => error,
        })
    }
}
