//! Fields from meshes: the grid around the mesh, its memory checked before any of it is taken, then the baker.

mod error;
pub(crate) mod inside;
#[cfg(feature = "files")]
mod join;
#[cfg(feature = "files")]
mod on_disk;
mod options;
#[cfg(feature = "files")]
mod parts;

use std::sync::atomic::{AtomicBool, Ordering};

use sdf_bake::error_budget::ErrorBudget;
use sdf_bake::sparse::{SparseBaker, streamed_slot_bytes};
use sdf_bake::{BakedGrid, MeshDistance, TriangleMesh, dense, lattice_around};
use sdf_core::Aabb;
use sdf_core::grid::Lattice;
use sdf_core::grid::owned::{Layout, Precision};
use sdf_core::grid::sparse::BRICK_SAMPLES;

pub use error::BakeError;
pub use sdf_bake::error_budget::ErrorBudgetError;
pub use sdf_bake::sparse::Certify;
pub use sdf_bake::{ErrorRegion, ErrorRegions, InvalidMesh, MeshReport, Progress, Topology};

#[cfg(feature = "files")]
pub use join::merge_parts;
#[cfg(feature = "files")]
pub use on_disk::{BakeFileError, GridOnDisk};
pub use options::{BakeOptions, GridSize, InnerFaces, MaxError};
#[cfg(feature = "files")]
pub use parts::{BakeOutcome, BakeTarget, BakedFile};
#[cfg(feature = "files")]
pub use sdf_bake::sparse::BrickShard;

use crate::info::{GridInfo, SignMethod};
use crate::{Field, KeptMesh, MeshView, memory};

/// A baked field, and what was found out about the mesh.
#[derive(Clone, Debug)]
pub struct Baked {
    /// A grid, with its [`GridInfo`].
    pub field: Field,
    /// Oddities of the input.
    pub mesh: MeshReport,
    /// Holes, shells, and worse.
    pub topology: Topology,
    /// Does the sign change at triangles alone? Not so at the holes of an open mesh: the error there is that of a distance with the sign of a
    /// cell's corners where they agree.
    pub is_sign_continuous: bool,
    /// Is a node inside? A solid thinner than a voxel may have none: then its grid has no surface.
    pub has_inside: bool,
    /// The error by region, where the sign may change away from triangles.
    pub regions: Option<ErrorRegions>,
}

impl Baked {
    /// The side of a voxel, where the mesh is closed and no node is inside of its solid: contacts with it are not found. `None` of others.
    pub fn thin_voxel(&self) -> Option<f64> {
        inside::thin_voxel(self.is_sign_continuous, self.has_inside, self.field.grid()?.lattice())
    }
}

impl Field {
    /// Is a node of the grid inside of the solid? `false` of other fields.
    pub fn has_inside(&self) -> bool {
        self.grid().is_some_and(|grid| inside::has_inside(grid))
    }

    /// Bakes a mesh into a grid of exact signed distances.
    pub fn bake(mesh: MeshView, options: &BakeOptions) -> Result<Baked, BakeError> {
        Self::bake_with_progress(mesh, options, &|_| ())
    }

    /// [`bake`](Self::bake), with a callback that any thread may call.
    pub fn bake_with_progress(
        mesh: MeshView,
        options: &BakeOptions,
        on_progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<Baked, BakeError> {
        Self::bake_cancellable(mesh, options, on_progress, &AtomicBool::new(false))
    }

    /// [`bake_with_progress`](Self::bake_with_progress), until another thread sets `cancel`. Then what is left is skipped, and the
    /// result is [`BakeError::Cancelled`]: at once while nodes are measured, within the time of reading the mesh before.
    pub fn bake_cancellable(
        mesh: MeshView,
        options: &BakeOptions,
        on_progress: &(dyn Fn(Progress) + Sync),
        cancel: &AtomicBool,
    ) -> Result<Baked, BakeError> {
        let baked = options.threads.install(|| {
            let mesh = CheckedMesh::new(mesh, options)?.solid(options);
            bake(&mesh, options, on_progress, cancel)
        });
        // What was skipped may look like any other error.
        if cancel.load(Ordering::Relaxed) { Err(BakeError::Cancelled) } else { baked }
    }
}

/// A mesh that was checked, welded and closed, and is to be baked. It holds all that a bake needs: the view that it came from can be freed
/// before.
#[derive(Clone, Debug)]
pub struct CheckedMesh(TriangleMesh);

impl CheckedMesh {
    /// Checks a mesh, and repairs it as the options say.
    pub fn new(mesh: MeshView, options: &BakeOptions) -> Result<Self, BakeError> {
        options.check()?;
        options.repairs()?.apply(mesh.points, mesh.faces).map(Self).map_err(BakeError::InvalidMesh)
    }

