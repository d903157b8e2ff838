//! Which nodes of a block are inside, by winding number.
//!
//! Between two points whose distances sum to more than the way between them there is no triangle: each point of that way
//! lies in one of two balls without any. Along it the winding number changes as slowly as the mesh's rim allows. So a side
//! spreads from where it is sure, and the winding number is asked where nothing has spread to. Where the rim is far, a whole cube
//! of nodes is spread through at once.
//!
//! A winding number never comes without a bound of its error, and no side is told where that covers one half but by the exact sum:
//! so every side is that of the exact winding number. (That sum is rounded; where it is nearer to one half than 1e-9, or a point
//! nearer to a triangle's edge than a millionth of its length, the side is a matter of rounding.)

mod bit_block;
mod regions;
mod winding_value;

use std::collections::VecDeque;

use sdf_core::nalgebra::Vector3;

use crate::MeshDistance;
use crate::rounding::{NODE_STEP_ROUNDING, SINGLE_SLACK};
use crate::sign::winding::{Estimate, MAX_DOUBT};
use bit_block::{Part, SIDE, Ways};
use regions::{Region, Regions};
pub(crate) use winding_value::Winding;

/// Two points whose distances sum to this many times the way between them have no triangle between them, though distances were
/// rounded to f32.
pub(crate) const CLEARANCE: f64 = 1.0 + SINGLE_SLACK;

/// Nodes nearer to the surface than this part of a spacing are on it but for rounding.
const ON_SURFACE: f64 = 1e-4;

/// Nodes of a regular grid, x fastest.
pub(crate) struct NodeBlock<P> {
    pub counts: [usize; 3],
    pub spacing: f64,
    pub position: P,
}

/// A point beside a node of a block, with its winding number.
pub(crate) struct Seed {
    pub node: [usize; 3],
    pub position: Vector3<f64>,
    /// From the node to there, in spacings.
    pub way: f64,
    /// No triangle is nearer to the point.
    pub distance: f32,
    pub winding: Winding,
}

/// The winding numbers of a block's nodes.
pub(crate) struct SignedBlock {
    strides: [usize; 3],
    windings: Vec<Winding>,
}

impl SignedBlock {
    pub fn at(&self, node: [usize; 3]) -> Winding {
        self.windings[index_of(node, self.strides)]
    }
}

/// Of a node in a block that has one more on each side.
fn index_of(node: [usize; 3], strides: [usize; 3]) -> usize {
    (0..3).map(|axis| (node[axis] + 1) * strides[axis]).sum()
}

impl<P: Fn([usize; 3]) -> Vector3<f64>> NodeBlock<P> {
    /// Negates the distances of all nodes inside, x fastest. A distance may be less than the true one. The side is that of the exact
    /// winding number but for rounding, whatever is `known`: only the time depends on that.
    pub fn sign(&self, mesh: &MeshDistance, known: &[Seed], distances: &mut [f32]) {
        self.sign_rows(mesh, known, &mut distances.chunks_mut(self.counts[0]).collect::<Vec<_>>());
    }

    /// As [`Self::sign`], of rows that need not follow on each other: those of the first layer first. The winding numbers come
    /// back.
    pub fn sign_rows(&self, mesh: &MeshDistance, known: &[Seed], rows: &mut [&mut [f32]]) -> SignedBlock {
        let mut flood = FloodFill::new(self, mesh, rows);
        for point in known {
            flood.accept(point);
        }
        flood.give_all_sides();
        for ([y, z], row) in self.rows().zip(rows) {
            let from = flood.index([0, y, z]);
            for (distance, winding) in row.iter_mut().zip(&flood.windings[from..]) {
                *distance = if winding.is_inside() { -distance.abs() } else { distance.abs() };
            }
        }
        SignedBlock { strides: flood.strides, windings: flood.windings }
    }

    fn rows(&self) -> impl Iterator<Item = [usize; 2]> + use<P> {
        let [_, rows, layers] = self.counts;
        (0..layers).flat_map(move |z| (0..rows).map(move |y| [y, z]))
    }
}

