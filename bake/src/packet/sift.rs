//! From what may be nearest somewhere in a cube to what may be in each of eight cubes in it.

use super::candidates::Candidate;
use super::eighths::steps;
use crate::lanes_triangle::LANES;
use crate::near_cubes::{Lists, NearCubes, NearestPoints};
use crate::rough_triangle::{Lanes, RoughTriangle, Seen};

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
    slots: [u32; LANES],
    seen: Seen,
}

/// How near what is nearest to a point of each of eight cubes is at most.
///
/// A point at v from the middle, v·v ≤ ρ², is no farther from the nearest point, at a distance D with direction e from there to
/// the middle, than √(D² + 2D v·e + ρ²) ≤ A + k v·e, where A = √(D² + ρ²) and k = D/A; and from a triangle, at d with direction f,
/// it is at least d + v·f away, as that lies behind the plane across f.
struct Bounds {
    /// A, and twice the rounding.
    most: Lanes,
    /// k e of the same.
    slope: [Lanes; 3],
}

/// Triangles, and room to tell which of them may be nearest in which of eight cubes.
pub(super) struct Sifted {
    picked: Vec<u32>,
    /// What was looked at closely.
    seen: Vec<(u32, Seen)>,
    /// Of what was seen, by cube.
    lists: Lists,
    /// By cube, what is nearest to its middle of what was looked at.
    nearest: [u32; LANES],
}

impl Sifted {
    pub fn new() -> Self {
        Self { picked: vec![], seen: vec![], lists: Lists::new(), nearest: [0; LANES] }
    }

    /// Nearest to the middle of a cube, about.
    pub fn nearest(&self, cube: usize) -> u32 {
        self.nearest[cube]
    }

    /// What else may be nearest to a point of a cube.
    #[inline(always)]
    pub fn candidates(&self, cube: usize) -> impl Iterator<Item = Candidate> + '_ {
        let nearest = self.nearest[cube];
        let candidate = move |number: &u32| {
            let (slot, seen) = &self.seen[*number as usize];
            let direction = [seen.direction[0][cube], seen.direction[1][cube], seen.direction[2][cube]];
            Candidate { slot: *slot, least: seen.least[cube], direction }
        };
        self.lists.of(cube).iter().map(candidate).filter(move |candidate| candidate.slot != nearest)
    }

    /// Finds which of the triangles in these `slots` may be nearest to a point of each of eight cubes.
    #[inline(always)]
    pub fn sift(&mut self, triangles: &[RoughTriangle], slots: &[u32], cubes: &Cubes) {
        let Cubes { half_side, rounding, .. } = *cubes;
        let middles = cubes.middles();
        let mut bests = Bests::first_seen(triangles, slots, &middles);
        let near = NearCubes::new(middles, half_side, bests.points(&middles), rounding);
        self.picked.clear();
        self.picked.resize(slots.len(), 0);
        let mut count = 0;
        for slot in slots {
            let triangle = &triangles[*slot as usize];
            self.picked[count] = *slot;
            let holds = near.may_hold_triangle(&triangle.corners(), triangle.radius_sq());
            count += holds.iter().fold(0, |any, one| any | one) as usize;
        }
        self.seen.clear();
        for slot in &self.picked[..count] {
            let found = triangles[*slot as usize].seen_from(&middles);
            bests.update(*slot, &found);
            self.seen.push((*slot, found));
        }
        let bounds = bests.bounds(half_side, rounding);
        self.lists.clear(self.seen.len());
        for (number, (_, found)) in (0..).zip(&self.seen) {
            self.lists.push(number, &bounds.passed(&found.least, &found.direction, half_side));
        }
        self.nearest = bests.slots;
    }
}

impl Cubes {
    /// Of the eight.
    #[inline(always)]
    pub fn middles(&self) -> [Lanes; 3] {
        let mut middles = steps(self.step);
        for axis in 0..3 {
            for lane in 0..LANES {
                middles[axis][lane] += self.middle[axis];
            }
        }
        middles
    }
}

impl Bests {
    /// Of the triangles with the nearest corners.
    #[inline(always)]
    fn first_seen(triangles: &[RoughTriangle], slots: &[u32], middles: &[Lanes; 3]) -> Self {
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
    fn points(&self, middles: &[Lanes; 3]) -> [Lanes; 3] {
        let mut points = *middles;
        for axis in 0..3 {
            for lane in 0..LANES {
                points[axis][lane] -= self.seen.most[lane] * self.seen.direction[axis][lane];
            }
        }
        points
    }

    #[inline(always)]
    fn update(&mut self, slot: u32, found: &Seen) {
        for lane in 0..LANES {
            let is_nearer = found.most[lane] < self.seen.most[lane];
            self.slots[lane] = if is_nearer { slot } else { self.slots[lane] };
            self.seen.most[lane] = if is_nearer { found.most[lane] } else { self.seen.most[lane] };
            for axis in 0..3 {
                let best = &mut self.seen.direction[axis][lane];
                *best = if is_nearer { found.direction[axis][lane] } else { *best };
            }
        }
    }

    #[inline(always)]
    fn bounds(&self, half_side: f32, rounding: f32) -> Bounds {
        let mut bounds = Bounds { most: [0.0; LANES], slope: [[0.0; LANES]; 3] };
        for lane in 0..LANES {
            let distance = self.seen.most[lane];
            let hypotenuse = (distance * distance + 3.0 * half_side * half_side).sqrt();
            let share = distance / hypotenuse;
            bounds.most[lane] = hypotenuse + 2.0 * rounding;
            for axis in 0..3 {
                bounds.slope[axis][lane] = share * self.seen.direction[axis][lane];
            }
        }
        bounds
    }
}

impl Bounds {
    /// In which of the cubes a triangle may be nearest to a point: 1, else 0.
    #[inline(always)]
    fn passed(&self, least: &Lanes, direction: &[Lanes; 3], half_side: f32) -> [u32; LANES] {
        let mut passed = [0; LANES];
        for lane in 0..LANES {
            let apart = (self.slope[0][lane] - direction[0][lane]).abs()
                + (self.slope[1][lane] - direction[1][lane]).abs()
                + (self.slope[2][lane] - direction[2][lane]).abs();
            passed[lane] = if least[lane] > self.most[lane] + half_side * apart { 0 } else { 1 };
        }
        passed
    }
}
