//! Triangles around a place, gathered once, and of these the candidates of its blocks, for eight at a time. Most triangles are
//! passed over by balls around them in f32.

use sdf_core::nalgebra::Vector3;

use crate::bvh::Bvh;
use crate::error::Query;
use crate::error::candidates::{Blocks, Candidates, CenterOffset};
use crate::rounding::{CHAIN_SLACK_F32, DIRECTION_SLACK_SQ, SINGLE_SLACK, SPHERE_SLACK};
use crate::simd::{LANES, Lanes, VectorX8, dot};
use crate::triangle::nearest_on_triangle;

/// More than all rounding of what is said of balls, but for where they are.
const SLACK: f32 = 1.0 + CHAIN_SLACK_F32;

const ROOT_OF_SIX: f32 = 2.449_489_8;

/// In units. Squares of more may be too much for f32.
const FARTHEST: f64 = 1e15;

/// Triangles of a tree in an order that does not depend on where they were gathered.
pub(crate) struct LocalTriangles<'a> {
    tree: &'a Bvh,
    center: Vector3<f64>,
    inv_length: f64,
    slots: Vec<u32>,
    /// Around each.
    balls: Vec<BoundingSpheres>,
    /// Around all balls of each eight.
    groups: Vec<BoundingSpheres>,
    /// Those among which candidates were looked for last.
    pub picked: Vec<u32>,
    pub found: Candidates<'a>,
}

/// Balls side by side.
#[derive(Clone)]
struct BoundingSpheres {
    middle: VectorX8<f32>,
    /// Less than any number where there is none.
    radius: Lanes<f32>,
}

impl<'a> LocalTriangles<'a> {
    /// All triangles no farther from a point than that, and perhaps some more. In f32 ways are counted from there in `unit`s,
    /// and blocks stand within `within`.
    pub fn gather(tree: &'a Bvh, center: Vector3<f64>, within: f64, unit: f64) -> Self {
        let (slots, balls, groups) = (vec![], vec![], vec![]);
        let (picked, found) = (vec![], Candidates::new(tree));
        let mut nearby = Self { tree, center, inv_length: 1.0 / unit, slots, balls, groups, picked, found };
        let within = within * f64::from(SLACK);
        let farthest = within / unit;
        tree.near(center, within * within, |slot| nearby.push(slot, farthest));
        let around = |eights: &[BoundingSpheres]| BoundingSpheres::around(eights, farthest);
        nearby.groups.extend(nearby.balls.chunks(LANES).map(around));
        nearby
    }

    fn push(&mut self, slot: usize, farthest: f64) {
        let corners = self.tree.corners[slot];
        let [a, b, c] = corners;
        let middle = (a.inf(&b).inf(&c) + a.sup(&b).sup(&c)) * 0.5;
        let radius_sq = corners.iter().map(|corner| (corner - middle).norm_squared()).fold(0.0, f64::max);
        let lane = self.slots.len() % LANES;
        if lane == 0 {
            self.balls.push(BoundingSpheres::NONE);
        }
        self.slots.push(slot as u32);
        let middle = (middle - self.center) * self.inv_length;
        if let Some(balls) = self.balls.last_mut() {
            balls.set(lane, middle, radius_sq.sqrt() * self.inv_length, farthest);
        }
    }

    /// The triangles that can be nearest to a point of each of up to eight blocks, all of one size. These are not farther from the
    /// surface, nor from where triangles were gathered, than was said.
    pub fn find(&mut self, asked: &[Query]) {
        let most = |asked: &Query| asked.distance + 2.0 * 3.0_f64.sqrt() * asked.block.half_side * (1.0 + SINGLE_SLACK);
        let blocks = Blocks::new(asked.len(), |number| (asked[number].block, most(&asked[number])));
        let mut nearest: Vec<CenterOffset> = asked.iter().map(|asked| self.to_center(asked)).collect();
        self.pick(&blocks, &nearest);
        self.found.find(&self.picked, &blocks);
        if !self.are_as_found(&nearest) {
            // Of several at the same distance another is the first.
            for (number, nearest) in nearest.iter_mut().enumerate() {
                *nearest = self.found.nearest(number).unwrap_or(*nearest);
            }
            self.pick(&blocks, &nearest);
            self.found.find(&self.picked, &blocks);
        }
    }

