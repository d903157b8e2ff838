//! Signs of a block of nodes, by flood fill of winding numbers.
//!
//! A segment from p to q is *clear* if D(p) + D(q) > |p − q|, D the distance to the mesh. No triangle meets it: each of
//! its points lies in one of the open balls around p and q of radius D. Along a clear segment the winding number w
//! changes by at most slope · |p − q| (`winding::boundary`); for a closed mesh it does not change.
//!
//! | step | which nodes get w | file |
//! |---|---|---|
//! | 1 | nodes beside seeds, points with known w | [`FloodFill::plant`] |
//! | 2 | all that clear grid edges reach, breadth first; whole cubes of 8³ or 4³ nodes if the boundary is far | [`FloodFill::flood`], `bit_block`, `regions` |
//! | 3 | neighbours along clear diagonals, and across triangles by exact predicates | `crossing` |
//! | 4 | the rest, evaluated; each begins step 2 again | [`FloodFill::evaluate`] |
//!
//! Every value has a bound of its error (`winding_value`), and is carried on only if that decides |w| ≥ 1/2; otherwise
//! w is evaluated. So every sign is that of the exact winding number, but for rounding: where ||w| − 1/2| < 1e-9, or a
//! point is nearer to a triangle's edge than a millionth of its length. A node on an open mesh of which rounding decides, as of all in the
//! plane of a flat one, is outside, as the nodes beside it are: its distance is 0 on either side.

mod bit_block;
mod crossing;
mod regions;
mod winding_value;

use std::collections::VecDeque;

use sdf_core::nalgebra::Vector3;

use crate::MeshDistance;
use crate::rounding::{NODE_STEP_ROUNDING, PRUNE_SLACK, SINGLE_SLACK, SUM_SLACK};
use crate::sign::winding::{Estimate, MAX_CONGRUENT_ERROR};
use bit_block::{ClearEdges, SIDE, SubCube};
use regions::{Region, Regions};
pub(crate) use winding_value::Winding;

/// A segment is clear if the distances at its ends sum to this many of its lengths, though they were rounded to f32.
pub(crate) const CLEARANCE: f64 = 1.0 + SINGLE_SLACK;

/// Nodes nearer to the surface than this fraction of a spacing count as on it.
const ON_SURFACE: f64 = 1e-4;

/// Nodes of a regular grid, x fastest.
#[derive(Clone, Copy)]
pub(crate) struct NodeBlock<'a> {
    pub counts: [usize; 3],
    pub spacing: f64,
    pub position: &'a (dyn Fn([usize; 3]) -> Vector3<f64> + Sync),
}

/// A point with a known winding number, beside a node of a block.
pub(crate) struct Seed {
    pub node: [usize; 3],
    pub position: Vector3<f64>,
    /// Length of the segment from the node to the position, in spacings.
    pub length: f64,
    /// Lower bound of the distance at the position.
    pub distance: f32,
    pub winding: Winding,
}

/// Winding numbers of a block's nodes.
pub(crate) struct SignedBlock {
    strides: [usize; 3],
    windings: Vec<Winding>,
}

impl SignedBlock {
    pub fn winding(&self, node: [usize; 3]) -> Winding {
        self.windings[padded_index(node, self.strides)]
    }
}

/// Index of a node in a block with a layer of padding on each side.
fn padded_index(node: [usize; 3], strides: [usize; 3]) -> usize {
    (0..3).map(|axis| (node[axis] + 1) * strides[axis]).sum()
}

impl NodeBlock<'_> {
    /// Negates the distances of all nodes inside, x fastest. Each is a lower bound of the true one.
    ///
    /// The signs do not depend on the seeds, but the time does.
    pub fn sign(&self, mesh: &MeshDistance, seeds: &[Seed], distances: &mut [f32]) {
        self.sign_rows(mesh, seeds, &mut distances.chunks_mut(self.counts[0]).collect::<Vec<_>>());
    }

    /// As [`Self::sign`], for rows that lie anywhere in memory: y fastest, then z. Returns the winding numbers.
    pub fn sign_rows(&self, mesh: &MeshDistance, seeds: &[Seed], rows: &mut [&mut [f32]]) -> SignedBlock {
        let mut flood = FloodFill::new(*self, mesh, rows);
        for seed in seeds {
            flood.plant(seed);
        }
        flood.assign_all_sides();
        for ([y, z], row) in self.rows().zip(rows) {
            let first = flood.index([0, y, z]);
            for (distance, winding) in row.iter_mut().zip(&flood.windings[first..]) {
                *distance = if winding.is_inside() { -distance.abs() } else { distance.abs() };
            }
        }
        SignedBlock { strides: flood.strides, windings: flood.windings }
    }

    fn rows(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [_, rows, layers] = self.counts;
        (0..layers).flat_map(move |z| (0..rows).map(move |y| [y, z]))
    }
}

