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

    /// At one of eight points it may be no farther than `most` there.
    #[inline(always)]
    pub fn may_be_within(&self, most: &Lanes, steps: &[Lanes; 3]) -> bool {
        let least = self.least_at(steps);
        let mut within = 0;
        for lane in 0..LANES {
            within |= if least[lane] > most[lane] { 0 } else { 1 };
        }
        within != 0
    }
}
