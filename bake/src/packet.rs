//! The nearest triangles of 8 × 8 × 8 nodes at once.
//!
//! What may be nearest to any of them is gathered once for all, and sifted twice: for each of eight cubes of 4 × 4 × 4 nodes,
//! and of these again for each of eight cubes of 2 × 2 × 2. The eight stand side by side in the lanes of registers, as do the
//! eight nodes in the end. Sifting is in f32 and keeps all that rounding leaves in doubt. What remains is measured in f64, with
//! the same bits as by [`Tree::nearest`].

mod candidates;
mod eighths;
mod sift;

use sdf_core::grid::Lattice;
use sdf_core::nalgebra::Vector3;

use crate::lanes_triangle::{LANES, Points, distances_sq};
use crate::rough_triangle::{Frame, Lanes, Seen};
use crate::tree::{Cube, NearestTriangle, Reached, Tree};
use candidates::{AtNodes, Candidate, pick};
use eighths::{corner, sides, steps};
use sift::{Cubes, sift};

/// Nodes along each side.
pub(crate) const SIDE: usize = 8;

/// All of them.
pub(crate) const NODES: usize = SIDE * SIDE * SIDE;

/// More triangles than this are not sifted; each node is searched for by itself.
const MOST_TRIANGLES: usize = 1 << 13;

/// Where the nodes stand.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nodes {
    /// Along each axis; of equal spacing.
    pub axes: [[f64; SIDE]; 3],
    pub spacing: f64,
    /// How many along each axis are asked for, the first of them.
    pub counts: [usize; 3],
}

/// The nearest triangle of each node, and room to work in.
pub(crate) struct Packet<'a> {
    tree: &'a Tree,
    /// By node, x fastest. What was not asked for is not set.
    nearest: Vec<NearestInPacket>,
    /// Nearest to the middle of the last packet.
    guess: usize,
    reached: Vec<Reached>,
    candidates: Vec<Candidate>,
    of_large: [Vec<Candidate>; LANES],
    of_small: [Vec<Candidate>; LANES],
    picked: Vec<u32>,
    seen: Vec<(u32, Seen)>,
}

/// What is nearest to a node.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NearestInPacket {
    /// In the order of the tree.
    pub slot: u32,
    pub distance_sq: f64,
}

impl Nodes {
    /// From the `first` on.
    pub fn of_lattice(lattice: &Lattice, first: [usize; 3], counts: [usize; 3]) -> Self {
        let mut axes = [[0.0; SIDE]; 3];
        for step in 0..SIDE {
            let node = lattice.node(first.map(|n| (n + step) as u32));
            for axis in 0..3 {
                axes[axis][step] = node[axis];
            }
        }
        Self { axes, spacing: lattice.spacing(), counts }
    }

    /// Some node from the `first` on is asked for.
    fn asks_from(&self, first: [usize; 3]) -> bool {
        (0..3).all(|axis| first[axis] < self.counts[axis])
    }

    /// 2 × 2 × 2 of them from the `first` on.
    #[inline(always)]
    fn eight_from(&self, first: [usize; 3]) -> Points {
        let mut points: Points = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            for axis in 0..3 {
                points[axis][lane] = self.axes[axis][first[axis] + corner(lane)[axis]];
            }
        }
        points
    }

    pub fn at(&self, step: [usize; 3]) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.axes[axis][step[axis]])
    }
}

impl<'a> Packet<'a> {
    pub fn new(tree: &'a Tree) -> Self {
        Self {
            tree,
            nearest: vec![NearestInPacket::default(); NODES],
            guess: 0,
            reached: vec![],
            candidates: vec![],
            of_large: Default::default(),
            of_small: Default::default(),
            picked: vec![],
            seen: vec![],
        }
    }

    /// Finds the nearest triangle of each node. False where none is `within` so much of the mesh: then they are not set.
    pub fn measure(&mut self, nodes: &Nodes, within: f64) -> bool {
        let middle = Vector3::from_fn(|axis, _| 0.5 * (nodes.axes[axis][0] + nodes.axes[axis][SIDE - 1]));
        let nearest = self.tree.nearest(middle, self.guess);
        self.guess = nearest.slot;
        match self.tree.arch.dispatch(MeasureTogether { packet: self, nodes, within, middle, nearest }) {
            Outcome::Measured => true,
            Outcome::Beyond => false,
            Outcome::TooMany => {
                self.measure_each(nodes);
                true
            }
        }
    }

    /// Of a node that was asked for.
    pub fn nearest(&self, [x, y, z]: [usize; 3]) -> NearestInPacket {
        self.nearest[(z * SIDE + y) * SIDE + x]
    }

    /// A triangle near to what was measured last.
    pub fn guess(&self) -> usize {
        self.guess
    }

    fn measure_each(&mut self, nodes: &Nodes) {
        let mut guess = self.guess;
        for index in 0..NODES {
            let step = [index % SIDE, index / SIDE % SIDE, index / SIDE / SIDE];
            if nodes.asks_from(step) {
                let node = nodes.at(step);
                let NearestTriangle { slot, on_triangle } = self.tree.nearest(node, guess);
                guess = slot;
                self.nearest[index] = NearestInPacket { slot: slot as u32, distance_sq: on_triangle.distance_sq };
            }
        }
    }
}

struct MeasureTogether<'a, 'b> {
    packet: &'a mut Packet<'b>,
    nodes: &'a Nodes,
    within: f64,
    middle: Vector3<f64>,
    nearest: NearestTriangle,
}

enum Outcome {
    Measured,
    /// No node is as near as was asked.
    Beyond,
    /// More triangles may be nearest than are worth sifting.
    TooMany,
}