/// A block padded to whole cubes and by one node on each side, so that each of its nodes has all neighbours.
struct FloodFill<'a> {
    block: NodeBlock<'a>,
    mesh: &'a MeshDistance<'a>,
    /// Index step to the next node along each axis.
    strides: [usize; 3],
    /// −∞ at padding, so that no segment to it is clear.
    distances: Vec<f32>,
    windings: Vec<Winding>,
    regions: Regions,
    /// [`CLEARANCE`], and more if coordinates are so large that nodes are off their lattice positions.
    clearance: f64,
    /// Clear edges from known to unknown nodes, first in first out.
    frontier: VecDeque<[usize; 2]>,
}

impl<'a> FloodFill<'a> {
    fn new(block: NodeBlock<'a>, mesh: &'a MeshDistance<'a>, rows: &[&mut [f32]]) -> Self {
        let padded_counts = block.counts.map(|n| n.next_multiple_of(SIDE) + 2);
        let strides = [1, padded_counts[0], padded_counts[0] * padded_counts[1]];
        let mut distances = vec![f32::NEG_INFINITY; padded_counts.iter().product()];
        for ([y, z], row) in block.rows().zip(rows) {
            let first = padded_index([0, y, z], strides);
            for (padded, distance) in distances[first..].iter_mut().zip(row.iter()) {
                *padded = distance.abs();
            }
        }
        let windings = vec![Winding::UNKNOWN; distances.len()];
        let ends = [[0; 3], block.counts.map(|n| n - 1)].map(block.position);
        let max_coordinate = ends.iter().map(|end| end.amax()).fold(0.0, f64::max);
        let clearance = CLEARANCE + NODE_STEP_ROUNDING * max_coordinate / block.spacing;
        let regions = Regions::new(block.counts, mesh, clearance);
        Self { block, mesh, strides, distances, windings, regions, clearance, frontier: VecDeque::new() }
    }

    fn index(&self, node: [usize; 3]) -> usize {
        padded_index(node, self.strides)
    }

    fn node(&self, index: usize) -> [usize; 3] {
        let [_, row, layer] = self.strides;
        [index % row - 1, index % layer / row - 1, index / layer - 1]
    }

    fn position(&self, index: usize) -> Vector3<f64> {
        (self.block.position)(self.node(index))
    }

    /// Floods from a seed, if the segment to its node is clear.
    fn plant(&mut self, seed: &Seed) {
        let index = self.index(seed.node);
        if !self.windings[index].is_known() && self.is_clear(index, seed.distance, seed.length) {
            self.adopt(index, seed.winding, seed.length, |_| seed.position);
            self.flood();
        }
    }

    /// Whether the segment from a node to a point at `distance` from the mesh is clear. `length` is in spacings.
    fn is_clear(&self, index: usize, distance: f32, length: f64) -> bool {
        if length == 0.0 {
            return !self.is_on_surface(index);
        }
        self.distances[index] + distance > (length * self.block.spacing * self.clearance) as f32
    }

    /// Assigns to a node the winding number of the point `from`, `length` spacings away on a clear segment, if that
    /// decides its side. If it decides the side of the whole cube, so to all nodes that clear edges reach there.
    fn adopt(&mut self, index: usize, winding: Winding, length: f64, from: impl FnOnce(&Self) -> Vector3<f64>) {
        if self.regions.is_empty() {
            return self.fill(index, winding, SIDE);
        }
        let node = self.node(index);
        let has_cone = self.mesh.boundary().has_cone();
        if let Some(carried) = self.regions.cube(&self.block, self.mesh, node).carry(winding, length, has_cone) {
            return self.fill(index, carried, SIDE);
        }
        if has_cone && let Some(carried) = self.sub_cube(node, SIDE / 2).carry(winding, length, true) {
            return self.fill(index, carried, SIDE / 2);
        }
        if let Some(carried) = self.carried_to_node(index, winding, length, from) {
            self.windings[index] = carried;
            for edge in self.grid_edges(index) {
                if self.extends_flood(edge) {
                    self.frontier.push_back(edge);
                }
            }
        }
    }