    fn to_center(&self, asked: &Query) -> CenterOffset {
        let on_triangle = nearest_on_triangle(asked.block.center, self.tree.corners[asked.slot]);
        CenterOffset { way: asked.block.center - on_triangle.point, distance_sq: on_triangle.distance_sq }
    }

    fn are_as_found(&self, nearest: &[CenterOffset]) -> bool {
        nearest.iter().enumerate().all(|(number, nearest)| {
            let found = self.found.nearest(number);
            found.is_some_and(|found| {
                (found.way - nearest.way).norm_squared() <= DIRECTION_SLACK_SQ * nearest.distance_sq
            })
        })
    }

    /// Those that may be candidates of one of some blocks, of which each has another in `nearest` that is as near to its center as
    /// any; in their order.
    fn pick(&mut self, blocks: &Blocks, nearest: &[CenterOffset]) {
        let seen = |number: usize| ApproxDistance::new(self, blocks, number, &nearest[number]);
        let from: [ApproxDistance; LANES] = std::array::from_fn(|number| seen(number.min(nearest.len() - 1)));
        let Self { tree, slots, balls, groups, picked, .. } = self;
        tree.arch.dispatch(Pick { slots, balls, groups, from: &from[..nearest.len()], picked });
    }
}

struct Pick<'a> {
    slots: &'a [u32],
    balls: &'a [BoundingSpheres],
    groups: &'a [BoundingSpheres],
    from: &'a [ApproxDistance],
    picked: &'a mut Vec<u32>,
}

impl pulp::NullaryFnOnce for Pick<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { slots, balls, groups, from, picked } = self;
        picked.clear();
        picked.resize(slots.len() + LANES, 0);
        let mut count = 0;
        for ((group, balls), slots) in groups.iter().zip(balls.chunks(LANES)).zip(slots.chunks(LANES * LANES)) {
            let may_hold = may_hold(from, group);
            let eights = balls.iter().zip(slots.chunks(LANES)).zip(may_hold);
            for ((balls, slots), _) in eights.filter(|(_, may_hold)| *may_hold != 0) {
                let may_hold = self::may_hold(from, balls);
                // Without a branch for each, which would be hard to foretell.
                for (slot, may_hold) in slots.iter().zip(may_hold) {
                    picked[count] = *slot;
                    count += may_hold as usize;
                }
            }
        }
        picked.truncate(count);
    }
}

#[inline(always)]
fn may_hold(from: &[ApproxDistance], balls: &BoundingSpheres) -> [u32; LANES] {
    let mut may_hold = [0; LANES];
    for block in from {
        let of_block = block.may_hold(balls);
        for lane in 0..LANES {
            may_hold[lane] |= of_block[lane];
        }
    }
    may_hold
}

impl BoundingSpheres {
    const NONE: Self = Self { middle: [[0.0; LANES]; 3], radius: [f32::NEG_INFINITY; LANES] };

    /// Seen from points that are no farther than that.
    fn set(&mut self, lane: usize, middle: Vector3<f64>, radius: f64, farthest: f64) {
        let radius = radius + SPHERE_SLACK * (middle.abs().sum() + radius + farthest);
        // What is not a number is not small.
        let is_small = radius < FARTHEST && middle.amax() < FARTHEST;
        self.radius[lane] = if is_small { radius as f32 } else { f32::INFINITY };
        (0..3).for_each(|axis| self.middle[axis][lane] = if is_small { middle[axis] as f32 } else { 0.0 });
    }