/// A block of whole cubes, with one more node on each side, so that every node of the block has all its neighbours.
struct FloodFill<'a, P> {
    block: &'a NodeBlock<P>,
    mesh: &'a MeshDistance<'a>,
    /// To the next node along each axis.
    strides: [usize; 3],
    /// Of nodes that are not the block's so negative that no way to them is free.
    distances: Vec<f32>,
    windings: Vec<Winding>,
    regions: Regions,
    /// [`CLEARANCE`], and more where coordinates are so large that nodes do not stand where the lattice says.
    free_way: f64,
    /// Free ways yet to be taken, from nodes that are known.
    ways: VecDeque<[usize; 2]>,
}

impl<'a, P: Fn([usize; 3]) -> Vector3<f64>> FloodFill<'a, P> {
    fn new(block: &'a NodeBlock<P>, mesh: &'a MeshDistance<'a>, of_rows: &[&mut [f32]]) -> Self {
        let [row, rows, layers] = block.counts.map(|n| n.next_multiple_of(SIDE) + 2);
        let mut padded = vec![f32::NEG_INFINITY; row * rows * layers];
        for ([y, z], distances) in block.rows().zip(of_rows) {
            let from = ((z + 1) * rows + y + 1) * row + 1;
            for (padded, distance) in padded[from..].iter_mut().zip(distances.iter()) {
                *padded = distance.abs();
            }
        }
        let windings = vec![Winding::UNKNOWN; padded.len()];
        let ends = [[0; 3], block.counts.map(|n| n - 1)].map(&block.position);
        let farthest = ends.iter().map(|end| end.amax()).fold(0.0, f64::max);
        let free_way = CLEARANCE + NODE_STEP_ROUNDING * farthest / block.spacing;
        let regions = Regions::new(block.counts, mesh, free_way);
        let strides = [1, row, row * rows];
        Self { block, mesh, strides, distances: padded, windings, regions, free_way, ways: VecDeque::new() }
    }

    fn index(&self, node: [usize; 3]) -> usize {
        index_of(node, self.strides)
    }

    fn node(&self, index: usize) -> [usize; 3] {
        let [_, row, layer] = self.strides;
        [index % row - 1, index % layer / row - 1, index / layer - 1]
    }

    fn position(&self, index: usize) -> Vector3<f64> {
        (self.block.position)(self.node(index))
    }

    fn accept(&mut self, known: &Seed) {
        let index = self.index(known.node);
        if !self.windings[index].is_known() && self.is_free(index, known.distance, known.way) {
            self.take(index, known.winding, known.way, |_| known.position);
            self.flood();
        }
    }

    /// No triangle is between a node and a point so many spacings away with no triangle nearer than `distance`.
    fn is_free(&self, index: usize, distance: f32, way: f64) -> bool {
        if way == 0.0 {
            return !self.is_on_surface(index);
        }
        self.distances[index] + distance > (way * self.block.spacing * self.free_way) as f32
    }

    /// The winding number of a point so many spacings away on a free way, if that tells the side; and with it all nodes of the cube
    /// that free ways lead to, if the rim is so far that it tells theirs.
    fn take(&mut self, index: usize, of: Winding, way: f64, from: impl FnOnce(&Self) -> Vector3<f64>) {
        if self.regions.are_none() {
            return self.fill(index, of, SIDE);
        }
        let node = self.node(index);
        let has_cap = self.mesh.boundary().has_cap();
        if let Some(winding) = self.regions.whole(self.block, self.mesh, node).carry(of, way, has_cap) {
            return self.fill(index, winding, SIDE);
        }
        if has_cap && let Some(winding) = self.part(node, SIDE / 2).carry(of, way, true) {
            return self.fill(index, winding, SIDE / 2);
        }
        if let Some(winding) = self.alone(index, of, way, from) {
            self.windings[index] = winding;
            for way in self.ways_around(index) {
                if self.leads_on(way) {
                    self.ways.push_back(way);
                }
            }
        }
    }

    fn part(&mut self, node: [usize; 3], side: usize) -> Region {
        self.regions.part(self.block, self.mesh, node, side)
    }