    fn sub_cube(&mut self, node: [usize; 3], side: usize) -> Region {
        self.regions.sub_cube(&self.block, self.mesh, node, side)
    }

    /// Winding number of this node alone, near the boundary.
    fn carried_to_node(
        &mut self,
        index: usize,
        winding: Winding,
        length: f64,
        from: impl FnOnce(&Self) -> Vector3<f64>,
    ) -> Option<Winding> {
        let node = self.node(index);
        let region = self.sub_cube(node, SIDE / 4);
        if self.mesh.boundary().has_cone()
            && let Some(carried) = region.carry(winding, length, true)
        {
            return Some(carried);
        }
        let estimate_by = |slope: f64| Estimate { error: f64::from(winding.error) + length * slope, ..winding.into() };
        let position = (self.block.position)(node);
        let mut estimate = estimate_by(region.slope);
        if estimate.error > MAX_CONGRUENT_ERROR {
            let step = self.block.spacing * self.clearance;
            // Beyond it the side, or which whole number to add, would not be certain.
            let has_cone = self.mesh.boundary().has_cone();
            let max_error = if has_cone { MAX_CONGRUENT_ERROR } else { (estimate.value.abs() - 0.5).abs() };
            let max_slope = (max_error - f64::from(winding.error)) / (length * step);
            let middle = (position + from(self)) * 0.5;
            let slope = self.mesh.boundary().slope_bound(middle, 0.5 * length * step, max_slope);
            estimate = estimate_by((slope * step).min(f64::MAX));
        }
        let carried = Winding::new(self.mesh.boundary().refine(estimate, position).unwrap_or(estimate));
        carried.is_certain().then_some(carried)
    }

    /// Assigns a winding number to a node and to all that clear edges reach in its cube of `side`³ nodes.
    fn fill(&mut self, index: usize, winding: Winding, side: usize) {
        self.windings[index] = winding;
        if !self.grid_edges(index).into_iter().any(|edge| self.extends_flood(edge)) {
            return;
        }
        let node = self.node(index);
        let corner = self.index(node.map(|n| n / SIDE * SIDE));
        let cube = SubCube::new(node.map(|n| n % SIDE), side);
        let nodes = self.clear_edges(node, corner).restricted_to(&cube).reachable_from(node.map(|n| n % SIDE));
        let [_, row, layer] = self.strides;
        for (z, layer_bits) in nodes.into_iter().enumerate().filter(|(_, bits)| *bits != 0) {
            for y in 0..SIDE {
                let first = corner + z * layer + y * row;
                let row_bits = (layer_bits >> (8 * y)) as u8;
                let windings = &mut self.windings[first..first + SIDE];
                if row_bits == u8::MAX {
                    windings.fill(winding);
                    continue;
                }
                for (x, node_winding) in windings.iter_mut().enumerate() {
                    *node_winding = if row_bits >> x & 1 == 1 { winding } else { *node_winding };
                }
            }
        }
        cube.visit_faces(&nodes, |[x, y, z], axis, is_last| {
            let from = corner + z * layer + y * row + x;
            let stride = self.strides[axis];
            let edge = [from, if is_last { from + stride } else { from - stride }];
            if self.extends_flood(edge) {
                self.frontier.push_back(edge);
            }
        });
    }

    /// Clear edges of the cube of a node. If its middle is farther from the surface than from its corners, all are.
    fn clear_edges(&self, node: [usize; 3], corner: usize) -> ClearEdges {
        let middle = corner + SIDE / 2 * self.strides.iter().sum::<usize>();
        let is_whole = (0..3).all(|axis| node[axis] / SIDE * SIDE + SIDE <= self.block.counts[axis]);
        let to_corner = (SIDE / 2) as f64 * 3.0_f64.sqrt() * self.block.spacing * self.clearance;
        if is_whole && self.distances[middle] > to_corner as f32 {
            return ClearEdges::ALL;
        }
        ClearEdges::new(&self.distances[corner..], self.strides, (self.block.spacing * self.clearance) as f32)
    }

    /// Whether an edge is clear and leads to an unknown node.
    fn extends_flood(&self, [from, to]: [usize; 2]) -> bool {
        let min_sum = (self.block.spacing * self.clearance) as f32;
        self.distances[from] + self.distances[to] > min_sum && !self.windings[to].is_known()
    }

