//! Triangles around a few blocks, gathered once, and of these the ones that can be nearest to a point of a block. Eight go
//! side by side, each step of it with the bits of [`nearest_on_triangle`].

use sdf_core::nalgebra::Vector3;

use crate::gradient_spread::{lesser, of_all};
use crate::interpolation::{Block, PLACE_ROUNDING};
use crate::lanes_triangle::{dot, minus};
use crate::tree::Tree;
use crate::triangle::{is_sliver, nearest_on_triangle};

/// Triangles side by side: as many as f64 numbers fit the widest registers.
const LANES: usize = 8;

/// A number of each.
type Lanes = [f64; LANES];

/// More than all rounding of what is said of balls, and of what a closer look says.
const SLACK: f64 = 1.0 + 1e-5;

const ROOT_OF_SIX: f64 = 2.449_489_742_783_178;

/// Triangles of a tree in an order that does not depend on where they were gathered.
pub(crate) struct Nearby<'a> {
    tree: &'a Tree,
    count: usize,
    eights: Vec<Eight>,
    /// Of each eight of these, a ball around each.
    groups: Vec<Balls>,
}

/// Of the nearest triangle to a block's center.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ToCenter {
    /// From the nearest point.
    pub way: Vector3<f64>,
    pub distance_sq: f64,
}

/// Triangles, a ball around each, and what is nearest of them to the block that was asked for last.
#[derive(Clone)]
struct Eight {
    /// In the order of the tree.
    slots: [u32; LANES],
    corners: [[Lanes; 3]; 3],
    has_sliver: bool,
    balls: Balls,
    is_measured: bool,
    /// To the block's center from the nearest point.
    way: [Lanes; 3],
    /// Infinite where there is no triangle.
    distance_sq: Lanes,
}

/// Balls side by side, as seen from a block's center.
#[derive(Clone)]
struct Balls {
    middle: [Lanes; 3],
    /// Less than any number where there is none.
    radius: Lanes,
    is_seen: bool,
    /// To the block's center from the middle.
    from_middle: [Lanes; 3],
    away: Lanes,
}

impl<'a> Nearby<'a> {
    pub fn new(tree: &'a Tree) -> Self {
        Self { tree, count: 0, eights: vec![], groups: vec![] }
    }

    /// All triangles no farther from a point than that, and perhaps some more.
    pub fn gather(&mut self, center: Vector3<f64>, within: f64) {
        self.clear();
        let within = within * SLACK;
        self.tree.near(center, within * within, |slot| self.push(slot));
        self.group();
    }

    pub fn clear(&mut self) {
        self.count = 0;
        self.eights.clear();
        self.groups.clear();
    }

    /// All that was pushed. Then candidates may be asked for.
    pub fn group(&mut self) {
        self.groups.clear();
        self.groups.extend(self.eights.chunks(LANES).map(Balls::around));
    }

    pub fn push(&mut self, slot: usize) {
        let corners = self.tree.corners[slot];
        let [a, b, c] = corners;
        let middle = (a.inf(&b).inf(&c) + a.sup(&b).sup(&c)) * 0.5;
        let radius_sq = corners.iter().map(|corner| (corner - middle).norm_squared()).fold(0.0, f64::max);
        let lane = self.count % LANES;
        if lane == 0 {
            self.eights.push(Eight::NONE);
        }
        self.count += 1;
        let Some(eight) = self.eights.last_mut() else { return };
        eight.slots[lane] = slot as u32;
        eight.balls.radius[lane] = radius_sq.sqrt();
        eight.has_sliver |= is_sliver(corners);
        for axis in 0..3 {
            eight.balls.middle[axis][lane] = middle[axis];
            (0..3).for_each(|corner| eight.corners[corner][axis][lane] = corners[corner][axis]);
        }
    }

    /// Adds those that can be nearest to a point of a block. At its center the surface is no farther than `distance`, and none
    /// of these is farther than `most`. `None` where there is no triangle.
    pub fn candidates(&mut self, block: Block, [distance, most]: [f64; 2], found: &mut Vec<u32>) -> Option<ToCenter> {
        let arch = self.tree.arch;
        arch.dispatch(Candidates { nearby: self, block, distance, most, found })
    }
}