    /// At this node alone, where the rim is near.
    fn alone(
        &mut self,
        index: usize,
        of: Winding,
        way: f64,
        from: impl FnOnce(&Self) -> Vector3<f64>,
    ) -> Option<Winding> {
        let node = self.node(index);
        let around = self.part(node, SIDE / 4);
        if self.mesh.boundary().has_cap()
            && let Some(winding) = around.carry(of, way, true)
        {
            return Some(winding);
        }
        let at = |slope: f64| Estimate { error: f64::from(of.error) + way * slope, ..of.into() };
        let point = (self.block.position)(node);
        let mut about = at(around.slope);
        if about.error > MAX_DOUBT {
            let radius = 0.5 * way * self.block.spacing * self.free_way;
            let slope = self.mesh.boundary().winding_slope((point + from(self)) * 0.5, radius);
            about = at((slope * self.block.spacing * self.free_way).min(f64::MAX));
        }
        let found = Winding::new(self.mesh.boundary().sharpen(about, point).unwrap_or(about));
        found.is_sure().then_some(found)
    }

    /// Gives a winding number to a node, and to all that free ways lead to in its cube of so many nodes along a side.
    fn fill(&mut self, index: usize, winding: Winding, side: usize) {
        self.windings[index] = winding;
        if !self.ways_around(index).into_iter().any(|way| self.leads_on(way)) {
            return;
        }
        let node = self.node(index);
        let corner = self.index(node.map(|n| n / SIDE * SIDE));
        let part = Part::new(node.map(|n| n % SIDE), side);
        let nodes = self.ways(node, corner).within(&part).from(node.map(|n| n % SIDE));
        let [_, row, layer] = self.strides;
        for (z, bits) in nodes.into_iter().enumerate().filter(|(_, bits)| *bits != 0) {
            for y in 0..SIDE {
                let from = corner + z * layer + y * row;
                let of_row = (bits >> (8 * y)) as u8;
                let windings = &mut self.windings[from..from + SIDE];
                if of_row == u8::MAX {
                    windings.fill(winding);
                    continue;
                }
                for (x, of_node) in windings.iter_mut().enumerate() {
                    *of_node = if of_row >> x & 1 == 1 { winding } else { *of_node };
                }
            }
        }
        part.on_faces(&nodes, |[x, y, z], axis, is_last| {
            let from = corner + z * layer + y * row + x;
            let stride = self.strides[axis];
            let way = [from, if is_last { from + stride } else { from - stride }];
            if self.leads_on(way) {
                self.ways.push_back(way);
            }
        });
    }

    /// In the cube of a node. If its middle is farther from the surface than its corners from there, all are free.
    fn ways(&self, node: [usize; 3], corner: usize) -> Ways {
        let middle = corner + SIDE / 2 * self.strides.iter().sum::<usize>();
        let is_whole = (0..3).all(|axis| node[axis] / SIDE * SIDE + SIDE <= self.block.counts[axis]);
        let reach = (SIDE / 2) as f64 * 3.0_f64.sqrt() * self.block.spacing * self.free_way;
        if is_whole && self.distances[middle] > reach as f32 {
            return Ways::ALL;
        }
        Ways::new(&self.distances[corner..], self.strides, (self.block.spacing * self.free_way) as f32)
    }

    /// Whether a way is free and leads to a node that is not known.
    fn leads_on(&self, [from, to]: [usize; 2]) -> bool {
        let free_way = (self.block.spacing * self.free_way) as f32;
        self.distances[from] + self.distances[to] > free_way && !self.windings[to].is_known()
    }

    fn ways_around(&self, index: usize) -> [[usize; 2]; 6] {
        let [x, y, z] = self.strides;
        [index - x, index + x, index - y, index + y, index - z, index + z].map(|to| [index, to])
    }

    /// Along all ways, the first to come first: so by the shortest.
    fn flood(&mut self) {
        while let Some([from, to]) = self.ways.pop_front() {
            if !self.windings[to].is_known() {
                self.take(to, self.windings[from], 1.0, |flood| flood.position(from));
            }
        }
    }

