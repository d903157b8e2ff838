//! Distances and sides of a brick's 8³ nodes, from the triangles of its list, in f32 around its middle, in voxels.
//!
//! An octant of 4³ nodes keeps only the triangles that can be nearest to one of its nodes (`nearest_test`). Each of them has
//! a supporting plane at its point nearest to the octant's middle, and no point of it is beyond:
//!
//! ```text
//! distance of (middle + v) ≥ d + v·f,   d and f: distance and direction of the middle from the triangle.
//! ```
//!
//! So sixteen nodes are measured to a triangle only if its plane is nearer to one of them than the nearest triangle so far.
//!
//! A node is outside if it is above the planes of all triangles that can be nearest to it, and inside if below all: so is
//! its angle-weighted pseudo-normal, whose faces are among them, for the node's height over a face that has its nearest
//! point is its product with that face's normal. The least distances to triangles that have the node above and below are
//! kept apart; a node is decided if they differ by more than rounding.

use super::frame::{TriangleFrame, greater, lesser, mix};
use super::nearest_test::{NearestTest, Region, largest_sine};
use super::order::ByDistance;
use super::packed::{PackedTriangles, View, WIDTH, Wide};
use super::sides::{NODES, NodeBits};
use crate::error::normal_cones::MAX_ERROR;
use crate::rounding::{BRICK_DISTANCE_ROUNDING, CHAIN_SLACK_F32};
use crate::simd::{bits_of_bytes, lesser_magnitude};

/// Groups of 4 × 2 × 2 nodes in an octant.
const GROUPS: usize = 4;

/// Nodes of a group in one layer.
const HALF: usize = WIDTH / 2;

/// Half diagonal of an octant's nodes, in voxels, rounded up.
const OCTANT_RADIUS: f32 = 2.5981;

/// Nodes of an octant, around their middle.
const OCTANT_NODES: Region = Region { lower: [-1.5; 3], upper: [1.5; 3] };

/// Cells whose first corners are these nodes.
const OCTANT_CELLS: Region = Region { lower: [-1.5; 3], upper: [2.5; 3] };

/// Distance to a triangle below which its direction is not known, in voxels. Beyond it, a direction is off by a hundred
/// times the rounding at most.
const MIN_DIRECTION: f32 = 0.02;

/// Error bound of a supporting plane, in roundings: (1 + |v| / [`MIN_DIRECTION`]), and two for the decision.
const PLANE_ROUNDINGS: f32 = 160.0;

/// Query of one brick.
#[derive(Clone, Copy)]
pub(super) struct BrickQuery<'a> {
    pub triangles: &'a [TriangleFrame],
    /// Indices of the triangles that can be nearest to a node within the largest reach, or to a cell in the band.
    pub list: &'a [u32],
    /// Middle of the nodes, from the block's middle.
    pub offset: [f32; 3],
    /// Nodes farther from the surface than this need no distance, nor do those beyond this and the coarse grid's value.
    pub reach: f32,
    pub kept_within: f32,
    /// The coarse grid's magnitudes at the corners of the slot, in voxels. `None`: all nodes within the reach need distances.
    pub coarse: Option<[f32; 8]>,
    /// Rounding of the positions of nodes and triangles, in voxels.
    pub position_rounding: f32,
    /// Half width of the band if the error is wanted.
    pub certified_band: Option<f32>,
}

/// Distances of one brick, and scratch buffers.
pub(super) struct BrickDistances {
    /// In voxels, x fastest; of nodes that need none, a number that is too great to be stored and no greater than the distance.
    pub distances: Box<[f32; NODES]>,
    /// Nodes whose side is decided, and those of them that are inside.
    pub decided: NodeBits,
    pub inside: NodeBits,
    /// Largest error of the distances, in voxels.
    pub rounding: f32,
    /// Error bound of interpolation in the cells that the band enters, in voxels.
    pub interpolation: f32,
    packed: Vec<PackedTriangles>,
    views: Vec<View>,
    masks: Vec<u32>,
    planes: Vec<[Wide; 4]>,
    picked: Vec<u32>,
    /// Triangles that matter to an octant, by their distances from its middle.
    by_distance: ByDistance,
}

/// Points of the groups of an octant, around its middle.
static GROUP_POINTS: [[Wide; 3]; GROUPS] = group_points();

