//! Grids and surfaces as files of other programs. docs/exports.md says who reads them, and how.
//!
//! | question | file |
//! |---|---|
//! | NanoVDB: which nodes are there, and in which order? | `nvdb::tree` |
//! | NanoVDB: which bytes has each? | `nvdb::bytes` |
//! | Plain arrays: raw, NumPy, NRRD | `arrays` |
//! | VTKHDF: image data, and a mesh that moves | `vtkhdf` |
//! | A surface as binary glTF | `glb` |
//! | A blob as source code | `table` |

mod arrays;
mod glb;
pub(crate) mod nvdb;
mod table;
mod vtkhdf;

use std::borrow::Cow;
use std::path::Path;

use sdf_core::grid::Lattice;
use sdf_core::grid::owned::{OwnedGrid, OwnedStorage};
use sdf_core::grid::sparse::{BrickData, Sparse};

pub(crate) use arrays::NPY_MAGIC;
pub use arrays::{RawFacts, npy, nrrd, raw, raw_description};
pub use glb::glb;
pub use nvdb::nvdb;
pub use table::{c_table, rust_table};
pub use vtkhdf::{MovingMesh, vtkhdf, write_moving_vtkhdf};

/// A file format of other programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ExportFormat {
    /// NanoVDB: a level set in leaves of 8 × 8 × 8 nodes.
    Nvdb,
    /// Samples alone, described by a JSON file beside it.
    Raw,
    /// A NumPy array.
    Npy,
    /// NRRD, of 3D Slicer, ITK and teem.
    Nrrd,
    /// VTKHDF image data, of ParaView and VTK.
    VtkHdf,
    /// The surface φ = 0 as binary glTF.
    Glb,
    /// A grid that is read where it lies: in flash, in a mapped file. See [`sdf_core::grid::Blob`].
    Blob,
    /// A blob as a table in C.
    C,
    /// A blob as a table in Rust.
    Rust,
}

impl ExportFormat {
    /// All of them.
    pub const ALL: [Self; 9] =
        [Self::Nvdb, Self::Raw, Self::Npy, Self::Nrrd, Self::VtkHdf, Self::Glb, Self::Blob, Self::C, Self::Rust];

    /// The format of this [`name`](Self::name).
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.name() == name)
    }

    /// The format of a file's ending.
    pub fn from_extension(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?;
        Self::ALL.into_iter().find(|format| ending.eq_ignore_ascii_case(format.extension()))
    }

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nvdb => "nvdb",
            Self::Raw => "raw",
            Self::Npy => "npy",
            Self::Nrrd => "nrrd",
            Self::VtkHdf => "vtkhdf",
            Self::Glb => "glb",
            Self::Blob => "blob",
            Self::C => "c",
            Self::Rust => "rust",
        }
    }

    /// The ending of its files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Blob => "sdfb",
            Self::Rust => "rs",
            _ => self.name(),
        }
    }
}

/// A sample for every node of a grid, x fastest: those of a dense grid of f32 as they are, others decoded.
pub fn dense_samples(grid: &OwnedGrid) -> Cow<'_, [f32]> {
    match grid.storage() {
        OwnedStorage::Dense(dense) => Cow::Borrowed(dense.storage().samples()),
        OwnedStorage::SparseF32(sparse) => Cow::Owned(decoded(grid.lattice(), sparse)),
        OwnedStorage::DenseU16(sparse) | OwnedStorage::SparseU16(sparse) => Cow::Owned(decoded(grid.lattice(), sparse)),
        OwnedStorage::DenseU8(sparse) | OwnedStorage::SparseU8(sparse) => Cow::Owned(decoded(grid.lattice(), sparse)),
    }
}

fn decoded<B: BrickData + Sync>(lattice: &Lattice, sparse: &Sparse<B>) -> Vec<f32> {
    let [nx, ny, _] = lattice.nodes();
    let mut samples = vec![0.0; lattice.node_count()];
    sdf_parallel::for_each(
        samples.chunks_mut(nx as usize).enumerate().collect(),
        |(row, samples): (usize, &mut [f32])| {
            let [y, z] = [row as u32 % ny, row as u32 / ny];
            (0..nx).zip(samples).for_each(|(x, sample)| *sample = sparse.node([x, y, z]));
        },
    );
    samples
}
