//! Descent of one packet: from the tree's candidates for 8³ nodes to exact distances of 2³ nodes at a time.

use sdf_core::nalgebra::Vector3;

use super::nearest_x8::NearestX8;
use super::octants::{Octants, corner};
use super::{NearestToNode, PacketNodes, PacketSearch, SIDE};
use crate::bvh::{PacketTree, PruneBound};
use crate::nearest::octant_cull::{NearestPoints, OctantCull};
use crate::rounding::{CHAIN_SLACK, NODE_POSITION_ROUNDING};
use crate::simd::{LANES, LaneLists, Lanes, VectorX8, lane_of, or_lanes};
use crate::triangle::approx::UnitFrame;

/// [`PacketSearch::descend`], dispatched to the instruction set of the machine.
struct Descent<'a, 'b> {
    search: &'a mut PacketSearch<'b>,
    nodes: &'a PacketNodes,
    on_mesh: Vector3<f64>,
    max_distance: f64,
}

impl pulp::NullaryFnOnce for Descent<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { search, nodes, on_mesh, max_distance } = self;
        search.search_packet(nodes, on_mesh, max_distance)
    }
}

impl PacketSearch<'_> {
    /// Searches all nodes of a packet. `on_mesh` is the point of the mesh nearest to its center.
    pub(super) fn descend(&mut self, nodes: &PacketNodes, on_mesh: Vector3<f64>, max_distance: f64) {
        self.tree.arch.dispatch(Descent { search: self, nodes, on_mesh, max_distance });
    }

    #[inline(always)]
    fn search_packet(&mut self, nodes: &PacketNodes, on_mesh: Vector3<f64>, max_distance: f64) {
        let bound = PruneBound::new(nodes.ends([0; 3], SIDE), on_mesh);
        let height = self.tree.candidates_within(&bound, self.max_expanded, &mut self.candidates, &mut self.expanded);
        let frame = self.tree.frame;
        let center = frame.unit_from_mesh_f32(nodes.center([0; 3], SIDE));
        let spacing = (nodes.spacing * frame.inv_length) as f32;
        let max_coordinate = center.iter().fold(0.0_f32, |max, x| max.max(x.abs())) + SIDE as f32 * spacing;
        let moved = nodes.max_coordinate() * frame.inv_length * NODE_POSITION_ROUNDING;
        let rounding = UnitFrame::rounding(max_coordinate) + moved as f32;
        let octants = Octants { center, step: 2.0 * spacing, half_side: 1.5 * spacing, rounding };
        let nearest = distribute(self.tree, height, &self.candidates, &octants, &mut self.octant_lists);
        for octant in 0..LANES {
            self.search_octant(nodes, octant, &octants, height, nearest[octant], max_distance);
        }
    }

    /// Searches the 4 × 4 × 4 nodes of an octant. `near` is a tree node near to it.
    #[inline(always)]
    fn search_octant(
        &mut self,
        nodes: &PacketNodes,
        octant: usize,
        octants: &Octants,
        height: usize,
        near: u32,
        max_distance: f64,
    ) {
        let first = corner(octant).map(|side| side * SIDE / 2);
        if !nodes.contains(first) {
            return;
        }
        let suboctants = Octants {
            center: octants.octant_center(octant),
            step: 0.5 * octants.step,
            half_side: 0.25 * octants.step,
            rounding: octants.rounding,
        };
        let bound = PruneBound::new(nodes.ends(first, SIDE / 2), disc_corner(self.tree, height, near));
        self.tree.expand(height, self.octant_lists.lane(octant), &bound, &mut self.candidates);
        match height - 1 {
            0 => self.search_triangles(nodes, first, &suboctants, max_distance),
            height => self.search_tree_nodes(nodes, first, &suboctants, height),
        }
    }

    /// Searches 4 × 4 × 4 nodes from `first` on, whose candidates are triangles.
    #[inline(always)]
    fn search_triangles(&mut self, nodes: &PacketNodes, first: [usize; 3], suboctants: &Octants, max_distance: f64) {
        let (approx, frame) = (self.tree.approx, self.tree.frame);
        self.prefilter.filter(approx, &self.candidates, suboctants);
        let lower_bounds =
            if max_distance < f64::INFINITY { self.prefilter.lower_bounds(suboctants) } else { [0.0; LANES] };
        let max_distance = (max_distance * (1.0 + CHAIN_SLACK) * frame.inv_length) as f32;
        let is_wanted = std::array::from_fn(|part| {
            lower_bounds[part] <= max_distance && nodes.contains(suboctant_first(first, part))
        });
        self.prefilter.filter_by_corners(approx, suboctants, &is_wanted);
        for part in 0..LANES {
            let part_first = suboctant_first(first, part);
            if is_wanted[part] {
                self.measure_suboctant(nodes, part_first, part);
            } else if nodes.contains(part_first) {
                let distance = f64::from(lower_bounds[part]) / frame.inv_length;
                self.store(part_first, |_| NearestToNode { slot: None, distance_sq: distance * distance });
            }
        }
    }

    /// Searches 4 × 4 × 4 nodes from `first` on, whose candidates are nodes of the tree.
    #[inline(always)]
    fn search_tree_nodes(&mut self, nodes: &PacketNodes, first: [usize; 3], suboctants: &Octants, height: usize) {
        let nearest = distribute(self.tree, height, &self.candidates, suboctants, &mut self.suboctant_lists);
        for part in 0..LANES {
            let first = suboctant_first(first, part);
            if nodes.contains(first) {
                self.descend_suboctant(nodes, first, part, suboctants, height, nearest[part]);
            }
        }
    }

    /// Measures the 2 × 2 × 2 nodes of a suboctant to what the prefilter left.
    #[inline(always)]
    fn measure_suboctant(&mut self, nodes: &PacketNodes, first: [usize; 3], part: usize) {
        let points = nodes.eight_from(first);
        let mut nearest = NearestX8::new(self.tree, &points, self.prefilter.nearest(part));
        for slot in self.prefilter.survivors(part) {
            nearest.update(self.tree, &points, *slot);
        }
        self.store(first, |lane| nearest.lane(lane));
    }

    /// Expands a suboctant's candidates down to triangles, and measures its 2 × 2 × 2 nodes to them. `near` is a tree
    /// node near to it.
    #[inline(always)]
    fn descend_suboctant(
        &mut self,
        nodes: &PacketNodes,
        first: [usize; 3],
        part: usize,
        suboctants: &Octants,
        height: usize,
        near: u32,
    ) {
        let bound = PruneBound::new(nodes.ends(first, 2), disc_corner(self.tree, height, near));
        let points = nodes.eight_from(first);
        let mut local: VectorX8<f32> = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let point = self.tree.frame.unit_from_mesh_f32(lane_of(&points, lane).into());
            (0..3).for_each(|axis| local[axis][lane] = point[axis]);
        }
        self.candidates.clear();
        self.candidates.extend_from_slice(self.suboctant_lists.lane(part));
        for height in (1..=height).rev() {
            retain_near(self.tree, height, &mut self.candidates, &local, suboctants.rounding);
            self.tree.expand(height, &self.candidates, &bound, &mut self.expanded);
            std::mem::swap(&mut self.candidates, &mut self.expanded);
        }
        let triangles = self.tree.approx;
        let mut nearest = NearestPoints::NONE;
        for slot in &self.candidates {
            nearest.update(*slot, triangles[*slot as usize].first_corner(), &local);
        }
        let cull = OctantCull::new(local, 0.0, nearest.points, suboctants.rounding);
        let mut nearest = NearestX8::new(self.tree, &points, nearest.ids[0]);
        for slot in &self.candidates {
            let triangle = &triangles[*slot as usize];
            if or_lanes(&cull.keeps_triangle(&triangle.corners(), triangle.radius_sq())) != 0 {
                nearest.update(self.tree, &points, *slot);
            }
        }
        self.store(first, |lane| nearest.lane(lane));
    }

    /// Stores the results of 2 × 2 × 2 nodes from `first` on.
    #[inline(always)]
    fn store(&mut self, first: [usize; 3], nearest: impl Fn(usize) -> NearestToNode) {
        for lane in 0..LANES {
            let [x, y, z]: [usize; 3] = [0, 1, 2].map(|axis: usize| first[axis] + corner(lane)[axis]);
            self.nearest[(z * SIDE + y) * SIDE + x] = nearest(lane);
        }
    }
}

