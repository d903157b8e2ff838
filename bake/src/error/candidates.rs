//! Candidates of a block: the triangles that can be nearest to one of its points.
//!
//! A block has center c and half side s; its points are c + v with |v|² ≤ ρ² = 3 s². The triangle nearest to c is at
//! distance D in direction −e, and another is at distance d in direction −f. Then at c + v
//!
//! ```text
//! D(c + v) ≤ √(D² + 2D v·e + ρ²) ≤ A + k v·e,   A = √(D² + ρ²), k = D/A       (a root lies below its tangent)
//! d(c + v) ≥ d + v·f                                                          (it lies behind the plane across f)
//! ```
//!
//! so the other can be nearest only if d ≤ A + s ‖k e − f‖₁ (`docs/error-bounds.md`, "Which triangles can be nearest").
//! Eight blocks are searched side by side; all distances have the bits of
//! [`nearest_on_triangle`](crate::triangle::nearest_on_triangle).

use sdf_core::nalgebra::Vector3;

use crate::bvh::Bvh;
use crate::error::block::ErrorBlock;
use crate::rounding::SINGLE_SLACK;
use crate::simd::{LANES, LaneLists, Lanes, VectorX8, dot, lane_of, sub};
use crate::triangle::nearest::for_each_point;

/// Blocks of one size side by side. Unused lanes repeat the last block.
pub(crate) struct BlocksX8 {
    pub centers: VectorX8<f64>,
    pub half_side: f64,
    /// Largest distance of a candidate from the center.
    pub max_distances: Lanes<f64>,
}

/// Offset of a block's center from the nearest point of a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CenterOffset {
    pub offset: Vector3<f64>,
    pub distance_sq: f64,
}

/// Candidates of the eight blocks of the last search.
pub(crate) struct Candidates<'a> {
    tree: &'a Bvh,
    offsets: Vec<CenterOffsetX8>,
    /// The first nearest triangle of each block. Infinitely far if there are no triangles.
    nearest: CenterOffsetX8,
    lists: LaneLists,
    memberships: Vec<Lanes<u64>>,
}

/// Offsets of eight blocks' centers from their nearest points of one triangle.
#[derive(Clone, Copy)]
struct CenterOffsetX8 {
    offset: VectorX8<f64>,
    distance_sq: Lanes<f64>,
}

impl BlocksX8 {
    /// Takes `count` blocks, from one to eight, each with the largest distance of its candidates.
    pub fn new(count: usize, block: impl Fn(usize) -> (ErrorBlock, f64)) -> Self {
        let blocks: [(ErrorBlock, f64); LANES] = std::array::from_fn(|lane| block(lane.min(count - 1)));
        Self {
            centers: [0, 1, 2].map(|axis| blocks.map(|(block, _)| block.center[axis])),
            half_side: blocks[0].0.half_side,
            max_distances: blocks.map(|(_, max_distance)| max_distance),
        }
    }
}

impl<'a> Candidates<'a> {
    pub fn new(tree: &'a Bvh) -> Self {
        tree.prepare_packets();
        let (offsets, memberships) = (vec![], vec![]);
        Self { tree, offsets, nearest: CenterOffsetX8::NONE, lists: LaneLists::new(), memberships }
    }

    /// Searches triangles of the tree. They must include those nearest to each block's center.
    pub fn find(&mut self, triangles: &[u32], blocks: &BlocksX8) {
        self.tree.arch.dispatch(FindCandidates { candidates: self, triangles, blocks });
    }

    /// Candidates of each block, as indices into the searched triangles.
    pub fn lists(&self) -> [&[u32]; LANES] {
        std::array::from_fn(|block| self.list(block))
    }

    /// Candidates of one block, as indices into the searched triangles.
    pub fn list(&self, block: usize) -> &[u32] {
        self.lists.lane(block)
    }

    /// For each searched triangle, 1 in the lanes of the blocks of which it is a candidate, else 0.
    pub fn memberships(&self) -> &[Lanes<u64>] {
        &self.memberships
    }

    /// `None` if there are no triangles or all distances are NaN or infinite.
    pub fn nearest(&self, block: usize) -> Option<CenterOffset> {
        let offset = Vector3::from(lane_of(&self.nearest.offset, block));
        let distance_sq = self.nearest.distance_sq[block];
        (distance_sq < f64::INFINITY).then_some(CenterOffset { offset, distance_sq })
    }
}

struct FindCandidates<'a, 'b> {
    candidates: &'a mut Candidates<'b>,
    triangles: &'a [u32],
    blocks: &'a BlocksX8,
}

