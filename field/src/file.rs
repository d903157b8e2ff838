//! Fields from files and to them.

use std::path::Path;

use sdf_core::AnyField;
use sdf_core::grid::owned::{Layout, OwnedBricks, OwnedGrid, OwnedStorage};
use sdf_formats::field_file::{self, OpenField};
use sdf_formats::grid_file::{
    self, About, DeepValues, DenseBlockSamples, Samples, SparseSamples, StoredGrid, StoredMesh, WriteOptions,
};
pub use sdf_formats::{
    blob_file::StoredBlob,
    field_file::FieldError,
    grid_file::{Compression, GridFault, GridFileError},
};

use crate::info::{GridInfo, SignMethod, Source};
use crate::{Field, KeptMesh};

impl Field {
    /// Opens a baked grid (`.sdf.h5`), a blob of one (`.sdfb`) or shapes in closed form (`.sdf.toml`), by content: HDF5 and blobs have
    /// a signature, all else is taken for TOML. A grid is read whole and held against its checksums, on all threads or
    /// as many as [`Threads::install`](crate::Threads::install) gives.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, FieldError> {
        Ok(match field_file::open(path.as_ref())? {
            OpenField::Analytic(field) => Self::new(field),
            OpenField::Blob(blob) => Self::from_blob(blob),
            OpenField::Grid(reader) => Self::from_stored(reader.read()?),
        })
    }

    /// [`open`](Self::open) of the bytes of a file. Shapes in closed form must not name grids: there is no folder to look in.
    /// Errors show `name` in place of a path.
    pub fn from_bytes(bytes: &[u8], name: &str) -> Result<Self, FieldError> {
        Ok(match field_file::open_bytes(bytes, name)? {
            OpenField::Analytic(field) => Self::new(field),
            OpenField::Blob(blob) => Self::from_blob(blob),
            OpenField::Grid(reader) => Self::from_stored(reader.read()?),
        })
    }

    /// The grid of a blob. It has the samples and bounds of the one that was exported, and no other metadata.
    pub fn from_blob(StoredBlob { grid, padding, .. }: StoredBlob) -> Self {
        let info = GridInfo {
            sign_method: SignMethod::Given,
            sign_reason: "given: a blob does not say how".to_owned(),
            error_bound: grid.global_error_bound(),
            error_regions: None,
            padding,
            band: Some(grid.band()).filter(|band| band.is_finite()),
            source: Source::default(),
            tool: concat!("sdftool ", env!("CARGO_PKG_VERSION")).to_owned(),
            options: "export --format blob".to_owned(),
        };
        Self::from_grid(grid, info)
    }

    /// A grid that was read.
    pub fn from_stored(stored: StoredGrid) -> Self {
        let band = stored.sparse.map(|sparse| sparse.band);
        let field = Self::from_grid(stored.grid, info_from(stored.about, band));
        match stored.mesh {
            Some(StoredMesh { vertices, triangles, is_sign_continuous }) => {
                field.with_mesh(KeptMesh::new(vertices, triangles, is_sign_continuous))
            }
            None => field,
        }
    }

    /// Writes a baked grid as HDF5 (`.sdf.h5`), a closed form as TOML (`.sdf.toml`): whole, or not at all. [`open`](Self::open)
    /// reads the same field, bit for bit.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), SaveError> {
        self.save_packed(path, Compression::Deflate)
    }

    /// [`save`](Self::save) with another compression of a grid: without one, the file is larger, and written and read faster.
    pub fn save_packed(&self, path: impl AsRef<Path>, compression: Compression) -> Result<(), SaveError> {
        if self.grid().is_none() {
            return field_file::write(path.as_ref(), self.as_any()).map_err(SaveError::ClosedForm);
        }
        let (grid, info) = self.baked_grid()?;
        let about = about_from(grid, info);
        let mesh = self.stored_mesh();
        let coarse = coarse_samples(grid);
        let (path, lattice, samples) = (path.as_ref(), grid.lattice(), samples(grid, info, &coarse));
        let options = WriteOptions { mesh: mesh.as_ref(), compression };
        grid_file::write_with(path, lattice, samples, &about, options).map_err(SaveError::Grid)
    }

    /// The bytes that [`save`](Self::save) writes.
    pub fn to_bytes(&self) -> Result<Vec<u8>, SaveError> {
        self.to_packed_bytes(Compression::Deflate)
    }

    /// The bytes that [`save_packed`](Self::save_packed) writes.
    pub fn to_packed_bytes(&self, compression: Compression) -> Result<Vec<u8>, SaveError> {
        if self.grid().is_none() {
            let text = field_file::to_text(self.as_any(), "the field").map_err(SaveError::ClosedForm)?;
            return Ok(text.into_bytes());
        }
        let (grid, info) = self.baked_grid()?;
        let about = about_from(grid, info);
        let mesh = self.stored_mesh();
        let options = WriteOptions { mesh: mesh.as_ref(), compression };
        let coarse = coarse_samples(grid);
        grid_file::to_bytes_with(grid.lattice(), samples(grid, info, &coarse), &about, options)
            .map_err(SaveError::Fault)
    }

    fn stored_mesh(&self) -> Option<StoredMesh> {
        self.mesh().map(|mesh| StoredMesh {
            vertices: mesh.view().points.to_vec(),
            triangles: mesh.view().faces.to_vec(),
            is_sign_continuous: mesh.is_sign_continuous(),
        })
    }

    fn baked_grid(&self) -> Result<(&OwnedGrid, &GridInfo), SaveError> {
        let is_of_sparse = |grid: &OwnedGrid| grid.storage().layout() == Layout::Dense && grid.band().is_finite();
        match (self.as_any(), self.info()) {
            (AnyField::Grid(grid), Some(_)) if is_of_sparse(grid) => Err(SaveError::DenseWithBand),
            (AnyField::Grid(grid), Some(info)) => Ok((grid, info)),
            _ => Err(SaveError::NotABakedGrid),
        }
    }
}

