//! Of some triangles the ones that can be nearest to a point of a block: its candidates. Eight blocks go side by side, each step
//! of it with the bits of [`nearest_on_triangle`](crate::triangle::nearest_on_triangle).

use sdf_core::nalgebra::Vector3;

use crate::bvh::Bvh;
use crate::error::Block;
use crate::rounding::SINGLE_SLACK;
use crate::simd::{LANES, LaneLists, Lanes, VectorX8, dot, lane_of, sub};
use crate::triangle::nearest::for_each_point;

/// Blocks side by side. Where there are fewer than eight, the last of them stands several times.
pub(crate) struct Blocks {
    pub centers: VectorX8<f64>,
    pub half_side: f64,
    /// No candidate is farther from the center.
    pub most: Lanes<f64>,
}

/// Of the nearest triangle to a block's center.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CenterOffset {
    /// From the nearest point.
    pub way: Vector3<f64>,
    pub distance_sq: f64,
}

/// What was found last.
pub(crate) struct Candidates<'a> {
    tree: &'a Bvh,
    measured: Vec<Measured>,
    /// The first of the nearest of each block. Infinitely far where there is no triangle.
    nearest: Measured,
    of_blocks: LaneLists,
    /// Of each triangle, 1 for the blocks of which it is a candidate, else 0.
    holds: Vec<[u64; LANES]>,
}

/// A triangle as seen from each block's center.
#[derive(Clone, Copy)]
struct Measured {
    /// To the center from the nearest point.
    way: VectorX8<f64>,
    distance_sq: Lanes<f64>,
}

impl Blocks {
    /// From one to eight blocks, all of one size. None of the candidates of each is farther from its center than stands beside it.
    pub fn new(count: usize, block: impl Fn(usize) -> (Block, f64)) -> Self {
        let blocks: [(Block, f64); LANES] = std::array::from_fn(|lane| block(lane.min(count - 1)));
        Self {
            centers: [0, 1, 2].map(|axis| blocks.map(|(block, _)| block.center[axis])),
            half_side: blocks[0].0.half_side,
            most: blocks.map(|(_, most)| most),
        }
    }
}

impl<'a> Candidates<'a> {
    pub fn new(tree: &'a Bvh) -> Self {
        Self { tree, measured: vec![], nearest: Measured::NONE, of_blocks: LaneLists::new(), holds: vec![] }
    }

    /// Of triangles of the tree, among which those nearest to each block's center are.
    pub fn find(&mut self, triangles: &[u32], blocks: &Blocks) {
        self.tree.arch.dispatch(Find { found: self, triangles, blocks });
    }

    /// Of each block, by their numbers among the triangles.
    pub fn of_each(&self) -> [&[u32]; LANES] {
        std::array::from_fn(|block| self.of(block))
    }

    /// Of a block, by their numbers among the triangles.
    pub fn of(&self, block: usize) -> &[u32] {
        self.of_blocks.lane(block)
    }

    /// Of each triangle, 1 for the blocks of which it is a candidate, else 0.
    pub fn holds(&self) -> &[[u64; LANES]] {
        &self.holds
    }

    /// `None` where there is no triangle, or no distance that is a number.
    pub fn nearest(&self, block: usize) -> Option<CenterOffset> {
        let way = Vector3::from_fn(|axis, _| self.nearest.way[axis][block]);
        let distance_sq = self.nearest.distance_sq[block];
        (distance_sq < f64::INFINITY).then_some(CenterOffset { way, distance_sq })
    }
}

struct Find<'a, 'b> {
    found: &'a mut Candidates<'b>,
    triangles: &'a [u32],
    blocks: &'a Blocks,
}

impl pulp::NullaryFnOnce for Find<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { found: Candidates { tree, measured, nearest, of_blocks, holds }, triangles, blocks } = self;
        measured.clear();
        *nearest = Measured::NONE;
        for slot in triangles {
            let slot = *slot as usize;
            let of_triangle = Measured::new(&tree.corners[slot], tree.rough[slot].is_sliver, &blocks.centers);
            nearest.keep_nearer(&of_triangle);
            measured.push(of_triangle);
        }
        let reach = PruneBound::new(blocks, nearest);
        of_blocks.clear(triangles.len());
        holds.clear();
        for (number, of_triangle) in (0..).zip(measured.iter()) {
            let takes = reach.holds(of_triangle);
            of_blocks.push(number, &takes);
            holds.push(takes.map(u64::from));
        }
    }
}