impl pulp::NullaryFnOnce for FindCandidates<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { candidates: Candidates { tree, offsets, nearest, lists, memberships }, triangles, blocks } = self;
        offsets.clear();
        *nearest = CenterOffsetX8::NONE;
        let approx = tree.approx();
        for slot in triangles {
            let slot = *slot as usize;
            let offset = CenterOffsetX8::new(&tree.corners[slot], approx[slot].is_sliver, &blocks.centers);
            nearest.keep_nearer(&offset);
            offsets.push(offset);
        }
        let bound = CandidateBound::new(blocks, nearest);
        lists.clear(triangles.len());
        memberships.clear();
        for (index, offset) in (0..).zip(offsets.iter()) {
            let is_member = bound.admits(offset);
            lists.push(index, &is_member);
            memberships.push(is_member.map(u64::from));
        }
    }
}

impl CenterOffsetX8 {
    const NONE: Self = Self { offset: [[0.0; LANES]; 3], distance_sq: [f64::INFINITY; LANES] };

    #[inline(always)]
    fn new(corners: &[Vector3<f64>; 3], is_sliver: bool, centers: &VectorX8<f64>) -> Self {
        let mut offsets = Self::NONE;
        for_each_point(centers, corners, is_sliver, |lane, nearest, distance_sq| {
            let offset = sub(lane_of(centers, lane), nearest);
            (0..3).for_each(|axis| offsets.offset[axis][lane] = offset[axis]);
            offsets.distance_sq[lane] = distance_sq;
        });
        offsets
    }

    #[inline(always)]
    fn keep_nearer(&mut self, other: &Self) {
        for lane in 0..LANES {
            let is_nearer = other.distance_sq[lane] < self.distance_sq[lane];
            let select = |mine: f64, others: f64| if is_nearer { others } else { mine };
            self.distance_sq[lane] = select(self.distance_sq[lane], other.distance_sq[lane]);
            for axis in 0..3 {
                self.offset[axis][lane] = select(self.offset[axis][lane], other.offset[axis][lane]);
            }
        }
    }
}

/// The test d ≤ A + s ‖k e − f‖₁ and d ≤ `max_distance`, for each block.
struct CandidateBound {
    half_side: f64,
    /// A.
    hypotenuse: Lanes<f64>,
    /// k e.
    slope: VectorX8<f64>,
    max_distance_sq: Lanes<f64>,
}

impl CandidateBound {
    #[inline(always)]
    fn new(blocks: &BlocksX8, nearest: &CenterOffsetX8) -> Self {
        let half_side = blocks.half_side * (1.0 + SINGLE_SLACK);
        let (mut hypotenuse, mut slope, mut max_distance_sq) = ([0.0; LANES], [[0.0; LANES]; 3], [0.0; LANES]);
        for lane in 0..LANES {
            let distance_sq = nearest.distance_sq[lane];
            let offset = lane_of(&nearest.offset, lane);
            let length = length_or_one(offset);
            hypotenuse[lane] = (distance_sq + 3.0 * half_side * half_side).sqrt();
            let k = distance_sq.sqrt() / hypotenuse[lane];
            (0..3).for_each(|axis| slope[axis][lane] = offset[axis] / length * k);
            max_distance_sq[lane] = blocks.max_distances[lane] * blocks.max_distances[lane];
        }
        Self { half_side, hypotenuse, slope, max_distance_sq }
    }

    /// 1 for the blocks of which a triangle is a candidate, else 0.
    #[inline(always)]
    fn admits(&self, offsets: &CenterOffsetX8) -> Lanes<u32> {
        let mut admits = [0; LANES];
        for lane in 0..LANES {
            let offset = lane_of(&offsets.offset, lane);
            let length = length_or_one(offset);
            let difference = |axis: usize| (self.slope[axis][lane] - offset[axis] / length).abs();
            let excess = self.half_side * (difference(0) + difference(1) + difference(2));
            let distance_sq = offsets.distance_sq[lane];
            let is_candidate = (distance_sq <= self.max_distance_sq[lane])
                & (distance_sq.sqrt() <= (self.hypotenuse[lane] + excess) * (1.0 + SINGLE_SLACK));
            admits[lane] = u32::from(is_candidate);
        }
        admits
    }
}

/// Length of a vector; 1 for the zero vector, so that it divides to zero.
#[inline(always)]
fn length_or_one(vector: [f64; 3]) -> f64 {
    let length = dot(vector, vector).sqrt();
    if length > 0.0 { length } else { 1.0 }
}