    /// One around all balls of each eight.
    fn around(eights: &[Self], farthest: f64) -> Self {
        let mut around = Self::NONE;
        for (lane, balls) in eights.iter().enumerate() {
            let middle_of = |lane: usize| Vector3::from_fn(|axis, _| f64::from(balls.middle[axis][lane]));
            let used = || (0..LANES).filter(|lane| balls.radius[*lane] >= 0.0);
            let low = used().map(middle_of).reduce(|a, b| a.inf(&b)).unwrap_or_default();
            let high = used().map(middle_of).reduce(|a, b| a.sup(&b)).unwrap_or_default();
            let middle = (low + high) * 0.5;
            let reach = |lane: usize| (middle_of(lane) - middle).norm() + f64::from(balls.radius[lane]);
            around.set(lane, middle, used().map(reach).fold(0.0, f64::max), farthest);
        }
        around
    }
}

/// A block that balls are seen from, as [`PruneBound`](crate::error::candidates::Reach) in f32.
struct ApproxDistance {
    center: [f32; 3],
    half_side: f32,
    hypotenuse: f32,
    slope: [f32; 3],
    most: f32,
}

impl ApproxDistance {
    fn new(nearby: &LocalTriangles, blocks: &Blocks, block: usize, nearest: &CenterOffset) -> Self {
        let inv_length = nearby.inv_length;
        let center = Vector3::from_fn(|axis, _| blocks.centers[axis][block]);
        let hypotenuse = (nearest.distance_sq + 3.0 * blocks.half_side * blocks.half_side).sqrt();
        let toward = nearest.way.try_normalize(0.0).unwrap_or_default();
        let slope = toward * (nearest.distance_sq.sqrt() / hypotenuse);
        Self {
            center: ((center - nearby.center) * inv_length).map(|x| x as f32).into(),
            half_side: (blocks.half_side * inv_length) as f32,
            hypotenuse: (hypotenuse * inv_length) as f32,
            slope: slope.map(|x| x as f32).into(),
            most: (blocks.most[block] * inv_length) as f32,
        }
    }

