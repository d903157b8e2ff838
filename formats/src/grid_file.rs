//! Grid files: baked grids in HDF5. docs/format.md describes the format.
//!
//! h5py and h5dump open every grid file; ParaView and VTK open dense ones of f32. `write` and `check` write a file, `reader`
//! and the modules that it lists read one, whole or in part. Grids that are baked in parts: [`part`].
//!
//! ```no_run
//! let stored = sdf_formats::grid_file::read("dragon.sdf.h5".as_ref())?;
//! println!("{:?} nodes, within {} of the mesh", stored.grid.lattice().nodes(), stored.about.error_bound);
//! # Ok::<(), sdf_formats::grid_file::GridFileError>(())
//! ```

mod attributes;
mod block_mask;
mod check;
mod coarse_reader;
mod coding;
mod digests;
mod error;
mod error_regions;
mod header;
mod kept_mesh;
mod layout;
pub mod part;
mod placeholder;
mod read_dense;
mod read_sparse;
mod reader;
mod write;

use std::path::Path;

use sdf_core::ErrorBound;
use sdf_core::grid::owned::{ErrorRegions, Layout, OwnedGrid, Precision};
use sdf_core::grid::sparse::{DEEP_ERROR, Scale};
use sdf_core::grid::{BlockBounds, Lattice, Sampling};
use serde::Serialize;

pub use error::{GridFault, GridFileError};
pub use reader::{GridReader, open, open_bytes, read, read_bytes};
pub(crate) use write::Chunks;

use crate::atomic_write::atomic_write;
pub use crate::hdf5::Compression;

/// A grid read from a file, with its metadata.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredGrid {
    /// The grid.
    pub grid: OwnedGrid,
    /// `None` for a dense grid.
    pub sparse: Option<SparseInfo>,
    /// Metadata.
    pub about: About,
    /// The mesh, where the file keeps it and it was read.
    pub mesh: Option<StoredMesh>,
    /// Amount of the file that was read.
    pub read: ReadCount,
}

/// The mesh that a grid was baked from, as the file keeps it.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredMesh {
    /// Positions of the vertices.
    pub vertices: Vec<[f64; 3]>,
    /// For each triangle its vertices, counterclockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// See [`MeshInfo::is_sign_continuous`].
    pub is_sign_continuous: bool,
}

/// The size of a stored mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshInfo {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of triangles.
    pub triangles: usize,
    /// Does the sign of the distance change at triangles alone? It jumps elsewhere too at the holes of an open mesh.
    pub is_sign_continuous: bool,
}

impl MeshInfo {
    const KINDS: [(bool, &'static str); 2] = [(true, "closed"), (false, "open")];

    fn kind(mesh: Option<Self>) -> &'static str {
        let name = |mesh: Self| Self::KINDS.iter().find(|(is_continuous, _)| *is_continuous == mesh.is_sign_continuous);
        mesh.and_then(name).map_or("none", |(_, name)| name)
    }
}

/// Amount of a file that was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadCount {
    /// Bytes of attributes, tables and samples; bytes read twice count twice.
    pub bytes: u64,
    /// Bricks of a sparse grid, blocks of a dense one of codes, or chunks of one of f32, whose samples were read.
    pub blocks: usize,
    /// Bricks, blocks or chunks in the file.
    pub total_blocks: usize,
}

/// Header of a sparse grid, which has bricks near the surface over a coarse grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SparseInfo {
    /// Within this distance of the surface, the grid interpolates only samples of bricks.
    pub band: f64,
    /// The type of a sample.
    pub precision: Precision,
    /// Number of bricks.
    pub bricks: usize,
    /// Meaning of the coarse grid's values inside of the solid.
    pub deep_values: DeepValues,
}

/// Meaning of a sparse grid's values beyond the band and inside of the solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeepValues {
    /// Distances, off by at most [`DEEP_ERROR`] spacings: what `sdftool bake` writes.
    Distances,
    /// No larger in magnitude than the distance, without a bound of how much smaller: files of version 2.
    LowerBounds,
}

impl DeepValues {
    const ALL: [Self; 2] = [Self::Distances, Self::LowerBounds];