/// First node of a suboctant in the octant that begins at `first`.
#[inline(always)]
fn suboctant_first(first: [usize; 3], part: usize) -> [usize; 3] {
    [0, 1, 2].map(|axis: usize| first[axis] + 2 * corner(part)[axis])
}

/// A point of the mesh: the corner of a triangle in the middle of a tree node's disc.
#[inline(always)]
fn disc_corner(tree: PacketTree, height: usize, node: u32) -> Vector3<f64> {
    tree.corners[tree.bounding_disc(height, node).slot as usize][0]
}

/// Fills each octant's list with the tree nodes of one height that can hold the nearest to a point of the octant.
/// Returns the tree node whose disc's center is nearest to each octant's.
#[inline(always)]
fn distribute(tree: PacketTree, height: usize, nodes: &[u32], octants: &Octants, lists: &mut LaneLists) -> Lanes<u32> {
    let centers = octants.centers();
    let mut nearest = NearestPoints::NONE;
    for node in nodes {
        nearest.update(*node, tree.bounding_disc(height, *node).center, &centers);
    }
    let cull = OctantCull::new(centers, octants.half_side, nearest.points, octants.rounding);
    lists.clear(nodes.len());
    for node in nodes {
        lists.push(*node, &cull.keeps_disc(tree.bounding_disc(height, *node)));
    }
    nearest.ids
}

/// Keeps those tree nodes of one height that can hold the nearest to one of eight points.
#[inline(always)]
fn retain_near(tree: PacketTree, height: usize, nodes: &mut Vec<u32>, points: &VectorX8<f32>, rounding: f32) {
    let mut nearest = NearestPoints::NONE;
    for node in nodes.iter() {
        nearest.update(*node, tree.bounding_disc(height, *node).center, points);
    }
    let cull = OctantCull::new(*points, 0.0, nearest.points, rounding);
    // Branch-free: `count` advances only past nodes that are kept.
    let mut count = 0;
    for index in 0..nodes.len() {
        let node = nodes[index];
        nodes[count] = node;
        count += or_lanes(&cull.keeps_disc(tree.bounding_disc(height, node))) as usize;
    }
    nodes.truncate(count);
}
