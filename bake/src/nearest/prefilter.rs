//! From what may be nearest somewhere in a cube to what may be in each of eight cubes in it.

use super::octants::{sides, steps};
use crate::nearest::octant_cull::{NearestPoints, OctantCull};
use crate::simd::{LANES, LaneLists, Lanes, VectorX8, or_lanes};
use crate::triangle::approx::{ApproxDistance, ApproxTriangle};

/// Eight cubes in a cube.
#[derive(Clone, Copy)]
pub(super) struct Cubes {
    /// Of the outer cube, in the tree's frame, as all here.
    pub middle: [f32; 3],
    /// From there to the middles of the eight, along each axis.
    pub step: f32,
    pub half_side: f32,
    /// What bounds are off by at most.
    pub rounding: f32,
}

/// What is nearest to the middles of eight cubes so far.
struct Bests {
    slots: Lanes<u32>,
    seen: ApproxDistance,
}

/// How near what is nearest to a point of each of eight cubes is at most.
///
/// A point at v from the middle, v·v ≤ ρ², is no farther from the nearest point, at a distance D with direction e from there to
/// the middle, than √(D² + 2D v·e + ρ²) ≤ A + k v·e, where A = √(D² + ρ²) and k = D/A; and from a triangle, at d with direction f,
/// it is at least d + v·f away, as that lies behind the plane across f.
struct Bounds {
    /// A, and twice the rounding.
    most: Lanes<f32>,
    /// k e of the same.
    slope: VectorX8<f32>,
}

/// Triangles, and room to tell which of them may be nearest in which of eight cubes.
pub(super) struct Prefilter {
    /// In the end of the corners of each cube, one after the other.
    picked: Vec<u32>,
    /// What was looked at closely.
    seen: Vec<(u32, ApproxDistance)>,
    /// Of what was seen, by cube.
    lists: LaneLists,
    /// Of each of these, from the corners of its cube, [`ApproxDistance::way_sq`] and [`ApproxDistance::along`].
    near: Vec<(Lanes<f32>, Lanes<f32>)>,
    picked_ends: Lanes<usize>,
    /// By cube, what is nearest to its middle of what was looked at.
    nearest: Lanes<u32>,
}

impl Prefilter {
    pub fn new() -> Self {
        Self {
            picked: vec![],
            seen: vec![],
            lists: LaneLists::new(),
            near: vec![],
            picked_ends: [0; LANES],
            nearest: [0; LANES],
        }
    }

    /// Nearest to the middle of a cube, about.
    pub fn nearest(&self, cube: usize) -> u32 {
        self.nearest[cube]
    }

    /// In each cube no corner is nearer to anything.
    #[inline(always)]
    pub fn least(&self, cubes: &Cubes) -> Lanes<f32> {
        let mut least = [f32::INFINITY; LANES];
        for (_, ApproxDistance { way_sq, along, .. }) in &self.seen {
            for lane in 0..LANES {
                // What is too much for f32 says nothing.
                let is_told = (along[lane] > 0.0) & (along[lane] < f32::INFINITY) & (way_sq[lane] < f32::INFINITY);
                let found = if is_told { along[lane] / way_sq[lane].sqrt() } else { 0.0 };
                least[lane] = if found < least[lane] { found } else { least[lane] };
            }
        }
        least.map(|least| least - 3.0_f32.sqrt() * cubes.half_side - 2.0 * cubes.rounding)
    }

    /// Picks what may be nearest to a corner of each cube that `is_asked` for. All cubes are looked at before any is picked for, so that
    /// nothing waits for the last that was looked at.
    #[inline(always)]
    pub fn pick(&mut self, triangles: &[ApproxTriangle], cubes: &Cubes, is_asked: &Lanes<bool>) {
        let mut most_sq = [[f32::INFINITY; LANES]; LANES];
        self.near.clear();
        for cube in 0..LANES {
            if !is_asked[cube] {
                self.lists.clear_lane(cube);
            }
            let corners = cubes.corners_of(cube);
            for slot in self.lists.lane(cube) {
                let ApproxDistance { way_sq, along, .. } = triangles[*slot as usize].seen_from(&corners);
                for lane in 0..LANES {
                    let most_sq = &mut most_sq[cube][lane];
                    *most_sq = if way_sq[lane] < *most_sq { way_sq[lane] } else { *most_sq };
                }
                self.near.push((way_sq, along));
            }
        }
        self.picked.clear();
        self.picked.resize(self.near.len(), 0);
        let (mut first, mut count) = (0, 0);
        for cube in 0..LANES {
            let most = most_sq[cube].map(|most_sq| most_sq.sqrt() + 2.0 * cubes.rounding);
            let slots = self.lists.lane(cube);
            for (slot, (way_sq, along)) in slots.iter().zip(&self.near[first..]) {
                self.picked[count] = *slot;
                let mut within = 0;
                for lane in 0..LANES {
                    let is_beyond = along[lane] * along[lane].abs() > most[lane] * most[lane] * way_sq[lane];
                    within |= if is_beyond { 0 } else { 1 };
                }
                count += within & usize::from(*slot != self.nearest[cube]);
            }
            first += slots.len();
            self.picked_ends[cube] = count;
        }
    }

