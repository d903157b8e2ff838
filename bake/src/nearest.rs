//! The nearest triangles of 8 × 8 × 8 nodes at once.
//!
//! What may hold the nearest to any of them is gathered once for all: nodes of the tree, so few that each can be looked at. From
//! cubes of 8 × 8 × 8 nodes down to 2 × 2 × 2, the nodes of the tree are told which of eight parts they matter to, and are opened for
//! each. The eight stand side by side in the lanes of registers, as do the eight nodes in the end. Sifting is in f32 and keeps all
//! that rounding leaves in doubt. What remains is measured in f64, with the same bits as by [`Bvh::nearest`].

pub mod octant_cull;
mod octants;
mod prefilter;

use sdf_core::grid::Lattice;
use sdf_core::nalgebra::Vector3;

use crate::bvh::{Bvh, NearestTriangle, PruneBound};
use crate::nearest::octant_cull::{NearestPoints, OctantCull};
use crate::rounding::{CHAIN_SLACK, NODE_POSITION_ROUNDING, SINGLE_SLACK};
use crate::simd::{LANES, LaneLists, Lanes, VectorX8, lane_of, or_lanes};
use crate::triangle::approx::UnitFrame;
use crate::triangle::nearest::distances_sq;
use octants::{corner, sides};
use prefilter::{Cubes, Prefilter};

/// Nodes along each side.
pub(crate) const SIDE: usize = 8;

/// All of them.
pub(crate) const NODES: usize = SIDE * SIDE * SIDE;

/// Nodes of the tree are opened for a packet while there are no more of them. With fewer, what is opened for each part of it is
/// more than was needed; with more, too many are looked at.
pub(crate) const MAX_OPENED: usize = 192;

/// Nodes, x fastest, cut into rows: those of the packets that begin at the same y and z, with these.
pub(crate) fn rows_of_packets<T>(nodes: &mut [T], [row, rows, layers]: [usize; 3]) -> Vec<([usize; 2], Vec<&mut [T]>)> {
    let along_y = rows.div_ceil(SIDE);
    let first = |tile: usize| [tile % along_y * SIDE, tile / along_y * SIDE];
    let mut tiles: Vec<_> = (0..along_y * layers.div_ceil(SIDE)).map(|tile| (first(tile), vec![])).collect();
    for (index, nodes) in nodes.chunks_mut(row).enumerate() {
        tiles[index / rows / SIDE * along_y + index % rows / SIDE].1.push(nodes);
    }
    tiles
}

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
    tree: &'a Bvh,
    /// By node, x fastest. What was not asked for is not set.
    nearest: Vec<NearestInPacket>,
    /// Nearest to the middle of the last packet.
    guess: usize,
    last: Option<Nodes>,
    /// [`MAX_OPENED`].
    most_opened: usize,
    found: Vec<u32>,
    opened: Vec<u32>,
    of_large: LaneLists,
    of_small: LaneLists,
    sifted: Prefilter,
}

/// What is nearest to a node.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NearestInPacket {
    /// In the order of the tree. `None` of a node so far that it was not measured: then no triangle is nearer than the distance.
    pub slot: Option<u32>,
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
    fn eight_from(&self, first: [usize; 3]) -> VectorX8<f64> {
        let mut points: VectorX8<f64> = [[0.0; LANES]; 3];
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

    /// Of a cube of nodes.
    fn middle_of(&self, first: [usize; 3], side: usize) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| 0.5 * (self.axes[axis][first[axis]] + self.axes[axis][first[axis] + side - 1]))
    }

    /// From that middle to the farthest node, and a bit more.
    fn radius(&self, first: [usize; 3], side: usize) -> f64 {
        let middle = self.middle_of(first, side);
        let way = Vector3::from_fn(|axis, _| {
            let ends = [first[axis], first[axis] + side - 1].map(|step| self.axes[axis][step]);
            (middle[axis] - ends[0]).abs().max((middle[axis] - ends[1]).abs())
        });
        way.norm() * (1.0 + SINGLE_SLACK)
    }

    /// The largest coordinate.
    fn farthest(&self) -> f64 {
        self.axes.iter().flat_map(|axis| [axis[0], axis[SIDE - 1]]).fold(0.0, |most, x| most.max(x.abs()))
    }

    /// Of so many along each axis, that are asked for, the first and the last coordinates.
    #[inline(always)]
    fn ends(&self, first: [usize; 3], side: usize) -> [[f64; 2]; 3] {
        let last = |axis: usize| (first[axis] + side).min(self.counts[axis]).max(first[axis] + 1) - 1;
        [0, 1, 2].map(|axis: usize| [self.axes[axis][first[axis]], self.axes[axis][last(axis)]])
    }

    /// That node that was asked for and is about the nearest to a point.
    fn step_near(&self, point: Vector3<f64>) -> [usize; 3] {
        [0, 1, 2].map(|axis: usize| {
            let step = ((point[axis] - self.axes[axis][0]) / self.spacing).round().max(0.0) as usize;
            step.min(self.counts[axis].clamp(1, SIDE) - 1)
        })
    }
}

