//! The cells that a triangle meets, and the bounds of ∇φ over them, eight cells at a time.
//!
//! 1. [`Cells::collect`] lists the cells of the triangle's box that no plane separates from it (`separating_planes`).
//! 2. [`Cells::bound_directions`] unites the intervals of ∇φ·d of eight cells with those so far, and notes along which
//!    directions φ falls everywhere in a cell.
//! 3. [`Cells::stationary_cells`] yields the cells without such a direction; `descent_table` compares neighbours.
//!
//! Samples are in single precision, and bounds of differences need no more: they are computed in f32 and widened by its
//! rounding. Whatever is evaluated is evaluated in the caller's numbers.

use core::array::from_fn;

use nalgebra::Vector3;

use super::cell::Cell;
use super::cell_range::CellRange;
use super::directions::{DirectionalBounds, Directions};
use super::grid_triangle::{GridTriangle, MAX_CELLS};
use super::in_lane;
use super::separating_planes::SeparatingPlanes;
use super::team_list::TeamList;
use super::{LANES, corners_of_thread, of_all_lanes};
use crate::grid::Storage;
use crate::grid::exact::polynomial::Polynomial;
use crate::grid::node_box::NodeBox;
use crate::number::{Float, Real};

/// Room for the cells of a triangle's box, and for full lanes after the last.
pub(super) const CELL_ROOM: usize = MAX_CELLS as usize + LANES;

/// Larger than all numbers of cells.
const EDGE: u16 = 1024;

/// The cells that a triangle meets.
pub(super) struct Cells<const ROOM: usize> {
    range: CellRange<f32>,
    /// Numbers of the cells in `range`, plus [`EDGE`] times the edges whose planes they meet, as
    /// [`SeparatingPlanes::overlap_and_edges`] has them. From `count` on, the first is repeated to fill all lanes.
    numbers: TeamList<u16, ROOM>,
    /// For each of them: the directions along which φ falls everywhere in the cell. Bit k for direction k, bit 4 + k for
    /// its opposite.
    descents: TeamList<u8, ROOM>,
    pub count: usize,
}

/// A cell of the list.
#[derive(Clone, Copy)]
pub(super) struct MetCell {
    /// Its number in the triangle's box, x fastest.
    pub number: u16,
    /// Bits of the edges that it may meet.
    pub edges: u8,
    /// Bits of the directions along which φ falls everywhere in it.
    pub descents: u8,
}

/// Bits of the directions, as numbers, and of their opposites.
const ALONG: [f32; 4] = [1.0, 2.0, 4.0, 8.0];
const AGAINST: [f32; 4] = [16.0, 32.0, 64.0, 128.0];

impl<const ROOM: usize> Cells<ROOM> {
    /// An empty list.
    #[inline(always)]
    pub fn new<R: Float>(triangle: &GridTriangle<R>) -> Self {
        let range = CellRange::new(triangle);
        Self { range, numbers: TeamList::new(0), descents: TeamList::new(0), count: 0 }
    }

    /// Fills the list with the cells that `triangle` meets. It must be the one passed to [`new`](Self::new).
    #[inline(always)]
    pub fn collect<R: Float, S: Storage>(&mut self, storage: &S, triangle: &GridTriangle<R>) {
        self.collect_met(storage, triangle, self.range.count, |_, from| {
            let mut numbers = [0.0; LANES];
            for lane in 0..S::LANES_OF_THREAD {
                numbers[lane] = from as u32 as f32 + lane as f32;
            }
            numbers
        });
    }