const fn group_points() -> [[Wide; 3]; GROUPS] {
    let mut points = [[[0.0; WIDTH]; 3]; GROUPS];
    let mut index = 0;
    while index < GROUPS * WIDTH {
        let (group, lane) = (index / WIDTH, index % WIDTH);
        points[group][0][lane] = (lane % 4) as f32 - 1.5;
        points[group][1][lane] = (lane / 4 % 2 + 2 * (group % 2)) as f32 - 1.5;
        points[group][2][lane] = (lane / 8 + 2 * (group / 2)) as f32 - 1.5;
        index += 1;
    }
    points
}

/// An octant's nodes, and their least squared distances so far.
struct Nearest {
    /// The nodes, around the middle of the brick.
    points: [[Wide; 3]; GROUPS],
    /// Distances beyond which they need none.
    limits: [Wide; GROUPS],
    all: [Wide; GROUPS],
    /// To triangles that have the node above them, and below.
    above: [Wide; GROUPS],
    below: [Wide; GROUPS],
}

impl BrickDistances {
    pub fn new() -> Self {
        Self {
            distances: Box::new([0.0; NODES]),
            decided: [0; 8],
            inside: [0; 8],
            rounding: 0.0,
            interpolation: 0.0,
            packed: vec![],
            views: vec![],
            masks: vec![],
            planes: vec![],
            picked: vec![],
            by_distance: ByDistance::default(),
        }
    }

    /// Measures all nodes of a brick. The list is not empty.
    pub fn measure(&mut self, arch: pulp::Arch, query: BrickQuery) {
        arch.dispatch(Measure { brick: self, query });
    }

    /// Indices in the list of the triangles whose distances from a point exceed the least by no more than twice the
    /// rounding. `offset` is the point's from the middle, in voxels. To be asked after [`Self::measure`].
    pub fn nearest_to(&mut self, arch: pulp::Arch, offset: [f32; 3], list_length: usize) -> &[u32] {
        let packs = list_length.div_ceil(WIDTH);
        let count = arch.dispatch(FindNearest { brick: self, packs, offset });
        &self.picked[..count]
    }

    #[inline(always)]
    fn load(&mut self, query: &BrickQuery) {
        let packs = query.list.len().div_ceil(WIDTH);
        if self.packed.len() < packs {
            self.packed.resize(packs, PackedTriangles::default());
            self.planes.resize(packs, [[0.0; WIDTH]; 4]);
            self.masks.resize(packs, 0);
            self.views.resize(packs, View::default());
            self.picked.resize(packs * WIDTH, 0);
        }
        let mut sizes = [0.0; WIDTH];
        for (indices, pack) in query.list.chunks(WIDTH).zip(&mut self.packed) {
            // The last triangle fills the rest: nothing changes by a triangle that occurs twice.
            let mut all = [indices[indices.len() - 1]; WIDTH];
            all[..indices.len()].copy_from_slice(indices);
            let (now, before) = (pack.load(query.triangles, &all, query.offset), sizes);
            for lane in 0..WIDTH {
                sizes[lane] = greater(now[lane], before[lane]);
            }
        }
        let size = sizes.into_iter().fold(0.0, greater);
        self.rounding = BRICK_DISTANCE_ROUNDING * (size + 16.0) + query.position_rounding;
        self.interpolation = 0.0;
        (self.decided, self.inside) = ([0; 8], [0; 8]);
    }