    /// The mesh without inner faces, as the options say.
    fn solid(self, options: &BakeOptions) -> TriangleMesh {
        let Self(mesh) = self;
        match (options.inner_faces, options.sign) {
            (InnerFaces::Keep, _) => mesh,
            (InnerFaces::Drop, Some(SignMethod::PseudoNormal)) => mesh.without_inner_shells(),
            (InnerFaces::Drop, _) => mesh.without_inner_faces(),
        }
    }
}

/// Bakes on the threads of the current pool.
fn bake(
    mesh: &TriangleMesh,
    options: &BakeOptions,
    on_progress: &(dyn Fn(Progress) + Sync),
    cancel: &AtomicBool,
) -> Result<Baked, BakeError> {
    let method = options.sign.and_then(SignMethod::for_mesh);
    let distance = MeshDistance::new(mesh, method).with_cancel(cancel);
    let memory = Memory { limit: None };
    let grid = bake_grid(&distance, options, memory, on_progress)?;
    Ok(finished(mesh, &distance, options, grid))
}

fn bake_grid(
    distance: &MeshDistance,
    options: &BakeOptions,
    memory: Memory,
    on_progress: &(dyn Fn(Progress) + Sync),
) -> Result<GridAndBand, BakeError> {
    let bounds = distance.bounds();
    match (options.size.spacing(&bounds), options.layout) {
        (Err(max_error), _) => bake_within(distance, options, &bounds, max_error, memory, on_progress),
        (Ok(spacing), Layout::Dense) => {
            let lattice = lattice(options, &bounds, spacing, 0, memory)?;
            require_samples(&lattice)?;
            on_progress(Progress::Total(lattice.node_count() as u64));
            let dense = dense::bake(distance, &lattice, &|nodes| on_progress(Progress::Done(nodes as u64)));
            Ok((dense.into_grid_as(&lattice, options.precision.unwrap_or(Precision::F32)), None))
        }
        (Ok(spacing), Layout::Sparse) => {
            let baker = sparse_baker(distance, options, spacing, memory)?;
            bake_bricks(&baker, options, memory, on_progress)
        }
    }
}

/// Refuses a dense grid whose samples cannot be allocated: the process has a limit of its own, and would be aborted.
fn require_samples(lattice: &Lattice) -> Result<(), BakeError> {
    let (count, nodes) = (lattice.node_count(), lattice.nodes().map(f64::from));
    let bytes = Some(count as f64 * size_of::<f32>() as f64);
    let too_large =
        |_| BakeError::TooLarge { layout: Layout::Dense, nodes, bricks: None, bytes, triangle_bytes: 0.0, free: None };
    Vec::<f32>::new().try_reserve_exact(count).map_err(too_large)
}

/// A baked grid with all that is known of it.
fn finished(mesh: &TriangleMesh, distance: &MeshDistance, options: &BakeOptions, (baked, band): GridAndBand) -> Baked {
    let regions = distance.error_regions(&baked);
    let BakedGrid { grid, error_bound, .. } = baked;
    let (has_inside, is_sign_continuous) = (inside::has_inside(&grid), distance.is_continuous());
    let info = grid_info(mesh, distance, options, &grid.lattice().bounds(), error_bound, band);
    let sign_reason = info.sign_reason + at_box(grid.inside_reaches_box());
    let info = GridInfo { sign_reason, error_regions: regions.clone(), ..info };
    let mut field = Field::from_grid(grid, info);
    if options.keep_mesh {
        let (points, faces) = mesh.packed();
        field = field.with_mesh(KeptMesh::new(points, faces, is_sign_continuous));
    }
    Baked { field, mesh: mesh.report(), topology: *distance.topology(), is_sign_continuous, has_inside, regions }
}

fn grid_info(
    mesh: &TriangleMesh,
    distance: &MeshDistance,
    options: &BakeOptions,
    grid_box: &Aabb,
    error_bound: f64,
    band: Option<f64>,
) -> GridInfo {
    let bounds = mesh.bounds();
    let inside = |axis: usize| (bounds.min[axis] - grid_box.min[axis]).min(grid_box.max[axis] - bounds.max[axis]);
    GridInfo {
        sign_method: match distance.sign_method() {
            sdf_bake::SignMethod::PseudoNormal => SignMethod::PseudoNormal,
            sdf_bake::SignMethod::Winding => SignMethod::Winding,
        },
        sign_reason: format!("{}{}", distance.sign_reason(), dropped(&mesh.report())),
        error_bound,
        error_regions: None,
        padding: (0..3).map(inside).fold(f64::INFINITY, f64::min).max(0.0),
        band,
        source: options.source.clone(),
        tool: TOOL.to_owned(),
        options: options.words(),
    }
}

/// Words about an open mesh whose inside reaches the faces of the grid's box.
fn at_box(inside_reaches_box: bool) -> &'static str {
    if inside_reaches_box {
        "; its inside reaches the grid's box, and the error outside of that is not known"
    } else {
        ""
    }
}