    /// 0 of no ball that has a triangle which is a candidate, else 1.
    ///
    /// A triangle in a ball of radius r whose middle is L away in direction g is at a distance d ≥ L − r. Its own direction f
    /// is at an angle α from g with sin α ≤ r/L, so |f − g|₁ ≤ √3 · √2 · r/L; where r ≥ L it may hold. So where d ≤ A + s |k e − f|₁,
    /// also L − r ≤ A + s (|k e − g|₁ + √6 · r/L). Both sides are multiplied by L.
    #[inline(always)]
    fn may_hold(&self, balls: &BoundingSpheres) -> [u32; LANES] {
        let mut may_hold = [0; LANES];
        for lane in 0..LANES {
            let way = [0, 1, 2].map(|axis: usize| self.center[axis] - balls.middle[axis][lane]);
            let radius = balls.radius[lane];
            let away = dot(way, way).sqrt();
            let apart = |axis: usize| (self.slope[axis] * away - way[axis]).abs();
            let apart = ROOT_OF_SIX * radius + apart(0) + apart(1) + apart(2);
            let least = away - radius;
            // What is not a number is not beyond.
            let is_beyond = (least * away > (self.hypotenuse * away + self.half_side * apart) * SLACK)
                | (least > self.most * SLACK);
            may_hold[lane] = u32::from(!is_beyond);
        }
        may_hold
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TriangleMesh;
    use crate::error::Block;
    use crate::testing::{instruction_sets, random, random_vector};
    use crate::triangle::NearestOnTriangle;

    /// Small and large triangles, some of them slivers, each also upside down a little farther on.
    fn soup(triangles: u32, state: &mut u64) -> TriangleMesh {
        let mut points = vec![];
        for _ in 0..triangles {
            let (a, size) = (random_vector(state), random(state).powi(4));
            let b = a + random_vector(state) * size;
            let width = if random(state) > 0.8 { 1e-9 } else { size };
            let c = a + (b - a) * random(state) + random_vector(state) * width;
            let step = random_vector(state) * 1e-3;
            points.extend([a, b, c, b + step, a + step, c].map(<[f64; 3]>::from));
        }
        let triangles: Vec<[u32; 3]> = (0..2 * triangles).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        TriangleMesh::new(&points, &triangles).unwrap()
    }

    fn most(asked: &Query) -> f64 {
        asked.distance + 12.0_f64.sqrt() * asked.block.half_side * (1.0 + SINGLE_SLACK)
    }

    /// By the same formula, of all triangles and one by one.
    fn one_by_one(tree: &Bvh, asked: &Query) -> (Vec<u32>, CenterOffset) {
        let Block { center, half_side } = asked.block;
        let mut all: Vec<(u32, NearestOnTriangle)> = vec![];
        tree.near(center, 1e6, |slot| all.push((slot as u32, nearest_on_triangle(center, tree.corners[slot]))));
        let (_, nearest) = *all.iter().min_by(|a, b| a.1.distance_sq.total_cmp(&b.1.distance_sq)).unwrap();
        let toward = |of: &NearestOnTriangle| (center - of.point).try_normalize(0.0).unwrap_or_default();
        let half_side = half_side * (1.0 + SINGLE_SLACK);
        let hypotenuse = (nearest.distance_sq + 3.0 * half_side * half_side).sqrt();
        let slope = toward(&nearest) * (nearest.distance_sq.sqrt() / hypotenuse);
        let most = 2.0 * 3.0_f64.sqrt() * asked.block.half_side * (1.0 + SINGLE_SLACK) + asked.distance;
        all.retain(|(_, on_triangle)| {
            let way = half_side * (slope - toward(on_triangle)).abs().sum();
            on_triangle.distance_sq <= most * most
                && on_triangle.distance_sq.sqrt() <= (hypotenuse + way) * (1.0 + SINGLE_SLACK)
        });
        let way = center - nearest.point;
        (all.into_iter().map(|(slot, _)| slot).collect(), CenterOffset { way, distance_sq: nearest.distance_sq })
    }

    #[test]
    fn the_candidates_of_blocks_are_those_that_are_found_one_by_one_among_all() {
        let mut state = 11;
        println!("seed {state}");
        for (arch, triangles) in instruction_sets().into_iter().cycle().zip([1, 3, 30, 300, 300, 300, 300]) {
            let mut tree = Bvh::new(&soup(triangles, &mut state));
            tree.arch = arch;
            for round in 0..90 {
                let (middle, size) = (random_vector(&mut state) * 1.2, 0.2 * random(&mut state).abs().powi(2));
                let half_side = size * random(&mut state).abs();
                let mut asked = || {
                    let mut center = middle + random_vector(&mut state) * size;
                    if random(&mut state) > 0.8 {
                        // In a corner, where several are equally near.
                        center = tree.corners[tree.nearest(center, 0).slot][1];
                    }
                    let nearest = tree.nearest(center, 0);
                    let block = Block { center, half_side };
                    Query { block, distance: nearest.on_triangle.distance_sq.sqrt(), slot: nearest.slot }
                };
                let asked: Vec<Query> = (0..1 + round % LANES).map(|_| asked()).collect();
                let reach = |of: &Query| (of.block.center - middle).norm() + most(of);
                let within = asked.iter().map(reach).fold(0.0, f64::max);
                let mut nearby = LocalTriangles::gather(&tree, middle, within, half_side);
                nearby.find(&asked);
                for (number, of) in asked.iter().enumerate() {
                    let found = nearby.found.of(number).iter().map(|number| nearby.picked[*number as usize]);
                    let (wanted, wanted_nearest) = one_by_one(&tree, of);
                    assert_eq!(found.collect::<Vec<u32>>(), wanted, "{of:?} of {triangles} triangles by {arch:?}");
                    let nearest = nearby.found.nearest(number).unwrap();
                    assert_eq!(nearest.distance_sq.to_bits(), wanted_nearest.distance_sq.to_bits());
                    assert_eq!(nearest.way, wanted_nearest.way);
                }
            }
        }
    }

    #[test]
    fn between_two_equally_near_triangles_candidates_are_those_of_the_first_whichever_was_named() {
        // Around the middle of one side, and of the other. Those that are a little farther are candidates behind the first alone.
        let side = |x: f64| [[x, -0.005, -0.005], [x, 0.005, -0.005], [x, 0.0, 0.005]];
        let both = |step: u32| [0.1 + 0.002 * f64::from(step), -0.1 - 0.002 * f64::from(step)].map(side);
        let points: Vec<[f64; 3]> = (0..39).flat_map(both).flatten().collect();
        let triangles: Vec<[u32; 3]> = (0..78).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let tree = Bvh::new(&TriangleMesh::new(&points, &triangles).unwrap());
        let block = Block { center: Vector3::zeros(), half_side: 0.02 };
        for slot in (0..78).filter(|slot| tree.corners[*slot][0].x.abs() < 0.101) {
            let asked = Query { block, distance: 0.1, slot };
            let mut nearby = LocalTriangles::gather(&tree, block.center, most(&asked), block.half_side);
            nearby.find(&[asked]);
            let found: Vec<u32> = nearby.found.of(0).iter().map(|number| nearby.picked[*number as usize]).collect();
            let (wanted, wanted_nearest) = one_by_one(&tree, &asked);
            assert_eq!(found, wanted);
            assert_eq!(nearby.found.nearest(0).unwrap().way, wanted_nearest.way);
            assert!((10..70).contains(&wanted.len()), "{}", wanted.len());
        }
    }

    #[test]
    fn no_ball_is_passed_over_with_a_point_that_is_a_candidate_even_where_it_is_only_just_passed_over() {
        let mut state = 23;
        println!("seed {state}");
        let mut just_held = 0;
        for round in 0..40_000 {
            let (half_side, distance) = (1.0, [0.1, 1.0, 4.0][round % 3] * random(&mut state).abs());
            let hypotenuse = (distance * distance + 3.0 * half_side * half_side).sqrt();
            let slope = random_vector(&mut state).normalize() * (distance / hypotenuse);
            let toward = random_vector(&mut state).normalize();
            let radius = [0.1, 1.0][round / 3 % 2] * random(&mut state).abs();
            let apart = half_side * (slope - toward).abs().sum();
            let away = radius + hypotenuse + apart + 0.4 * half_side * radius * random(&mut state).abs();
            // From the ball's middle to its rim, where a point comes nearest to being a candidate.
            let excess = |point: Vector3<f64>| {
                let way = -point;
                way.norm() - hypotenuse - half_side * (slope - way.normalize()).abs().sum()
            };
            let middle = -toward * away;
            let on_rim = || middle + (toward + random_vector(&mut state) * 0.6).normalize() * radius;
            let least = std::iter::repeat_with(on_rim).take(30).map(excess).fold(f64::INFINITY, f64::min);
            let mut balls = BoundingSpheres::NONE;
            balls.set(0, middle, radius, 10.0);
            let slope: [f32; 3] = slope.map(|x| x as f32).into();
            let [half_side, hypotenuse] = [half_side, hypotenuse].map(|x| x as f32);
            let seen = ApproxDistance { center: [0.0; 3], half_side, hypotenuse, slope, most: 1e6 };
            assert!(least > 0.0 || seen.may_hold(&balls)[0] == 1, "{middle} {radius} {least}");
            just_held += usize::from(least <= 0.0);
        }
        assert!(just_held > 1000, "{just_held}");
    }
}