struct Candidates<'a, 'b> {
    nearby: &'a mut Nearby<'b>,
    block: Block,
    distance: f64,
    most: f64,
    found: &'a mut Vec<u32>,
}

impl pulp::NullaryFnOnce for Candidates<'_, '_> {
    type Output = Option<ToCenter>;

    #[inline(always)]
    fn call(self) -> Option<ToCenter> {
        let Self { nearby: Nearby { eights, groups, .. }, block, distance, most, found } = self;
        groups.iter_mut().for_each(|group| group.see_anew(block.center));
        for eight in &mut *eights {
            (eight.balls.is_seen, eight.is_measured) = (false, false);
        }
        let nearest = nearest(eights, groups, block.center, distance * SLACK + block.half_side * PLACE_ROUNDING)?;
        let reach = Reach::new(block.half_side, &nearest, most);
        for (group, eights) in groups.iter().zip(eights.chunks_mut(LANES)) {
            let may_hold = reach.may_hold(group);
            for (eight, _) in eights.iter_mut().zip(may_hold).filter(|(_, may_hold)| *may_hold) {
                eight.balls.see(block.center);
                if !any(reach.may_hold(&eight.balls)) {
                    continue;
                }
                eight.measure(block.center);
                // Without a branch for each, which would be hard to foretell.
                let mut count = found.len();
                found.resize(count + LANES, 0);
                for (slot, holds) in eight.slots.into_iter().zip(reach.holds(eight)) {
                    found[count] = slot;
                    count += usize::from(holds);
                }
                found.truncate(count);
            }
        }
        Some(nearest)
    }
}

#[inline(always)]
fn any(lanes: [bool; LANES]) -> bool {
    lanes.into_iter().fold(false, |any, one| any | one)
}

/// The first of the nearest to a point, which is no farther than `within`.
#[inline(always)]
fn nearest(eights: &mut [Eight], groups: &[Balls], point: Vector3<f64>, within: f64) -> Option<ToCenter> {
    let (mut least_sq, mut numbers) = ([f64::INFINITY; LANES], [usize::MAX; LANES]);
    for (group, balls) in groups.iter().enumerate() {
        let may_be_within = balls.may_be_within(within);
        let first = group * LANES;
        for number in (first..eights.len().min(first + LANES)).filter(|number| may_be_within[number - first]) {
            let eight = &mut eights[number];
            eight.balls.see(point);
            if !any(eight.balls.may_be_within(within)) {
                continue;
            }
            eight.measure(point);
            for lane in 0..LANES {
                let is_nearer = eight.distance_sq[lane] < least_sq[lane];
                least_sq[lane] = if is_nearer { eight.distance_sq[lane] } else { least_sq[lane] };
                numbers[lane] = if is_nearer { number * LANES + lane } else { numbers[lane] };
            }
        }
    }
    let least_of_all = of_all(least_sq, lesser);
    for lane in 0..LANES {
        numbers[lane] = if least_sq[lane] == least_of_all { numbers[lane] } else { usize::MAX };
    }
    let first = of_all(numbers, usize::min);
    let (eight, lane) = (eights.get(first / LANES)?, first % LANES);
    let way = Vector3::from_fn(|axis, _| eight.way[axis][lane]);
    Some(ToCenter { way, distance_sq: eight.distance_sq[lane] })
}

impl Balls {
    const NONE: Self = Self {
        middle: [[0.0; LANES]; 3],
        radius: [f64::NEG_INFINITY; LANES],
        is_seen: false,
        from_middle: [[0.0; LANES]; 3],
        away: [0.0; LANES],
    };

    /// One around all balls of each eight.
    fn around(eights: &[Eight]) -> Self {
        let mut around = Self::NONE;
        for (lane, Eight { balls, .. }) in eights.iter().enumerate() {
            let middle_of = |lane: usize| Vector3::from_fn(|axis, _| balls.middle[axis][lane]);
            let used = || (0..LANES).filter(|lane| balls.radius[*lane] >= 0.0);
            let low = used().map(middle_of).reduce(|a, b| a.inf(&b)).unwrap_or_default();
            let high = used().map(middle_of).reduce(|a, b| a.sup(&b)).unwrap_or_default();
            let middle = (low + high) * 0.5;
            (0..3).for_each(|axis| around.middle[axis][lane] = middle[axis]);
            let reach = |lane: usize| (middle_of(lane) - middle).norm() + balls.radius[lane];
            around.radius[lane] = used().map(reach).fold(f64::NEG_INFINITY, f64::max);
        }
        around
    }