/// The program and its version, as a grid states them.
const TOOL: &str = concat!("sdftool ", env!("CARGO_PKG_VERSION"));

/// Shells and faces that were dropped, or could not be, and what was closed, in words to follow the reason of the sign method.
fn dropped(report: &MeshReport) -> String {
    let counts = [
        (report.inner_shells, "shell inside of the solid, dropped", "shells inside of the solid, dropped"),
        (report.degenerate_triangles, "face without area, dropped", "faces without area, dropped"),
        (report.merged_points, "vertex welded to another", "vertices welded to others"),
        (report.capped_loops, "boundary loop capped", "boundary loops capped"),
        (
            report.open_loops,
            "boundary loop not capped, too large or not to be closed",
            "boundary loops not capped, too large or not to be closed",
        ),
        (
            report.entangled_shells,
            "shell crosses or touches itself: its faces inside of the solid count",
            "shells cross or touch: their faces inside of the solid count",
        ),
    ];
    let counts = counts.into_iter().filter(|(count, ..)| *count > 0);
    let counts = counts.map(|(count, one, several)| format!("; {count} {}", if count == 1 { one } else { several }));
    let MeshReport { crossing_triangles, kept_pieces, dropped_pieces, has_too_many_crossings, .. } = *report;
    let cut = (crossing_triangles > 0).then(|| {
        let pieces = kept_pieces + dropped_pieces;
        format!("; {crossing_triangles} faces cut where others meet them, {dropped_pieces} of {pieces} pieces inside of the solid, dropped")
    });
    let uncut = has_too_many_crossings
        .then(|| "; too many faces cross or are near each other: those inside of the solid count".to_owned());
    counts.chain(cut).chain(uncut).collect()
}

/// A grid, and the half width of its band.
type GridAndBand = (BakedGrid, Option<f64>);

/// A sparse grid before it is baked.
fn sparse_baker<'a>(
    distance: &'a MeshDistance,
    options: &BakeOptions,
    spacing: f64,
    memory: Memory,
) -> Result<SparseBaker<'a>, BakeError> {
    let slot_bytes = streamed_slot_bytes(distance);
    let lattice = lattice(options, &distance.bounds(), spacing, slot_bytes, memory)?;
    let band = f64::from(options.band) * lattice.spacing();
    let baker =
        SparseBaker::new(distance, &lattice, band).map_err(|_| BakeError::BandOutOfRange { band: options.band })?;
    Ok(baker.certified(options.certify))
}

fn bake_bricks(
    baker: &SparseBaker,
    options: &BakeOptions,
    memory: Memory,
    on_progress: &(dyn Fn(Progress) + Sync),
) -> Result<GridAndBand, BakeError> {
    let precision = options.precision.unwrap_or(Precision::U16);
    let (nodes, bytes) = (baker.lattice().nodes().map(f64::from), baker.max_bytes_as(precision) as f64);
    memory.require(Layout::Sparse, nodes, Some(baker), bytes)?;
    on_progress(Progress::Total(baker.slot_count() as u64));
    let on_done = |slots: usize| on_progress(Progress::Done(slots as u64));
    Ok((baker.bake_as(precision, &on_done), Some(baker.band())))
}

