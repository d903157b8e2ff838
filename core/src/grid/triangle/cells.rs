use nalgebra::Vector3;

use super::block::Block;
use super::cell::Cell;
use super::face::{Face, MOST_CELLS};
use super::ways::{Rises, Ways};
use crate::grid::Storage;
use crate::grid::polynomial::Polynomial;
use crate::real::{Float, Real};

/// As many f64 as the widest vectors hold.
pub(super) const LANES: usize = 8;

/// The cells that a triangle meets.
pub(super) struct Cells<R> {
    block: Block<R>,
    /// Their numbers in the block.
    numbers: [u16; MOST_CELLS as usize + LANES],
    /// Whether φ is level along none of the ways, once it was looked at.
    is_steep: [bool; MOST_CELLS as usize + LANES],
    pub count: usize,
}

/// What was seen of some of them.
pub(super) struct Look<R> {
    /// All samples are numbers.
    pub is_finite: bool,
    pub least: [[R; LANES]; 4],
    pub most: [[R; LANES]; 4],
}

impl<R: Float> Cells<R> {
    #[inline(always)]
    pub fn of(face: &Face<R>) -> Self {
        let block = Block::new(face);
        let mut numbers = [0; MOST_CELLS as usize + LANES];
        let mut count = 0;
        let mut from = 0;
        while from < block.count {
            let mut room = [R::zero(); LANES];
            for lane in 0..LANES {
                let part = block.part(R::lift(from as f64) + R::lift(lane as f64));
                let middle = Vector3::new(
                    part.first[0] + part.middle[0],
                    part.first[1] + part.middle[1],
                    part.first[2] + part.middle[2],
                );
                room[lane] = face.outline.room(middle, part.half.into());
            }
            // All are written, so that nothing branches by what is met.
            for lane in 0..LANES {
                let number = from.wrapping_add(lane);
                if let Some(slot) = numbers.get_mut(count) {
                    *slot = number as u16;
                }
                let is_missed = room[lane] < R::zero();
                count = count.wrapping_add(usize::from(!is_missed & (number < block.count)));
            }
            from = from.saturating_add(LANES);
        }
        Self { block, numbers, is_steep: [false; MOST_CELLS as usize + LANES], count }
    }

    /// The numbers of up to so many from one on; where there are no more, the first of these.
    #[inline(always)]
    fn numbers(&self, from: usize) -> [R; LANES] {
        let at = |place: usize| self.numbers.get(place).copied().unwrap_or(0);
        let mut numbers = [R::zero(); LANES];
        for lane in 0..LANES {
            let place = from.wrapping_add(lane);
            numbers[lane] = R::lift(f64::from(at(if place < self.count { place } else { from })));
        }
        numbers
    }

    /// At those from one on, side by side.
    #[inline(always)]
    pub fn look<S: Storage>(&mut self, storage: &S, ways: &Ways<R>, from: usize) -> Look<R> {
        let numbers = self.numbers(from);
        let mut at = [[R::zero(); LANES]; 3];
        for lane in 0..LANES {
            let first = self.block.part(numbers[lane]).first;
            (at[0][lane], at[1][lane], at[2][lane]) = (first[0], first[1], first[2]);
        }
        let samples = storage.corners_of(at);
        let nothing = [R::zero(); LANES];
        let (mut twists, mut least, mut most) = (nothing, [nothing; 4], [nothing; 4]);
        for lane in 0..LANES {
            let part = self.block.part(numbers[lane]);
            let field = Polynomial::new([
                samples[0][lane],
                samples[1][lane],
                samples[2][lane],
                samples[3][lane],
                samples[4][lane],
                samples[5][lane],
                samples[6][lane],
                samples[7][lane],
            ]);
            let cell = part.of(field);
            let slopes = cell.slopes();
            let (u, v, w, x) = (slopes.over(ways, 0), slopes.over(ways, 1), slopes.over(ways, 2), slopes.over(ways, 3));
            (least[0][lane], most[0][lane]) = (u[0], u[1]);
            (least[1][lane], most[1][lane]) = (v[0], v[1]);
            (least[2][lane], most[2][lane]) = (w[0], w[1]);
            (least[3][lane], most[3][lane]) = (x[0], x[1]);
            twists[lane] = cell.field.xyz * R::zero();
        }
        let (mut sum, mut is_steep) = (R::zero(), [false; LANES]);
        for lane in 0..LANES {
            sum += twists[lane];
            for way in 0..4 {
                is_steep[lane] |= (R::zero() < least[way][lane]) | (most[way][lane] < R::zero());
            }
        }
        let places = self.is_steep.get_mut(from..).unwrap_or(&mut []);
        places.iter_mut().zip(is_steep).for_each(|(place, is_steep)| *place = is_steep);
        Look { is_finite: sum == R::zero(), least, most }
    }

    /// Those where the field may be level along the triangle.
    pub fn level<S: Storage>(&self, storage: &S) -> impl Iterator<Item = Cell<R>> {
        let places = self.numbers.iter().zip(&self.is_steep).take(self.count);
        places.filter(|(_, is_steep)| !**is_steep).map(|(number, _)| self.cell(storage, *number))
    }

    fn cell<S: Storage>(&self, storage: &S, number: u16) -> Cell<R> {
        let part = self.block.part(R::lift(f64::from(number)));
        let samples = storage.corners(part.first.map(Float::to_index));
        part.of(Polynomial::new(samples.map(R::of_stored)))
    }
}

/// The [`Rises`] over all cells so far, lane by lane.
pub(super) struct LaneRises<R> {
    least: [[R; LANES]; 4],
    most: [[R; LANES]; 4],
}

impl<R: Float> LaneRises<R> {
    #[inline(always)]
    pub fn none() -> Self {
        let Rises { least, most } = Rises::none();
        Self { least: least.map(|x| [x; LANES]), most: most.map(|x| [x; LANES]) }
    }

    #[inline(always)]
    pub fn include(&mut self, look: &Look<R>) {
        for way in 0..4 {
            for lane in 0..LANES {
                self.least[way][lane] = Real::min(self.least[way][lane], look.least[way][lane]);
                self.most[way][lane] = Real::max(self.most[way][lane], look.most[way][lane]);
            }
        }
    }

    /// Of all lanes.
    #[inline(always)]
    pub fn all(&self) -> Rises<R> {
        let mut all = Rises::none();
        for way in 0..4 {
            for lane in 0..LANES {
                all.least[way] = Real::min(all.least[way], self.least[way][lane]);
                all.most[way] = Real::max(all.most[way], self.most[way][lane]);
            }
        }
        all
    }
}
