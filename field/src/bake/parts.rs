//! Bakes into files whose samples need not be in memory: a part of the bricks, all of them one after the other, or parts joined.
//!
//! One path of code serves all three. A part file has the bricks of a stretch of the Hilbert curve as they come, and what is known of
//! all slots ([`sdf_formats::grid_file::part`]). Joining ([`join`]) reads all tables, bounds the bricks some thousands at a time, with
//! their neighbours' samples, and copies the samples chunk by chunk. A streamed bake is a bake of one part beside the target, joined at
//! once.

use std::io;
use std::path::Path;
use std::time::Instant;

use sdf_bake::sparse::{BakedPart, BrickColumns, BrickShard, Quantize, SlotSides, SparseBaker};
use sdf_bake::{MeshDistance, MeshReport, Topology, TriangleMesh};
use sdf_core::grid::owned::{Layout, Precision};
use sdf_core::grid::sparse::BRICK_SAMPLES;
use sdf_formats::atomic_write;
use sdf_formats::grid_file::part::{self, Codes, JoinedParts, PartInfo, PartTables, Sides};
use sdf_formats::grid_file::{Compression, StoredMesh};

use super::join::join;
use super::on_disk::{BRICKS_AT_A_TIME, BakeFileError, Failure, GridOnDisk};
use super::sparse_baker;
use super::{
    BakeError, BakeOptions, Baked, CheckedMesh, Memory, Progress, bake_bricks, bake_grid, finished, grid_info,
};
use crate::Field;
use crate::file::about;
use crate::info::SignMethod;

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

impl BakeTarget<'_> {
    fn memory(&self) -> Memory {
        Memory { limit: self.max_bytes }
    }
}

/// A bake in memory or in its file.
#[derive(Clone, Debug)]
pub enum BakeOutcome {
    /// In memory; the target is not written.
    InMemory(Box<Baked>),
    /// In the target, which is written.
    OnDisk(Box<BakedFile>),
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
    /// When all bricks were measured, and those of a whole grid bounded. What came after was packing and writing them.
    pub baked: Instant,
    /// Is there room in memory for the whole grid, too?
    pub fits: bool,
}