    /// Edges from a node to its six neighbours.
    fn grid_edges(&self, index: usize) -> [[usize; 2]; 6] {
        let [x, y, z] = self.strides;
        [index - x, index + x, index - y, index + y, index - z, index + z].map(|to| [index, to])
    }

    /// Carries winding numbers along all clear edges, breadth first: so along shortest paths.
    fn flood(&mut self) {
        while let Some([from, to]) = self.frontier.pop_front() {
            if !self.windings[to].is_known() {
                self.adopt(to, self.windings[from], 1.0, |flood| flood.position(from));
            }
        }
    }

    fn assign_all_sides(&mut self) {
        let mut unknown = self.unknown();
        // Crossing triangles from a known node is cheaper than an evaluation.
        if unknown.len() < self.block.counts.iter().product() {
            self.assign_sides(&mut unknown, 0.0, false);
        }
        // Nodes far from the surface first: a value there floods the most nodes.
        for min_spacings in [4.0, 1.0] {
            self.assign_sides(&mut unknown, (min_spacings * self.block.spacing) as f32, true);
        }
        for index in &unknown {
            if !self.windings[*index].is_known() {
                self.copy_from_diagonal(*index);
                self.flood();
            }
        }
        self.assign_sides(&mut unknown, 0.0, true);
    }

    fn unknown(&self) -> Vec<usize> {
        let rows = self.block.rows().map(|[y, z]| self.index([0, y, z]));
        let nodes = rows.flat_map(|first| first..first + self.block.counts[0]);
        nodes.filter(|index| !self.windings[*index].is_known()).collect()
    }

    /// Assigns winding numbers to the unknown nodes with at least this distance: to all of them if `evaluates`.
    fn assign_sides(&mut self, unknown: &mut Vec<usize>, min_distance: f32, evaluates: bool) {
        for index in unknown.iter().copied() {
            if self.windings[index].is_known() || self.distances[index] < min_distance {
                continue;
            }
            self.copy_from_diagonal(index);
            if !self.windings[index].is_known() {
                self.cross_triangles(index);
            }
            if evaluates && !self.windings[index].is_known() {
                self.evaluate(index);
            }
            self.flood();
        }
        unknown.retain(|index| !self.windings[*index].is_known());
    }

    fn evaluate(&mut self, index: usize) {
        // A value that cannot be carried on needs no smaller error than its own side does.
        let is_carried = self.regions.is_empty() || self.sub_cube(self.node(index), SIDE / 4).slope < 0.5;
        let max_error = if is_carried { MAX_EVALUATED_ERROR } else { f64::INFINITY };
        let position = self.position(index);
        let estimate = self.mesh.winding_estimate(position, max_error);
        if self.is_on_surface(index) && self.is_undecided(position, estimate) {
            self.windings[index] = Winding::UNDECIDED;
            return;
        }
        let winding = Winding::new(estimate);
        if winding.is_certain() {
            self.adopt(index, winding, 0.0, |flood| flood.position(index));
        }
        if !self.windings[index].is_known() {
            self.windings[index] = winding;
        }
    }

    /// Is a point on an open mesh, up to the rounding of f64, and does rounding decide its side? It does where |w| is 1/2, and at edges.
    fn is_undecided(&self, point: Vector3<f64>, estimate: Estimate) -> bool {
        if self.mesh.boundary().is_empty() {
            return false;
        }
        let nearest = self.mesh.nearest(point, 0);
        let [a, b, c] = self.mesh.tree().corners[nearest.guess];
        let is_at_edge = |[from, to]: [Vector3<f64>; 2]| {
            (to - from).cross(&(point - from)).norm() <= SINGLE_SLACK * (to - from).norm_squared()
        };
        let is_at_half = (estimate.value.abs() - 0.5).abs() <= estimate.error.max(SUM_SLACK);
        let size = self.mesh.bounds().diagonal().max(point.amax());
        nearest.distance <= PRUNE_SLACK * size && (is_at_half || [[a, b], [b, c], [c, a]].into_iter().any(is_at_edge))
    }

    fn is_on_surface(&self, index: usize) -> bool {
        f64::from(self.distances[index]) < ON_SURFACE * self.block.spacing
    }
}

/// Largest error with which an evaluated winding number can be carried on.
const MAX_EVALUATED_ERROR: f64 = 0.25;