fn bake_within(
    distance: &MeshDistance,
    options: &BakeOptions,
    bounds: &Aabb,
    max_error: MaxError,
    memory: Memory,
    on_progress: &(dyn Fn(Progress) + Sync),
) -> Result<GridAndBand, BakeError> {
    let max_error = match max_error {
        MaxError::Length(length) => length,
        MaxError::Fraction(fraction) => fraction * bounds.diagonal(),
    };
    let max_bytes = memory.bytes() as usize;
    let budget = ErrorBudget { max_error, band: f64::from(options.band), padding: options.padding, max_bytes };
    let baked = budget.bake(distance, on_progress).map_err(BakeError::ErrorBudget)?;
    let band = f64::from(options.band) * baked.grid.lattice().spacing();
    Ok((baked, Some(band)))
}

/// Largest side of a cell in sides of the mesh's box. One says nothing of the mesh already; from 1e16 on, the nodes are so far
/// away that the whole mesh is one point.
const MAX_SIDES: f64 = 1e3;

/// `slot_bytes`: memory for each slot of a sparse grid.
fn lattice(
    options: &BakeOptions,
    bounds: &Aabb,
    spacing: f64,
    slot_bytes: usize,
    memory: Memory,
) -> Result<Lattice, BakeError> {
    let side = bounds.longest_side();
    if spacing > MAX_SIDES * side {
        return Err(BakeError::VoxelTooLarge { side });
    }
    let nodes = bounds.extents().map(|extent| (extent / spacing).ceil() + 2.0 * f64::from(options.padding) + 1.0);
    // A sparse grid has a number for each slot of 8 × 8 × 8 nodes, and while it is baked what is known of its middle. Whether its bricks
    // fit is known later.
    let bytes_per_node = match options.layout {
        Layout::Dense => {
            let samples = dense::bytes_per_node(options.precision.unwrap_or(Precision::F32));
            samples as f64 + size_of::<&mut [f32]>() as f64 / nodes[0]
        }
        Layout::Sparse => slot_bytes as f64 / BRICK_SAMPLES as f64,
    };
    let sign_bytes = match (options.layout, options.sign) {
        (Layout::Sparse, _) | (_, Some(SignMethod::PseudoNormal)) => 0.0,
        _ => sdf_parallel::thread_count() as f64 * dense::SIGN_BYTES as f64 * nodes[0],
    };
    memory.require(options.layout, nodes, None, nodes.iter().product::<f64>() * bytes_per_node + sign_bytes)?;
    let too_large = BakeError::TooLarge {
        layout: options.layout,
        nodes,
        bricks: None,
        bytes: None,
        triangle_bytes: 0.0,
        free: None,
    };
    lattice_around(bounds, spacing, options.padding).ok_or(too_large)
}

/// Memory that a bake may take.
#[derive(Clone, Copy)]
struct Memory {
    /// At most so many bytes; in any case no more than are free.
    limit: Option<u64>,
}

impl Memory {
    fn free(self) -> Option<f64> {
        let limit = self.limit.map(|bytes| bytes as f64);
        memory::free_bytes().into_iter().chain(limit).reduce(f64::min)
    }

    fn bytes(self) -> f64 {
        self.free().unwrap_or(memory::ASSUMED_BYTES)
    }

    /// Refuses what needs more.
    fn require(
        self,
        layout: Layout,
        nodes: [f64; 3],
        baker: Option<&SparseBaker>,
        bytes: f64,
    ) -> Result<(), BakeError> {
        if bytes > self.bytes() {
            let bricks = baker.map(SparseBaker::max_bricks);
            let bytes = Some(bytes).filter(|bytes| bytes.is_finite());
            let triangle_bytes = baker.map_or(0.0, |baker| baker.triangle_bytes() as f64);
            return Err(BakeError::TooLarge { layout, nodes, bricks, bytes, triangle_bytes, free: self.free() });
        }
        Ok(())
    }
}
