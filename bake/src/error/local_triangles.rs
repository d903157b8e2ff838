//! Triangles near a brick, gathered once, and a fast first test of which can be candidates of its blocks.
//!
//! Triangles are enclosed in spheres, eight to an item, and these in spheres of eight. [`ApproxBound`] rejects most of
//! them in f32 for eight blocks at once; [`Candidates`] decides about the rest.

use sdf_core::nalgebra::Vector3;

use crate::bvh::Bvh;
use crate::error::block::Query;
use crate::error::candidates::{BlocksX8, Candidates, CenterOffset};
use crate::rounding::{CHAIN_SLACK_F32, DIRECTION_SLACK_SQ, SINGLE_SLACK, SPHERE_SLACK};
use crate::simd::{LANES, Lanes, VectorX8, dot, lane_of};
use crate::triangle::nearest_on_triangle;

/// Factor that covers all rounding in the test of a sphere, but for that of its center.
const SLACK: f32 = 1.0 + CHAIN_SLACK_F32;

const SQRT_6: f32 = 2.449_489_8;

/// Largest coordinate of a sphere, in units. The square of a larger one may overflow f32.
const MAX_COORDINATE: f64 = 1e15;

/// Triangles of a tree near a point. Their order does not depend on the point.
pub(crate) struct LocalTriangles<'a> {
    tree: &'a Bvh,
    center: Vector3<f64>,
    inv_unit: f64,
    slots: Vec<u32>,
    /// Around each triangle.
    spheres: Vec<BoundingSpheres>,
    /// Around the spheres of each item of [`Self::spheres`].
    groups: Vec<BoundingSpheres>,
    /// Triangles that passed the first test of the last query.
    pub picked: Vec<u32>,
    /// Candidates among [`Self::picked`].
    pub candidates: Candidates<'a>,
}

/// Spheres side by side, in units about the center. Unused lanes have radius −∞.
#[derive(Clone)]
struct BoundingSpheres {
    center: VectorX8<f32>,
    radius: Lanes<f32>,
}

impl<'a> LocalTriangles<'a> {
    /// Gathers all triangles within `radius` of a point, and perhaps some more. Blocks must lie within `radius` too.
    ///
    /// `unit` is the unit of length of all f32 numbers.
    pub fn gather(tree: &'a Bvh, center: Vector3<f64>, radius: f64, unit: f64) -> Self {
        let (slots, spheres, groups) = (vec![], vec![], vec![]);
        let (picked, candidates) = (vec![], Candidates::new(tree));
        let mut local = Self { tree, center, inv_unit: 1.0 / unit, slots, spheres, groups, picked, candidates };
        let radius = radius * f64::from(SLACK);
        let max_offset = radius / unit;
        tree.visit_within(center, radius * radius, |slot| local.push(slot, max_offset));
        let enclosing = |items: &[BoundingSpheres]| BoundingSpheres::enclosing(items, max_offset);
        local.groups.extend(local.spheres.chunks(LANES).map(enclosing));
        local
    }

    fn push(&mut self, slot: usize, max_offset: f64) {
        let corners = self.tree.corners[slot];
        let [a, b, c] = corners;
        let center = (a.inf(&b).inf(&c) + a.sup(&b).sup(&c)) * 0.5;
        let radius_sq = corners.iter().map(|corner| (corner - center).norm_squared()).fold(0.0, f64::max);
        let lane = self.slots.len() % LANES;
        if lane == 0 {
            self.spheres.push(BoundingSpheres::NONE);
        }
        self.slots.push(slot as u32);
        let center = (center - self.center) * self.inv_unit;
        if let Some(spheres) = self.spheres.last_mut() {
            spheres.set(lane, center, radius_sq.sqrt() * self.inv_unit, max_offset);
        }
    }

