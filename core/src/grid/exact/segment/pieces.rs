use nalgebra::Vector3;

use super::Line;
use super::cubic::Cubic;
use super::voxel_walk::Step;
use crate::grid::Storage;
use crate::number::{Float, Real};

/// As many f64 as the widest vectors hold.
pub(super) const LANES: usize = 8;

/// Parts of lines, each in one cell.
pub(super) struct Pieces<R: Real> {
    pub count: usize,
    /// Of its line.
    pub ends: [[[R; 3]; 2]; LANES],
    pub bound: [R; LANES],
    pub is_first: [bool; LANES],
    /// Along each axis: the cell's first corner, a whole number.
    first: [[R; LANES]; 3],
    from: [[R; LANES]; 3],
    way: [[R; LANES]; 3],
    entry: [R; LANES],
    exit: [R; LANES],
}

/// What is least on each piece.
pub(super) struct Least<R> {
    /// Of the line.
    pub share: [R; LANES],
    pub value: [R; LANES],
    /// The least sample of the cell.
    pub corner: [R; LANES],
    /// All of the cell's samples are numbers.
    pub is_finite: [bool; LANES],
    /// 1 where the value may be less than the one to compare with, or no number; else 0.
    pub may_be_less: [u8; LANES],
}

impl<R: Float> Pieces<R> {
    #[inline(always)]
    pub fn new() -> Self {
        let nothing = [[R::zero(); LANES]; 3];
        Self {
            count: 0,
            ends: [[[R::zero(); 3]; 2]; LANES],
            bound: nothing[0],
            is_first: [false; LANES],
            first: nothing,
            from: nothing,
            way: nothing,
            entry: nothing[0],
            exit: nothing[0],
        }
    }

    #[inline(always)]
    pub fn push(&mut self, line: &Line<R>, step: &Step<R>) {
        let at = self.count % LANES;
        (self.ends[at], self.bound[at]) = (line.ends, line.bound);
        self.is_first[at] = step.is_first;
        for axis in 0..3 {
            self.first[axis][at] = step.cell[axis];
            self.from[axis][at] = line.from[axis];
            self.way[axis][at] = line.way[axis];
        }
        (self.entry[at], self.exit[at]) = (step.entry, step.exit);
        self.count = self.count.saturating_add(1);
    }

    /// Of all lanes, and compared with a value; where no piece was put, what stood there before.
    #[inline(always)]
    pub fn least<S: Storage>(&self, storage: &S, than: R) -> Least<R> {
        let samples = storage.corners_in_lanes(self.first);
        let nothing = [R::zero(); LANES];
        let (is_finite, may_be_less) = ([false; LANES], [0; LANES]);
        let mut least = Least { share: nothing, value: nothing, corner: nothing, is_finite, may_be_less };
        for lane in 0..LANES {
            let of_axis = |axis: &[R; LANES]| axis[lane % LANES];
            let [first, from, way] = [&self.first, &self.from, &self.way]
                .map(|axes| Vector3::new(of_axis(&axes[0]), of_axis(&axes[1]), of_axis(&axes[2])));
            let (entry, span) = (self.entry[lane], self.exit[lane] - self.entry[lane]);
            let mut corners = [R::zero(); 8];
            let (mut lowest, mut sum) = (R::from_f64(f64::INFINITY), R::zero());
            for corner in 0..8 {
                corners[corner] = samples[corner][lane];
                lowest = Real::min(lowest, corners[corner]);
                sum += corners[corner] * R::zero();
            }
            let (share, value) = Cubic::along(corners, from + way * entry - first, way * span).least();
            least.share[lane] = entry + span * share;
            least.value[lane] = value;
            least.corner[lane] = lowest;
            least.is_finite[lane] = sum == R::zero();
            let is_no_less = than <= value;
            // Of what is no number, nor the value by it, nothing is certain.
            least.may_be_less[lane] = u8::from(!is_no_less | (sum + value * R::zero() != R::zero()));
        }
        least
    }
}