    /// Fills the list with those cells of a block that `triangle` meets and that have a sample below `ceiling`. Returns the lowest
    /// sample of the cells that have none.
    #[inline(always)]
    pub fn collect_low<R: Float>(&mut self, triangle: &GridTriangle<R>, nodes: &NodeBox, ceiling: f32) -> f32 {
        let [x, y, z] = triangle.cell_counts();
        let (mut first, mut count, mut above) = (0_u16, 0_usize, [f32::INFINITY; LANES]);
        for (z, y) in (0..z).flat_map(|z| (0..y).map(move |y| (z, y))) {
            let Some(lowest) = nodes.lowest_in_row(y, z) else { break };
            let mut any = 0;
            for lane in 0..LANES {
                let is_low = lowest[lane] < ceiling;
                above[lane] =
                    Real::min(above[lane], Real::select((lane as u32) < x && !is_low, lowest[lane], f32::INFINITY));
                any |= u32::from(is_low);
            }
            if any != 0 {
                for lane in 0..LANES {
                    self.numbers.set(nodes, count, first.wrapping_add(lane as u16));
                    count = count.wrapping_add(usize::from(lowest[lane] < ceiling && (lane as u32) < x));
                }
            }
            first = first.wrapping_add(x as u16);
        }
        if count > 0 {
            self.collect_met(nodes, triangle, count, |list, from| {
                let mut numbers = [0.0; LANES];
                let entries = list.own_lanes::<NodeBox>(from).unwrap_or([0; LANES]);
                for lane in 0..NodeBox::LANES_OF_THREAD {
                    numbers[lane] = f32::from(entries[lane]);
                }
                numbers
            });
        }
        above.into_iter().fold(f32::INFINITY, Real::min)
    }

    /// Fills the list with those of `total` cells that `triangle` meets. `get` returns the numbers from a position on for each lane of
    /// this thread, and may read the list from there on.
    #[inline(always)]
    fn collect_met<R: Float, S: Storage>(
        &mut self,
        storage: &S,
        triangle: &GridTriangle<R>,
        total: usize,
        get: impl Fn(&TeamList<u16, ROOM>, usize) -> [f32; LANES],
    ) {
        let planes = SeparatingPlanes::new(triangle).to_single(R::from_f64(f64::from(triangle.extent)));
        let Self { range, numbers, .. } = self;
        let mut count = 0;
        let mut from = 0;
        while from < total {
            let (mut is_met, mut entries) = ([0_u8; LANES], [0_u16; LANES]);
            let of_thread = from.wrapping_add(storage.first_lane());
            let some = get(numbers, of_thread);
            let left = total.saturating_sub(of_thread) as u32 as f32;
            for lane in 0..S::LANES_OF_THREAD {
                let number = some[lane];
                let part = range.clip(number);
                let center = Vector3::new(
                    part.offset[0] + part.center[0],
                    part.offset[1] + part.center[1],
                    part.offset[2] + part.center[2],
                );
                let (overlap, edges) = planes.overlap_and_edges(center, part.half_extents.into());
                entries[lane] = (number + edges * f32::from(EDGE)).to_index() as u16;
                is_met[lane] = u8::from((0.0 <= overlap) & ((lane as f32) < left));
            }
            count = numbers.append(storage, count, &entries, &is_met);
            from = from.saturating_add(LANES);
        }
        if let Some(first) = numbers.own_lanes::<S>(0) {
            numbers.fill(storage, count, storage.of_lane(&first, 0));
        }
        self.count = count;
    }

