//! Bakes into files whose samples need not be in memory: a part of the bricks, all of them one after the other, or parts joined.
//!
//! One path of code serves all three. A part file has the bricks of a stretch of the Hilbert curve as they come, and what is known of
//! all slots ([`sdf_formats::grid_file::part`]). Joining reads all tables, bounds the bricks a few thousand at a time, with their
//! neighbours' samples, and copies the samples chunk by chunk. A streamed bake is a bake of one part beside the target, joined at once.

use std::io;
use std::path::{Path, PathBuf};

use sdf_bake::sparse::{
    BakedPart, BrickColumns, BrickSamples, BrickShard, CoarseMap, Quantize, STREAMED_SLOTS, SparseBaker, SparseGrid,
    UnboundedGrid,
};
use sdf_bake::{MeshDistance, MeshReport, Topology, TriangleMesh};
use sdf_core::grid::Lattice;
use sdf_core::grid::owned::{Layout, Precision};
use sdf_formats::atomic_write;
use sdf_formats::grid_file::part::{self, Codes, JoinedParts, PartInfo, PartTables};
use sdf_formats::grid_file::{
    About, Compression, DeepValues, GridFault, GridFileError, Samples, SparseSamples, StoredMesh,
};

use super::{BakeError, BakeOptions, Baked, Memory, Progress, TOOL, bake_bricks, bake_grid, finished, grid_info};
use super::{solid_mesh, sparse_baker};
use crate::file::{about, info_from};
use crate::info::{GridInfo, SignMethod};
use crate::{Field, MeshView};

/// Where a bake goes if its samples do not fit into memory.
#[derive(Clone, Copy, Debug)]
pub struct BakeTarget<'a> {
    /// The file.
    pub path: &'a Path,
    /// Packing of its chunks.
    pub compression: Compression,
    /// Memory that the bake may take, in bytes; in any case no more than is free.
    pub max_bytes: Option<u64>,
}

/// A part of the bricks of a sparse grid: the `index`-th of `count` parts, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridShard {
    /// Less than the count.
    pub index: u32,
    /// Number of parts.
    pub count: u32,
}

/// A bake in memory or in its file.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "a program has one or two")]
pub enum BakeOutcome {
    /// In memory; the target is not written.
    InMemory(Baked),
    /// In the target, which is written.
    OnDisk(BakedFile),
}

/// A grid in a file, or a part of one, and what was found out about the mesh.
#[derive(Clone, Debug)]
pub struct BakedFile {
    /// The grid; of a part with bounds of zero, and with the part's bricks, some of which may be left out of the grid.
    pub grid: GridOnDisk,
    /// Oddities of the input.
    pub mesh: MeshReport,
    /// Holes, shells, and worse.
    pub topology: Topology,
}

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
    /// Is the error bound proven? Not where the sign may change away from triangles, as at the holes of an open mesh.
    pub is_proven: bool,
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

impl std::error::Error for BakeFileError {}

impl From<BakeError> for BakeFileError {
    fn from(error: BakeError) -> Self {
        Self::Bake(error)
    }
}

