//! Why is a mesh not baked?

use sdf_bake::InvalidMesh;
use sdf_bake::error_budget::ErrorBudgetError;
use sdf_core::grid::owned::Layout;

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
    /// [`GridSize::Cells`](super::GridSize::Cells) of none.
    NoCells,
    /// [`GridSize::VoxelSize`](super::GridSize::VoxelSize) is not a positive finite length.
    InvalidVoxel {
        /// The requested length.
        size: f64,
    },
    /// The voxels are larger than a thousand times the mesh.
    VoxelTooLarge {
        /// The longest side of the mesh.
        side: f64,
    },
    /// The grid has more nodes than can be numbered, or takes more memory than there is.
    TooLarge {
        /// Dense or sparse.
        layout: Layout,
        /// Nodes along each axis.
        nodes: [f64; 3],
        /// Bricks of a sparse grid, once they are known.
        bricks: Option<usize>,
        /// Memory that is needed, in bytes; `None` where the nodes cannot be numbered.
        bytes: Option<f64>,
        /// Memory for the mesh's triangles among these, in bytes, which no smaller grid saves; 0 where there is none.
        triangle_bytes: f64,
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
            Self::NoCells => f.write_str("a grid needs a cell along its longest side: give 1 or more"),
            Self::InvalidVoxel { size } => write!(f, "voxels need a positive finite size, not {size:?}"),
            Self::VoxelTooLarge { side } => write!(f, "the whole mesh is {side:?} long: take smaller voxels"),
            Self::TooLarge { layout, nodes, bytes, triangle_bytes, free, .. } => {
                write!(f, "a grid of {} nodes ", nodes.map(many).join(" × "))?;
                let Some(bytes) = *bytes else {
                    return f.write_str("is too large: take larger voxels");
                };
                write!(f, "needs {} bytes", many(bytes))?;
                free.map_or(Ok(()), |free| write!(f, ", and {} are free", many(free)))?;
                if free.is_some_and(|free| *triangle_bytes > free) {
                    return write!(
                        f,
                        ", {} of them for the mesh's faces: take a mesh of fewer faces or a dense grid",
                        many(*triangle_bytes)
                    );
                }
                f.write_str(match layout {
                    Layout::Dense => ": take larger voxels or a sparse grid",
                    Layout::Sparse => ": take larger voxels",
                })
            }
            Self::ErrorBudget(error) => error.fmt(f),
            Self::Cancelled => f.write_str("the bake was cancelled"),
        }
    }
}

/// A count of any size; in exponential form from 10¹⁵ on.
fn many(count: f64) -> String {
    if count < 1e15 { format!("{count:.0}") } else { format!("{count:.1e}") }
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