    /// Beside what is nearest to the middle of a cube.
    pub fn picked(&self, cube: usize) -> &[u32] {
        let first = if cube == 0 { 0 } else { self.picked_ends[cube - 1] };
        &self.picked[first..self.picked_ends[cube]]
    }

    /// Finds which of the triangles in these `slots` may be nearest to a point of each of eight cubes.
    #[inline(always)]
    pub fn sift(&mut self, triangles: &[ApproxTriangle], slots: &[u32], cubes: &Cubes) {
        let Cubes { half_side, rounding, .. } = *cubes;
        let middles = cubes.middles();
        let mut bests = Bests::first_seen(triangles, slots, &middles);
        let near = OctantCull::new(middles, half_side, bests.points(&middles), rounding);
        self.picked.clear();
        self.picked.resize(slots.len(), 0);
        let mut count = 0;
        for slot in slots {
            let triangle = &triangles[*slot as usize];
            self.picked[count] = *slot;
            let holds = near.may_hold_triangle(&triangle.corners(), triangle.radius_sq());
            count += or_lanes(&holds) as usize;
        }
        self.seen.clear();
        for slot in &self.picked[..count] {
            let found = triangles[*slot as usize].seen_from(&middles);
            bests.update(*slot, &found);
            self.seen.push((*slot, found));
        }
        let bounds = bests.bounds(half_side, rounding);
        self.lists.clear(self.seen.len());
        for (slot, found) in &self.seen {
            self.lists.push(*slot, &bounds.passed(found, half_side));
        }
        self.nearest = bests.slots;
    }
}

impl Cubes {
    /// Of the eight.
    #[inline(always)]
    pub fn middles(&self) -> VectorX8<f32> {
        let mut middles = steps(self.step);
        for axis in 0..3 {
            for lane in 0..LANES {
                middles[axis][lane] += self.middle[axis];
            }
        }
        middles
    }

    /// Of one of the eight.
    #[inline(always)]
    fn corners_of(&self, cube: usize) -> VectorX8<f32> {
        let middle = [0, 1, 2].map(|axis: usize| self.middle[axis] + sides(cube)[axis] * self.step);
        Self { middle, step: self.half_side, ..*self }.middles()
    }
}

impl Bests {
    /// Of the triangles with the nearest corners.
    #[inline(always)]
    fn first_seen(triangles: &[ApproxTriangle], slots: &[u32], middles: &VectorX8<f32>) -> Self {
        let mut nearest = NearestPoints::NONE;
        for slot in slots {
            nearest.consider(*slot, triangles[*slot as usize].first_corner(), middles);
        }
        let mut last = nearest.names[0];
        let mut bests = Self { slots: [last; LANES], seen: triangles[last as usize].seen_from(middles) };
        for slot in nearest.names {
            if slot != last {
                bests.update(slot, &triangles[slot as usize].seen_from(middles));
                last = slot;
            }
        }
        bests
    }

    /// Where they are.
    #[inline(always)]
    fn points(&self, middles: &VectorX8<f32>) -> VectorX8<f32> {
        let mut points = *middles;
        for axis in 0..3 {
            for lane in 0..LANES {
                points[axis][lane] -= self.seen.way[axis][lane];
            }
        }
        points
    }

    #[inline(always)]
    fn update(&mut self, slot: u32, found: &ApproxDistance) {
        for lane in 0..LANES {
            let is_nearer = found.way_sq[lane] < self.seen.way_sq[lane];
            self.slots[lane] = if is_nearer { slot } else { self.slots[lane] };
            self.seen.way_sq[lane] = if is_nearer { found.way_sq[lane] } else { self.seen.way_sq[lane] };
            for axis in 0..3 {
                let best = &mut self.seen.way[axis][lane];
                *best = if is_nearer { found.way[axis][lane] } else { *best };
            }
        }
    }

    #[inline(always)]
    fn bounds(&self, half_side: f32, rounding: f32) -> Bounds {
        let mut bounds = Bounds { most: [0.0; LANES], slope: [[0.0; LANES]; 3] };
        for lane in 0..LANES {
            let hypotenuse = (self.seen.way_sq[lane] + 3.0 * half_side * half_side).sqrt();
            bounds.most[lane] = hypotenuse + 2.0 * rounding;
            for axis in 0..3 {
                bounds.slope[axis][lane] = self.seen.way[axis][lane] / hypotenuse;
            }
        }
        bounds
    }
}

impl Bounds {
    /// In which of the cubes a triangle may be nearest to a point: 1, else 0. All of it times the length of the way.
    #[inline(always)]
    fn passed(&self, found: &ApproxDistance, half_side: f32) -> Lanes<u32> {
        let mut passed = [0; LANES];
        for lane in 0..LANES {
            let length = found.way_sq[lane].sqrt();
            let apart = |axis: usize| (length * self.slope[axis][lane] - found.way[axis][lane]).abs();
            let most = length * self.most[lane] + half_side * (apart(0) + apart(1) + apart(2));
            passed[lane] = if found.along[lane] > most { 0 } else { 1 };
        }
        passed
    }
}