    #[inline(always)]
    fn octant(&mut self, octant: usize, query: &BrickQuery) {
        let packs = query.list.len().div_ceil(WIDTH);
        let side = |axis: usize| if octant >> axis & 1 == 0 { 0 } else { 4 };
        let first: [usize; 3] = [side(0), side(1), side(2)];
        let middle = first.map(|side| side as f32 - 2.0);
        let mut nearest = Nearest::new(middle, query, self.rounding);
        let farthest = nearest.limits.iter().flatten().copied().fold(0.0, greater);
        for (pack, view) in self.packed[..packs].iter().zip(&mut self.views) {
            pack.view(middle, view);
        }
        let (pack, lane) = nearest_of(&self.views[..packs]);
        let (nearest_sq, offset) = self.views[pack].lane(lane);
        if nearest_sq.sqrt() > (farthest + OCTANT_RADIUS + 4.0 * self.rounding) * 1.0001 {
            for row in 0..16 {
                let at = first[0] + 8 * (first[1] + row % 4 + 8 * (first[2] + row / 4));
                self.distances[at..at + 4].fill(farthest);
            }
            return;
        }
        let test = NearestTest::new(OCTANT_NODES, nearest_sq, offset, self.rounding)
            .within(farthest + OCTANT_RADIUS + 4.0 * self.rounding);
        let margin = PLANE_ROUNDINGS * self.rounding;
        self.by_distance.clear();
        for (index, (view, planes)) in self.views[..packs].iter().zip(&mut self.planes).enumerate() {
            let mut mask = test.pass(view);
            if mask != 0 {
                *planes = view.supporting_planes(MIN_DIRECTION, margin);
            }
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                self.by_distance.push(view.distances_sq[lane], WIDTH * index + lane);
            }
        }
        for triangle in self.by_distance.in_order() {
            let (pack, lane) = (triangle / WIDTH, triangle % WIDTH);
            let plane = [0, 1, 2, 3].map(|k: usize| self.planes[pack][k][lane]);
            let mut groups = nearest.improvable(plane);
            while groups != 0 {
                let group = groups.trailing_zeros() as usize;
                groups &= groups - 1;
                nearest.update(group, &self.packed[pack], lane, self.rounding);
            }
        }
        self.store(first, &nearest);
        let Some(band) = query.certified_band else { return };
        let farthest = (band + OCTANT_CELLS.radius_sq().sqrt() + 4.0 * self.rounding) * 1.0001;
        if nearest_sq.sqrt() <= farthest && self.interpolation < MAX_ERROR as f32 {
            let test = NearestTest::new(OCTANT_CELLS, nearest_sq, offset, self.rounding);
            for (view, mask) in self.views[..packs].iter().zip(&mut self.masks) {
                *mask = test.pass(view);
            }
            let sine = largest_sine(&self.packed[..packs], &self.masks[..packs]);
            self.interpolation = greater(self.interpolation, MAX_ERROR as f32 * sine);
        }
    }

    #[inline(always)]
    fn store(&mut self, first: [usize; 3], nearest: &Nearest) {
        for group in 0..GROUPS {
            let (mut distances, mut decided, mut inside) = ([0.0; WIDTH], [0_u8; WIDTH], [0_u8; WIDTH]);
            for lane in 0..WIDTH {
                let (above, below) = (nearest.above[group][lane], nearest.below[group][lane]);
                let distance = nearest.all[group][lane].sqrt();
                distances[lane] = distance;
                let sure = 2.0_f32.mul_add(self.rounding, distance) * (1.0 + CHAIN_SLACK_F32);
                let limit = nearest.limits[group][lane] - 4.0 * self.rounding;
                decided[lane] = u8::from((greater(above, below) > sure * sure) & (distance < limit));
                inside[lane] = u8::from(below < above);
            }
            let (decided, inside) = (bits_of_bytes(&decided), bits_of_bytes(&inside));
            for row in 0..4 {
                let (y, z) = (first[1] + 2 * (group % 2) + row % 2, first[2] + 2 * (group / 2) + row / 2);
                let at = first[0] + 8 * (y + 8 * z);
                self.distances[at..at + 4].copy_from_slice(&distances[4 * row..4 * row + 4]);
                self.decided[z] |= (decided >> (4 * row) & 0xf) << (at % 64);
                self.inside[z] |= (inside >> (4 * row) & 0xf) << (at % 64);
            }
        }
    }
}

impl Nearest {
    /// The nodes of the octant around a point.
    #[inline(always)]
    fn new(middle: [f32; 3], query: &BrickQuery, rounding: f32) -> Self {
        let mut points = GROUP_POINTS;
        for group in &mut points {
            for axis in 0..3 {
                group[axis].iter_mut().for_each(|x| *x += middle[axis]);
            }
        }
        let mut limits = [[query.reach; WIDTH]; GROUPS];
        if let Some(coarse) = &query.coarse {
            for (limits, points) in limits.iter_mut().zip(&points) {
                for lane in 0..WIDTH {
                    let [x, y, z] = [0, 1, 2].map(|axis: usize| (points[axis][lane] + 3.5) * 0.125);
                    let along_x = [0, 2, 4, 6].map(|edge: usize| mix(coarse[edge], coarse[edge + 1], x));
                    let value = mix(mix(along_x[0], along_x[1], y), mix(along_x[2], along_x[3], y), z);
                    limits[lane] = greater(value, query.kept_within);
                }
            }
        }
        let mut limits_sq = limits;
        for (limits, limits_sq) in limits.iter_mut().zip(&mut limits_sq) {
            for lane in 0..WIDTH {
                limits[lane] = limits[lane].mul_add(1.0001, 8.0 * rounding);
                limits_sq[lane] = limits[lane] * limits[lane];
            }
        }
        Self { points, limits, all: limits_sq, above: limits_sq, below: limits_sq }
    }

