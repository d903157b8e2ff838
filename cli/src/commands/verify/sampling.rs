//! Where is a field compared with its mesh? Random points, evenly in a box or by area on the surface, and nodes of a grid.
//!
//! Each sample depends on the seed and its own index alone: the number of threads does not change it.

use sdf_bake::sparse::code_step;
use sdf_bake::{MeshDistance, TriangleMesh};
use sdf_core::grid::owned::OwnedGrid;
use sdf_core::grid::sparse::{BRICK, brick_counts};
use sdf_core::grid::{Lattice, Storage};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, EnclosedSdf};
use sdf_procedural::random::unit_at;

use crate::args::VerifyArgs;

/// The field's value and the exact signed distance at a point.
#[derive(Clone, Copy)]
pub struct PointSample {
    pub point: [f64; 3],
    pub value: f64,
    /// Norm of the field's gradient; zero for a node.
    pub slope: f64,
    /// Where rounding decides the side, on that of the value.
    pub truth: f64,
    /// Largest error that storing the value with its precision can cause.
    pub rounding: f64,
}

impl PointSample {
    /// A field's value at a point, stored without rounding.
    pub fn new(mesh: &MeshDistance, point: [f64; 3], value: f64) -> Self {
        let distance = mesh.signed_distance(point);
        let is_on_other_side = (value < 0.0) != (distance < 0.0);
        let truth = if is_on_other_side && !mesh.is_side_certain(point) { -distance } else { distance };
        Self { point, value, slope: 0.0, truth, rounding: 0.0 }
    }

    pub fn error(&self) -> f64 {
        (self.value - self.truth).abs()
    }

    /// The sign of the corners of the point's cell, if all have one, in place of the winding number's: between them the error of an open
    /// mesh's grid is that of a distance with their sign (docs/error-bounds.md).
    pub fn take_sign_of_cell(&mut self, grid: &OwnedGrid) {
        let corners = grid.storage().corners(cell_at(grid.lattice(), self.point));
        let inside_count = corners.iter().filter(|corner| **corner < 0.0).count();
        self.truth = match inside_count {
            0 => self.truth.abs(),
            8 => -self.truth.abs(),
            _ => self.truth,
        };
    }

    pub fn has_wrong_sign(&self, tolerance: f64) -> bool {
        (self.value < 0.0) != (self.truth < 0.0) && self.truth.abs() > tolerance
    }
}

/// Samples at `point(index)` for each index below `args.points`.
pub fn sample<F: EnclosedSdf + Sync>(
    args: &VerifyArgs,
    field: &F,
    truth: &MeshDistance,
    point: impl Fn(u64) -> [f64; 3] + Sync,
) -> Vec<PointSample> {
    sdf_parallel::map(args.points as usize, |index| sample_at(field, truth, point(index as u64)))
}

fn sample_at<F: EnclosedSdf>(field: &F, truth: &MeshDistance, point: [f64; 3]) -> PointSample {
    let sample = field.sample(Vector3::from(point));
    PointSample { slope: sample.gradient.norm(), ..PointSample::new(truth, point, sample.value) }
}

/// Samples at nodes: random ones, or all. In a sparse grid only nodes in bricks.
pub fn sample_nodes(args: &VerifyArgs, grid: &OwnedGrid, truth: &MeshDistance) -> Vec<PointSample> {
    let lattice = grid.lattice();
    let count = grid.storage().brick_count().map_or(lattice.node_count(), |bricks| bricks * NODES_PER_BRICK);
    let check = |index: usize| {
        let (node, step) = node(grid, index)?;
        let sample = PointSample::new(truth, lattice.node(node), stored_at(grid, node));
        Some(PointSample { rounding: 0.5 * step + sample.truth.abs() * f64::from(f32::EPSILON), ..sample })
    };
    drawn(args, count, check)
}

/// Nodes in no brick of a sparse grid, one for each node of its coarse grid that has a slot without a brick beside it: the node of that
/// slot that is nearest to it, where the coarse node counts for most. Random ones, or all.
pub fn sample_coarse_nodes(args: &VerifyArgs, grid: &OwnedGrid, truth: &MeshDistance) -> Vec<PointSample> {
    let (nodes, slots) = (grid.lattice().nodes(), brick_counts(grid.lattice()));
    let [row, rows, layers] = slots.map(|n| n as usize + 1);
    drawn(args, row * rows * layers, |index| {
        let coarse = [index % row, index / row % rows, index / row / rows].map(|i| i as u32);
        let slot_beside = |below: u32| {
            let slot: [u32; 3] = std::array::from_fn(|axis| coarse[axis].wrapping_sub(below >> axis & 1));
            let is_empty = (0..3).all(|axis| slot[axis] < slots[axis]) && grid.storage().brick_at(slot).is_none();
            is_empty.then_some(slot)
        };
        let slot = (0..8).find_map(slot_beside)?;
        let nearest = |axis: usize| (BRICK * coarse[axis]).min(BRICK * slot[axis] + BRICK - 1).min(nodes[axis] - 1);
        let node = [nearest(0), nearest(1), nearest(2)];
        Some(PointSample::new(truth, grid.lattice().node(node), stored_at(grid, node)))
    })
}

