//! Why is a field not exported?

use std::fmt;
use std::path::PathBuf;

use super::BEYOND_GRIDS;

/// Why a field cannot be exported.
#[derive(Debug)]
#[non_exhaustive]
pub enum ExportError {
    /// The closed form has no box to sample.
    Unbounded,
    /// The box cannot be cut into so many cells.
    NoLattice,
    /// [`cells`](super::ExportOptions::cells) or [`band`](super::ExportOptions::band) is 0.
    NoCells(&'static str),
    /// A value of the field is not finite, or too large for f32.
    NotFinite,
    /// The file's numbers are f32, which does not hold the field's box or its voxels.
    OutsideSingle {
        /// The largest coordinate or side of the box where it is too large, else the voxel.
        size: f64,
    },
    /// There is not so much memory.
    TooLarge {
        /// Nodes along each axis.
        nodes: [u32; 3],
        /// Memory that is needed, in bytes.
        bytes: f64,
        /// Memory that is free, in bytes.
        free: f64,
    },
    /// φ is nowhere 0 between the nodes, or nowhere within the band.
    NoSurface {
        /// Nodes along each axis. Between more of them the field may have a surface, if it is not a grid with these.
        nodes: [u32; 3],
    },
    /// The surface lies beyond the band or the box of a grid that the field is made of.
    BeyondBand,
    /// A number of the grid is too large for f32, or there are more bricks than u32 counts.
    NotABlob,
    /// The file could not be written.
    Unwritable(PathBuf, std::io::Error),
}

impl fmt::Display for ExportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unbounded => f.write_str("the field is unbounded: intersect it with a box"),
            Self::NoLattice => f.write_str("its box cannot be cut into so many cells: use fewer"),
            Self::NoCells(what) => write!(f, "{what}: give 1 cell or more"),
            Self::NotFinite => {
                f.write_str("the field is not finite everywhere in its box, or too large there for f32: scale it")
            }
            Self::OutsideSingle { size } if *size > 1.0 => {
                write!(
                    f,
                    "its box reaches {size:.1e}, too large for f32, which the samples and points are: scale the field"
                )
            }
            Self::OutsideSingle { size } => {
                write!(
                    f,
                    "its voxels of {size:.1e} are too small for f32, which the samples and points are: scale the field"
                )
            }
            Self::TooLarge { nodes: [x, y, z], bytes, free } => {
                write!(f, "{x} × {y} × {z} nodes need {bytes:.0} bytes, and {free:.0} are free: use fewer cells")
            }
            Self::NoSurface { nodes: [x, y, z] } => {
                write!(
                    f,
                    "the surface is empty: between {x} × {y} × {z} nodes the distance is nowhere 0, use more cells"
                )
            }
            Self::BeyondBand => f.write_str(BEYOND_GRIDS),
            Self::NotABlob => {
                f.write_str("a number of the grid is too large for a blob, whose numbers are f32: change the unit")
            }
            Self::Unwritable(path, _) => write!(f, "{}", path.display()),
        }
    }
}

impl std::error::Error for ExportError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Unwritable(_, error) => Some(error),
            _ => None,
        }
    }
}