    /// Includes the eight cells from position `from` of the list in `bounds`, and notes their descents.
    #[inline(always)]
    pub fn bound_directions<S: Storage>(
        &mut self,
        storage: &S,
        directions: &Directions<f32>,
        from: usize,
        bounds: &mut DirectionalBoundsLanes,
    ) {
        let Some(entries) = self.numbers.own_lanes::<S>(from) else { return };
        let mut numbers = [0.0_f32; LANES];
        for lane in 0..S::LANES_OF_THREAD {
            numbers[lane] = f32::from(entries[lane] % EDGE);
        }
        let mut cells = [[0.0_f32; LANES]; 3];
        for lane in 0..S::LANES_OF_THREAD {
            let cell = self.range.clip(numbers[lane]).origin;
            (cells[0][lane], cells[1][lane], cells[2][lane]) = (cell[0], cell[1], cell[2]);
        }
        let samples = corners_of_thread(storage, cells);
        let mut descents = [0.0_f32; LANES];
        for lane in 0..S::LANES_OF_THREAD {
            let part = self.range.clip(numbers[lane]);
            let polynomial = Polynomial::new(in_lane(&samples, lane));
            let cell = part.with_polynomial(polynomial);
            let form = cell.mean_value_form();
            let mut bits = 0.0_f32;
            for k in 0..4 {
                let [lower, upper] = form.directional_range(directions, k);
                bounds.lower[k][lane] = Real::min(bounds.lower[k][lane], lower);
                bounds.upper[k][lane] = Real::max(bounds.upper[k][lane], upper);
                bits += Real::select(upper < 0.0, ALONG[k], 0.0);
                bits += Real::select(0.0 < lower, AGAINST[k], 0.0);
            }
            descents[lane] = bits;
            bounds.nan_check[lane] += cell.polynomial.xyz * 0.0;
        }
        self.descents.set_own_lanes::<S>(from, descents.map(|bits| bits.to_index() as u8));
    }

    /// Eight cells from position `from` of the list on, a multiple of eight: those of the lanes of this thread.
    #[inline(always)]
    pub fn own_lanes<S: Storage>(&self, from: usize) -> Option<[MetCell; LANES]> {
        let (numbers, descents) = (self.numbers.own_lanes::<S>(from)?, self.descents.own_lanes::<S>(from)?);
        Some(from_fn(|lane| MetCell {
            number: numbers[lane] % EDGE,
            edges: (numbers[lane] / EDGE) as u8,
            descents: descents[lane],
        }))
    }

    /// The cells that may hold a stationary point of φ along the triangle.
    pub fn stationary_cells<R: Float, S: Storage>(
        &self,
        triangle: &GridTriangle<R>,
        storage: &S,
    ) -> impl Iterator<Item = Cell<R>> {
        let range = CellRange::<R>::new(triangle);
        let chunks = (0..self.count).step_by(LANES).filter_map(|from| Some((from, self.own_lanes::<S>(from)?)));
        let numbers = chunks.flat_map(move |(from, cells)| {
            let left = self.count.saturating_sub(from).min(LANES);
            (0..left).filter_map(move |lane| {
                let cell = storage.of_lane(&cells, lane);
                (cell.descents == 0).then_some(cell.number)
            })
        });
        numbers.map(move |number| {
            let part = range.clip(R::from_f64(f64::from(number)));
            let samples = storage.corners(part.origin.map(Float::to_index));
            part.with_polynomial(Polynomial::new(samples.map(R::from_stored)))
        })
    }
}

/// [`DirectionalBounds`] over all cells so far, lane by lane.
pub(super) struct DirectionalBoundsLanes {
    lower: [[f32; LANES]; 4],
    upper: [[f32; LANES]; 4],
    /// 0 as long as all samples are finite, then NaN.
    nan_check: [f32; LANES],
}

impl DirectionalBoundsLanes {
    #[inline(always)]
    pub fn empty() -> Self {
        let DirectionalBounds { lower, upper } = DirectionalBounds::<f32>::empty();
        Self { lower: lower.map(|x| [x; LANES]), upper: upper.map(|x| [x; LANES]), nan_check: [0.0; LANES] }
    }

    /// Union of all lanes, by halves. `None` if a sample is not finite.
    #[inline(always)]
    pub fn merge<S: Storage>(mut self, storage: &S) -> Option<DirectionalBounds<f32>> {
        for k in 0..4 {
            self.lower[k] = of_all_lanes(storage, &self.lower[k]);
            self.upper[k] = of_all_lanes(storage, &self.upper[k]);
        }
        self.nan_check = of_all_lanes(storage, &self.nan_check);
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
        (self.nan_check[0] == 0.0).then_some(bounds)
    }
}