impl<'a> Packet<'a> {
    pub fn new(tree: &'a Bvh) -> Self {
        Self {
            tree,
            nearest: vec![NearestInPacket::default(); NODES],
            guess: 0,
            last: None,
            most_opened: MAX_OPENED,
            found: vec![],
            opened: vec![],
            of_large: LaneLists::new(),
            of_small: LaneLists::new(),
            sifted: Prefilter::new(),
        }
    }

    /// Finds the nearest triangle of each node that is no farther than `far`, and of some that are. False where no node is `within`
    /// so much of the mesh: then none is set.
    pub fn measure(&mut self, nodes: &Nodes, within: f64, far: f64) -> bool {
        let middle = nodes.middle_of([0; 3], SIDE);
        let beside = self.last.and_then(|last| self.nearest(last.step_near(middle)).slot);
        let nearest = self.tree.nearest(middle, beside.map_or(self.guess, |slot| slot as usize));
        self.guess = nearest.slot;
        if self.is_beyond(nodes, nearest, within) {
            return false;
        }
        self.tree.arch.dispatch(MeasureTogether { packet: self, nodes, near: nearest.on_triangle.point, far });
        self.last = Some(*nodes);
        true
    }

    /// No node is `within` so much of the mesh. Nodes that are not asked for count as well.
    fn is_beyond(&self, nodes: &Nodes, nearest: NearestTriangle, within: f64) -> bool {
        let is_within = |distance_sq: f64, first, side| distance_sq.sqrt() <= within + nodes.radius(first, side);
        let is_octant_within = |octant: usize| {
            let first = corner(octant).map(|side| side * SIDE / 2);
            let nearest = self.tree.nearest(nodes.middle_of(first, SIDE / 2), nearest.slot);
            is_within(nearest.on_triangle.distance_sq, first, SIDE / 2)
        };
        let distance_sq = nearest.on_triangle.distance_sq;
        let is_any_within =
            distance_sq.sqrt() <= within || is_within(distance_sq, [0; 3], SIDE) && (0..LANES).any(is_octant_within);
        !is_any_within
    }

    /// Of a node that was asked for.
    pub fn nearest(&self, [x, y, z]: [usize; 3]) -> NearestInPacket {
        self.nearest[(z * SIDE + y) * SIDE + x]
    }

    /// A triangle near to what was measured last.
    pub fn guess(&self) -> usize {
        self.guess
    }
}

struct MeasureTogether<'a, 'b> {
    packet: &'a mut Packet<'b>,
    nodes: &'a Nodes,
    /// Nearest to the middle.
    near: Vector3<f64>,
    /// Farther nodes are not measured.
    far: f64,
}

impl pulp::NullaryFnOnce for MeasureTogether<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { packet, nodes, near, far } = self;
        packet.measure_together(nodes, near, far)
    }
}