    #[inline(always)]
    fn see(&mut self, center: Vector3<f64>) {
        if self.is_seen {
            return;
        }
        self.is_seen = true;
        self.see_anew(center);
    }

    #[inline(always)]
    fn see_anew(&mut self, center: Vector3<f64>) {
        for lane in 0..LANES {
            let way =
                [center.x - self.middle[0][lane], center.y - self.middle[1][lane], center.z - self.middle[2][lane]];
            (0..3).for_each(|axis| self.from_middle[axis][lane] = way[axis]);
            self.away[lane] = dot(way, way).sqrt();
        }
    }

    #[inline(always)]
    fn may_be_within(&self, distance: f64) -> [bool; LANES] {
        let mut may_be_within = [false; LANES];
        for lane in 0..LANES {
            may_be_within[lane] = self.away[lane] - self.radius[lane] <= distance;
        }
        may_be_within
    }
}

impl Eight {
    const NONE: Self = Self {
        slots: [0; LANES],
        corners: [[[0.0; LANES]; 3]; 3],
        has_sliver: false,
        balls: Balls::NONE,
        is_measured: false,
        way: [[0.0; LANES]; 3],
        distance_sq: [f64::INFINITY; LANES],
    };

    #[inline(always)]
    fn measure(&mut self, center: Vector3<f64>) {
        if self.is_measured {
            return;
        }
        self.is_measured = true;
        if self.has_sliver {
            return self.measure_one_by_one(center);
        }
        let center: [f64; 3] = center.into();
        for lane in 0..LANES {
            let corners: [[f64; 3]; 3] =
                std::array::from_fn(|corner| std::array::from_fn(|axis| self.corners[corner][axis][lane]));
            let (way, distance_sq) = way_from(corners, center);
            (0..3).for_each(|axis| self.way[axis][lane] = way[axis]);
            self.distance_sq[lane] = if self.balls.radius[lane] >= 0.0 { distance_sq } else { f64::INFINITY };
        }
    }

    #[inline(never)]
    fn measure_one_by_one(&mut self, center: Vector3<f64>) {
        for lane in 0..LANES {
            let corner = |corner: usize| Vector3::from_fn(|axis, _| self.corners[corner][axis][lane]);
            let on_triangle = nearest_on_triangle(center, [corner(0), corner(1), corner(2)]);
            let way = center - on_triangle.point;
            (0..3).for_each(|axis| self.way[axis][lane] = way[axis]);
            let is_there = self.balls.radius[lane] >= 0.0;
            self.distance_sq[lane] = if is_there { on_triangle.distance_sq } else { f64::INFINITY };
        }
    }
}

/// What tells whether a triangle can be nearest to a point of a block, and is no farther from its center than `most`.
///
/// A point x = c + v of it, v·v ≤ ρ², is no farther from the triangle nearest to c, at D with direction e from there to c,
/// than √(D² + 2D v·e + ρ²) ≤ A + k v·e, where A = √(D² + ρ²) and k = D/A; and from any other, at d with direction f, it is at
/// least d + v·f away, as that lies behind the plane across f.
struct Reach {
    half_side: f64,
    hypotenuse: f64,
    slope: [f64; 3],
    most: f64,
}

impl Reach {
    #[inline(always)]
    fn new(half_side: f64, nearest: &ToCenter, most: f64) -> Self {
        let half_side = half_side * (1.0 + PLACE_ROUNDING);
        let hypotenuse = (nearest.distance_sq + 3.0 * half_side * half_side).sqrt();
        let toward = nearest.way.try_normalize(0.0).unwrap_or_default();
        let slope = toward * (nearest.distance_sq.sqrt() / hypotenuse);
        Self { half_side, hypotenuse, slope: slope.into(), most }
    }

