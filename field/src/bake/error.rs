//! Why is a mesh not baked?

use sdf_bake::InvalidMesh;
use sdf_bake::error_budget::ErrorBudgetError;

/// Why a mesh cannot be baked.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum BakeError {
    /// See [`InvalidMesh`].
    InvalidMesh(InvalidMesh),
    /// [`weld`](super::BakeOptions::weld) or [`close`](super::BakeOptions::close) is not a positive finite length.
    InvalidRepair {
        /// The requested length.
        length: f64,
    },
    /// [`band`](super::BakeOptions::band) is not 1 to 1000 cells.
    BandOutOfRange {
        /// The requested cells.
        band: u32,
    },
    /// The voxels are larger than a thousand times the mesh.
    VoxelTooLarge {
        /// The longest side of the mesh.
        side: f64,
    },
    /// The grid has more nodes than can be numbered, or takes more memory than there is.
    TooLarge {
        /// Nodes along each axis.
        nodes: [f64; 3],
        /// Bricks of a sparse grid, once they are known.
        bricks: Option<usize>,
        /// Memory that is needed, in bytes; `None` where the nodes cannot be numbered.
        bytes: Option<f64>,
        /// Memory that is free, in bytes; `None` where the system does not say.
        free: Option<f64>,
    },
    /// No voxels are certified to keep within the error.
    ErrorBudget(ErrorBudgetError),
    /// The flag of [`Field::bake_cancellable`](crate::Field::bake_cancellable) was set.
    Cancelled,
}

impl std::fmt::Display for BakeError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::InvalidMesh(error) => error.fmt(f),
            Self::InvalidRepair { length } => {
                write!(f, "welding and closing need a positive finite length, not {length:?}")
            }
            Self::BandOutOfRange { band } => write!(f, "band {band}: give 1 to 1000 cells"),
            Self::VoxelTooLarge { side } => write!(f, "the whole mesh is {side:?} long: take smaller voxels"),
            Self::TooLarge { nodes: [x, y, z], bytes: Some(bytes), free, .. } => {
                write!(f, "a grid of {x} × {y} × {z} nodes needs {bytes:.0} bytes")?;
                free.map_or(Ok(()), |free| write!(f, ", and {free:.0} are free"))?;
                f.write_str(": take larger voxels or a sparse grid")
            }
            Self::TooLarge { nodes: [x, y, z], .. } => {
                write!(f, "a grid of {x} × {y} × {z} nodes is too large: take larger voxels")
            }
            Self::ErrorBudget(error) => error.fmt(f),
            Self::Cancelled => f.write_str("the bake was cancelled"),
        }
    }
}

impl std::error::Error for BakeError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::InvalidMesh(error) => Some(error),
            Self::ErrorBudget(error) => Some(error),
            _ => None,
        }
    }
}