    /// `distances` or `lower bounds`, as files have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Distances => "distances",
            Self::LowerBounds => "lower bounds",
        }
    }

    fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|values| values.name() == name)
    }

    /// Bound of |φ − d| deep inside: see [`OwnedGrid::with_deep_error`].
    pub fn deep_error(self, spacing: f64) -> f64 {
        match self {
            Self::Distances => DEEP_ERROR * spacing,
            Self::LowerBounds => f64::INFINITY,
        }
    }

    /// The meaning that a grid may state: the inverse of [`deep_error`](Self::deep_error).
    pub fn of_grid(grid: &OwnedGrid) -> Self {
        let is_proven = grid.deep_error() <= DEEP_ERROR * grid.lattice().spacing();
        if is_proven { Self::Distances } else { Self::LowerBounds }
    }
}

/// The layout of a grid's samples.
pub fn layout_of(sparse: Option<SparseInfo>) -> Layout {
    if sparse.is_some() { Layout::Sparse } else { Layout::Dense }
}

/// Contents of a file without its samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Nodes of the full resolution.
    pub lattice: Lattice,
    /// `None` for a dense grid.
    pub sparse: Option<SparseInfo>,
    /// The type of a sample.
    pub precision: Precision,
    /// Metadata.
    pub about: About,
    /// `None` where the file keeps no mesh.
    pub mesh: Option<MeshInfo>,
    /// Datasets: the samples first, the digests last.
    pub parts: Vec<Part>,
    /// Size of the file.
    pub file_bytes: u64,
}

impl Summary {
    /// Bound of the error of the whole grid: no more than the header tells.
    pub fn error_bound(&self) -> ErrorBound {
        let spacing = self.lattice.spacing();
        let (band, deep_error) =
            self.sparse.map_or((f64::INFINITY, 0.0), |sparse| (sparse.band, sparse.deep_values.deep_error(spacing)));
        Sampling { spacing, band, deep_error }.of_whole(self.about.error_bound, self.about.slope_bound, &self.lattice)
    }
}

/// A dataset of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Name of the dataset.
    pub name: &'static str,
    /// Compressed size.
    pub stored_bytes: u64,
}

/// Metadata of a grid of either layout.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// Test for inside and outside.
    pub sign_method: SignMethod,
    /// In words: the state of the mesh, and why this method. The attribute `sign_verdict`.
    pub sign_reason: String,
    /// A Lipschitz constant of the interpolated value.
    pub slope_bound: f64,
    /// Certified bound on |interpolated value − true distance|, in the unit of the mesh: anywhere in the box of a dense
    /// grid, anywhere in the band of a sparse one. Infinite of imported samples: nothing is certified.
    pub error_bound: f64,
    /// The inside of an open mesh reaches the faces of the box, so that nothing is known of the error outside.
    pub inside_reaches_box: bool,
    /// Where the error of an open mesh's grid is large; `None` where `error_bound` is all that is known.
    pub error_regions: Option<ErrorRegions>,
    /// The mesh lies at least this far inside the box, on every side. In the unit of the mesh.
    pub padding: f64,
    /// The mesh that was baked.
    pub source: Source,
    /// The program and its version, such as `sdftool 0.1.0`.
    pub tool: String,
    /// The options that shaped the result, such as `--res 256 --padding 2 --sign auto`.
    pub options: String,
}

/// Test for inside and outside that the grid was baked with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SignMethod {
    /// Angle-weighted pseudo-normals.
    PseudoNormal,
    /// Generalized winding numbers.
    Winding,
    /// The samples were imported with their signs.
    Given,
}

impl SignMethod {
    const ALL: [Self; 3] = [Self::PseudoNormal, Self::Winding, Self::Given];

    /// `pseudo-normal`, `winding` or `given`.
    pub fn name(self) -> &'static str {
        match self {
            Self::PseudoNormal => "pseudo-normal",
            Self::Winding => "winding",
            Self::Given => "given",
        }
    }

    fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|method| method.name() == name)
    }
}

/// The mesh that was baked.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// Name of the mesh file, without its folder.
    pub name: String,
    /// SHA-256 of the mesh file's bytes.
    pub sha256: [u8; 32],
    /// Number of triangles in the file.
    pub triangles: u64,
}

