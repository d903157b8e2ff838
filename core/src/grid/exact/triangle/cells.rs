use nalgebra::Vector3;

use super::cell::Cell;
use super::cell_range::CellRange;
use super::directions::{DirectionalBounds, Directions};
use super::face::{Face, MAX_CELLS};
use crate::grid::Storage;
use crate::grid::exact::polynomial::Polynomial;
use crate::number::{Float, Real};

/// As many f64 as the widest vectors hold.
pub(super) const LANES: usize = 8;

/// The cells that a triangle meets.
pub(super) struct Cells<R> {
    cell_range: CellRange<R>,
    /// Their numbers in the block; [`STEEP`] is added where φ is not level along some of the ways, once that was looked at. Beyond
    /// the last, the first again, to fill all lanes.
    numbers: [u16; MAX_CELLS as usize + LANES],
    pub count: usize,
}

/// More than all numbers of cells.
const STEEP: u16 = 1024;

impl<R: Float> Cells<R> {
    /// None yet.
    #[inline(always)]
    pub fn new(face: &Face<R>) -> Self {
        Self { cell_range: CellRange::new(face), numbers: [0; MAX_CELLS as usize + LANES], count: 0 }
    }

    /// Finds all of the triangle, the same that its box was made of.
    #[inline(always)]
    pub fn find(&mut self, face: &Face<R>) {
        let (cell_range, numbers) = (&self.cell_range, &mut self.numbers);
        let all = R::from_f64(cell_range.count as u32 as f64);
        let mut count = 0;
        let mut from = 0;
        while from < cell_range.count {
            let mut is_met = [0; LANES];
            for lane in 0..LANES {
                let number = R::from_f64(from as u32 as f64) + R::from_f64(lane as f64);
                let part = cell_range.part(number);
                let middle = Vector3::new(
                    part.first[0] + part.middle[0],
                    part.first[1] + part.middle[1],
                    part.first[2] + part.middle[2],
                );
                let is_missed = face.separating_planes.room(middle, part.half.into()) < R::zero();
                is_met[lane] = u8::from(!is_missed & (number < all));
            }
            // All are written, so that nothing branches by what is met.
            for lane in 0..LANES {
                let number = from.wrapping_add(lane);
                if let Some(slot) = numbers.get_mut(count) {
                    *slot = number as u16;
                }
                count = count.wrapping_add(usize::from(is_met[lane]));
            }
            from = from.saturating_add(LANES);
        }
        let first = numbers[0];
        if let Some(beyond) = numbers.get_mut(count..).and_then(<[u16]>::first_chunk_mut::<LANES>) {
            *beyond = [first; LANES];
        }
        self.count = count;
    }

    /// How φ rises in those from one on, side by side.
    #[inline(always)]
    pub fn look<S: Storage>(
        &mut self,
        storage: &S,
        directions: &Directions<R>,
        from: usize,
        rises: &mut DirectionalBoundsLanes<R>,
    ) {
        let Some(place) = self.numbers.get_mut(from..).and_then(<[u16]>::first_chunk_mut::<LANES>) else { return };
        let numbers = place.map(|number| R::from_f64(f64::from(number)));
        let mut at = [[R::zero(); LANES]; 3];
        for lane in 0..LANES {
            let first = self.cell_range.part(numbers[lane]).first;
            (at[0][lane], at[1][lane], at[2][lane]) = (first[0], first[1], first[2]);
        }
        let samples = storage.corners_in_lanes(at);
        let mut marked = numbers;
        for lane in 0..LANES {
            let part = self.cell_range.part(numbers[lane]);
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
            let mut steepest = R::zero();
            for way in 0..4 {
                let [least, most] = slopes.over(directions, way);
                rises.least[way][lane] = Real::min(rises.least[way][lane], least);
                rises.most[way][lane] = Real::max(rises.most[way][lane], most);
                steepest = Real::max(steepest, Real::max(least, -most));
            }
            let mark = if R::zero() < steepest { R::from_f64(f64::from(STEEP)) } else { R::zero() };
            marked[lane] = numbers[lane] + mark;
            rises.doubt[lane] += cell.field.xyz * R::zero();
        }
        *place = marked.map(|number| number.to_index() as u16);
    }

    /// Those where the field may be level along the triangle.
    pub fn level<S: Storage>(&self, storage: &S) -> impl Iterator<Item = Cell<R>> {
        let looked_at = self.numbers.iter().take(self.count);
        looked_at.filter(|number| **number < STEEP).map(|number| self.cell(storage, *number))
    }

    fn cell<S: Storage>(&self, storage: &S, number: u16) -> Cell<R> {
        let part = self.cell_range.part(R::from_f64(f64::from(number)));
        let samples = storage.corners(part.first.map(Float::to_index));
        part.of(Polynomial::new(samples.map(R::from_stored)))
    }
}

/// The [`DirectionalBounds`] over all cells so far, lane by lane.
pub(super) struct DirectionalBoundsLanes<R> {
    least: [[R; LANES]; 4],
    most: [[R; LANES]; 4],
    /// Zero as long as all samples are numbers.
    doubt: [R; LANES],
}

impl<R: Float> DirectionalBoundsLanes<R> {
    #[inline(always)]
    pub fn none() -> Self {
        let DirectionalBounds { least, most } = DirectionalBounds::none();
        Self { least: least.map(|x| [x; LANES]), most: most.map(|x| [x; LANES]), doubt: [R::zero(); LANES] }
    }

    /// Of all lanes. `None` where a sample is no number.
    #[inline(always)]
    pub fn all(mut self) -> Option<DirectionalBounds<R>> {
        let mut apart = LANES / 2;
        while apart > 0 {
            for lane in 0..apart {
                let other = (lane + apart) % LANES;
                for way in 0..4 {
                    self.least[way][lane] = Real::min(self.least[way][lane], self.least[way][other]);
                    self.most[way][lane] = Real::max(self.most[way][lane], self.most[way][other]);
                }
                let doubt = self.doubt[other];
                self.doubt[lane] += doubt;
            }
            apart /= 2;
        }
        let rises =
            DirectionalBounds { least: self.least.map(|lanes| lanes[0]), most: self.most.map(|lanes| lanes[0]) };
        (self.doubt[0] == R::zero()).then_some(rises)
    }
}
