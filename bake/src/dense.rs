//! A distance at every node of a grid.

use rayon::prelude::*;
use sdf_core::Aabb;
use sdf_core::grid::sparse::brick_counts;
use sdf_core::grid::{BlockBounds, Dense, Lattice, slope_bound_with_outside};
use sdf_core::nalgebra::Vector3;

use crate::error::node_bounds::{HaloBlock, inside_reaches_box};
use crate::mesh_distance::AdjacentTriangles;
use crate::nearest::{Nodes, Packet, SIDE, rows_of_packets};
use crate::rounding::{SAMPLE_ROUNDING, SUM_SLACK};
use crate::sign::flood_fill::NodeBlock;
use crate::{MeshDistance, SignMethod};

/// The samples of a baked grid, and what is certain of it.
#[derive(Clone, Debug, PartialEq)]
pub struct DenseGrid {
    /// By node, x fastest, in the mesh's unit, negative inside.
    pub distances: Vec<f32>,
    /// Of each place of 8 × 8 × 8 nodes, x fastest, as [`WithBlockBounds`](sdf_core::grid::WithBlockBounds) wants them: an open mesh is
    /// steep only around the surface that closes its holes.
    pub bounds: Vec<BlockBounds>,
    /// The most that the interpolant changes over a unit of distance.
    pub slope_bound: f64,
    /// The most by which the interpolant differs from the signed distance anywhere in the grid's box.
    pub error_bound: f64,
}

/// A grid of cubic cells with sides `spacing` around a box, at least `padding` cells wider on each side, the box in the
/// middle. `None` where that is no [`Lattice`].
pub fn lattice_around(bounds: &Aabb, spacing: f64, padding: u32) -> Option<Lattice> {
    // A side that is a whole number of cells but for rounding gets that number.
    let covering = |extent: f64| (extent / spacing - SUM_SLACK).ceil().max(0.0) + 2.0 * f64::from(padding);
    let cells = bounds.extents().map(|extent| covering(extent).max(1.0));
    let in_range = cells.iter().all(|cells| *cells < f64::from(Lattice::MAX_NODES));
    let origin =
        std::array::from_fn(|axis| 0.5 * bounds.min[axis] + 0.5 * bounds.max[axis] - 0.5 * cells[axis] * spacing);
    in_range.then(|| Lattice::new(origin, spacing, cells.map(|cells| cells as u32 + 1)))?
}

/// What signs by winding number take on each thread for a while, in bytes for each node of a row: those of 8 × 8 rows and of one
/// more to each side, of lists of those that are not yet known, of ways yet to be taken, and of what the rim says around them.
pub const SIGN_BYTES: usize = 10 * 10 * 12 + 2 * 8 * 8 * 16 + 300;

/// The exact distance at every node, rounded once to f32. `on_nodes_done` is told, from any thread, how many nodes more
/// are done. The result does not depend on the number of threads.
pub fn bake(mesh: &MeshDistance, lattice: &Lattice, on_nodes_done: &(dyn Fn(usize) + Sync)) -> DenseGrid {
    let counts = lattice.nodes().map(|n| n as usize);
    let mut distances = vec![0.0_f32; lattice.node_count()];
    measure(mesh, lattice, &mut distances, on_nodes_done);
    if mesh.sign_method() == SignMethod::Winding {
        rows_of_packets(&mut distances, counts).into_par_iter().for_each(|([y, z], mut rows)| {
            let position = |[x, above, behind]: [usize; 3]| node(lattice, [x, y + above, z + behind]);
            let counts = [counts[0], (counts[1] - y).min(SIDE), (counts[2] - z).min(SIDE)];
            NodeBlock { counts, spacing: lattice.spacing(), position }.sign_rows(mesh, &[], &mut rows);
        });
    }
    let value = |node: [u32; 3]| distances[lattice.index(node)];
    let values = |node: [u32; 3], row: &mut [f32]| {
        let from = lattice.index(node);
        row.copy_from_slice(&distances[from..from + row.len()]);
    };
    let [along_x, along_y, along_z] = brick_counts(lattice).map(|n| n as usize);
    let place =
        |index: usize| [index % along_x, index / along_x % along_y, index / along_x / along_y].map(|n| n as u32);
    let places = (0..along_x * along_y * along_z).into_par_iter().map(place);
    let bounds: Vec<BlockBounds> = places.map(|place| HaloBlock::new(lattice, place, values).bounds()).collect();
    let steepest = bounds.iter().map(|nodes| nodes.slope_bound).fold(0.0, f32::max);
    let slope_bound = slope_bound_with_outside(steepest.into(), inside_reaches_box(lattice, value));
    let error_bound = error_bound(mesh, lattice, &distances);
    DenseGrid { distances, bounds, slope_bound, error_bound }
}