    /// Finds the candidates of up to eight blocks of one size.
    pub fn find_candidates(&mut self, queries: &[Query]) {
        let max_distance =
            |query: &Query| query.distance + 2.0 * 3.0_f64.sqrt() * query.block.half_side * (1.0 + SINGLE_SLACK);
        let blocks = BlocksX8::new(queries.len(), |index| (queries[index].block, max_distance(&queries[index])));
        let mut nearest: Vec<CenterOffset> = queries.iter().map(|query| self.center_offset(query)).collect();
        self.pick(&blocks, &nearest);
        self.candidates.find(&self.picked, &blocks);
        if !self.has_confirmed(&nearest) {
            // Among equally near triangles, the first is another than the query's.
            for (index, nearest) in nearest.iter_mut().enumerate() {
                *nearest = self.candidates.nearest(index).unwrap_or(*nearest);
            }
            self.pick(&blocks, &nearest);
            self.candidates.find(&self.picked, &blocks);
        }
    }

    fn center_offset(&self, query: &Query) -> CenterOffset {
        let on_triangle = nearest_on_triangle(query.block.center, self.tree.corners[query.slot]);
        CenterOffset { offset: query.block.center - on_triangle.point, distance_sq: on_triangle.distance_sq }
    }

    /// Whether the exact search found the same nearest points, but for rounding.
    fn has_confirmed(&self, nearest: &[CenterOffset]) -> bool {
        nearest.iter().enumerate().all(|(index, nearest)| {
            let found = self.candidates.nearest(index);
            found.is_some_and(|found| {
                (found.offset - nearest.offset).norm_squared() <= DIRECTION_SLACK_SQ * nearest.distance_sq
            })
        })
    }

    /// Picks, in order, the triangles that may be candidates of a block. `nearest`: offsets from the nearest points.
    fn pick(&mut self, blocks: &BlocksX8, nearest: &[CenterOffset]) {
        let bound = |index: usize| ApproxBound::new(self, blocks, index, &nearest[index]);
        let bounds: [ApproxBound; LANES] = std::array::from_fn(|lane| bound(lane.min(nearest.len() - 1)));
        let Self { tree, slots, spheres, groups, picked, .. } = self;
        tree.arch.dispatch(PickTriangles { slots, spheres, groups, bounds: &bounds[..nearest.len()], picked });
    }
}

struct PickTriangles<'a> {
    slots: &'a [u32],
    spheres: &'a [BoundingSpheres],
    groups: &'a [BoundingSpheres],
    bounds: &'a [ApproxBound],
    picked: &'a mut Vec<u32>,
}

impl pulp::NullaryFnOnce for PickTriangles<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { slots, spheres, groups, bounds, picked } = self;
        picked.clear();
        picked.resize(slots.len() + LANES, 0);
        let mut count = 0;
        for ((group, spheres), slots) in groups.iter().zip(spheres.chunks(LANES)).zip(slots.chunks(LANES * LANES)) {
            let admitted = any_admits(bounds, group);
            let items = spheres.iter().zip(slots.chunks(LANES)).zip(admitted);
            for ((spheres, slots), _) in items.filter(|(_, admitted)| *admitted != 0) {
                let admitted = any_admits(bounds, spheres);
                // Branch-free: the lanes are unpredictable.
                for (slot, admitted) in slots.iter().zip(admitted) {
                    picked[count] = *slot;
                    count += admitted as usize;
                }
            }
        }
        picked.truncate(count);
    }
}

/// 1 for the spheres that may hold a candidate of any block, else 0.
#[inline(always)]
fn any_admits(bounds: &[ApproxBound], spheres: &BoundingSpheres) -> Lanes<u32> {
    let mut any = [0; LANES];
    for bound in bounds {
        let admitted = bound.admits(spheres);
        for lane in 0..LANES {
            any[lane] |= admitted[lane];
        }
    }
    any
}

impl BoundingSpheres {
    const NONE: Self = Self { center: [[0.0; LANES]; 3], radius: [f32::NEG_INFINITY; LANES] };

