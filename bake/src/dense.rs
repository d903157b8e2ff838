//! Dense grid: a distance at every node. As codes of 2 or 1 bytes: `blocks`.

mod blocks;

use std::ops::Range;

use sdf_core::Aabb;
use sdf_core::grid::sparse::brick_counts;
use sdf_core::grid::{BlockBounds, Dense, Lattice, Storage, slope_bound_with_outside};
use sdf_core::nalgebra::Vector3;

use crate::error::node_bounds::{HaloBlock, inside_reaches_box};
use crate::mesh_distance::MeasuredPoint;
use crate::nearest::{PacketNodes, PacketSearch, SIDE, packet_rows};
use crate::rounding::{SAMPLE_ROUNDING, SUM_SLACK, node_position_rounding};
use crate::sign::flood_fill::NodeBlock;
use crate::sparse::slot_at;
use crate::{MeshDistance, SignMethod};

pub use blocks::bytes_per_node;

/// Samples of a baked grid and certified bounds.
#[derive(Clone, Debug, PartialEq)]
pub struct DenseGrid {
    /// Samples, x fastest, in the mesh's unit, negative inside.
    pub distances: Vec<f32>,
    /// Bounds of each block of 8 × 8 × 8 nodes, x fastest, for [`WithBlockBounds`](sdf_core::grid::WithBlockBounds).
    /// An open mesh is steep only around the surface that closes its holes.
    pub bounds: Vec<BlockBounds>,
    /// Lipschitz constant of the interpolant.
    pub slope_bound: f64,
    /// Largest difference of the interpolant from the signed distance anywhere in the grid's box.
    pub error_bound: f64,
    /// See [`Grid::with_inside_at_box`](sdf_core::grid::Grid::with_inside_at_box). Also true if the box does not hold the whole mesh.
    pub inside_reaches_box: bool,
}

impl DenseGrid {
    /// Samples that were not baked here, one for each node, x fastest: their bounds and slope are measured, nothing is certified of
    /// their error. `None` unless there is a finite sample for every node.
    pub fn from_samples(lattice: &Lattice, distances: Vec<f32>) -> Option<Self> {
        if distances.len() != lattice.node_count() || !are_finite(&distances) {
            return None;
        }
        let Measured { bounds, slope_bound, .. } = Measured::new(lattice, &distances);
        // Without a bound of the error there is none outside either.
        let (error_bound, inside_reaches_box) = (f64::INFINITY, false);
        slope_bound.is_finite().then_some(Self { distances, bounds, slope_bound, error_bound, inside_reaches_box })
    }
}

fn are_finite(samples: &[f32]) -> bool {
    let are_finite = |chunk: Range<usize>| samples[chunk].iter().all(|sample| sample.is_finite());
    sdf_parallel::map_chunks(samples.len(), are_finite).into_iter().all(|are_finite| are_finite)
}

/// Facts that samples tell.
struct Measured {
    /// Bounds of each block.
    bounds: Vec<BlockBounds>,
    /// A Lipschitz constant of all.
    slope_bound: f64,
    /// Is a sample on the faces of the box negative?
    inside_reaches_box: bool,
}

impl Measured {
    fn new(lattice: &Lattice, distances: &[f32]) -> Self {
        let bounds = block_bounds(lattice, distances);
        let max_slope = bounds.iter().map(|block| block.slope_bound).fold(0.0, f32::max);
        let inside_reaches_box = inside_reaches_box(lattice, |node| distances[lattice.index(node)]);
        Self { bounds, slope_bound: slope_bound_with_outside(max_slope.into(), inside_reaches_box), inside_reaches_box }
    }
}

/// Grid of cubic cells of side `spacing` centered on a box, at least `padding` cells wider on each side. `None` if
/// that is not a valid [`Lattice`].
pub fn lattice_around(bounds: &Aabb, spacing: f64, padding: u32) -> Option<Lattice> {
    // A side that is a whole number of cells up to rounding gets that number.
    let covering = |extent: f64| (extent / spacing - SUM_SLACK).ceil().max(0.0) + 2.0 * f64::from(padding);
    let cells = bounds.extents().map(|extent| covering(extent).max(1.0));
    let in_range = cells.iter().all(|cells| *cells < f64::from(Lattice::MAX_NODES));
    let origin =
        std::array::from_fn(|axis| 0.5 * bounds.min[axis] + 0.5 * bounds.max[axis] - 0.5 * cells[axis] * spacing);
    in_range.then(|| Lattice::new(origin, spacing, cells.map(|cells| cells as u32 + 1)))?
}

/// Memory of a thread that computes signs by winding number, in bytes per node of a row: 10 × 10 rows of the flood
/// fill's values, two queues for 8 × 8 rows, and the winding number's slopes around them.
pub const SIGN_BYTES: usize = 10 * 10 * 12 + 2 * 8 * 8 * 16 + 300;

/// Computes the exact distance at every node, rounded once to f32. The lattice should hold the whole mesh, as that of [`lattice_around`]
/// does: of others the error is bounded in the box alone, and [`DenseGrid::inside_reaches_box`] is true.
///
/// Calls `on_nodes_done` with the number of nodes just finished, from any thread. The result does not depend on the
/// number of threads.
pub fn bake(mesh: &MeshDistance, lattice: &Lattice, on_nodes_done: &(dyn Fn(usize) + Sync)) -> DenseGrid {
    let counts = lattice.nodes().map(|n| n as usize);
    let mut distances = vec![0.0_f32; lattice.node_count()];
    measure(mesh, lattice, &mut distances, on_nodes_done);
    if mesh.sign_method() == SignMethod::Winding {
        sdf_parallel::for_each(packet_rows(&mut distances, counts), |([y, z], mut rows)| {
            if mesh.is_cancelled() {
                return;
            }
            let position = &|[x, above, behind]: [usize; 3]| node(lattice, [x, y + above, z + behind]);
            let counts = [counts[0], (counts[1] - y).min(SIDE), (counts[2] - z).min(SIDE)];
            NodeBlock { counts, spacing: lattice.spacing(), position }.sign_rows(mesh, &[], &mut rows);
        });
    }
    let Measured { bounds, slope_bound, inside_reaches_box } = Measured::new(lattice, &distances);
    let error_bound = error_bound(mesh, lattice, &distances);
    // The inside of a closed mesh lies in a box that holds the mesh: a sample there is negative by rounding.
    let inside_reaches_box = inside_reaches_box && !mesh.is_continuous() || !mesh.lies_in(lattice);
    DenseGrid { distances, bounds, slope_bound, error_bound, inside_reaches_box }
}