    /// Bits of the groups to a node of which a triangle with this supporting plane can be nearer than those so far.
    #[inline(always)]
    fn improvable(&self, [x, y, z, distance]: [f32; 4]) -> u32 {
        // Heights of the plane over the first rows of a layer, and over the others.
        let mut heights = [[0.0; HALF]; 2];
        for (rows, heights) in heights.iter_mut().enumerate() {
            for lane in 0..HALF {
                let at = [GROUP_POINTS[rows][0][lane], GROUP_POINTS[rows][1][lane]];
                heights[lane] = at[0].mul_add(x, at[1].mul_add(y, distance));
            }
        }
        let mut groups = 0;
        for group in 0..GROUPS {
            let mut can_improve = [false; HALF];
            for layer in 0..2 {
                let height = z * ((2 * (group / 2) + layer) as f32 - 1.5);
                for lane in 0..HALF {
                    let bound = greater(heights[group % 2][lane] + height, 0.0);
                    can_improve[lane] |= bound * bound <= self.all[group][HALF * layer + lane];
                }
            }
            let any = can_improve.iter().fold(false, |any, lane| any | *lane);
            groups |= u32::from(any) << group;
        }
        groups
    }

    #[inline(always)]
    fn update(&mut self, group: usize, pack: &PackedTriangles, lane: usize, rounding: f32) {
        let (now, heights) = pack.measure(lane, &self.points[group]);
        let (all, above, below) = (self.all[group], self.above[group], self.below[group]);
        for lane in 0..WIDTH {
            let as_above = if heights[lane] > -rounding { now[lane] } else { f32::INFINITY };
            let as_below = if heights[lane] < rounding { now[lane] } else { f32::INFINITY };
            self.all[group][lane] = lesser_magnitude(now[lane], all[lane]);
            self.above[group][lane] = lesser_magnitude(as_above, above[lane]);
            self.below[group][lane] = lesser_magnitude(as_below, below[lane]);
        }
    }
}

struct Measure<'a, 'b> {
    brick: &'a mut BrickDistances,
    query: BrickQuery<'b>,
}

impl pulp::NullaryFnOnce for Measure<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { brick, query } = self;
        brick.load(&query);
        for octant in 0..8 {
            brick.octant(octant, &query);
        }
    }
}

struct FindNearest<'a> {
    brick: &'a mut BrickDistances,
    packs: usize,
    offset: [f32; 3],
}

impl pulp::NullaryFnOnce for FindNearest<'_> {
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        let Self { brick: BrickDistances { packed, views, picked, rounding, .. }, packs, offset } = self;
        let mut least = [f32::INFINITY; WIDTH];
        for (pack, view) in packed[..packs].iter().zip(views.iter_mut()) {
            view.distances_sq = pack.distances_sq_from(offset);
            let before = least;
            for lane in 0..WIDTH {
                least[lane] = lesser(view.distances_sq[lane], before[lane]);
            }
        }
        let most = least.into_iter().fold(f32::INFINITY, lesser).sqrt() + 2.0 * *rounding;
        let most_sq = most * most * (1.0 + CHAIN_SLACK_F32);
        let mut count = 0;
        for (pack, view) in views[..packs].iter().enumerate() {
            for lane in 0..WIDTH {
                picked[count.min(WIDTH * packs - 1)] = (WIDTH * pack + lane) as u32;
                count += usize::from(view.distances_sq[lane] <= most_sq);
            }
        }
        count
    }
}

/// Pack and lane of the nearest triangle, the first of equals.
#[inline(always)]
fn nearest_of(views: &[View]) -> (usize, usize) {
    let (mut least, mut packs) = ([f32::INFINITY; WIDTH], [0_u32; WIDTH]);
    for (pack, view) in (0_u32..).zip(views) {
        let (before, mut next) = (least, packs);
        for lane in 0..WIDTH {
            next[lane] = if view.distances_sq[lane] < before[lane] { pack } else { packs[lane] };
            least[lane] = lesser_magnitude(view.distances_sq[lane], before[lane]);
        }
        packs = next;
    }
    let mut nearest = 0;
    for lane in 1..WIDTH {
        nearest = if least[lane] < least[nearest] { lane } else { nearest };
    }
    (packs[nearest] as usize, nearest)
}

#[cfg(test)]
mod tests;