/// The distance at every node, with its sign where pseudo-normals tell it.
fn measure(mesh: &MeshDistance, lattice: &Lattice, distances: &mut [f32], on_nodes_done: &(dyn Fn(usize) + Sync)) {
    let counts = lattice.nodes().map(|n| n as usize);
    let [row, rows, layers] = counts;
    rows_of_packets(distances, counts).into_par_iter().for_each(|([y, z], mut tile_rows)| {
        let counts_above = [rows - y, layers - z].map(|count| count.min(SIDE));
        let mut packet = Packet::new(mesh.tree());
        for x in (0..row).step_by(SIDE) {
            let counts = [(row - x).min(SIDE), counts_above[0], counts_above[1]];
            let nodes = Nodes::of_lattice(lattice, [x, y, z], counts);
            packet.measure(&nodes, f64::INFINITY, f64::INFINITY);
            let mut last: Option<AdjacentTriangles> = None;
            for (above, nodes_of_row) in tile_rows.iter_mut().enumerate() {
                for i in 0..counts[0] {
                    // To and fro, so that the next node is a neighbour.
                    let i = if above % 2 == 0 { i } else { counts[0] - 1 - i };
                    let step = [i, above % counts[1], above / counts[1]];
                    let nearest = mesh.nearest_in(&packet, &nodes, step, last);
                    last = Some(AdjacentTriangles { point: nodes.at(step), nearest });
                    nodes_of_row[x + i] = nearest.signed() as f32;
                }
            }
            on_nodes_done(counts.iter().product());
        }
    });
}

fn node(lattice: &Lattice, index: [usize; 3]) -> Vector3<f64> {
    lattice.node(index.map(|i| i as u32)).into()
}

/// A true signed distance changes by at most the way, so the interpolant of exact nodes is off by at most
/// Σ wᵢ |xᵢ − x| ≤ √3/2 of a spacing, half a cell's diagonal; and a node by its rounding to f32.
///
/// Where a mesh is open the sign changes away from it, across the surface that closes its holes by a winding number of
/// one half; or elsewhere, by pseudo-normals that are no answer there. In a cell there the interpolant is off by as much
/// as the distance, at most half a diagonal more than at the corners, and its own value. A patch of that surface so small that it cuts no edge of a cell goes unseen.
fn error_bound(mesh: &MeshDistance, lattice: &Lattice, distances: &[f32]) -> f64 {
    let half_diagonal = 0.75_f64.sqrt() * lattice.spacing();
    let largest = distances.par_iter().map(|distance| distance.abs()).reduce(|| 0.0, f32::max);
    let rounding = f64::from(largest) * f64::from(SAMPLE_ROUNDING);
    let unpaired_at_boundary = if mesh.is_continuous() { 0.0 } else { largest_at_sign_change(lattice, distances) };
    half_diagonal + rounding + 2.0 * unpaired_at_boundary
}

/// The largest distance at a corner of a cell with corners of both signs.
fn largest_at_sign_change(lattice: &Lattice, distances: &[f32]) -> f64 {
    use sdf_core::grid::Storage;
    let Some(storage) = Dense::new(lattice, distances) else { return 0.0 };
    let [cells_x, cells_y, cells_z] = lattice.cells();
    let of_layer = |z: u32| {
        let cells = (0..cells_y).flat_map(|y| (0..cells_x).map(move |x| [x, y, z]));
        cells.fold(0.0_f32, |largest, cell| {
            let corners = storage.corners(cell);
            let inside = corners.iter().filter(|corner| **corner < 0.0).count();
            if inside % 8 == 0 { largest } else { corners.iter().fold(largest, |most, corner| most.max(corner.abs())) }
        })
    };
    f64::from((0..cells_z).into_par_iter().map(of_layer).reduce(|| 0.0, f32::max))
}
