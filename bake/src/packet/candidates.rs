//! Triangles that may be nearest somewhere in a cube, and which of them are worth a closer look.

use crate::lanes_triangle::LANES;
use crate::rough_triangle::Lanes;

/// A triangle that may be nearest to a node of a cube.
#[derive(Clone, Copy)]
pub(super) struct Candidate {
    pub slot: u32,
    /// At v from the middle of the cube it is no nearer than `least` + v · `direction`.
    pub least: f32,
    pub direction: [f32; 3],
}

impl Candidate {
    /// No nearer than this, at so many steps from the middle of its cube.
    #[inline(always)]
    pub fn least_at(&self, steps: &[Lanes; 3]) -> Lanes {
        let mut least = [0.0; LANES];
        for lane in 0..LANES {
            least[lane] = self.least
                + (steps[0][lane] * self.direction[0]
                    + steps[1][lane] * self.direction[1]
                    + steps[2][lane] * self.direction[2]);
        }
        least
    }
}

/// Whether a candidate may be nearest, by lanes: 1, else 0.
pub(super) trait Test {
    fn passed(&self, candidate: &Candidate) -> [u32; LANES];
}

/// At nodes that are no farther from the mesh than `most`.
pub(super) struct AtNodes {
    pub steps: [Lanes; 3],
    pub most: Lanes,
}

impl Test for AtNodes {
    #[inline(always)]
    fn passed(&self, candidate: &Candidate) -> [u32; LANES] {
        let least = candidate.least_at(&self.steps);
        let mut passed = [0; LANES];
        for lane in 0..LANES {
            passed[lane] = if least[lane] > self.most[lane] { 0 } else { 1 };
        }
        passed
    }
}

/// The numbers of those candidates that pass in any lane. Without a branch for each, which would be hard to foretell.
#[inline(always)]
pub(super) fn pick(candidates: &[Candidate], picked: &mut Vec<u32>, test: &impl Test) {
    picked.clear();
    picked.resize(candidates.len(), 0);
    let mut count = 0;
    for (number, candidate) in (0..).zip(candidates) {
        picked[count] = number;
        count += test.passed(candidate).iter().fold(0, |any, one| any | one) as usize;
    }
    picked.truncate(count);
}

/// At each of eight points the number of the candidate that may be nearest by what is known: a good one to begin with.
#[inline(always)]
pub(super) fn lowest(candidates: &[Candidate], steps: &[Lanes; 3]) -> [u32; LANES] {
    let mut numbers = [0; LANES];
    let mut lowest = [f32::INFINITY; LANES];
    for (number, candidate) in (0..).zip(candidates) {
        let least = candidate.least_at(steps);
        for lane in 0..LANES {
            let is_lower = least[lane] < lowest[lane];
            numbers[lane] = if is_lower { number } else { numbers[lane] };
            lowest[lane] = if is_lower { least[lane] } else { lowest[lane] };
        }
    }
    numbers
}