/// Samples of a grid to be written.
#[derive(Clone, Copy, Debug)]
pub enum Samples<'a> {
    /// A sample at every node.
    Dense {
        /// A distance for every node, x fastest: negative inside, in the unit of the mesh.
        distances: &'a [f32],
        /// Bounds of each block of 8 × 8 × 8 nodes, x fastest.
        bounds: &'a [BlockBounds],
    },
    /// 16-bit codes at every node.
    DenseU16(DenseBlockSamples<'a, u16>),
    /// 8-bit codes at every node.
    DenseU8(DenseBlockSamples<'a, u8>),
    /// Bricks of `f32` samples.
    F32(SparseSamples<'a, f32>),
    /// Bricks of 16-bit codes.
    U16(SparseSamples<'a, u16>),
    /// Bricks of 8-bit codes.
    U8(SparseSamples<'a, u8>),
}

/// Blocks of codes: a [`DenseBlocks`](sdf_core::grid::owned::DenseBlocks).
#[derive(Clone, Copy, Debug)]
pub struct DenseBlockSamples<'a, C> {
    /// Slot of each block: every slot once.
    pub slots: &'a [[u32; 3]],
    /// Decoding of each block's codes.
    pub scales: &'a [Scale],
    /// Codes of one block after the other, x fastest.
    pub samples: &'a [C],
    /// Bounds of each block's nodes.
    pub bounds: &'a [BlockBounds],
}

/// Bricks and a coarse grid: an [`OwnedBricks`](sdf_core::grid::owned::OwnedBricks) without its table, which follows from the bricks' slots.
#[derive(Clone, Copy, Debug)]
pub struct SparseSamples<'a, C> {
    /// See [`SparseInfo::band`].
    pub band: f64,
    /// See [`SparseInfo::deep_values`].
    pub deep_values: DeepValues,
    /// Slot of each brick.
    pub slots: &'a [[u32; 3]],
    /// Decoding of each brick's codes.
    pub scales: &'a [Scale],
    /// Codes of one brick after the other, x fastest.
    pub samples: &'a [C],
    /// Bounds of each brick's nodes.
    pub bounds: &'a [BlockBounds],
    /// Error bound of each brick.
    pub errors: &'a [f32],
    /// Samples of the coarse grid, x fastest.
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
/// Refuses whatever [`read`] would refuse: counts that do not fit, NaN and infinities, negative bounds, a brick outside
/// of the lattice or in the slot of another, no bricks, a text that contains a NUL or has more than 64 KiB.
pub fn write<'a>(
    path: &Path,
    lattice: &Lattice,
    samples: impl Into<Samples<'a>>,
    about: &About,
) -> Result<(), GridFileError> {
    write_with(path, lattice, samples, about, WriteOptions::default())
}

/// Contents of a file beside the grid, and its packing.
#[derive(Clone, Copy, Debug, Default)]
pub struct WriteOptions<'a> {
    /// The mesh that the grid was baked from.
    pub mesh: Option<&'a StoredMesh>,
    /// Packing of chunks.
    pub compression: Compression,
}

/// [`write()`] with options.
pub fn write_with<'a>(
    path: &Path,
    lattice: &Lattice,
    samples: impl Into<Samples<'a>>,
    about: &About,
    options: WriteOptions<'a>,
) -> Result<(), GridFileError> {
    let contents = contents(lattice, samples.into(), about, options).map_err(|fault| fault.with_path(path))?;
    let written = atomic_write(path, |temporary| write::write(temporary, contents));
    written.map_err(|fault| fault.with_path(path))
}

/// The bytes that [`write()`] would write.
pub fn to_bytes<'a>(lattice: &Lattice, samples: impl Into<Samples<'a>>, about: &About) -> Result<Vec<u8>, GridFault> {
    to_bytes_with(lattice, samples, about, WriteOptions::default())
}

/// The bytes that [`write_with`] would write.
pub fn to_bytes_with<'a>(
    lattice: &Lattice,
    samples: impl Into<Samples<'a>>,
    about: &About,
    options: WriteOptions<'a>,
) -> Result<Vec<u8>, GridFault> {
    write::to_bytes(contents(lattice, samples.into(), about, options)?)
}

fn contents<'a>(
    lattice: &Lattice,
    samples: Samples<'a>,
    about: &About,
    WriteOptions { mesh, compression }: WriteOptions<'a>,
) -> Result<write::Contents<'a>, GridFault> {
    let coding = coding::Coding::of(compression);
    let header = check::checked_header(lattice, &samples, about, mesh, coding, true).map_err(GridFault::Refused)?;
    Ok(write::Contents { samples, elsewhere: None, mesh, header, compression })
}
