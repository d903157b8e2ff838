//! Grids read from a file or its bytes, whole or in part.
//!
//! | step | question | file |
//! |---|---|---|
//! | 1 | What do the attributes of /sdf say, and does their checksum hold? | `header` |
//! | 2 | Where are the datasets, and which tables accompany the samples? | `read_dense`, `read_sparse` |
//! | 3 | Does the checksum of each chunk hold? | `digests` |
//! | 4 | Which blocks of 8 × 8 × 8 nodes do the caller's regions need? | `block_mask` |
//! | 5 | What are their samples? | `read_dense`, `read_sparse` |
//!
//! Steps 1 and 2 happen in [`open`], 4 and 5 in [`GridReader::read_needed`].

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use sdf_core::Aabb;
use sdf_core::grid::Lattice;
use sdf_core::grid::owned::{OwnedGrid, Precision};

use super::block_mask::BlockMask;
use super::digests::Digests;
use super::header::Header;
use super::kept_mesh::MeshReader;
use super::part;
use super::read_dense::DenseReader;
use super::read_sparse::SparseReader;
use super::{About, GridFault, GridFileError, MeshInfo, SparseInfo, StoredGrid, StoredMesh, Summary, layout};
use crate::hdf5::Hdf5Reader;

/// Reads a grid and verifies its checksums. See [`open`].
pub fn read(path: &Path) -> Result<StoredGrid, GridFileError> {
    open(path)?.read()
}

/// Reads all but the samples of a grid, dense or fine or coarse, and verifies its checksums.
///
/// Refuses a file that is cut short, damaged, not HDF5, not a grid, of another version, or declares more than it holds.
/// Memory stays below about seven thousand times the size of the file: deflate expands at most 1032 times, and each
/// number of the coarse grid brings two of ours, in blocks that may stick out of a small grid.
pub fn open(path: &Path) -> Result<GridReader<'static>, GridFileError> {
    let grid = Hdf5Reader::open(path).map_err(GridFault::from).and_then(OpenGrid::open);
    grid.map(|grid| GridReader { path: path.to_owned(), grid }).map_err(|fault| fault.with_path(path))
}

/// Reads a grid from the bytes of a file and verifies its checksums. Errors show `name` in place of a path.
pub fn read_bytes(bytes: &[u8], name: &str) -> Result<StoredGrid, GridFileError> {
    open_bytes(bytes, name)?.read()
}

/// Like [`open`], from the bytes of a file, lent (`&[u8]`) or owned (`Vec<u8>`). Errors show `name` in place of a path.
pub fn open_bytes<'a>(bytes: impl Into<Cow<'a, [u8]>>, name: &str) -> Result<GridReader<'a>, GridFileError> {
    let path = Path::new(name);
    let grid = Hdf5Reader::open_bytes(bytes.into()).map_err(GridFault::from).and_then(OpenGrid::open);
    grid.map(|grid| GridReader { path: path.to_owned(), grid }).map_err(|fault| fault.with_path(path))
}

/// An open grid file: everything but the samples is read and checked.
pub struct GridReader<'a> {
    path: PathBuf,
    grid: OpenGrid<'a>,
}

impl GridReader<'_> {
    /// Nodes of the full resolution.
    pub fn lattice(&self) -> &Lattice {
        &self.grid.header.lattice
    }

    /// Metadata.
    pub fn about(&self) -> &About {
        &self.grid.header.about
    }

    /// Band, precision and number of bricks; `None` for a dense grid.
    pub fn sparse(&self) -> Option<SparseInfo> {
        self.grid.header.sparse
    }

    /// Contents of the file without its samples.
    pub fn summary(&self) -> Summary {
        let OpenGrid { file, header, digests, .. } = &self.grid;
        Summary {
            lattice: header.lattice,
            sparse: header.sparse,
            precision: header.precision,
            about: header.about.clone(),
            mesh: header.mesh,
            parts: digests.parts.clone(),
            file_bytes: file.file_bytes(),
        }
    }

    /// Size of the mesh that the file keeps.
    pub fn mesh(&self) -> Option<MeshInfo> {
        self.grid.header.mesh
    }

    /// Reads the mesh alone; `None` where the file keeps none.
    pub fn read_mesh(&self) -> Result<Option<StoredMesh>, GridFileError> {
        self.grid.read_mesh().map_err(|fault| fault.with_path(&self.path))
    }

    /// Checks the checksums of everything in the file, in the memory of some chunks and the mesh.
    pub fn check(&self) -> Result<(), GridFileError> {
        self.grid.check().map_err(|fault| fault.with_path(&self.path))
    }

    /// Reads all samples, and the mesh.
    pub fn read(self) -> Result<StoredGrid, GridFileError> {
        let mesh = self.read_mesh()?;
        let stored = self.grid.read(None).map_err(|fault| fault.with_path(&self.path))?;
        Ok(StoredGrid { mesh, ..stored })
    }

    /// Reads the samples that queries in `regions` need: boxes in the field's own frame. All other samples have no meaning, and the mesh is
    /// not read.
    /// The grid may be evaluated inside the regions only, but local bounds are valid everywhere, infinite where the coarse grid was not
    /// read; `bounds` of the whole grid would read missing samples.
    ///
    /// Skips regions in which no value is at most `level`: with its margin as `level`, [`sdf_core::contact`] never
    /// evaluates there. Rounding to f32 in the field's own frame is allowed for; for a field placed far from the
    /// origin, add the rounding of world coordinates to `level`. An empty or non-finite region makes everything needed.
    pub fn read_needed(self, regions: impl IntoIterator<Item = Aabb>, level: f64) -> Result<StoredGrid, GridFileError> {
        let Self { path, grid } = self;
        let stored = grid.mask(regions, level).and_then(|(grid, mask)| grid.read(Some(&mask)));
        stored.map_err(|fault| fault.with_path(&path))
    }
}

