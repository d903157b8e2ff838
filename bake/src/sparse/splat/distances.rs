//! Distances of a brick's 8³ nodes to the triangles of its list, in f32 around its middle, in voxels.
//!
//! Octants of 4³ nodes, then groups of 4 × 2 × 2, keep only the triangles that can be nearest to one of their points
//! (`nearest_test`). Sixteen triangles are looked at from one middle, then sixteen nodes are measured to one triangle.

use sdf_core::nalgebra::Vector3;

use super::frame::{TriangleFrame, greater, lesser};
use super::nearest_test::{NearestTest, Region, largest_sine};
use super::packed::{PackedTriangles, View, WIDTH};
use crate::error::normal_cones::MAX_ERROR;
use crate::rounding::{BRICK_DISTANCE_ROUNDING, CHAIN_SLACK_F32};

/// Nodes of a brick.
pub(super) const NODES: usize = 512;

/// Lists of more packs than this are copied for each octant; shorter ones are masked.
const MAX_MASKED_PACKS: usize = 6;

/// Half diagonal of the 4 × 2 × 2 nodes of a group, in voxels, rounded up.
const GROUP_RADIUS: f32 = 1.6584;

/// Query of one brick.
#[derive(Clone, Copy)]
pub(super) struct BrickQuery<'a> {
    pub triangles: &'a [TriangleFrame],
    /// Indices of the triangles that can be nearest to a node within `reach`, or to a cell in the band.
    pub list: &'a [u32],
    /// Middle of the nodes.
    pub middle: Vector3<f64>,
    pub inv_spacing: f64,
    /// Nodes farther than this from the surface need no distance.
    pub reach: f32,
    /// Half width of the band if the error is wanted.
    pub certified_band: Option<f32>,
}

/// Distances of one brick, and scratch buffers.
pub(super) struct BrickDistances {
    /// In voxels, x fastest; of nodes beyond the reach, anything beyond it.
    pub distances: Box<[f32; NODES]>,
    /// Index in the list of the nearest triangle, or of one near it.
    pub nearest: Box<[u32; NODES]>,
    /// Largest error of the distances, in voxels.
    pub rounding: f32,
    /// Error bound of interpolation in the cells that the band enters, in voxels.
    pub interpolation: f32,
    packed: Vec<PackedTriangles>,
    octant_packed: Vec<PackedTriangles>,
    octant_list: Vec<u32>,
    masks: Vec<u32>,
    views: Vec<View>,
    picked: Vec<u32>,
}

/// Nodes and cells of an octant, around the middle of its cells.
const OCTANT: Region = Region::symmetric([2.0; 3]);
const GROUP_NODES: Region = Region::symmetric([1.5, 0.5, 0.5]);
/// The cells whose first corners are the nodes of a group.
const GROUP_CELLS: Region = Region { lower: [-1.5, -0.5, -0.5], upper: [2.5, 1.5, 1.5] };

impl BrickDistances {
    pub fn new() -> Self {
        Self {
            distances: Box::new([0.0; NODES]),
            nearest: Box::new([0; NODES]),
            rounding: 0.0,
            interpolation: 0.0,
            packed: vec![],
            octant_packed: vec![],
            octant_list: vec![],
            masks: vec![],
            views: vec![],
            picked: vec![],
        }
    }

    /// Measures all nodes of a brick. The list is not empty.
    pub fn measure(&mut self, arch: pulp::Arch, query: BrickQuery) {
        arch.dispatch(Measure { brick: self, query });
    }

    /// Indices in the list of the triangles whose distances from a point exceed the least by no more than twice
    /// `rounding`. `offset` is the point's from the middle, in voxels. To be asked after [`Self::measure`].
    pub fn nearest_to(&mut self, arch: pulp::Arch, offset: [f32; 3], list_length: usize, rounding: f32) -> &[u32] {
        let packs = list_length.div_ceil(WIDTH);
        let count = arch.dispatch(FindNearest { brick: self, packs, offset, rounding });
        &self.picked[..count]
    }

    #[inline(always)]
    fn load(&mut self, query: &BrickQuery) {
        let packs = query.list.len().div_ceil(WIDTH);
        if self.packed.len() < packs {
            self.packed.resize(packs, PackedTriangles::default());
            self.octant_packed.resize(packs, PackedTriangles::default());
            self.octant_list.resize(packs * WIDTH, 0);
            self.masks.resize(packs, 0);
            self.views.resize(packs, View::default());
            self.picked.resize(packs * WIDTH, 0);
        }
        let mut size = 0.0;
        for index in 0..packs * WIDTH {
            // The last triangle fills the rest: nothing changes by a triangle that occurs twice.
            let triangle = &query.triangles[query.list[index.min(query.list.len() - 1)] as usize];
            let pack = &mut self.packed[index / WIDTH];
            size = greater(size, pack.set(index % WIDTH, triangle, query.middle, query.inv_spacing));
        }
        self.rounding = BRICK_DISTANCE_ROUNDING * (size + 8.0);
        self.interpolation = 0.0;
    }