impl Measured {
    const NONE: Self = Self { way: [[0.0; LANES]; 3], distance_sq: [f64::INFINITY; LANES] };

    #[inline(always)]
    fn new(corners: &[Vector3<f64>; 3], is_sliver: bool, centers: &VectorX8<f64>) -> Self {
        let mut measured = Self::NONE;
        for_each_point(centers, corners, is_sliver, |lane, nearest, distance_sq| {
            let way = sub(lane_of(centers, lane), nearest);
            (0..3).for_each(|axis| measured.way[axis][lane] = way[axis]);
            measured.distance_sq[lane] = distance_sq;
        });
        measured
    }

    #[inline(always)]
    fn keep_nearer(&mut self, other: &Self) {
        for lane in 0..LANES {
            let is_nearer = other.distance_sq[lane] < self.distance_sq[lane];
            let keep = |mine: f64, others: f64| if is_nearer { others } else { mine };
            self.distance_sq[lane] = keep(self.distance_sq[lane], other.distance_sq[lane]);
            for axis in 0..3 {
                self.way[axis][lane] = keep(self.way[axis][lane], other.way[axis][lane]);
            }
        }
    }
}

/// What tells whether a triangle can be nearest to a point of each block, and is no farther from its center than `most`.
///
/// A point x = c + v of it, v·v ≤ ρ², is no farther from the triangle nearest to c, at D with direction e from there to c,
/// than √(D² + 2D v·e + ρ²) ≤ A + k v·e, where A = √(D² + ρ²) and k = D/A; and from any other, at d with direction f, it is at
/// least d + v·f away, as that lies behind the plane across f.
pub(crate) struct PruneBound {
    half_side: f64,
    hypotenuse: Lanes<f64>,
    slope: VectorX8<f64>,
    most_sq: Lanes<f64>,
}

impl PruneBound {
    #[inline(always)]
    fn new(blocks: &Blocks, nearest: &Measured) -> Self {
        let half_side = blocks.half_side * (1.0 + SINGLE_SLACK);
        let (mut hypotenuse, mut slope, mut most_sq) = ([0.0; LANES], [[0.0; LANES]; 3], [0.0; LANES]);
        for lane in 0..LANES {
            let distance_sq = nearest.distance_sq[lane];
            let way = lane_of(&nearest.way, lane);
            let length = length_or_one(way);
            hypotenuse[lane] = (distance_sq + 3.0 * half_side * half_side).sqrt();
            let share = distance_sq.sqrt() / hypotenuse[lane];
            (0..3).for_each(|axis| slope[axis][lane] = way[axis] / length * share);
            most_sq[lane] = blocks.most[lane] * blocks.most[lane];
        }
        Self { half_side, hypotenuse, slope, most_sq }
    }

    /// 1, else 0.
    #[inline(always)]
    fn holds(&self, measured: &Measured) -> [u32; LANES] {
        let mut holds = [0; LANES];
        for lane in 0..LANES {
            let way = lane_of(&measured.way, lane);
            let length = length_or_one(way);
            let apart = |axis: usize| (self.slope[axis][lane] - way[axis] / length).abs();
            let apart = self.half_side * (apart(0) + apart(1) + apart(2));
            let distance_sq = measured.distance_sq[lane];
            let is_held = (distance_sq <= self.most_sq[lane])
                & (distance_sq.sqrt() <= (self.hypotenuse[lane] + apart) * (1.0 + SINGLE_SLACK));
            holds[lane] = u32::from(is_held);
        }
        holds
    }
}

/// No way has no direction.
#[inline(always)]
fn length_or_one(way: [f64; 3]) -> f64 {
    let length = dot(way, way).sqrt();
    if length > 0.0 { length } else { 1.0 }
}