    fn give_all_sides(&mut self) {
        let mut unknown = self.unknown();
        // Through the surface from what is known, which takes less time than to ask.
        if unknown.len() < self.block.counts.iter().product() {
            self.assign_sides(&mut unknown, 0.0, false);
        }
        // From far out first, where a side holds for the most nodes.
        for least in [4.0, 1.0] {
            self.assign_sides(&mut unknown, (least * self.block.spacing) as f32, true);
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
        let nodes = rows.flat_map(|from| from..from + self.block.counts[0]);
        nodes.filter(|index| !self.windings[*index].is_known()).collect()
    }

    /// Gives a side to nodes with at least this distance: to all of them where it `asks`.
    fn assign_sides(&mut self, unknown: &mut Vec<usize>, least: f32, asks: bool) {
        for index in unknown.iter().copied() {
            if self.windings[index].is_known() || self.distances[index] < least {
                continue;
            }
            self.copy_from_diagonal(index);
            if !self.windings[index].is_known() {
                self.cross_triangles(index);
            }
            if asks && !self.windings[index].is_known() {
                self.ask(index);
            }
            self.flood();
        }
        unknown.retain(|index| !self.windings[*index].is_known());
    }

    fn ask(&mut self, index: usize) {
        // What cannot be carried on needs no less doubt than the side does.
        let most = if self.mesh.boundary().tells_slopes() { MAX_ASKED_ERROR } else { f64::INFINITY };
        let winding = Winding::new(self.mesh.bounded_winding(self.position(index), most));
        if winding.is_sure() {
            self.take(index, winding, 0.0, |flood| flood.position(index));
        }
        if !self.windings[index].is_known() {
            self.windings[index] = winding;
        }
    }

    /// The winding number of a neighbour across an edge or a corner of a cell, where the way is free as it was along no axis.
    fn copy_from_diagonal(&mut self, index: usize) {
        for (neighbour, way) in self.neighbours(index) {
            let winding = self.windings[neighbour];
            if way > 1.0 && winding.is_known() && self.is_free(index, self.distances[neighbour], way) {
                self.take(index, winding, way, |flood| flood.position(neighbour));
                if self.windings[index].is_known() {
                    return;
                }
            }
        }
    }

    /// The winding number of a neighbour, and what the triangles between add to it.
    fn cross_triangles(&mut self, index: usize) {
        if self.is_on_surface(index) {
            return;
        }
        let known =
            |(neighbour, _): &(usize, f64)| self.windings[*neighbour].is_sure() && !self.is_on_surface(*neighbour);
        let tried: Vec<_> = self.neighbours(index).filter(known).take(TRIES).collect();
        for (neighbour, way) in tried {
            let before = Estimate::from(self.windings[neighbour]);
            let Some(step) = self.mesh.winding_step([neighbour, index].map(|end| self.position(end))) else { continue };
            let after = Winding::new(Estimate { value: before.value + step, ..before });
            self.take(index, after, way, |flood| flood.position(neighbour));
            if self.windings[index].is_known() {
                return;
            }
        }
    }

    fn is_on_surface(&self, index: usize) -> bool {
        f64::from(self.distances[index]) < ON_SURFACE * self.block.spacing
    }

    /// Along edges of cells, and across their faces and through them, with the way there in spacings.
    fn neighbours(&self, index: usize) -> impl Iterator<Item = (usize, f64)> + use<P> {
        let strides = self.strides;
        let first = index - strides.iter().sum::<usize>();
        STEPS.into_iter().map(move |step| {
            let way = (step.iter().filter(|along| **along != 1).count() as f64).sqrt();
            (first + (0..3).map(|axis| step[axis] * strides[axis]).sum::<usize>(), way)
        })
    }
}

/// From the node before a node along each axis to its neighbours.
const STEPS: [[usize; 3]; 26] = {
    let mut steps = [[0; 3]; 26];
    let mut index = 0;
    while index < 26 {
        let place = if index < 13 { index } else { index + 1 };
        steps[index] = [place % 3, place / 3 % 3, place / 9];
        index += 1;
    }
    steps
};

/// Neighbours from which it is tried to pass through the surface. It seldom fails but where the rim is near.
const TRIES: usize = 3;

/// With more, a winding number that was asked for would not be carried on.
const MAX_ASKED_ERROR: f64 = 0.25;