/// Distance at every node, signed if pseudo-normals give the sign.
fn measure(mesh: &MeshDistance, lattice: &Lattice, distances: &mut [f32], on_nodes_done: &(dyn Fn(usize) + Sync)) {
    let counts = lattice.nodes().map(|n| n as usize);
    let [row, rows, layers] = counts;
    mesh.tree().prepare_packets();
    sdf_parallel::for_each(packet_rows(distances, counts), |([y, z], mut group_rows)| {
        let counts_above = [rows - y, layers - z].map(|count| count.min(SIDE));
        let mut search = PacketSearch::new(mesh.tree());
        for x in (0..row).step_by(SIDE) {
            if mesh.is_cancelled() {
                return;
            }
            let counts = [(row - x).min(SIDE), counts_above[0], counts_above[1]];
            let nodes = PacketNodes::new(lattice, [x, y, z], counts);
            search.find(&nodes, f64::INFINITY, f64::INFINITY);
            let mut last: Option<MeasuredPoint> = None;
            for (above, distances) in group_rows.iter_mut().enumerate() {
                for i in 0..counts[0] {
                    // Boustrophedon: the next node is a neighbour.
                    let i = if above % 2 == 0 { i } else { counts[0] - 1 - i };
                    let step = [i, above % counts[1], above / counts[1]];
                    let nearest = mesh.nearest_to_node(&search, &nodes, step, last);
                    last = Some(MeasuredPoint { point: nodes.position(step), nearest });
                    distances[x + i] = nearest.signed() as f32;
                }
            }
            on_nodes_done(counts.iter().product());
        }
    });
}

fn block_bounds(lattice: &Lattice, distances: &[f32]) -> Vec<BlockBounds> {
    let values = |node: [u32; 3], row: &mut [f32]| {
        let first = lattice.index(node);
        row.copy_from_slice(&distances[first..first + row.len()]);
    };
    let counts = brick_counts(lattice);
    let block_count = counts.iter().map(|n| *n as usize).product();
    sdf_parallel::map(block_count, |index| HaloBlock::new(lattice, slot_at(counts, index), values).bounds())
}

fn node(lattice: &Lattice, index: [usize; 3]) -> Vector3<f64> {
    lattice.node(index.map(|i| i as u32)).into()
}

/// Error bound of the whole grid, h its spacing:
///
/// ```text
/// √3/2 h + ε max |φ| + ρ + δ + 2 max |φ at the corners of cells with both signs|   (the last only for a discontinuous sign).
/// ```
///
/// A signed distance is 1-Lipschitz, so the interpolant of exact nodes errs by at most Σ wᵢ |xᵢ − x| ≤ √3/2 h. A node
/// errs by its rounding to f32, by ρ where the surface was cut out of crossing faces, and by δ, the rounding of its own position: far
/// from the origin δ exceeds a small h. The sign of an open mesh also jumps away from the mesh. There the error is at most the
/// distance, half a diagonal more than at the corners, and the interpolant's magnitude. In a cell whose corners have one sign, points have
/// that sign by definition (`docs/error-bounds.md`, "What is added"). Infinite where the sign is not certain.
fn error_bound(mesh: &MeshDistance, lattice: &Lattice, distances: &[f32]) -> f64 {
    if !mesh.is_sign_certain() {
        return f64::INFINITY;
    }
    let half_diagonal = 0.75_f64.sqrt() * lattice.spacing();
    let max_in = |chunk: Range<usize>| distances[chunk].iter().fold(0.0, |max: f32, distance| max.max(distance.abs()));
    let max_distance = sdf_parallel::map_chunks(distances.len(), max_in).into_iter().fold(0.0, f32::max);
    let rounding =
        f64::from(max_distance) * f64::from(SAMPLE_ROUNDING) + mesh.rounding() + node_position_rounding(lattice);
    let at_jump = if mesh.is_continuous() { 0.0 } else { max_distance_at_sign_change(lattice, distances) };
    half_diagonal + rounding + 2.0 * at_jump
}

/// Largest distance at a corner of a cell with corners of both signs.
fn max_distance_at_sign_change(lattice: &Lattice, distances: &[f32]) -> f64 {
    let Some(storage) = Dense::new(lattice, distances) else { return 0.0 };
    let [cells_x, cells_y, cells_z] = lattice.cells();
    let max_in_layer = |z: u32| {
        let cells = (0..cells_y).flat_map(|y| (0..cells_x).map(move |x| [x, y, z]));
        cells.fold(0.0_f32, |max, cell| {
            let corners = storage.corners(cell);
            let inside = corners.iter().filter(|corner| **corner < 0.0).count();
            if inside % 8 == 0 { max } else { corners.iter().fold(max, |max, corner| max.max(corner.abs())) }
        })
    };
    f64::from(sdf_parallel::map(cells_z as usize, |z| max_in_layer(z as u32)).into_iter().fold(0.0, f32::max))
}
