//! Fields from meshes: the grid around the mesh, its memory checked before any of it is taken, then the baker.

mod options;

use std::sync::atomic::{AtomicBool, Ordering};

use sdf_bake::error_budget::ErrorBudget;
use sdf_bake::sparse::SparseBaker;
use sdf_bake::{BakedGrid, MeshDistance, TriangleMesh, dense, lattice_around};
use sdf_core::Aabb;
use sdf_core::grid::Lattice;
use sdf_core::grid::owned::{Layout, Precision};
use sdf_core::grid::sparse::BRICK_SAMPLES;

pub use sdf_bake::error_budget::ErrorBudgetError;
pub use sdf_bake::sparse::Certify;
pub use sdf_bake::{ErrorRegion, ErrorRegions, InvalidMesh, MeshReport, Topology};

pub use options::{BakeOptions, GridSize, InnerFaces, MaxError};

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
    /// Is the error bound proven? Not where the sign may change away from triangles, as at the holes of an open mesh.
    pub is_proven: bool,
    /// The error by region, where the sign may change away from triangles.
    pub regions: Option<ErrorRegions>,
}

/// Why a mesh cannot be baked.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum BakeError {
    /// See [`InvalidMesh`].
    InvalidMesh(InvalidMesh),
    /// [`BakeOptions::weld`] or [`BakeOptions::close`] is not a positive finite length.
    InvalidRepair {
        /// The requested length.
        length: f64,
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
    /// The flag of [`Field::bake_cancellable`] was set.
    Cancelled,
}

impl std::fmt::Display for BakeError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::InvalidMesh(error) => error.fmt(f),
            Self::InvalidRepair { length } => {
                write!(f, "welding and closing need a positive finite length, not {length:?}")
            }
            Self::VoxelTooLarge { side } => write!(f, "the whole mesh is {side} long: take smaller voxels"),
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

impl std::error::Error for BakeError {}

/// Work done so far, and all of it as far as it is known, in steps of no fixed length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// So many steps are to come in all.
    Total(u64),
    /// So many more are done.
    Done(u64),
}

impl Field {
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
            let mesh = options.repairs()?.apply(mesh.points, mesh.faces).map_err(BakeError::InvalidMesh)?;
            let mesh = match (options.inner_faces, options.sign) {
                (InnerFaces::Keep, _) => mesh,
                (InnerFaces::Drop, Some(SignMethod::PseudoNormal)) => mesh.without_inner_shells(),
                (InnerFaces::Drop, _) => mesh.without_inner_faces(),
            };
            bake(&mesh, options, on_progress, cancel)
        });
        // What was skipped may look like any other error.
        if cancel.load(Ordering::Relaxed) { Err(BakeError::Cancelled) } else { baked }
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
    let bounds = mesh.bounds();
    let (BakedGrid { grid, error_bound }, band) = match options.size {
        GridSize::Cells(cells) => {
            bake_size(&distance, options, &bounds, bounds.longest_side() / f64::from(cells), on_progress)?
        }
        GridSize::VoxelSize(spacing) => bake_size(&distance, options, &bounds, spacing, on_progress)?,
        GridSize::MaxError(max_error) => bake_within(&distance, options, &bounds, max_error, on_progress)?,
    };
    let sign_method = match distance.sign_method() {
        sdf_bake::SignMethod::PseudoNormal => SignMethod::PseudoNormal,
        sdf_bake::SignMethod::Winding => SignMethod::Winding,
    };
    let grid_box = grid.lattice().bounds();
    let inside = |axis: usize| (bounds.min[axis] - grid_box.min[axis]).min(grid_box.max[axis] - bounds.max[axis]);
    let regions = distance.error_regions(&grid, band);
    let info = GridInfo {
        sign_method,
        sign_reason: format!("{}{}", distance.sign_reason(), dropped(&mesh.report())),
        error_bound,
        error_regions: regions.clone(),
        padding: (0..3).map(inside).fold(f64::INFINITY, f64::min).max(0.0),
        band,
        source: options.source.clone(),
        tool: concat!("sdftool ", env!("CARGO_PKG_VERSION")).to_owned(),
        options: options.words(),
    };
    let mut field = Field::from_grid(grid, info);
    if options.keep_mesh {
        let (points, faces) = mesh.packed();
        field = field.with_mesh(KeptMesh::new(points, faces, distance.is_continuous()));
    }
    Ok(Baked {
        field,
        mesh: mesh.report(),
        topology: *distance.topology(),
        is_proven: distance.is_continuous(),
        regions,
    })
}

