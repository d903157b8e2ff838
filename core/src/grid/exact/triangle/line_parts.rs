//! Minima on parts of creases and edges, eight at a time.
//!
//! A plane x_k = p has the corners at heights a_k − p, b_k − p, c_k − p. If their signs differ, one corner is alone
//! on its side; call its height s and another one's r. The cut ends on the edge between them, at the fraction s / (s
//! − r) from the lone corner.
//!
//! A line start + t d is clipped to a cell by the slabs between its faces (Kay and Kajiya 1986, "Ray Tracing Complex
//! Scenes"). On the part that is left φ is a cubic (`../segment/cubic`).

use nalgebra::Vector3;

use super::LANES;
use super::LowestPoint;
use super::descent_table::LinePart;
use super::grid_triangle::GridTriangle;
use super::{corners_of_thread, in_lane};
use crate::grid::Storage;
use crate::grid::exact::segment::Cubic;
use crate::number::{Float, Real};

/// Up to [`LANES`] parts, each a line start + t d, 0 ≤ t ≤ 1, in a cell. Vectors are by axis, weights by corner, then by
/// lane. Flags are numbers, 0 or 1, and each step is a loop of its own, so that compilers make vectors of it.
pub(super) struct LineParts<R: Real> {
    count: usize,
    /// [`LinePart::line`], as a number.
    line: [R; LANES],
    /// Index of the cell, as a number.
    cell: [[R; LANES]; 3],
    start: [[R; LANES]; 3],
    direction: [[R; LANES]; 3],
    /// Barycentric weights of the line's two ends.
    end_weights: [[[R; LANES]; 3]; 2],
    /// The interval of t in the cell.
    from: [R; LANES],
    to: [R; LANES],
    /// The line does not meet the triangle or the cell.
    is_none: [R; LANES],
}

impl<R: Float> LineParts<R> {
    #[inline(always)]
    pub fn new() -> Self {
        let zero = [R::zero(); LANES];
        Self {
            count: 0,
            line: zero,
            cell: [zero; 3],
            start: [zero; 3],
            direction: [zero; 3],
            end_weights: [[zero; 3]; 2],
            from: zero,
            to: zero,
            is_none: zero,
        }
    }

    /// Takes as many parts as there are lanes. False if there is none.
    #[inline(always)]
    pub fn fill<S: Storage>(
        &mut self,
        storage: &S,
        triangle: &GridTriangle<R>,
        parts: &mut impl Iterator<Item = LinePart>,
    ) -> bool {
        let first = storage.first_lane();
        self.count = 0;
        while self.count < LANES {
            let Some(part) = parts.next() else { break };
            let lane = self.count.wrapping_sub(first);
            if lane < S::LANES_OF_THREAD {
                self.line[lane] = R::from_f64(f64::from(part.line));
                for axis in 0..3 {
                    let index = triangle.first_cell[axis].wrapping_add(part.cell[axis]).min(triangle.last_cell[axis]);
                    self.cell[axis][lane] = R::from_f64(f64::from(index));
                }
            }
            self.count = self.count.saturating_add(1);
        }
        self.count > 0
    }

    /// Lowers `lowest` to the minima on all parts. `None` if a value is not finite.
    #[inline(always)]
    pub fn minimize<S: Storage>(
        &mut self,
        triangle: &GridTriangle<R>,
        storage: &S,
        lowest: &mut LowestPoint<R>,
    ) -> Option<()> {
        let samples = corners_of_thread(storage, self.cell);
        self.find_lines::<S>(triangle);
        self.clip::<S>(triangle.rounding);
        let infinity = R::from_f64(f64::INFINITY);
        let (mut values, mut at) = ([infinity; LANES], [R::zero(); LANES]);
        for lane in 0..S::LANES_OF_THREAD {
            let vector = |axes: &[[R; LANES]; 3]| Vector3::new(axes[0][lane], axes[1][lane], axes[2][lane]);
            let (cell, start, direction) = (vector(&self.cell), vector(&self.start), vector(&self.direction));
            let corners = in_lane(&samples, lane);
            let (from, span) = (self.from[lane], self.to[lane] - self.from[lane]);
            let (t, value) = Cubic::restrict(corners, start + direction * from - cell, direction * span).minimum();
            at[lane] = from + span * t;
            // Infinite is the part that is none, NaN what is to be refused.
            values[lane] = R::select(R::zero() < self.is_none[lane], infinity, value + value * R::zero());
        }
        for lane in 0..self.count.min(LANES) {
            lowest.evaluations = lowest.evaluations.saturating_add(1);
            let value = storage.of_lane(&values, lane);
            if value < lowest.value {
                let t = storage.of_lane(&at, lane);
                for k in 0..3 {
                    let [start, end] = [0, 1].map(|end: usize| storage.of_lane(&self.end_weights[end % 2][k], lane));
                    lowest.weights[k] = start * (R::one() - t) + end * t;
                }
                lowest.value = value;
            } else if lowest.value.partial_cmp(&value).is_none() {
                return None;
            }
        }
        Some(())
    }

