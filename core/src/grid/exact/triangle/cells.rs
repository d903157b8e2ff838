//! The cells that a triangle meets, and the bounds of ∇φ over them, eight cells at a time.
//!
//! 1. [`Cells::collect`] lists the cells of the triangle's box that no plane separates from it (`separating_planes`).
//! 2. [`Cells::bound_directions`] unites the intervals of ∇φ·d of eight cells with those so far, and marks the cells
//!    in which φ is monotonic along some direction.
//! 3. [`Cells::stationary_cells`] yields the cells without that mark.

use nalgebra::Vector3;

use super::LANES;
use super::cell::Cell;
use super::cell_range::CellRange;
use super::directions::{DirectionalBounds, Directions};
use super::grid_triangle::{GridTriangle, MAX_CELLS};
use crate::grid::Storage;
use crate::grid::exact::polynomial::Polynomial;
use crate::number::{Float, Real};

/// The cells that a triangle meets.
pub(super) struct Cells<R> {
    range: CellRange<R>,
    /// Numbers of the cells in `range`, plus [`MONOTONIC`] where that holds. From `count` on, the first number is
    /// repeated to fill all lanes.
    numbers: [u16; MAX_CELLS as usize + LANES],
    pub count: usize,
}

/// Added to the number of a cell without stationary points. Larger than all numbers.
const MONOTONIC: u16 = 1024;

impl<R: Float> Cells<R> {
    /// An empty list.
    #[inline(always)]
    pub fn new(triangle: &GridTriangle<R>) -> Self {
        Self { range: CellRange::new(triangle), numbers: [0; MAX_CELLS as usize + LANES], count: 0 }
    }

    /// Fills the list with the cells that `triangle` meets. It must be the one passed to [`new`](Self::new).
    #[inline(always)]
    pub fn collect(&mut self, triangle: &GridTriangle<R>) {
        let (range, numbers) = (&self.range, &mut self.numbers);
        let cell_count = R::from_f64(range.count as u32 as f64);
        let mut count = 0;
        let mut from = 0;
        while from < range.count {
            let mut is_met = [0; LANES];
            for lane in 0..LANES {
                let number = R::from_f64(from as u32 as f64) + R::from_f64(lane as f64);
                let part = range.clip(number);
                let center = Vector3::new(
                    part.origin[0] + part.center[0],
                    part.origin[1] + part.center[1],
                    part.origin[2] + part.center[2],
                );
                let is_disjoint = triangle.separating_planes.overlap(center, part.half_extents.into()) < R::zero();
                is_met[lane] = u8::from(!is_disjoint & (number < cell_count));
            }
            // Every number is written, but kept only if met: no branch on unpredictable data.
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
        if let Some(padding) = numbers.get_mut(count..).and_then(<[u16]>::first_chunk_mut::<LANES>) {
            *padding = [first; LANES];
        }
        self.count = count;
    }

    /// Includes the eight cells from position `from` of the list in `bounds`.
    #[inline(always)]
    pub fn bound_directions<S: Storage>(
        &mut self,
        storage: &S,
        directions: &Directions<R>,
        from: usize,
        bounds: &mut DirectionalBoundsLanes<R>,
    ) {
        let Some(chunk) = self.numbers.get_mut(from..).and_then(<[u16]>::first_chunk_mut::<LANES>) else { return };
        let numbers = chunk.map(|number| R::from_f64(f64::from(number)));
        let mut cells = [[R::zero(); LANES]; 3];
        for lane in 0..LANES {
            let cell = self.range.clip(numbers[lane]).origin;
            (cells[0][lane], cells[1][lane], cells[2][lane]) = (cell[0], cell[1], cell[2]);
        }
        let samples = storage.corners_in_lanes(cells);
        let mut marked = numbers;
        for lane in 0..LANES {
            let part = self.range.clip(numbers[lane]);
            let polynomial = Polynomial::new([
                samples[0][lane],
                samples[1][lane],
                samples[2][lane],
                samples[3][lane],
                samples[4][lane],
                samples[5][lane],
                samples[6][lane],
                samples[7][lane],
            ]);
            let cell = part.with_polynomial(polynomial);
            let form = cell.mean_value_form();
            // Largest distance of an interval from 0; positive if φ is monotonic along some direction.
            let mut steepest = R::zero();
            for k in 0..4 {
                let [lower, upper] = form.directional_range(directions, k);
                bounds.lower[k][lane] = Real::min(bounds.lower[k][lane], lower);
                bounds.upper[k][lane] = Real::max(bounds.upper[k][lane], upper);
                steepest = Real::max(steepest, Real::max(lower, -upper));
            }
            let mark = if R::zero() < steepest { R::from_f64(f64::from(MONOTONIC)) } else { R::zero() };
            marked[lane] = numbers[lane] + mark;
            bounds.nan_check[lane] += cell.polynomial.xyz * R::zero();
        }
        *chunk = marked.map(|number| number.to_index() as u16);
    }

    /// The cells that may hold a stationary point of φ along the triangle.
    pub fn stationary_cells<S: Storage>(&self, storage: &S) -> impl Iterator<Item = Cell<R>> {
        let numbers = self.numbers.iter().take(self.count);
        numbers.filter(|number| **number < MONOTONIC).map(|number| self.cell(storage, *number))
    }

    fn cell<S: Storage>(&self, storage: &S, number: u16) -> Cell<R> {
        let part = self.range.clip(R::from_f64(f64::from(number)));
        let samples = storage.corners(part.origin.map(Float::to_index));
        part.with_polynomial(Polynomial::new(samples.map(R::from_stored)))
    }
}

/// [`DirectionalBounds`] over all cells so far, lane by lane.
pub(super) struct DirectionalBoundsLanes<R> {
    lower: [[R; LANES]; 4],
    upper: [[R; LANES]; 4],
    /// 0 as long as all samples are finite, then NaN.
    nan_check: [R; LANES],
}

impl<R: Float> DirectionalBoundsLanes<R> {
    #[inline(always)]
    pub fn empty() -> Self {
        let DirectionalBounds { lower, upper } = DirectionalBounds::empty();
        Self { lower: lower.map(|x| [x; LANES]), upper: upper.map(|x| [x; LANES]), nan_check: [R::zero(); LANES] }
    }

    /// Union of all lanes, by halves. `None` if a sample is not finite.
    #[inline(always)]
    pub fn merge(mut self) -> Option<DirectionalBounds<R>> {
        let mut stride = LANES / 2;
        while stride > 0 {
            for lane in 0..stride {
                let other = (lane + stride) % LANES;
                for k in 0..4 {
                    self.lower[k][lane] = Real::min(self.lower[k][lane], self.lower[k][other]);
                    self.upper[k][lane] = Real::max(self.upper[k][lane], self.upper[k][other]);
                }
                let nan_check = self.nan_check[other];
                self.nan_check[lane] += nan_check;
            }
            stride /= 2;
        }
        let bounds =
            DirectionalBounds { lower: self.lower.map(|lanes| lanes[0]), upper: self.upper.map(|lanes| lanes[0]) };
        (self.nan_check[0] == R::zero()).then_some(bounds)
    }
}