    /// What is said of balls. False of none that has a triangle which holds.
    ///
    /// A triangle in a ball of radius r whose middle is L away in direction g is at a distance d ≥ L − r. Its own direction f
    /// is at an angle α from g with sin α ≤ r/L, so |f − g|₁ ≤ √3 · √2 · r/L; where r ≥ L it may hold. So where d ≤ A + s |k e − f|₁,
    /// also L − r ≤ A + s (|k e − g|₁ + √6 · r/L). Both sides are multiplied by L.
    #[inline(always)]
    fn may_hold(&self, balls: &Balls) -> [bool; LANES] {
        let mut may_hold = [false; LANES];
        for lane in 0..LANES {
            let (away, radius) = (balls.away[lane], balls.radius[lane]);
            let mut apart = ROOT_OF_SIX * radius;
            for axis in 0..3 {
                apart += (self.slope[axis] * away - balls.from_middle[axis][lane]).abs();
            }
            let least = away - radius;
            let may_be_nearest = least * away <= (self.hypotenuse * away + self.half_side * apart) * SLACK;
            may_hold[lane] = may_be_nearest & (least <= self.most * SLACK);
        }
        may_hold
    }

    #[inline(always)]
    fn holds(&self, eight: &Eight) -> [bool; LANES] {
        let mut holds = [false; LANES];
        for lane in 0..LANES {
            let way = [eight.way[0][lane], eight.way[1][lane], eight.way[2][lane]];
            let length = dot(way, way).sqrt();
            // No way has no direction.
            let length = if length > 0.0 { length } else { 1.0 };
            let apart = |axis: usize| (self.slope[axis] - way[axis] / length).abs();
            let apart = self.half_side * (apart(0) + apart(1) + apart(2));
            let distance_sq = eight.distance_sq[lane];
            holds[lane] = (distance_sq <= self.most * self.most)
                & (distance_sq.sqrt() <= (self.hypotenuse + apart) * (1.0 + PLACE_ROUNDING));
        }
        holds
    }
}