struct OpenGrid<'a> {
    file: Hdf5Reader<'a>,
    header: Header,
    digests: Digests,
    contents: Contents,
    mesh: Option<MeshReader>,
}

enum Contents {
    Dense(DenseReader),
    Bricks(Box<SparseReader>),
}

impl<'a> OpenGrid<'a> {
    fn open(file: Hdf5Reader<'a>) -> Result<Self, GridFault> {
        let sdf = match file.member(None, "sdf") {
            Ok(sdf) => sdf,
            Err(missing) => return Err(part::fault(&file).unwrap_or_else(|| missing.into())),
        };
        let header = Header::read(&file, &sdf)?;
        let (contents, digests, mesh) = match (header.sparse, header.precision) {
            (None, Precision::F32) => {
                let (dense, digests, mesh) = DenseReader::open(&file, &sdf, &header)?;
                (Contents::Dense(dense), digests, mesh)
            }
            (sparse, _) => {
                let slots = layout::slot_count(&header.lattice).filter(|slots| *slots <= layout::MAX_BRICKS);
                let bricks = sparse.map(|sparse| sparse.bricks).or(slots);
                let bricks = bricks.ok_or_else(|| GridFault::damaged("too many brick slots"))?;
                let (bricks, digests, mesh) = SparseReader::open(&file, &sdf, &header, bricks)?;
                (Contents::Bricks(Box::new(bricks)), digests, mesh)
            }
        };
        Ok(Self { file, header, digests, contents, mesh })
    }

    fn read_mesh(&self) -> Result<Option<StoredMesh>, GridFault> {
        self.mesh.as_ref().map(|mesh| mesh.read(&self.file, &self.digests)).transpose()
    }

    fn check(&self) -> Result<(), GridFault> {
        match &self.contents {
            Contents::Dense(dense) => dense.check(&self.file, &self.digests)?,
            Contents::Bricks(bricks) => bricks.check(&self.file, &self.digests)?,
        }
        self.read_mesh().map(drop)
    }

    fn mask(self, regions: impl IntoIterator<Item = Aabb>, level: f64) -> Result<(Self, BlockMask), GridFault> {
        let Self { file, header, digests, contents, mesh } = self;
        let (contents, mask) = match contents {
            Contents::Dense(dense) => {
                let mask = dense.mask(&header, regions, level);
                (Contents::Dense(dense), mask)
            }
            Contents::Bricks(bricks) => {
                let (bricks, mask) = bricks.mask(&file, &digests, &header, regions, level)?;
                (Contents::Bricks(Box::new(bricks)), mask)
            }
        };
        Ok((Self { file, header, digests, contents, mesh }, mask))
    }

    /// Reads all samples, or those of the blocks in `mask`.
    fn read(self, mask: Option<&BlockMask>) -> Result<StoredGrid, GridFault> {
        let Self { file, header, digests, contents, .. } = self;
        let (samples, read) = match contents {
            Contents::Dense(dense) => dense.read(&file, &digests, &header.lattice, mask)?,
            Contents::Bricks(bricks) => bricks.read(&file, &digests, &header.lattice, mask)?,
        };
        let Header { lattice, sparse, about, .. } = header;
        let band = sparse.as_ref().map_or(f64::INFINITY, |sparse| sparse.band);
        let grid = OwnedGrid::new(lattice, samples, about.slope_bound).expect("the header has a valid slope bound");
        let deep_error = sparse.map_or(f64::INFINITY, |sparse| sparse.deep_values.deep_error(lattice.spacing()));
        let grid = grid.with_band(band).with_error_bound(about.error_bound).with_deep_error(deep_error);
        let grid = grid.with_inside_at_box(about.inside_reaches_box);
        Ok(StoredGrid { grid, sparse, about, mesh: None, read })
    }
}