    /// The lines: cuts with the lower faces of the cells, or edges.
    #[inline(always)]
    fn find_lines<S: Storage>(&mut self, triangle: &GridTriangle<R>) {
        let (zero, one) = (R::zero(), R::one());
        let [two, three, four, five] = [2.0, 3.0, 4.0, 5.0].map(R::from_f64);
        let [a, b, c] = triangle.corners;
        for lane in 0..S::LANES_OF_THREAD {
            let line = self.line[lane];
            let (is_x, is_y, is_edge) = (line < one, line < two, three <= line);
            let pick = |x: R, y: R, z: R| R::select(is_x, x, R::select(is_y, y, z));
            let plane = pick(self.cell[0][lane], self.cell[1][lane], self.cell[2][lane]);
            let heights = [pick(a.x, a.y, a.z) - plane, pick(b.x, b.y, b.z) - plane, pick(c.x, c.y, c.z) - plane];
            let (cut_weights, is_disjoint) = cut(heights);
            let from_b = R::select(five <= line, one, zero);
            let to_b = R::select(four <= line, zero, one);
            let edge_weights = [[one - from_b, from_b, zero], [zero, to_b, one - to_b]];
            for end in 0..2 {
                for k in 0..3 {
                    self.end_weights[end][k][lane] = R::select(is_edge, edge_weights[end][k], cut_weights[end][k]);
                }
            }
            for k in 0..3 {
                let on_cut = |[_, v, w]: [R; 3]| a[k] + (b[k] - a[k]) * v + (c[k] - a[k]) * w;
                let is_across = line == R::from_f64(k as f64);
                let from = R::select(is_across, plane, on_cut(cut_weights[0]));
                let to = R::select(is_across, plane, on_cut(cut_weights[1]));
                let start = R::select(is_edge, R::select(five <= line, b[k], a[k]), from);
                let end = R::select(is_edge, R::select(four <= line, c[k], b[k]), to);
                (self.start[k][lane], self.direction[k][lane]) = (start, end - start);
            }
            self.is_none[lane] = R::select(is_edge, zero, R::select(is_disjoint, one, zero));
        }
    }

    /// The intervals of t in the cells. A line farther than `rounding` from its cell is none.
    #[inline(always)]
    fn clip<S: Storage>(&mut self, rounding: R) {
        let (zero, one) = (R::zero(), R::one());
        for lane in 0..S::LANES_OF_THREAD {
            let (mut from, mut to, mut is_none, mut length) = (zero, one, self.is_none[lane], zero);
            for k in 0..3 {
                let (d, lower) = (self.direction[k][lane], self.cell[k][lane] - self.start[k][lane]);
                let upper = lower + one;
                let inverse = one / d;
                // A line within rounding of a face of cells belongs to those of both sides.
                let (t_lower, t_upper) = ((lower - rounding) * inverse, (upper + rounding) * inverse);
                let is_level = d == zero;
                is_none = R::select(is_level, R::select(rounding < lower, one, is_none), is_none);
                is_none = R::select(is_level, R::select(upper < -rounding, one, is_none), is_none);
                let near = R::select(is_level, zero, Real::min(t_lower, t_upper));
                let far = R::select(is_level, one, Real::max(t_lower, t_upper));
                (from, to) = (Real::max(from, near), Real::min(to, far));
                length = Real::max(length, d.abs());
            }
            is_none = R::select(rounding + rounding < (from - to) * length, one, is_none);
            from = Real::min(from, one);
            (self.from[lane], self.to[lane], self.is_none[lane]) = (from, Real::max(to, from), is_none);
        }
    }
}

/// Barycentric weights of the two ends of a cut, from the corners' heights over the plane, and whether there is no
/// cut. The first end lies on the edge from the lone corner to its successor, the second on that to its predecessor.
#[cfg_attr(feature = "std", inline(always))]
fn cut<R: Float>([a, b, c]: [R; 3]) -> ([[R; 3]; 2], bool) {
    let (zero, one) = (R::zero(), R::one());
    let (is_a, is_b) = ((zero <= b) == (zero <= c), (zero <= a) == (zero <= c));
    let pick = |if_a: R, if_b: R, if_c: R| R::select(is_a, if_a, R::select(is_b, if_b, if_c));
    let lone = [pick(one, zero, zero), pick(zero, one, zero), pick(zero, zero, one)];
    let [first, second, third] = lone;
    let height = pick(a, b, c);
    let end = |other_height: R, other: [R; 3]| {
        let fraction = height / (height - other_height);
        [0, 1, 2].map(|k: usize| lone[k % 3] * (one - fraction) + other[k % 3] * fraction)
    };
    ([end(pick(b, c, a), [third, first, second]), end(pick(c, a, b), [second, third, first])], is_a & is_b)
}