/// To a point from what of a triangle is nearest to it, and the distance's square. The steps of [`nearest_on_triangle`], all of
/// them taken and one chosen.
#[inline(always)]
fn way_from([a, b, c]: [[f64; 3]; 3], point: [f64; 3]) -> ([f64; 3], f64) {
    let [ab, ac, bc] = [minus(b, a), minus(c, a), minus(c, b)];
    let normal = [ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2], ab[0] * ac[1] - ab[1] * ac[0]];
    let [from_a, from_b, from_c] = [minus(point, a), minus(point, b), minus(point, c)];
    let (d1, d2) = (dot(ab, from_a), dot(ac, from_a));
    let (d3, d4) = (dot(ab, from_b), dot(ac, from_b));
    let (d5, d6) = (dot(ab, from_c), dot(ac, from_c));
    let opposite_a = d3 * d6 - d5 * d4;
    let opposite_b = d5 * d2 - d1 * d6;
    let opposite_c = d1 * d4 - d3 * d2;
    let (from_b_on, to_c_on) = (d4 - d3, d5 - d6);

    let at_a = (d1 <= 0.0) & (d2 <= 0.0);
    let at_b = (d3 >= 0.0) & (d4 <= d3);
    let on_ab = (opposite_c <= 0.0) & (d1 >= 0.0) & (d3 <= 0.0);
    let at_c = (d6 >= 0.0) & (d5 <= d6) & !on_ab;
    let on_ac = (opposite_b <= 0.0) & (d2 >= 0.0) & (d6 <= 0.0);
    let on_bc = (opposite_a <= 0.0) & (from_b_on >= 0.0) & (to_c_on >= 0.0);
    let is_inside = !(at_a | at_b | at_c | on_ab | on_ac | on_bc);

    // From the last choice to the first, which so prevails.
    let choose = |ab: f64, ac: f64, bc: f64, inside: f64| {
        let chosen = if on_bc { bc } else { inside };
        let chosen = if on_ac { ac } else { chosen };
        if on_ab { ab } else { chosen }
    };
    let share = choose(d1, d2, from_b_on, dot(normal, from_a))
        / choose(d1 - d3, d2 - d6, from_b_on + to_c_on, dot(normal, normal));
    let along: [f64; 3] = std::array::from_fn(|axis| choose(ab[axis], ac[axis], bc[axis], normal[axis]) * share);
    let way: [f64; 3] = std::array::from_fn(|axis| {
        let nearest = choose(a[axis], a[axis], b[axis], 0.0) + along[axis];
        let nearest = if is_inside { point[axis] - along[axis] } else { nearest };
        let way = point[axis] - nearest;
        let way = if at_c { from_c[axis] } else { way };
        let way = if at_b { from_b[axis] } else { way };
        if at_a { from_a[axis] } else { way }
    });
    (way, if is_inside { dot(along, along) } else { dot(way, way) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TriangleMesh;
    use crate::gradient_spread::tests::{random, random_vector};
    use crate::packet::tests::instruction_sets;
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

    /// By the same formula, of all triangles and one by one.
    fn one_by_one(tree: &Tree, block: Block, most: f64) -> (Vec<u32>, ToCenter) {
        let mut all: Vec<(u32, NearestOnTriangle)> = vec![];
        tree.near(block.center, 1e6, |slot| {
            all.push((slot as u32, nearest_on_triangle(block.center, tree.corners[slot])));
        });
        all.retain(|(_, on_triangle)| on_triangle.distance_sq <= most * most);
        let (_, nearest) = *all.iter().min_by(|a, b| a.1.distance_sq.total_cmp(&b.1.distance_sq)).unwrap();
        let toward = |of: &NearestOnTriangle| (block.center - of.point).try_normalize(0.0).unwrap_or_default();
        let half_side = block.half_side * (1.0 + PLACE_ROUNDING);
        let hypotenuse = (nearest.distance_sq + 3.0 * half_side * half_side).sqrt();
        let slope = toward(&nearest) * (nearest.distance_sq.sqrt() / hypotenuse);
        all.retain(|(_, on_triangle)| {
            let way = half_side * (slope - toward(on_triangle)).abs().sum();
            on_triangle.distance_sq.sqrt() <= (hypotenuse + way) * (1.0 + PLACE_ROUNDING)
        });
        let way = block.center - nearest.point;
        (all.into_iter().map(|(slot, _)| slot).collect(), ToCenter { way, distance_sq: nearest.distance_sq })
    }

    #[test]
    fn the_candidates_of_a_block_are_those_that_are_found_one_by_one_among_all() {
        let mut state = 11;
        for (arch, triangles) in instruction_sets().into_iter().cycle().zip([1, 3, 30, 300, 300, 300, 300]) {
            let mut tree = Tree::new(&soup(triangles, &mut state));
            tree.arch = arch;
            let mut nearby = Nearby::new(&tree);
            for _ in 0..60 {
                let (middle, size) = (random_vector(&mut state) * 1.2, 0.2 * random(&mut state).abs().powi(2));
                let mut blocks = vec![];
                for _ in 0..10 {
                    let mut center = middle + random_vector(&mut state) * size;
                    if random(&mut state) > 0.8 {
                        // In a corner, where several are equally near.
                        center = tree.corners[tree.nearest(center, 0).slot][1];
                    }
                    let block = Block { center, half_side: size * random(&mut state).abs() };
                    blocks.push((block, tree.nearest(center, 0).on_triangle.distance_sq.sqrt()));
                }
                let most = |(block, distance): &(Block, f64)| distance + 12.0_f64.sqrt() * block.half_side * 1.000_001;
                let reach = |of: &(Block, f64)| (of.0.center - middle).norm() + most(of);
                nearby.gather(middle, blocks.iter().map(reach).fold(0.0, f64::max));
                for of in blocks {
                    let mut found = vec![];
                    let nearest = nearby.candidates(of.0, [of.1, most(&of)], &mut found).unwrap();
                    let (wanted, wanted_nearest) = one_by_one(&tree, of.0, most(&of));
                    assert_eq!(found, wanted, "{of:?} of {triangles} triangles by {arch:?}");
                    assert_eq!(nearest.distance_sq.to_bits(), wanted_nearest.distance_sq.to_bits());
                    assert_eq!(nearest.way, wanted_nearest.way);
                }
            }
        }
    }
}