/// Shells and faces that were dropped, or could not be, and what was closed, in words to follow the reason of the sign method.
fn dropped(report: &MeshReport) -> String {
    let counts = [
        (report.inner_shells, "shell inside of the solid, dropped", "shells inside of the solid, dropped"),
        (report.degenerate_triangles, "face without area, dropped", "faces without area, dropped"),
        (report.merged_points, "vertex welded to another", "vertices welded to others"),
        (report.capped_loops, "boundary loop capped", "boundary loops capped"),
        (report.open_loops, "boundary loop too large to cap", "boundary loops too large to cap"),
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
    let uncut = has_too_many_crossings.then(|| "; too many faces cross: those inside of the solid count".to_owned());
    counts.chain(cut).chain(uncut).collect()
}

/// A grid, and the half width of its band.
type GridAndBand = (BakedGrid, Option<f64>);

fn bake_size(
    distance: &MeshDistance,
    options: &BakeOptions,
    bounds: &Aabb,
    spacing: f64,
    on_progress: &(dyn Fn(Progress) + Sync),
) -> Result<GridAndBand, BakeError> {
    let lattice = lattice(options, bounds, spacing)?;
    if options.layout == Layout::Dense {
        on_progress(Progress::Total(lattice.node_count() as u64));
        let dense = dense::bake(distance, &lattice, &|nodes| on_progress(Progress::Done(nodes as u64)));
        return Ok((dense.into_grid(&lattice), None));
    }
    let band = f64::from(options.band) * lattice.spacing();
    let baker = SparseBaker::new(distance, &lattice, band).certified(options.certify);
    let precision = options.precision.unwrap_or(Precision::U16);
    let bytes = baker.max_bytes_as(precision);
    let nodes = lattice.nodes().map(f64::from);
    require_memory(nodes, Some(baker.max_bricks()), bytes as f64)?;
    on_progress(Progress::Total(baker.slot_count() as u64));
    let on_done = |slots: usize| on_progress(Progress::Done(slots as u64));
    Ok((baker.bake_as(precision, &on_done), Some(band)))
}

fn bake_within(
    distance: &MeshDistance,
    options: &BakeOptions,
    bounds: &Aabb,
    max_error: MaxError,
    on_progress: &(dyn Fn(Progress) + Sync),
) -> Result<GridAndBand, BakeError> {
    let max_error = match max_error {
        MaxError::Length(length) => length,
        MaxError::Fraction(fraction) => fraction * bounds.diagonal(),
    };
    let max_bytes = memory::free_bytes().unwrap_or(memory::ASSUMED_BYTES) as usize;
    let budget = ErrorBudget { max_error, band: f64::from(options.band), padding: options.padding, max_bytes };
    let on_done = |slots: usize| {
        // How many there are is known only when a size has been picked.
        on_progress(Progress::Total(slots as u64));
        on_progress(Progress::Done(slots as u64));
    };
    let baked = budget.bake(distance, &on_done).map_err(BakeError::ErrorBudget)?;
    let band = f64::from(options.band) * baked.grid.lattice().spacing();
    Ok((baked, Some(band)))
}

/// Largest side of a cell in sides of the mesh's box. One says nothing of the mesh already; from 1e16 on, the nodes are so far
/// away that the whole mesh is one point.
const MAX_SIDES: f64 = 1e3;

fn lattice(options: &BakeOptions, bounds: &Aabb, spacing: f64) -> Result<Lattice, BakeError> {
    let side = bounds.longest_side();
    if spacing > MAX_SIDES * side {
        return Err(BakeError::VoxelTooLarge { side });
    }
    let nodes = bounds.extents().map(|extent| (extent / spacing).ceil() + 2.0 * f64::from(options.padding) + 1.0);
    // A sparse grid has a number for each slot of 8 × 8 × 8 nodes, and while it is baked what is known of its middle.
    let bytes_per_node = match options.layout {
        Layout::Dense => size_of::<f32>() as f64 + size_of::<&mut [f32]>() as f64 / nodes[0],
        Layout::Sparse => 72.0 / BRICK_SAMPLES as f64,
    };
    let sign_bytes = match (options.layout, options.sign) {
        (Layout::Sparse, _) | (_, Some(SignMethod::PseudoNormal)) => 0.0,
        _ => rayon::current_num_threads() as f64 * dense::SIGN_BYTES as f64 * nodes[0],
    };
    require_memory(nodes, None, nodes.iter().product::<f64>() * bytes_per_node + sign_bytes)?;
    let too_large = BakeError::TooLarge { nodes, bricks: None, bytes: None, free: None };
    lattice_around(bounds, spacing, options.padding).ok_or(too_large)
}

fn require_memory(nodes: [f64; 3], bricks: Option<usize>, bytes: f64) -> Result<(), BakeError> {
    let free = memory::free_bytes();
    if bytes > free.unwrap_or(memory::ASSUMED_BYTES) {
        return Err(BakeError::TooLarge { nodes, bricks, bytes: Some(bytes), free });
    }
    Ok(())
}
