//! How does a field get into other programs? As a file of theirs: NanoVDB, plain arrays, VTKHDF, glTF. docs/exports.md says who reads
//! which.
//!
//! A sparse grid's bricks become NanoVDB leaves as they are, and a blob is the grid itself; the other formats hold a sample for every
//! node. Closed forms are sampled first.

mod error;

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use sdf_bake::{DenseGrid, lattice_around};
use sdf_core::grid::Lattice;
use sdf_core::grid::owned::{OwnedGrid, Precision};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, Interval, Sdf};
pub use sdf_formats::export::ExportFormat;
use sdf_formats::export::{self, RawFacts};
use sdf_formats::{atomic_write, atomic_write_both, blob_file};

pub use error::ExportError;

use crate::bake::inside::has_inside;
use crate::reach::{Boxes, Reach};
use crate::requantize::{Requantized, requantize};
use crate::{Field, SurfaceMesh, Threads, memory};

/// How a field is exported.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExportOptions {
    /// Cells along the longest side of what is sampled; `None` stands for the grid's own nodes, and for 128 of a closed form.
    pub cells: Option<u32>,
    /// Half width of a NanoVDB level set's band, in cells; `None` stands for the band of a sparse grid, and for 4 of others. Never
    /// more than the band of a sparse grid, also where that is sampled again, moved or part of a combination.
    pub band: Option<u32>,
    /// The name of a NanoVDB grid or of a table; `distance` where it is empty.
    pub name: String,
    /// Type of the samples of a blob or table; `None` stands for the grid's own. Rounding widens the certified bounds.
    pub precision: Option<Precision>,
    /// How many threads work.
    pub threads: Threads,
}

/// A file of another program.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// The bytes of the file.
    pub bytes: Vec<u8>,
    /// The lattice of its samples, or on which its surface was extracted.
    pub lattice: Lattice,
    /// Half width of a NanoVDB level set's band; `None` of other formats.
    pub band: Option<f64>,
    /// The field was sampled, and no sample is inside: the shape is thinner than the cells, and the samples have no surface.
    pub has_lost_surface: bool,
    /// Facts for the file that describes a raw one.
    facts: Option<RawFacts>,
}

impl Exported {
    fn new(bytes: Vec<u8>, lattice: Lattice) -> Self {
        Self { bytes, lattice, band: None, has_lost_surface: false, facts: None }
    }

    /// The text of the JSON file that describes a raw file of this name; `None` of other formats, which describe themselves.
    pub fn description(&self, name: &str) -> Option<String> {
        self.facts.as_ref().map(|facts| export::raw_description(name, &self.lattice, facts))
    }
}

/// Files that were written.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// See [`Exported::lattice`].
    pub lattice: Lattice,
    /// See [`Exported::band`].
    pub band: Option<f64>,
    /// See [`Exported::has_lost_surface`].
    pub has_lost_surface: bool,
    /// The file, then its description if it has one.
    pub files: Vec<PathBuf>,
}

/// Cells along the longest side of a closed form.
const DEFAULT_CELLS: u32 = 128;

/// Cells around the box of a closed form, and half width of a band that nobody chose.
const PADDING: u32 = 4;

/// Rows of nodes that a thread samples at a time.
const ROWS: usize = 64;

impl Field {
    /// The bytes of a file of another program.
    pub fn export(&self, format: ExportFormat, options: &ExportOptions) -> Result<Exported, ExportError> {
        options.threads.install(|| self.exported(format, options))
    }

    /// Writes [`export`](Self::export) to a file, whole or not at all, and the description of a raw file beside it, as
    /// `NAME.json`.
    pub fn export_to(
        &self,
        path: impl AsRef<Path>,
        format: ExportFormat,
        options: &ExportOptions,
    ) -> Result<Written, ExportError> {
        let path = path.as_ref();
        let exported = self.export(format, options)?;
        let mut files = vec![path.to_owned()];
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        match exported.description(&name) {
            Some(text) => {
                let beside = description_path(path);
                write_described(path, &exported.bytes, &beside, text.as_bytes())?;
                files.push(beside);
            }
            None => write(path, &exported.bytes)?,
        }
        let Exported { lattice, band, has_lost_surface, .. } = exported;
        Ok(Written { lattice, band, has_lost_surface, files })
    }

