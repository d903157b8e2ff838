//! From what may be nearest somewhere in a cube to what may be in each of eight cubes in it.

use super::candidates::{Candidate, Test, lowest, pick};
use super::eighths::steps;
use crate::lanes_triangle::LANES;
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
struct Bounds {
    /// A of [`Tree::reaching`], and twice the rounding.
    most: Lanes,
    /// k e of the same.
    slope: [Lanes; 3],
}

/// Somewhere in cubes.
struct InCubes {
    steps: [Lanes; 3],
    bounds: Bounds,
    half_side: f32,
}

/// Of the candidates of a cube those of each of eight cubes in it, the nearest to its middle first.
#[inline(always)]
pub(super) fn sift(
    triangles: &[RoughTriangle],
    candidates: &[Candidate],
    cubes: &Cubes,
    picked: &mut Vec<u32>,
    seen: &mut Vec<(u32, Seen)>,
    of_cubes: &mut [Vec<Candidate>; LANES],
) {
    let Cubes { half_side, rounding, .. } = *cubes;
    let steps = steps(cubes.step);
    let mut middles = steps;
    for axis in 0..3 {
        for lane in 0..LANES {
            middles[axis][lane] += cubes.middle[axis];
        }
    }
    let mut bests = Bests::first_seen(triangles, candidates, &steps, &middles);
    pick(candidates, picked, &InCubes { steps, bounds: bests.bounds(half_side, rounding), half_side });
    seen.clear();
    for picked in picked.iter() {
        let slot = candidates[*picked as usize].slot;
        let found = triangles[slot as usize].seen_from(&middles);
        bests.update(slot, &found);
        seen.push((slot, found));
    }
    bests.deal_out(seen, half_side, rounding, of_cubes);
}

impl Test for InCubes {
    #[inline(always)]
    fn passed(&self, candidate: &Candidate) -> [u32; LANES] {
        let [x, y, z] = candidate.direction;
        self.bounds.passed(&candidate.least_at(&self.steps), &[[x; LANES], [y; LANES], [z; LANES]], self.half_side)
    }
}

impl Bests {
    /// Of the first candidate and those that look nearest from afar.
    #[inline(always)]
    fn first_seen(
        triangles: &[RoughTriangle],
        candidates: &[Candidate],
        steps: &[Lanes; 3],
        middles: &[Lanes; 3],
    ) -> Self {
        let slot = candidates[0].slot;
        let mut bests = Self { slots: [slot; LANES], seen: triangles[slot as usize].seen_from(middles) };
        let mut last = 0;
        for number in lowest(candidates, steps) {
            if number != last {
                let slot = candidates[number as usize].slot;
                bests.update(slot, &triangles[slot as usize].seen_from(middles));
                last = number;
            }
        }
        bests
    }

    /// To each cube what may be nearest to a point of it.
    #[inline(always)]
    fn deal_out(&self, seen: &[(u32, Seen)], half_side: f32, rounding: f32, of_cubes: &mut [Vec<Candidate>; LANES]) {
        let bounds = self.bounds(half_side, rounding);
        of_cubes.iter_mut().for_each(Vec::clear);
        for (slot, found) in seen {
            let passed = bounds.passed(&found.least, &found.direction, half_side);
            let mut passed = (0..LANES).fold(0_u32, |bits, lane| bits | passed[lane] << lane);
            while passed != 0 {
                let lane = passed.trailing_zeros() as usize % LANES;
                passed &= passed - 1;
                let of_cube = &mut of_cubes[lane];
                let direction = [found.direction[0][lane], found.direction[1][lane], found.direction[2][lane]];
                of_cube.push(Candidate { slot: *slot, least: found.least[lane], direction });
                if *slot == self.slots[lane] {
                    let last = of_cube.len() - 1;
                    of_cube.swap(0, last);
                }
            }
        }
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