impl Field {
    /// Bakes a mesh in memory if the grid is small, dense, or of [`GridSize::MaxError`](super::GridSize::MaxError). Any other sparse grid
    /// is streamed: its bricks go to a temporary file beside the target as they come, and from there into the target, which has the bytes
    /// that [`Field::save_packed`] would write.
    pub fn bake_or_stream(
        mesh: CheckedMesh,
        options: &BakeOptions,
        target: BakeTarget,
        on_progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<BakeOutcome, BakeFileError> {
        options.threads.install(|| {
            let mesh = mesh.solid(options);
            let distance = MeshDistance::new(&mesh, options.sign.and_then(SignMethod::for_mesh));
            let memory = target.memory();
            let grid = match (options.size.spacing(&mesh.bounds()), options.layout) {
                (Ok(spacing), Layout::Sparse) => {
                    let baker = sparse_baker(&distance, options, spacing, memory)?;
                    let precision = options.precision.unwrap_or(Precision::U16);
                    let bytes = baker.max_bytes_as(precision) as f64;
                    let fits = bytes <= memory.bytes();
                    // The triangles take the same memory either way.
                    if !fits || bytes - baker.triangle_bytes() as f64 > STREAMED_BYTES {
                        memory.require_streamed(&baker, precision)?;
                        let (grid, baked) = stream(&mesh, &distance, baker, options, target, on_progress)?;
                        let (mesh, topology) = (mesh.report(), *distance.topology());
                        let file = BakedFile { grid, mesh, topology, baked, fits };
                        return Ok(BakeOutcome::OnDisk(Box::new(file)));
                    }
                    bake_bricks(&baker, options, memory, on_progress)?
                }
                _ => bake_grid(&distance, options, memory, on_progress)?,
            };
            Ok(BakeOutcome::InMemory(Box::new(finished(&mesh, &distance, options, grid))))
        })
    }

    /// Bakes a part of a sparse grid's bricks into a file, which is for [`merge_parts`](super::merge_parts) alone.
    pub fn bake_part(
        mesh: CheckedMesh,
        options: &BakeOptions,
        target: BakeTarget,
        shard: BrickShard,
        on_progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<BakedFile, BakeFileError> {
        options.threads.install(|| {
            let mesh = mesh.solid(options);
            let distance = MeshDistance::new(&mesh, options.sign.and_then(SignMethod::for_mesh));
            let memory = target.memory();
            let (Ok(spacing), Layout::Sparse) = (options.size.spacing(&mesh.bounds()), options.layout) else {
                return Err(BakeFileError::NotInParts);
            };
            let baker = sparse_baker(&distance, options, spacing, memory)?;
            let precision = options.precision.unwrap_or(Precision::U16);
            memory.require_streamed(&baker, precision)?;
            let fits = baker.max_bytes_as(precision) as f64 <= memory.bytes();
            let part = Part { mesh: &mesh, distance: &distance, options, target, shard };
            let written = atomic_write(target.path, |temporary| part.write(baker, temporary, on_progress));
            let grid = written.map_err(|failure: Failure| failure.at(target.path))?;
            let (mesh, topology, baked) = (mesh.report(), *distance.topology(), Instant::now());
            Ok(BakedFile { grid, mesh, topology, baked, fits })
        })
    }
}

/// A grid that takes more memory, without that of the mesh's triangles, is streamed though it would fit.
const STREAMED_BYTES: f64 = 8e6;

/// So many where there is little memory: with fewer, threads wait for each other and neighbours are read again and again.
const MIN_BRICKS_AT_A_TIME: usize = 256;

impl Memory {
    /// Bricks whose samples are in memory at a time: in a 32nd of the limit.
    fn bricks_at_a_time(self) -> usize {
        let bytes = self.limit.unwrap_or(u64::MAX) / 32;
        ((bytes / (BRICK_SAMPLES * size_of::<f32>()) as u64) as usize).clamp(MIN_BRICKS_AT_A_TIME, BRICKS_AT_A_TIME)
    }

    fn require_streamed(self, baker: &SparseBaker, precision: Precision) -> Result<(), BakeError> {
        let bytes = baker.max_streamed_bytes_as(precision, self.bricks_at_a_time()) as f64;
        self.require(Layout::Sparse, baker.lattice().nodes().map(f64::from), Some(baker), bytes)
    }
}

/// Bakes all bricks into a part beside the target's temporary file, and joins it. Returns when they were bounded, too.
fn stream(
    mesh: &TriangleMesh,
    distance: &MeshDistance,
    baker: SparseBaker,
    options: &BakeOptions,
    target: BakeTarget,
    on_progress: &(dyn Fn(Progress) + Sync),
) -> Result<(GridOnDisk, Instant), BakeFileError> {
    let shard = BrickShard::WHOLE;
    let part = Part { mesh, distance, options, target, shard };
    let write = |temporary: &Path| {
        // In the folder that is removed with the temporary file.
        let path = temporary.with_file_name("part");
        part.write(baker, &path, on_progress)?;
        let mut baked = Instant::now();
        let on_bounded = || baked = Instant::now();
        let at_a_time = target.memory().bricks_at_a_time();
        let grid = join(JoinedParts::open(&[path])?, temporary, at_a_time, Some(distance), on_bounded)?;
        Ok((grid, baked))
    };
    atomic_write(target.path, write).map_err(|failure: Failure| failure.at(target.path))
}

/// A part that is to be baked.
struct Part<'a> {
    mesh: &'a TriangleMesh,
    distance: &'a MeshDistance<'a>,
    options: &'a BakeOptions,
    target: BakeTarget<'a>,
    shard: BrickShard,
}

impl Part<'_> {
    fn write(
        &self,
        baker: SparseBaker,
        path: &Path,
        on_progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<GridOnDisk, Failure> {
        let Self { mesh, distance, options, target, shard } = *self;
        let BrickShard { index, count } = shard;
        let (compression, at_a_time) = (target.compression, target.memory().bricks_at_a_time());
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
        let mut slots = vec![];
        part::write(path, &part_info, kept.as_ref(), |take| {
            let tables = match precision {
                Precision::F32 => tables::<f32>(baker, shard, at_a_time, take, &on_done)?,
                Precision::U16 => tables::<u16>(baker, shard, at_a_time, take, &on_done)?,
                Precision::U8 => tables::<u8>(baker, shard, at_a_time, take, &on_done)?,
            };
            slots.clone_from(&tables.slots);
            Ok::<_, Failure>(tables)
        })?;
        let (errors, has_inside) = (vec![], true);
        Ok(GridOnDisk { lattice, info, precision, slope_bound: 0.0, slots, errors, is_sign_continuous, has_inside })
    }
}

/// Bakes bricks; `take` receives their samples.
fn tables<C: Quantize>(
    baker: SparseBaker,
    shard: BrickShard,
    at_a_time: usize,
    take: &mut dyn FnMut(Codes) -> io::Result<()>,
    on_slots_done: &(dyn Fn(usize) + Sync),
) -> Result<PartTables, Failure>
where
    Codes: From<Vec<C>>,
{
    let mut take = |samples: Vec<C>| take(samples.into());
    let BakedPart { near: mut bricks, closing } =
        baker.bake_part::<C, io::Error>(shard, at_a_time, &mut take, on_slots_done)?;
    let near = bricks.slots.len();
    bricks.append(closing);
    let BrickColumns { slots, scales, roundings, interpolations } = bricks;
    let (coarse, sides) = baker.into_coarse_map().into_parts();
    let (sides, slot_sides) = match sides {
        SlotSides::FirstNodes => (Sides::FirstNodes, vec![]),
        SlotSides::Own(slots) => (Sides::Slots, slots),
        SlotSides::WithNodes(slots) => (Sides::SlotsAndNodes, slots),
    };
    Ok(PartTables { near, slots, scales, roundings, interpolations, coarse, sides, slot_sides })
}