impl Packet<'_> {
    #[inline(always)]
    fn measure_together(&mut self, nodes: &Nodes, near: Vector3<f64>, far: f64) {
        let reach = PruneBound::new(nodes.ends([0; 3], SIDE), near);
        let height = self.tree.reached(&reach, self.most_opened, &mut self.found, &mut self.opened);
        let frame = self.tree.frame;
        let middle = frame.local(nodes.middle_of([0; 3], SIDE));
        let spacing = (nodes.spacing * frame.inv_length) as f32;
        let farthest = middle.iter().fold(0.0_f32, |most, x| most.max(x.abs())) + SIDE as f32 * spacing;
        let moved = nodes.farthest() * frame.inv_length * NODE_POSITION_ROUNDING;
        let rounding = UnitFrame::rounding(farthest) + moved as f32;
        let large = Cubes { middle, step: 2.0 * spacing, half_side: 1.5 * spacing, rounding };
        let bounding_discs = deal_out(self.tree, height, &self.found, &large, &mut self.of_large);
        for octant in 0..LANES {
            self.measure_octant(nodes, octant, &large, height, bounding_discs[octant], far);
        }
    }

    /// 4 × 4 × 4 nodes: one of the large cubes. `bounding_disc` is near to it.
    #[inline(always)]
    fn measure_octant(
        &mut self,
        nodes: &Nodes,
        octant: usize,
        large: &Cubes,
        height: usize,
        bounding_disc: u32,
        far: f64,
    ) {
        let first = corner(octant).map(|side| side * SIDE / 2);
        if !nodes.asks_from(first) {
            return;
        }
        let sides = sides(octant);
        let middle = [0, 1, 2].map(|axis: usize| large.middle[axis] + sides[axis] * large.step);
        let small = Cubes { middle, step: 0.5 * large.step, half_side: 0.25 * large.step, rounding: large.rounding };
        let near = self.tree.corners[self.tree.bounding_disc(height, bounding_disc).slot as usize][0];
        let reach = PruneBound::new(nodes.ends(first, SIDE / 2), near);
        self.tree.open(height, self.of_large.lane(octant), &reach, &mut self.found);
        match height - 1 {
            0 => self.measure_found(nodes, first, &small, far),
            height => self.open_found(nodes, first, &small, height),
        }
    }

    /// 4 × 4 × 4 nodes from the `first` on, of which triangles were found.
    #[inline(always)]
    fn measure_found(&mut self, nodes: &Nodes, first: [usize; 3], cubes: &Cubes, far: f64) {
        let Bvh { rough, frame, .. } = self.tree;
        self.sifted.sift(rough, &self.found, cubes);
        let least = if far < f64::INFINITY { self.sifted.least(cubes) } else { [0.0; LANES] };
        let far = (far * (1.0 + CHAIN_SLACK) * frame.inv_length) as f32;
        let is_near = std::array::from_fn(|part| least[part] <= far && nodes.asks_from(first_of(first, part)));
        self.sifted.pick(rough, cubes, &is_near);
        for part in 0..LANES {
            if is_near[part] {
                self.measure_eight(nodes, first_of(first, part), part);
            } else if nodes.asks_from(first_of(first, part)) {
                let least = f64::from(least[part]) / frame.inv_length;
                self.set(first_of(first, part), |_| NearestInPacket { slot: None, distance_sq: least * least });
            }
        }
    }

    /// The same where nodes of the tree were found.
    #[inline(always)]
    fn open_found(&mut self, nodes: &Nodes, first: [usize; 3], cubes: &Cubes, height: usize) {
        let bounding_discs = deal_out(self.tree, height, &self.found, cubes, &mut self.of_small);
        for part in 0..LANES {
            let first = first_of(first, part);
            if nodes.asks_from(first) {
                self.open_for_eight(nodes, first, part, cubes, height, bounding_discs[part]);
            }
        }
    }

    /// 2 × 2 × 2 nodes from the `first` on: a part of those cubes.
    #[inline(always)]
    fn measure_eight(&mut self, nodes: &Nodes, first: [usize; 3], part: usize) {
        let points = nodes.eight_from(first);
        let mut bests = Bests::new(self.tree, &points, self.sifted.nearest(part));
        for slot in self.sifted.picked(part) {
            bests.consider(self.tree, &points, *slot);
        }
        self.set(first, |lane| bests.nearest(lane));
    }

    /// The same where nodes of the tree are still to be opened. `bounding_disc` is near.
    #[inline(always)]
    fn open_for_eight(
        &mut self,
        nodes: &Nodes,
        first: [usize; 3],
        part: usize,
        cubes: &Cubes,
        height: usize,
        bounding_disc: u32,
    ) {
        let near = self.tree.corners[self.tree.bounding_disc(height, bounding_disc).slot as usize][0];
        let reach = PruneBound::new(nodes.ends(first, 2), near);
        let points = nodes.eight_from(first);
        let mut local: VectorX8<f32> = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let point = self.tree.frame.local(lane_of(&points, lane).into());
            (0..3).for_each(|axis| local[axis][lane] = point[axis]);
        }
        self.found.clear();
        self.found.extend_from_slice(self.of_small.lane(part));
        for height in (1..=height).rev() {
            pick_patches(self.tree, height, &mut self.found, &local, cubes.rounding);
            self.tree.open(height, &self.found, &reach, &mut self.opened);
            std::mem::swap(&mut self.found, &mut self.opened);
        }
        let triangles = &self.tree.rough;
        let mut nearest = NearestPoints::NONE;
        for slot in &self.found {
            nearest.consider(*slot, triangles[*slot as usize].first_corner(), &local);
        }
        let near = OctantCull::new(local, 0.0, nearest.points, cubes.rounding);
        let mut bests = Bests::new(self.tree, &points, nearest.names[0]);
        for slot in &self.found {
            let triangle = &triangles[*slot as usize];
            let holds = near.may_hold_triangle(&triangle.corners(), triangle.radius_sq());
            if or_lanes(&holds) != 0 {
                bests.consider(self.tree, &points, *slot);
            }
        }
        self.set(first, |lane| bests.nearest(lane));
    }

    /// What is nearest to 2 × 2 × 2 nodes.
    #[inline(always)]
    fn set(&mut self, first: [usize; 3], nearest: impl Fn(usize) -> NearestInPacket) {
        for lane in 0..LANES {
            let [x, y, z]: [usize; 3] = [0, 1, 2].map(|axis: usize| first[axis] + corner(lane)[axis]);
            self.nearest[(z * SIDE + y) * SIDE + x] = nearest(lane);
        }
    }
}