    /// The grid itself, or samples of the field on a lattice of so many cells.
    pub(crate) fn sampled(&self, cells: Option<u32>) -> Result<Cow<'_, OwnedGrid>, ExportError> {
        match (self.grid(), cells) {
            (Some(grid), None) => Ok(Cow::Borrowed(grid)),
            _ => self.sample_on(self.lattice(cells)?).map(Cow::Owned),
        }
    }

    /// The grid's own lattice, or one of so many cells around the field.
    fn lattice(&self, cells: Option<u32>) -> Result<Lattice, ExportError> {
        let (bounds, padding) = match (self.grid(), cells) {
            (Some(grid), None) => return Ok(*grid.lattice()),
            (Some(grid), Some(_)) => (grid.lattice().bounds(), 0),
            (None, _) => (self.bounds(0.0), PADDING),
        };
        if !bounds.extents().iter().all(|extent| extent.is_finite()) {
            return Err(ExportError::Unbounded);
        }
        let spacing = bounds.longest_side() / f64::from(cells.unwrap_or(DEFAULT_CELLS));
        lattice_around(&bounds, spacing, padding).ok_or(ExportError::NoLattice)
    }

    fn sample_on(&self, lattice: Lattice) -> Result<OwnedGrid, ExportError> {
        require_single(&lattice, lattice.bounds().longest_side())?;
        // A sample, and the bounds of a block for 512 of them.
        require(&lattice, 4.1)?;
        let [nx, ny, _] = lattice.nodes();
        let mut samples = vec![0.0; lattice.node_count()];
        sdf_parallel::for_each(
            samples.chunks_mut(ROWS * nx as usize).enumerate().collect(),
            |(chunk, samples): (usize, &mut [f32])| {
                for (row, samples) in samples.chunks_mut(nx as usize).enumerate() {
                    let row = (chunk * ROWS + row) as u32;
                    let [y, z] = [row % ny, row / ny];
                    let value = |x: u32| self.as_any().value(Vector3::from(lattice.node([x, y, z]))) as f32;
                    (0..nx).zip(samples).for_each(|(x, sample)| *sample = value(x));
                }
            },
        );
        let dense = DenseGrid::from_samples(&lattice, samples).ok_or(ExportError::NotFinite)?;
        // Beyond the band of what was sampled, samples are no distances either.
        Ok(dense.into_grid(&lattice).grid.with_band(self.known_band()?))
    }

    /// Half width of the band of levels at which φ is the distance, but for what lies outside of the boxes of grids; infinite without a
    /// sparse one.
    fn known_band(&self) -> Result<f64, ExportError> {
        let Interval { lower, upper } = Reach::of(self.as_any(), Boxes::None).known();
        Some(upper.min(-lower)).filter(|band| *band > 0.0).ok_or(ExportError::BeyondBand)
    }

    fn exported(&self, format: ExportFormat, options: &ExportOptions) -> Result<Exported, ExportError> {
        match (options.cells, options.band) {
            (Some(0), _) => return Err(ExportError::NoCells("cells 0")),
            (_, Some(0)) => return Err(ExportError::NoCells("band 0")),
            _ => {}
        }
        self.known_band()?;
        if !self.knows_surface() {
            return Err(ExportError::BeyondBand);
        }
        if format == ExportFormat::Glb {
            let lattice = self.lattice(options.cells)?;
            let Aabb { min, max } = lattice.bounds();
            require_single(&lattice, min.iter().chain(&max).fold(0.0, |farthest: f64, x| farthest.max(x.abs())))?;
            return Ok(Exported::new(self.glb(&lattice)?, lattice));
        }
        let grid = self.sampled(options.cells)?;
        let lattice = *grid.lattice();
        let is_sampled = self.grid().is_none() || options.cells.is_some();
        // An open mesh has no inside to lose.
        let has_lost_surface = is_sampled && !has_inside(&grid) && self.grid().is_none_or(|own| has_inside(own));
        let name = if options.name.is_empty() { "distance" } else { &options.name };
        let stored = grid.storage().brick_count().map_or(lattice.node_count() as f64, |bricks| 512.0 * bricks as f64);
        if let ExportFormat::Blob | ExportFormat::C | ExportFormat::Rust = format {
            // Samples of another type, and those in the blob.
            require_bytes(&lattice, 8.0 * stored)?;
            let blob = self.blob(&grid, options).ok_or(ExportError::NotABlob)?;
            if format != ExportFormat::Blob {
                require_bytes(&lattice, 4.1 * blob.len() as f64)?;
            }
            let about = about_blob(&grid, &blob, options);
            let bytes = match format {
                ExportFormat::C => export::c_table(&blob, name, &about).into_bytes(),
                ExportFormat::Rust => export::rust_table(&blob, name, &about).into_bytes(),
                _ => blob,
            };
            return Ok(Exported { has_lost_surface, ..Exported::new(bytes, lattice) });
        }
        if format == ExportFormat::Nvdb {
            // Leaves of a sparse grid; of a dense one few of its bricks become leaves.
            if grid.storage().brick_count().is_some() {
                require_bytes(&lattice, 4.5 * stored)?;
            }
            let cells = options.band.map_or(f64::from(PADDING), f64::from);
            // Outside of a grid's own box, where a moved lattice or a rounded number of cells reaches, values are no distances.
            let is_within = self.grid().is_some_and(|own| own.lattice().bounds().encloses(&lattice.bounds()));
            let known = if is_within { f64::INFINITY } else { self.known_levels().upper };
            let wanted = (cells * lattice.spacing()).min(known);
            if wanted <= 0.0 {
                return Err(ExportError::BeyondBand);
            }
            let own = if options.band.is_none() && grid.band().is_finite() { known } else { wanted };
            let band = own.min(grid.band());
            let bytes = export::nvdb(&grid, name, band).ok_or(ExportError::NoSurface { nodes: lattice.nodes() })?;
            return Ok(Exported { band: Some(band), has_lost_surface, ..Exported::new(bytes, lattice) });
        }
        // Decoded samples, and the bytes of the file.
        require(&lattice, 8.0)?;
        let samples = export::dense_samples(&grid);
        let bytes = match format {
            ExportFormat::Npy => export::npy(&lattice, &samples),
            ExportFormat::Nrrd => export::nrrd(&lattice, &samples),
            ExportFormat::VtkHdf => export::vtkhdf(&lattice, &samples),
            _ => export::raw(&samples),
        };
        let facts = (format == ExportFormat::Raw).then(|| self.facts(&grid, options));
        Ok(Exported { has_lost_surface, facts, ..Exported::new(bytes, lattice) })
    }

    /// The bytes of a blob of the grid. Its padding is that of the baked grid, else as far as margins see distances.
    fn blob(&self, grid: &OwnedGrid, options: &ExportOptions) -> Option<Vec<u8>> {
        let baked = self.info().filter(|_| options.cells.is_none());
        let padding = baked
            .map_or_else(|| grid.lowest_boundary_sample().min(self.known_levels().upper).max(0.0), |info| info.padding);
        let own = grid.storage().precision();
        match requantize(grid, options.precision.unwrap_or(own)) {
            None => blob_file::write(grid, None, padding),
            Some(Requantized { grid, codes }) => blob_file::write(&grid, codes.as_ref(), padding),
        }
    }

    fn facts(&self, grid: &OwnedGrid, options: &ExportOptions) -> RawFacts {
        let info = self.info().filter(|_| options.cells.is_none());
        RawFacts {
            error_bound: info.map(|info| info.error_bound).filter(|bound| bound.is_finite()),
            slope_bound: grid.slope_bound(),
            band: Some(grid.band()).filter(|band| band.is_finite()),
            source: self.info().map(|info| info.source.name.clone()).filter(|name| !name.is_empty()),
        }
    }

    fn glb(&self, lattice: &Lattice) -> Result<Vec<u8>, ExportError> {
        require_bytes(lattice, SurfaceMesh::estimated_bytes(lattice.cells().map(f64::from)))?;
        let SurfaceMesh { points, triangles } = self.surface(0.0, lattice, Threads::ALL);
        if triangles.is_empty() {
            return Err(ExportError::NoSurface { nodes: lattice.nodes() });
        }
        let normal = |sample: &sdf_core::Sample<f64>| -> [f64; 3] {
            // glTF wants unit normals, also where there is none.
            sample.gradient.try_normalize(0.0).unwrap_or(Vector3::z()).into()
        };
        let normals: Vec<_> = self.sample(&points, Threads::ALL).iter().map(normal).collect();
        Ok(export::glb(&points, &normals, &triangles))
    }
}