impl Field {
    /// Bakes a mesh, in memory if that is enough. A sparse grid whose samples take more is streamed: its bricks go to a temporary file
    /// beside the target as they come, and from there into the target, which has the bytes that [`Field::save_packed`] would write.
    pub fn bake_or_stream(
        mesh: MeshView,
        options: &BakeOptions,
        target: BakeTarget,
        on_progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<BakeOutcome, BakeFileError> {
        options.threads.install(|| {
            let mesh = solid_mesh(mesh, options)?;
            let distance = MeshDistance::new(&mesh, options.sign.and_then(SignMethod::for_mesh));
            let memory = Memory { limit: target.max_bytes };
            let grid = match (options.size.spacing(&mesh.bounds()), options.layout) {
                (Ok(spacing), Layout::Sparse) => {
                    let baker = sparse_baker(&distance, options, spacing, memory)?;
                    let precision = options.precision.unwrap_or(Precision::U16);
                    if baker.max_bytes_as(precision) as f64 > memory.bytes() {
                        memory.require_streamed(&baker, precision)?;
                        let grid = stream(&mesh, &distance, baker, options, target, on_progress)?;
                        let (mesh, topology) = (mesh.report(), *distance.topology());
                        return Ok(BakeOutcome::OnDisk(BakedFile { grid, mesh, topology }));
                    }
                    bake_bricks(&baker, options, memory, on_progress)?
                }
                _ => bake_grid(&distance, options, memory, on_progress)?,
            };
            Ok(BakeOutcome::InMemory(finished(&mesh, &distance, options, grid)))
        })
    }

    /// Bakes a part of a sparse grid's bricks into a file, which is for [`merge_parts`] alone.
    pub fn bake_part(
        mesh: MeshView,
        options: &BakeOptions,
        target: BakeTarget,
        shard: GridShard,
        on_progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<BakedFile, BakeFileError> {
        options.threads.install(|| {
            let mesh = solid_mesh(mesh, options)?;
            let distance = MeshDistance::new(&mesh, options.sign.and_then(SignMethod::for_mesh));
            let memory = Memory { limit: target.max_bytes };
            let (Ok(spacing), Layout::Sparse) = (options.size.spacing(&mesh.bounds()), options.layout) else {
                return Err(BakeFileError::NotInParts);
            };
            let baker = sparse_baker(&distance, options, spacing, memory)?;
            memory.require_streamed(&baker, options.precision.unwrap_or(Precision::U16))?;
            let part = Part { mesh: &mesh, distance: &distance, options, compression: target.compression, shard };
            let written = atomic_write(target.path, |temporary| part.write(&baker, temporary, on_progress));
            let grid = written.map_err(|failure: Failure| failure.at(target.path))?;
            Ok(BakedFile { grid, mesh: mesh.report(), topology: *distance.topology() })
        })
    }
}

impl Memory {
    fn require_streamed(self, baker: &SparseBaker, precision: Precision) -> Result<(), BakeError> {
        let bytes = baker.max_streamed_bytes_as(precision) as f64;
        self.require(baker.lattice().nodes().map(f64::from), Some(baker), bytes)
    }
}

/// Joins the parts of one bake, in any order, into a grid file: the bytes of a bake at once. Holds the samples of a few thousand bricks.
pub fn merge_parts(parts: &[PathBuf], output: &Path) -> Result<GridOnDisk, BakeFileError> {
    let joined = JoinedParts::open(parts).map_err(BakeFileError::File)?;
    let tool = &joined.info().about.tool;
    if tool != TOOL {
        let fault = GridFault::DoesNotJoin(format!("was baked by {tool}, and this is {TOOL}: merge with the former"));
        return Err(BakeFileError::File(GridFileError { path: parts[0].clone(), fault }));
    }
    let written = atomic_write(output, |temporary| join(joined, temporary));
    written.map_err(|failure: Failure| failure.at(output))
}

/// Bakes all bricks into a part beside the target's temporary file, and joins it.
fn stream(
    mesh: &TriangleMesh,
    distance: &MeshDistance,
    baker: SparseBaker,
    options: &BakeOptions,
    target: BakeTarget,
    on_progress: &(dyn Fn(Progress) + Sync),
) -> Result<GridOnDisk, BakeFileError> {
    let shard = GridShard { index: 0, count: 1 };
    let part = Part { mesh, distance, options, compression: target.compression, shard };
    let write = |temporary: &Path| {
        // In the folder that is removed with the temporary file.
        let path = temporary.with_file_name("part");
        part.write(&baker, &path, on_progress)?;
        drop(baker);
        join(JoinedParts::open(&[path])?, temporary)
    };
    atomic_write(target.path, write).map_err(|failure: Failure| failure.at(target.path))
}

/// Why a file was not written.
enum Failure {
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
    fn at(self, path: &Path) -> BakeFileError {
        BakeFileError::File(match self {
            Self::Fault(fault) => GridFileError { path: path.to_owned(), fault },
            Self::File(error) => error,
        })
    }
}

/// A part that is to be baked.
struct Part<'a> {
    mesh: &'a TriangleMesh,
    distance: &'a MeshDistance<'a>,
    options: &'a BakeOptions,
    compression: Compression,
    shard: GridShard,
}

impl Part<'_> {
    fn write(
        &self,
        baker: &SparseBaker,
        path: &Path,
        on_progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<GridOnDisk, Failure> {
        let Self { mesh, distance, options, compression, shard: GridShard { index, count } } = *self;
        let (lattice, band, is_sign_continuous) = (*baker.lattice(), baker.band(), baker.is_continuous());
        let precision = options.precision.unwrap_or(Precision::U16);
        let info = grid_info(mesh, distance, options, &lattice.bounds(), 0.0, Some(band));
        let about = about(&info, 0.0);
        let part_info = PartInfo { index, count, lattice, band, precision, about, compression, is_sign_continuous };
        let kept = options.keep_mesh.then(|| {
            let (vertices, triangles) = mesh.packed();
            StoredMesh { vertices, triangles, is_sign_continuous }
        });
        on_progress(Progress::Total(baker.slot_count() as u64));
        let on_done = |slots: usize| on_progress(Progress::Done(slots as u64));
        let shard = BrickShard { index, count };
        let mut slots = vec![];
        part::write(path, &part_info, kept.as_ref(), |take| {
            let tables = match precision {
                Precision::F32 => tables::<f32>(baker, shard, take, &on_done)?,
                Precision::U16 => tables::<u16>(baker, shard, take, &on_done)?,
                Precision::U8 => tables::<u8>(baker, shard, take, &on_done)?,
            };
            slots.clone_from(&tables.slots);
            Ok::<_, Failure>(tables)
        })?;
        let (errors, is_proven) = (vec![], is_sign_continuous);
        Ok(GridOnDisk { lattice, info, precision, slope_bound: 0.0, slots, errors, is_proven })
    }
}

/// Bakes bricks; `take` receives their samples.
fn tables<C: Quantize>(
    baker: &SparseBaker,
    shard: BrickShard,
    take: &mut dyn FnMut(Codes) -> io::Result<()>,
    on_slots_done: &(dyn Fn(usize) + Sync),
) -> Result<PartTables, Failure>
where
    Codes: From<Vec<C>>,
{
    let mut take = |samples: Vec<C>| take(samples.into());
    let BakedPart { near: mut bricks, closing, coarse } =
        baker.bake_part::<C, io::Error>(shard, STREAMED_SLOTS, &mut take, on_slots_done)?;
    let near = bricks.slots.len();
    bricks.append(closing);
    let BrickColumns { slots, scales, roundings, interpolations } = bricks;
    let (magnitudes, slot_sides, node_sides) = coarse.into_parts();
    let node_sides = node_sides.unwrap_or_default();
    Ok(PartTables { near, slots, scales, roundings, interpolations, magnitudes, slot_sides, node_sides })
}

/// Writes the grid of all parts.
fn join(parts: JoinedParts, path: &Path) -> Result<GridOnDisk, Failure> {
    match parts.info().precision {
        Precision::F32 => join_as::<f32>(parts, path),
        Precision::U16 => join_as::<u16>(parts, path),
        Precision::U8 => join_as::<u8>(parts, path),
    }
}

fn join_as<C: Quantize>(mut parts: JoinedParts, path: &Path) -> Result<GridOnDisk, Failure>
where
    for<'a> SamplesOfParts<'a>: BrickSamples<C, Error = GridFileError>,
    for<'a> Samples<'a>: From<SparseSamples<'a, C>>,
{
    let PartInfo { lattice, band, precision, is_sign_continuous, about, .. } = parts.info().clone();
    let baked = baked_part(&lattice, parts.take_tables())?;
    let unbounded = UnboundedGrid::new(&lattice, band, is_sign_continuous, baked);
    if let Some(slot) = unbounded.missing() {
        return Err(
            GridFault::DoesNotJoin(format!("its parts lack the brick of slot {slot:?}: bake them again")).into()
        );
    }
    let (grid, sources) = unbounded.bounded(&SamplesOfParts(&parts))?;
    let SparseGrid { table, slots, scales, bounds, errors, coarse, slope_bound, error_bound, .. } = grid;
    drop(table);
    let about = About { slope_bound, error_bound, ..about };
    let mesh = parts.mesh()?;
    let deep_values = DeepValues::Distances;
    let samples = SparseSamples::<C> {
        band,
        deep_values,
        slots: &slots,
        scales: &scales,
        samples: &[],
        bounds: &bounds,
        errors: &errors,
        coarse: &coarse,
    };
    part::write_joined(path, &parts, samples, &|brick| sources.place(brick), &about, mesh.as_ref())?;
    let info = info_from(about, Some(band));
    Ok(GridOnDisk { lattice, info, precision, slope_bound, slots, errors, is_proven: is_sign_continuous })
}

fn baked_part(lattice: &Lattice, tables: PartTables) -> Result<BakedPart, GridFault> {
    let PartTables { near, mut slots, mut scales, mut roundings, mut interpolations, .. } = tables;
    let closing = BrickColumns {
        slots: slots.split_off(near),
        scales: scales.split_off(near),
        roundings: roundings.split_off(near),
        interpolations: interpolations.split_off(near),
    };
    let near = BrickColumns { slots, scales, roundings, interpolations };
    let node_sides = Some(tables.node_sides).filter(|sides| !sides.is_empty());
    let coarse = CoarseMap::new(lattice, tables.magnitudes, tables.slot_sides, node_sides);
    let coarse =
        coarse.ok_or_else(|| GridFault::Damaged("the parts' shares of the coarse grid do not add up".to_owned()))?;
    Ok(BakedPart { near, closing, coarse })
}

/// The samples of joined parts.
struct SamplesOfParts<'a>(&'a JoinedParts);

macro_rules! brick_samples {
    ($code:ty, $precision:ident) => {
        impl BrickSamples<$code> for SamplesOfParts<'_> {
            type Error = GridFileError;
            fn read(&self, bricks: &[u32]) -> Result<Vec<$code>, GridFileError> {
                match self.0.codes(bricks)? {
                    Codes::$precision(codes) => Ok(codes),
                    _ => unreachable!("parts have the precision that they state"),
                }
            }
        }
    };
}

brick_samples!(f32, F32);
brick_samples!(u16, U16);
brick_samples!(u8, U8);