/// Finds of `pick` at random indices below `count`, or at all.
fn drawn<T: Send>(args: &VerifyArgs, count: usize, pick: impl Fn(usize) -> Option<T> + Sync) -> Vec<T> {
    let draw = |index: usize| (unit_at(args.seed, index as u64) * count as f64) as usize;
    let found = if args.all_nodes {
        sdf_parallel::map(count, pick)
    } else {
        sdf_parallel::map(args.points as usize, |index| pick(draw(index)))
    };
    found.into_iter().flatten().collect()
}

const NODES_PER_BRICK: usize = (BRICK * BRICK * BRICK) as usize;

/// The node with an index, and the step between representable values of its sample. `None` for a node of a brick that lies
/// outside the lattice.
fn node(grid: &OwnedGrid, index: usize) -> Option<([u32; 3], f64)> {
    let (lattice, storage) = (grid.lattice(), grid.storage());
    if storage.brick_count().is_none() {
        let [row, rows, _] = lattice.nodes().map(|n| n as usize);
        let node = [index % row, index / row % rows, index / row / rows].map(|i| i as u32);
        let block = storage.brick_at(node.map(|n| n / BRICK));
        return Some((node, block.map_or(0.0, |block| step_of(grid, block))));
    }
    let (brick, local) = (index / NODES_PER_BRICK, (index % NODES_PER_BRICK) as u32);
    let local = [local % BRICK, local / BRICK % BRICK, local / BRICK / BRICK];
    let node: [u32; 3] = std::array::from_fn(|axis| storage.slots()[brick][axis] * BRICK + local[axis]);
    let is_inside = (0..3).all(|axis| node[axis] < lattice.nodes()[axis]);
    is_inside.then(|| (node, step_of(grid, brick)))
}

/// Step between the codes of a brick or block, zero of samples in f32.
fn step_of(grid: &OwnedGrid, brick: usize) -> f64 {
    f64::from(code_step(grid.storage().precision(), &grid.storage().scales()[brick..=brick]))
}

fn stored_at(grid: &OwnedGrid, node: [u32; 3]) -> f64 {
    let cell = std::array::from_fn(|axis| node[axis].min(grid.lattice().cells()[axis] - 1));
    let corner = (0..3).fold(0, |corner, axis| corner | ((node[axis] - cell[axis]) as usize) << axis);
    f64::from(grid.storage().corners(cell)[corner])
}

/// The cell that contains a point of the box.
pub fn cell_at(lattice: &Lattice, point: [f64; 3]) -> [u32; 3] {
    lattice.nodes_around(&Aabb { min: point, max: point }).map_or([0; 3], |[first, _]| first)
}

/// A mesh from which points are drawn evenly by area.
pub struct Surface<'a> {
    mesh: &'a TriangleMesh,
    /// Cumulative sums of twice the triangles' areas.
    areas: Vec<f64>,
}

impl<'a> Surface<'a> {
    pub fn new(mesh: &'a TriangleMesh) -> Self {
        let mut sum = 0.0;
        let area = |triangle: usize| {
            let [a, b, c] = mesh.corners(triangle).map(Vector3::from);
            sum += (b - a).cross(&(c - a)).norm();
            sum
        };
        Self { mesh, areas: (0..mesh.triangle_count()).map(area).collect() }
    }

    /// Uses the random numbers `index`, `index + 1` and `index + 2` of the seed.
    pub fn point(&self, seed: u64, index: u64) -> [f64; 3] {
        let area = unit_at(seed, index) * self.areas.last().copied().unwrap_or(0.0);
        let triangle = self.areas.partition_point(|sum| *sum <= area).min(self.areas.len() - 1);
        let [a, b, c] = self.mesh.corners(triangle).map(Vector3::from);
        let (u, v) = (unit_at(seed, index + 1), unit_at(seed, index + 2));
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        (a + (b - a) * u + (c - a) * v).into()
    }
}

/// Random points of a surface.
pub fn points_of(args: &VerifyArgs, surface: &Surface) -> Vec<[f64; 3]> {
    (0..u64::from(args.points)).map(|index| surface.point(args.seed, 8 * index)).collect()
}

/// Uses the random numbers from 3 · `index` on.
pub fn point_in_box(seed: u64, index: u64, bounds: &Aabb) -> [f64; 3] {
    std::array::from_fn(|axis| {
        bounds.min[axis] + unit_at(seed, 3 * index + axis as u64) * (bounds.max[axis] - bounds.min[axis])
    })
}