    #[inline(always)]
    fn octant(&mut self, octant: usize, query: &BrickQuery) {
        let packs = query.list.len().div_ceil(WIDTH);
        let side = |axis: usize| if octant >> axis & 1 == 0 { 0 } else { 4 };
        let first = [side(0), side(1), side(2)];
        // Middle of the nodes, and of the cells.
        let middle = first.map(|side| side as f32 - 2.0);
        let cells_middle = middle.map(|x| x + 0.5);
        for (pack, view) in self.packed[..packs].iter().zip(&mut self.views) {
            pack.view(cells_middle, view);
        }
        let (pack, lane) = nearest_of(&self.views[..packs], None);
        let (nearest_sq, offset) = lane_of(&self.views[pack], lane);
        // The nodes are in the cells.
        let farthest = query.reach + 2.0 * 3.0_f32.sqrt() + 4.0 * self.rounding;
        if nearest_sq.sqrt() > farthest * 1.0001 {
            let base = node_index(first);
            let nearest = (pack * WIDTH + lane) as u32;
            self.fill_beyond(base, [4, 4, 4], query.reach, nearest);
            return;
        }
        let test = NearestTest::new(OCTANT, nearest_sq, offset, self.rounding);
        for (view, mask) in self.views[..packs].iter().zip(&mut self.masks) {
            *mask = test.pass(view);
        }
        if packs > MAX_MASKED_PACKS {
            let kept = self.copy_masked(packs);
            let packs = kept.div_ceil(WIDTH);
            for [y, z] in [[0, 0], [2, 0], [0, 2], [2, 2]] {
                self.group::<true>([first[0], first[1] + y, first[2] + z], packs, query);
            }
        } else {
            for [y, z] in [[0, 0], [2, 0], [0, 2], [2, 2]] {
                self.group::<false>([first[0], first[1] + y, first[2] + z], packs, query);
            }
        }
    }