/// Why a field cannot be saved.
#[derive(Debug)]
#[non_exhaustive]
pub enum SaveError {
    /// A grid that was neither baked nor read from a file has no [`GridInfo`], which its file would state.
    NotABakedGrid,
    /// The dense grid was sampled from a sparse one: beyond a band it has no distances, which only a blob can say.
    DenseWithBand,
    /// The closed form has no text, or the file could not be written.
    ClosedForm(FieldError),
    /// The file could not be written.
    Grid(GridFileError),
    /// The grid cannot be stored.
    Fault(GridFault),
}

impl std::fmt::Display for SaveError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotABakedGrid => {
                f.write_str("the grid has no GridInfo, so that it cannot be saved: make the field by Field::from_grid")
            }
            Self::DenseWithBand => f.write_str(
                "the grid was sampled from a sparse one and has distances only within a band, which its file cannot say: export it as a blob",
            ),
            Self::ClosedForm(error) => error.fmt(f),
            Self::Grid(error) => error.fmt(f),
            Self::Fault(fault) => fault.fmt(f),
        }
    }
}

impl std::error::Error for SaveError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::ClosedForm(error) => Some(error),
            Self::Grid(error) => Some(error),
            Self::Fault(fault) => Some(fault),
            Self::NotABakedGrid | Self::DenseWithBand => None,
        }
    }
}

/// Samples of the coarse grid, x fastest; none of a dense grid.
fn coarse_samples(grid: &OwnedGrid) -> Vec<f32> {
    match grid.storage() {
        OwnedStorage::Dense(_) | OwnedStorage::DenseU16(_) | OwnedStorage::DenseU8(_) => vec![],
        OwnedStorage::SparseF32(bricks) => bricks.bricks().coarse.to_vec(),
        OwnedStorage::SparseU16(bricks) => bricks.bricks().coarse.to_vec(),
        OwnedStorage::SparseU8(bricks) => bricks.bricks().coarse.to_vec(),
    }
}

/// `coarse`: see [`coarse_samples`].
fn samples<'a>(grid: &'a OwnedGrid, info: &GridInfo, coarse: &'a [f32]) -> Samples<'a> {
    fn sparse<'a, C>(
        bricks: &'a OwnedBricks<C>,
        coarse: &'a [f32],
        (band, deep_values): (f64, DeepValues),
    ) -> SparseSamples<'a, C> {
        let OwnedBricks { slots, scales, samples, bounds, errors, .. } = bricks;
        SparseSamples { band, deep_values, slots, scales, samples, bounds, errors, coarse }
    }
    fn blocks<C>(bricks: &OwnedBricks<C>) -> DenseBlockSamples<'_, C> {
        let OwnedBricks { slots, scales, samples, bounds, .. } = bricks;
        DenseBlockSamples { slots, scales, samples, bounds }
    }
    let band = (info.band.unwrap_or(0.0), DeepValues::of_grid(grid));
    match grid.storage() {
        OwnedStorage::Dense(dense) => Samples::Dense { distances: dense.storage().samples(), bounds: dense.bounds() },
        OwnedStorage::DenseU16(bricks) => Samples::DenseU16(blocks(bricks.bricks())),
        OwnedStorage::DenseU8(bricks) => Samples::DenseU8(blocks(bricks.bricks())),
        OwnedStorage::SparseF32(bricks) => sparse(bricks.bricks(), coarse, band).into(),
        OwnedStorage::SparseU16(bricks) => sparse(bricks.bricks(), coarse, band).into(),
        OwnedStorage::SparseU8(bricks) => sparse(bricks.bricks(), coarse, band).into(),
    }
}

pub(crate) fn info_from(about: About, band: Option<f64>) -> GridInfo {
    let About { sign_method, sign_reason, error_bound, error_regions, padding, source, tool, options, .. } = about;
    GridInfo {
        sign_method: match sign_method {
            grid_file::SignMethod::PseudoNormal => SignMethod::PseudoNormal,
            grid_file::SignMethod::Winding => SignMethod::Winding,
            grid_file::SignMethod::Given => SignMethod::Given,
        },
        sign_reason,
        error_bound,
        error_regions,
        padding,
        band,
        source: Source { name: source.name, sha256: source.sha256, triangles: source.triangles },
        tool,
        options,
    }
}

fn about_from(grid: &OwnedGrid, info: &GridInfo) -> About {
    About { inside_reaches_box: grid.inside_reaches_box(), ..about(info, sdf_core::Sdf::slope_bound(grid)) }
}

pub(crate) fn about(info: &GridInfo, slope_bound: f64) -> About {
    let GridInfo { sign_method, sign_reason, error_bound, error_regions, padding, source, tool, options, .. } =
        info.clone();
    About {
        sign_method: match sign_method {
            SignMethod::PseudoNormal => grid_file::SignMethod::PseudoNormal,
            SignMethod::Winding => grid_file::SignMethod::Winding,
            SignMethod::Given => grid_file::SignMethod::Given,
        },
        sign_reason,
        slope_bound,
        error_bound,
        inside_reaches_box: false,
        error_regions,
        padding,
        source: grid_file::Source { name: source.name, sha256: source.sha256, triangles: source.triangles },
        tool,
        options,
    }
}