/// The first node of a part of 4 × 4 × 4 nodes.
#[inline(always)]
fn first_of(first: [usize; 3], part: usize) -> [usize; 3] {
    [0, 1, 2].map(|axis: usize| first[axis] + 2 * corner(part)[axis])
}

/// To each of eight cubes the nodes of one height that may hold the nearest to a point of it. What comes back is that near to each.
#[inline(always)]
fn deal_out(tree: &Bvh, height: usize, nodes: &[u32], cubes: &Cubes, lists: &mut LaneLists) -> Lanes<u32> {
    let middles = cubes.middles();
    let mut nearest = NearestPoints::NONE;
    for node in nodes {
        nearest.consider(*node, tree.bounding_disc(height, *node).middle, &middles);
    }
    let near = OctantCull::new(middles, cubes.half_side, nearest.points, cubes.rounding);
    lists.clear(nodes.len());
    for node in nodes {
        lists.push(*node, &near.may_hold_patch(tree.bounding_disc(height, *node)));
    }
    nearest.names
}

/// Leaves of nodes of one height those that may hold the nearest to one of eight points.
#[inline(always)]
fn pick_patches(tree: &Bvh, height: usize, nodes: &mut Vec<u32>, points: &VectorX8<f32>, rounding: f32) {
    let mut nearest = NearestPoints::NONE;
    for node in nodes.iter() {
        nearest.consider(*node, tree.bounding_disc(height, *node).middle, points);
    }
    let near = OctantCull::new(*points, 0.0, nearest.points, rounding);
    let mut count = 0;
    for number in 0..nodes.len() {
        let node = nodes[number];
        nodes[count] = node;
        count += or_lanes(&near.may_hold_patch(tree.bounding_disc(height, node))) as usize;
    }
    nodes.truncate(count);
}

/// What is nearest to eight nodes so far.
struct Bests {
    slots: Lanes<u32>,
    distances_sq: Lanes<f64>,
}

impl Bests {
    #[inline(always)]
    fn new(tree: &Bvh, points: &VectorX8<f64>, slot: u32) -> Self {
        Self { slots: [slot; LANES], distances_sq: distances_sq_of(tree, points, slot) }
    }

    #[inline(always)]
    fn nearest(&self, lane: usize) -> NearestInPacket {
        NearestInPacket { slot: Some(self.slots[lane]), distance_sq: self.distances_sq[lane] }
    }

    /// The first in the tree's order where they are equally near.
    #[inline(always)]
    fn consider(&mut self, tree: &Bvh, points: &VectorX8<f64>, slot: u32) {
        let found_sq = distances_sq_of(tree, points, slot);
        for lane in 0..LANES {
            let (best, best_sq) = (self.slots[lane], self.distances_sq[lane]);
            let is_tied = (found_sq[lane] == best_sq) & (slot < best);
            let is_nearer = (found_sq[lane] < best_sq) | is_tied;
            self.distances_sq[lane] = if is_nearer { found_sq[lane] } else { best_sq };
            self.slots[lane] = if is_nearer { slot } else { best };
        }
    }
}

#[inline(always)]
fn distances_sq_of(tree: &Bvh, points: &VectorX8<f64>, slot: u32) -> Lanes<f64> {
    let slot = slot as usize;
    distances_sq(points, &tree.corners[slot], tree.rough[slot].is_sliver)
}

#[cfg(test)]
pub(crate) mod tests;