impl pulp::NullaryFnOnce for MeasureTogether<'_, '_> {
    type Output = Outcome;

    #[inline(always)]
    fn call(self) -> Outcome {
        let Self { packet, nodes, within, middle, nearest } = self;
        packet.measure_together(nodes, within, middle, nearest)
    }
}

impl Packet<'_> {
    #[inline(always)]
    fn measure_together(
        &mut self,
        nodes: &Nodes,
        within: f64,
        middle: Vector3<f64>,
        nearest: NearestTriangle,
    ) -> Outcome {
        let cube = Cube { middle, half_side: 0.5 * (SIDE - 1) as f64 * nodes.spacing };
        if !self.tree.reaching(cube, &nearest.on_triangle, MOST_TRIANGLES, &mut self.reached) {
            return Outcome::TooMany;
        }
        self.take_reached(nearest.slot);
        let Frame { per_length, .. } = self.tree.frame;
        let middle = self.tree.frame.local(middle);
        let spacing = (nodes.spacing * per_length) as f32;
        let farthest = middle.iter().fold(0.0_f32, |most, x| most.max(x.abs())) + SIDE as f32 * spacing;
        let rounding = Frame::rounding(farthest);
        let large = Cubes { middle, step: 2.0 * spacing, half_side: 1.5 * spacing, rounding };
        sift(&self.tree.rough, &self.candidates, &large, &mut self.picked, &mut self.seen, &mut self.of_large);
        // From the middle of a large cube to its corners, and what rounding adds.
        let reach = 3.0_f32.sqrt() * large.half_side + 2.0 * rounding;
        let beyond = (within * per_length) as f32 + reach;
        if self.of_large.iter().flatten().all(|candidate| candidate.least > beyond) {
            return Outcome::Beyond;
        }
        for octant in 0..LANES {
            self.measure_octant(nodes, octant, &large);
        }
        Outcome::Measured
    }

    /// 4 × 4 × 4 nodes: one of the large cubes.
    #[inline(always)]
    fn measure_octant(&mut self, nodes: &Nodes, octant: usize, large: &Cubes) {
        let first = corner(octant).map(|side| side * SIDE / 2);
        if !nodes.asks_from(first) {
            return;
        }
        let sides = sides(octant);
        let middle = [0, 1, 2].map(|axis: usize| large.middle[axis] + sides[axis] * large.step);
        let small = Cubes { middle, step: 0.5 * large.step, half_side: 0.25 * large.step, rounding: large.rounding };
        sift(&self.tree.rough, &self.of_large[octant], &small, &mut self.picked, &mut self.seen, &mut self.of_small);
        for part in 0..LANES {
            let corner = corner(part);
            let first: [usize; 3] = [0, 1, 2].map(|axis: usize| first[axis] + 2 * corner[axis]);
            if nodes.asks_from(first) {
                self.measure_eight(nodes, first, part, &small);
            }
        }
    }

    /// Makes candidates of what was reached, that in the slot `nearest` the first.
    #[inline(always)]
    fn take_reached(&mut self, nearest: usize) {
        self.candidates.clear();
        for reached in &self.reached {
            let per_distance = if reached.distance > 0.0 { 1.0 / reached.distance } else { 0.0 };
            self.candidates.push(Candidate {
                slot: reached.slot as u32,
                least: (reached.distance * self.tree.frame.per_length) as f32,
                direction: reached.way.map(|way| (way * per_distance) as f32),
            });
            if reached.slot == nearest {
                let last = self.candidates.len() - 1;
                self.candidates.swap(0, last);
            }
        }
    }

    /// 2 × 2 × 2 nodes from the `first` on: a part of those cubes.
    #[inline(always)]
    fn measure_eight(&mut self, nodes: &Nodes, first: [usize; 3], part: usize, cubes: &Cubes) {
        let points = nodes.eight_from(first);
        let candidates = &self.of_small[part];
        let mut best_sq = distances_sq_of(self.tree, &points, candidates[0].slot);
        let mut slots = [candidates[0].slot; LANES];
        let mut most: Lanes = [0.0; LANES];
        for lane in 0..LANES {
            most[lane] = (best_sq[lane].sqrt() * self.tree.frame.per_length) as f32 + 2.0 * cubes.rounding;
        }
        let rest = &candidates[1..];
        pick(rest, &mut self.picked, &AtNodes { steps: steps(cubes.half_side), most });
        for picked in &self.picked {
            let slot = rest[*picked as usize].slot;
            let found_sq = distances_sq_of(self.tree, &points, slot);
            for lane in 0..LANES {
                let is_tied = (found_sq[lane] == best_sq[lane]) & (slot < slots[lane]);
                let is_nearer = (found_sq[lane] < best_sq[lane]) | is_tied;
                best_sq[lane] = if is_nearer { found_sq[lane] } else { best_sq[lane] };
                slots[lane] = if is_nearer { slot } else { slots[lane] };
            }
        }
        for lane in 0..LANES {
            let [x, y, z]: [usize; 3] = [0, 1, 2].map(|axis: usize| first[axis] + corner(lane)[axis]);
            self.nearest[(z * SIDE + y) * SIDE + x] = NearestInPacket { slot: slots[lane], distance_sq: best_sq[lane] };
        }
    }
}

#[inline(always)]
fn distances_sq_of(tree: &Tree, points: &Points, slot: u32) -> [f64; LANES] {
    let slot = slot as usize;
    distances_sq(points, &tree.corners[slot], tree.rough[slot].is_sliver)
}

#[cfg(test)]
pub(crate) mod tests;