/// Why a surface is not shown; see [`Field::knows_surface`].
pub(crate) const BEYOND_GRIDS: &str = "its surface lies beyond the band or the box in which a grid of this combination has distances: bake it with a larger padding, and dense or with a wider band";

/// One line that says what a table holds.
fn about_blob(grid: &OwnedGrid, blob: &[u8], options: &ExportOptions) -> String {
    let [x, y, z] = grid.lattice().nodes();
    let (layout, own) = (grid.storage().layout().name(), grid.storage().precision());
    let precision = options.precision.unwrap_or(own).name();
    format!(
        "A signed distance field: {x} x {y} x {z} nodes, {layout}, {precision}, {} bytes with their checksum.",
        blob.len()
    )
}

/// The path of the file that describes a raw one: its name with `.json` behind it.
pub fn description_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".json");
    name.into()
}

/// Writes a file and the one beside it that describes it: both or neither.
fn write_described(path: &Path, bytes: &[u8], beside: &Path, text: &[u8]) -> Result<(), ExportError> {
    let written = atomic_write_both([(path, bytes), (beside, text)]);
    written.map_err(|(index, error)| ExportError::Unwritable([path, beside][index].to_owned(), error))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    let written = atomic_write(path, |temporary| std::fs::write(temporary, bytes));
    written.map_err(|error| ExportError::Unwritable(path.to_owned(), error))
}

/// Smallest voxel of a field whose distances become f32: a ten-millionth of it is still a normal number.
const MIN_VOXEL: f64 = f32::MIN_POSITIVE as f64 / f32::EPSILON as f64;

/// Refuses a lattice whose distances f32 does not hold, or whose `largest` number it does not.
fn require_single(lattice: &Lattice, largest: f64) -> Result<(), ExportError> {
    match lattice.spacing() {
        _ if largest > f64::from(f32::MAX) => Err(ExportError::OutsideSingle { size: largest }),
        voxel if voxel < MIN_VOXEL => Err(ExportError::OutsideSingle { size: voxel }),
        _ => Ok(()),
    }
}

fn require(lattice: &Lattice, bytes_per_node: f64) -> Result<(), ExportError> {
    require_bytes(lattice, bytes_per_node * lattice.node_count() as f64)
}

fn require_bytes(lattice: &Lattice, bytes: f64) -> Result<(), ExportError> {
    let free = memory::free_bytes().unwrap_or(memory::ASSUMED_BYTES);
    if bytes > free { Err(ExportError::TooLarge { nodes: lattice.nodes(), bytes, free }) } else { Ok(()) }
}