    /// Copies the triangles of the masks to the octant's own packs, and returns their number.
    #[inline(always)]
    fn copy_masked(&mut self, packs: usize) -> usize {
        let mut kept = 0;
        for pack in 0..packs {
            let mut mask = self.masks[pack];
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                self.octant_packed[kept / WIDTH].copy(kept % WIDTH, &self.packed[pack], lane);
                self.octant_list[kept] = (pack * WIDTH + lane) as u32;
                kept += 1;
            }
        }
        let last = kept - 1;
        for index in kept..kept.next_multiple_of(WIDTH) {
            let from = self.octant_packed[last / WIDTH];
            self.octant_packed[index / WIDTH].copy(index % WIDTH, &from, last % WIDTH);
            self.octant_list[index] = self.octant_list[last];
        }
        self.masks[..kept.div_ceil(WIDTH)].fill(0xffff);
        kept
    }

    /// Measures 4 × 2 × 2 nodes.
    #[inline(always)]
    fn group<const IS_COPIED: bool>(&mut self, first: [usize; 3], packs: usize, query: &BrickQuery) {
        let packed = if IS_COPIED { &self.octant_packed[..packs] } else { &self.packed[..packs] };
        let start = first.map(|n| n as f32 - 3.5);
        let middle = [start[0] + 1.5, start[1] + 0.5, start[2] + 0.5];
        for pack in 0..packs {
            if self.masks[pack] != 0 {
                packed[pack].view(middle, &mut self.views[pack]);
            }
        }
        let (pack, lane) = nearest_of(&self.views[..packs], Some(&self.masks));
        let (nearest_sq, offset) = lane_of(&self.views[pack], lane);
        let nearest = nearest_sq.sqrt();
        let is_in_reach = nearest <= (query.reach + GROUP_RADIUS + 4.0 * self.rounding) * 1.0001;
        let is_certified = query.certified_band.is_some_and(|band| {
            let radius = GROUP_CELLS.radius_sq().sqrt();
            nearest <= (band + radius + 4.0 * self.rounding) * 1.0001
        });
        let base = node_index(first);
        if !is_in_reach {
            let index = if IS_COPIED { self.octant_list[pack * WIDTH + lane] } else { (pack * WIDTH + lane) as u32 };
            self.fill_beyond(base, [4, 2, 2], query.reach, index);
            return;
        }
        let nodes_test = NearestTest::new(GROUP_NODES, nearest_sq, offset, self.rounding);
        let mut picked = 0;
        for pack in 0..packs {
            if self.masks[pack] == 0 {
                continue;
            }
            let mut mask = nodes_test.pass(&self.views[pack]) & self.masks[pack];
            while mask != 0 {
                self.picked[picked] = (pack * WIDTH) as u32 + mask.trailing_zeros();
                mask &= mask - 1;
                picked += 1;
            }
        }
        if is_certified && f64::from(self.interpolation) < MAX_ERROR {
            let test = NearestTest::new(GROUP_CELLS, nearest_sq, offset, self.rounding);
            let sine = largest_sine(packed, &self.masks, &self.views, &test);
            self.interpolation = greater(self.interpolation, (MAX_ERROR as f32) * sine);
        }
        let mut points = [[0.0; WIDTH]; 3];
        for lane in 0..WIDTH {
            points[0][lane] = start[0] + (lane % 4) as f32;
            points[1][lane] = start[1] + (lane / 4 % 2) as f32;
            points[2][lane] = start[2] + (lane / 8) as f32;
        }
        let (mut least, mut indices) = ([f32::INFINITY; WIDTH], [0_u32; WIDTH]);
        for index in &self.picked[..picked] {
            let now = packed[*index as usize / WIDTH].distances_sq(*index as usize % WIDTH, &points);
            let (before, mut next) = (least, indices);
            for lane in 0..WIDTH {
                next[lane] = if now[lane] < before[lane] { *index } else { indices[lane] };
                least[lane] = lesser(now[lane], before[lane]);
            }
            indices = next;
        }
        for lane in 0..WIDTH {
            least[lane] = least[lane].sqrt();
        }
        for row in 0..4 {
            let at = base + 8 * (row % 2) + 64 * (row / 2);
            for x in 0..4 {
                let index = indices[4 * row + x];
                self.distances[at + x] = least[4 * row + x];
                self.nearest[at + x] = if IS_COPIED { self.octant_list[index as usize] } else { index };
            }
        }
    }

    /// Marks nodes as beyond the reach.
    #[inline(always)]
    fn fill_beyond(&mut self, base: usize, counts: [usize; 3], reach: f32, nearest: u32) {
        for z in 0..counts[2] {
            for y in 0..counts[1] {
                let at = base + 8 * (y + 8 * z);
                self.distances[at..at + counts[0]].fill(reach + 1.0);
                self.nearest[at..at + counts[0]].fill(nearest);
            }
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
    rounding: f32,
}

impl pulp::NullaryFnOnce for FindNearest<'_> {
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        let Self { brick: BrickDistances { packed, views, picked, .. }, packs, offset, rounding } = self;
        let mut least = [f32::INFINITY; WIDTH];
        for (pack, view) in packed[..packs].iter().zip(views.iter_mut()) {
            view.distances_sq = pack.distances_sq_from(offset);
            let before = least;
            for lane in 0..WIDTH {
                least[lane] = lesser(view.distances_sq[lane], before[lane]);
            }
        }
        let most = least.into_iter().fold(f32::INFINITY, lesser).sqrt() + 2.0 * rounding;
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

fn node_index([x, y, z]: [usize; 3]) -> usize {
    x + 8 * (y + 8 * z)
}

/// Pack and lane of the nearest triangle, the first of equals.
#[inline(always)]
fn nearest_of(views: &[View], masks: Option<&[u32]>) -> (usize, usize) {
    let (mut least, mut packs) = ([f32::INFINITY; WIDTH], [0_u32; WIDTH]);
    for (pack, view) in (0_u32..).zip(views) {
        if masks.is_some_and(|masks| masks[pack as usize] == 0) {
            continue;
        }
        let (before, mut next) = (least, packs);
        for lane in 0..WIDTH {
            next[lane] = if view.distances_sq[lane] < before[lane] { pack } else { packs[lane] };
            least[lane] = lesser(view.distances_sq[lane], before[lane]);
        }
        packs = next;
    }
    let mut nearest = 0;
    for lane in 1..WIDTH {
        nearest = if least[lane] < least[nearest] { lane } else { nearest };
    }
    (packs[nearest] as usize, nearest)
}

#[inline(always)]
fn lane_of(view: &View, lane: usize) -> (f32, [f32; 3]) {
    (view.distances_sq[lane], [view.offsets[0][lane], view.offsets[1][lane], view.offsets[2][lane]])
}