    /// Widens the radius by all rounding of positions, as compared with points at most `max_offset` away.
    fn set(&mut self, lane: usize, center: Vector3<f64>, radius: f64, max_offset: f64) {
        let radius = radius + SPHERE_SLACK * (center.abs().sum() + radius + max_offset);
        // NaN compares false, and the sphere becomes infinite.
        let fits = radius < MAX_COORDINATE && center.amax() < MAX_COORDINATE;
        self.radius[lane] = if fits { radius as f32 } else { f32::INFINITY };
        (0..3).for_each(|axis| self.center[axis][lane] = if fits { center[axis] as f32 } else { 0.0 });
    }

    /// One sphere around all spheres of each item.
    fn enclosing(items: &[Self], max_offset: f64) -> Self {
        let mut enclosing = Self::NONE;
        for (lane, spheres) in items.iter().enumerate() {
            let center_of = |lane: usize| Vector3::from(lane_of(&spheres.center, lane)).map(f64::from);
            let used = || (0..LANES).filter(|lane| spheres.radius[*lane] >= 0.0);
            let low = used().map(center_of).reduce(|a, b| a.inf(&b)).unwrap_or_default();
            let high = used().map(center_of).reduce(|a, b| a.sup(&b)).unwrap_or_default();
            let center = (low + high) * 0.5;
            let farthest = |lane: usize| (center_of(lane) - center).norm() + f64::from(spheres.radius[lane]);
            enclosing.set(lane, center, used().map(farthest).fold(0.0, f64::max), max_offset);
        }
        enclosing
    }
}

/// The test of [`candidates`](crate::error::candidates) for one block, in f32 and for spheres.
struct ApproxBound {
    center: [f32; 3],
    half_side: f32,
    /// A.
    hypotenuse: f32,
    /// k e.
    slope: [f32; 3],
    max_distance: f32,
}

impl ApproxBound {
    fn new(local: &LocalTriangles, blocks: &BlocksX8, block: usize, nearest: &CenterOffset) -> Self {
        let inv_unit = local.inv_unit;
        let center = Vector3::from(lane_of(&blocks.centers, block));
        let hypotenuse = (nearest.distance_sq + 3.0 * blocks.half_side * blocks.half_side).sqrt();
        let direction = nearest.offset.try_normalize(0.0).unwrap_or_default();
        let slope = direction * (nearest.distance_sq.sqrt() / hypotenuse);
        Self {
            center: ((center - local.center) * inv_unit).map(|x| x as f32).into(),
            half_side: (blocks.half_side * inv_unit) as f32,
            hypotenuse: (hypotenuse * inv_unit) as f32,
            slope: slope.map(|x| x as f32).into(),
            max_distance: (blocks.max_distances[block] * inv_unit) as f32,
        }
    }

    /// 0 only for spheres without a candidate, else 1.
    ///
    /// A sphere has radius r and its center is L away in direction −g. A triangle in it has d ≥ L − r. Its direction f
    /// is at an angle α to g with sin α ≤ r/L, so ‖f − g‖₁ ≤ √3 √2 r/L. Thus d ≤ A + s ‖k e − f‖₁ implies L − r ≤ A + s
    /// (‖k e − g‖₁ + √6 r/L). Both sides are multiplied by L; for r ≥ L the sphere is admitted.
    #[inline(always)]
    fn admits(&self, spheres: &BoundingSpheres) -> Lanes<u32> {
        let mut admits = [0; LANES];
        for lane in 0..LANES {
            let offset = [0, 1, 2].map(|axis: usize| self.center[axis] - spheres.center[axis][lane]);
            let radius = spheres.radius[lane];
            let length = dot(offset, offset).sqrt();
            let difference = |axis: usize| (self.slope[axis] * length - offset[axis]).abs();
            let differences = SQRT_6 * radius + difference(0) + difference(1) + difference(2);
            let min_distance = length - radius;
            // NaN compares false, and the sphere is admitted.
            let is_beyond = (min_distance * length > (self.hypotenuse * length + self.half_side * differences) * SLACK)
                | (min_distance > self.max_distance * SLACK);
            admits[lane] = u32::from(!is_beyond);
        }
        admits
    }
}

#[cfg(test)]
mod tests;
