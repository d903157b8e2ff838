//! Every isolated minimum of a field on a simplex: the case that §9 of the paper leaves open, a triangle that rests on
//! several bumps.
//!
//! With ε = tolerance · longest edge · slope bound:
//!
//! 1. `subdivide`: bisect the simplex into cells with a descent target each. It is a corner to which straight paths
//!    rise by at most ε/3 from every point of the cell ([`EnclosedSdf::max_rise_to_corners`]). Where φ is convex on the
//!    cell, it is the minimum there. Cells whose lower bound is above the level are dropped.
//! 2. `leads_lower`: flood the cells around each target over corners at most ε/3 above it. A target from which that
//!    reaches a lower one is not a minimum.
//! 3. `descend`: search the cells around each target that is left, and those around the point found, until none is lower. A path leads
//!    there that rises by at most ε/3, over the targets of these cells. `is_one_basin`: two ends count as one minimum if the
//!    straight path between them provably rises by at most ε/3 above the higher.
//!
//! This finds the minima of a merge tree whose persistence is above ε (Edelsbrunner, Letscher and Zomorodian 2002,
//! "Topological Persistence and Simplification").

use super::sub_simplex::{SubSimplex, WeightedValue};
use super::{Certified, Minimizer, Minimum};
use crate::number::{Float, Real};
use crate::rounding::{FieldScale, NESTED_FIELDS_TWICE, rounding};
use crate::simplex::mean;
use crate::{EnclosedSdf, Simplex};

/// Finds every isolated minimum of a field on a simplex.
///
/// The guarantee holds for every point of the simplex whose value is at least `tolerance`/3 below the level. A path
/// through the simplex leads from it to one of the minima, and never rises by more than `tolerance` above its start. So
/// a basin is missed only if the pass to a deeper one is at most that high. The global minimum is always included, by a
/// certified search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AllMinima {
    /// Largest number of cells to bound.
    pub max_cells: u32,
    /// A height, as a fraction of longest edge · slope bound.
    pub tolerance: f64,
    /// Finds the global minimum, and the minima of cells.
    pub search: Certified,
}

impl Default for AllMinima {
    fn default() -> Self {
        Self { max_cells: 4096, tolerance: 1e-2, search: Certified { evaluations: 1024, ..Certified::default() } }
    }
}

/// Parts of the straight path between two minima that are bounded one by one.
const PATH_PARTS: u32 = 16;

/// Most groups of cells through which a descent leads.
const MAX_DESCENTS: u32 = 64;

/// A cell of the subdivision: the element of [`AllMinima::minima`]'s scratch buffer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimplexCell<R, const N: usize> {
    part: SubSimplex<R, N>,
    /// Descent target: a gentle path leads to it from every point of the cell.
    target: WeightedValue<R, N>,
    /// Values at the corners that gentle paths lead to, infinite at the others.
    corner_values: [R; N],
    /// Number of the last flood that reached the cell.
    flood: usize,
    /// The flood has continued over the corners of the cell.
    is_visited: bool,
}

impl<R: Float, const N: usize> WeightedValue<R, N> {
    /// Compares values, and weights where those are equal, so that no two targets lead to each other.
    fn is_below(&self, other: &Self) -> bool {
        self.value < other.value || (self.value == other.value && self.weights < other.weights)
    }
}

impl<R: Float, const N: usize> Default for SimplexCell<R, N> {
    fn default() -> Self {
        let part = SubSimplex::whole();
        let target = WeightedValue { weights: part.centroid(), value: R::zero() };
        Self { part, target, corner_values: [R::from_f64(f64::INFINITY); N], flood: 0, is_visited: false }
    }
}

/// Result of [`AllMinima::minima`] beside the minima themselves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MinimaSummary<R: Real, const N: usize> {
    /// The lowest value found, whether or not it is at most the level.
    pub global_minimum: Minimum<R, N>,
    /// Number of minima written, in ascending order of their values.
    pub count: usize,
    /// These are all: no budget or buffer ran out, and no value is NaN.
    pub is_complete: bool,
    /// Lower bound of φ on the simplex.
    pub lower_bound: R,
    /// Number of evaluations, those of bounds included.
    pub evaluations: u32,
}

impl AllMinima {
    /// Writes the minima with values of at most `level` to `minima`, on a point, segment or triangle whose corners are
    /// finite and within ±[`Real::MAX_COORDINATE`]. `cells` is scratch and is overwritten. With fewer than a few
    /// hundred cells few triangles are searched to the end.
    pub fn minima<R: Float, F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
        level: R,
        cells: &mut [SimplexCell<R, N>],
        minima: &mut [Minimum<R, N>],
    ) -> MinimaSummary<R, N> {
        let (slope_bound, longest_edge) = (field.slope_bound(), simplex.longest_edge());
        let global_minimum = self.search.minimize_below(field, simplex, level);
        // The level may be far above every value, and its rounding above every height.
        let highest = global_minimum.sample.value + longest_edge * R::from_f64(slope_bound);
        let rounding = rounding(FieldScale::new(field), simplex.corners[0], longest_edge, Real::min(level, highest));
        let max_rise = longest_edge * R::from_f64(slope_bound * self.tolerance / 3.0)
            + rounding * R::from_f64(NESTED_FIELDS_TWICE);
        let evaluations = global_minimum.evaluations.to_f64() as u32;
        let lower_bound = global_minimum.lower_bound;
        let mut summary = MinimaSummary { global_minimum, count: 0, is_complete: true, lower_bound, evaluations };
        if level < lower_bound {
            return summary;
        }
        let mut search =
            MinimaSearch { field, simplex, certified: &self.search, max_rise, evaluations, is_complete: true };
        if let Some(first) = minima.first_mut().filter(|_| global_minimum.sample.value.le(level)) {
            *first = global_minimum;
            summary.count = 1;
        }
        let used = search.subdivide(self.max_cells, level, cells);
        let cells = cells.get_mut(..used).unwrap_or(&mut []);
        for flood in 1..=used {
            let Some(target) = cells.get(flood.wrapping_sub(1)).map(|cell| cell.target) else { break };
            let is_new = cells.iter().take(flood.wrapping_sub(1)).all(|cell| cell.target != target);
            if !is_new || search.leads_lower(flood, &target, cells) {
                continue;
            }
            let minimum = search.descend(&target, cells);
            if !minimum.sample.value.le(level) {
                continue;
            }
            let is_one_basin = |known: &&mut Minimum<R, N>| search.is_one_basin(&minimum, known);
            if let Some(known) = minima.iter_mut().take(summary.count).find(is_one_basin) {
                *known = lower(*known, minimum);
            } else if let Some(free) = minima.get_mut(summary.count) {
                *free = minimum;
                summary.count = summary.count.saturating_add(1);
            } else {
                search.is_complete = false;
                minima.last_mut().into_iter().for_each(|highest| *highest = lower(*highest, minimum));
            }
            sort(minima, summary.count);
        }
        let (is_complete, converged) = (search.is_complete, search.is_complete && global_minimum.converged);
        for minimum in minima.iter_mut().take(summary.count) {
            (minimum.lower_bound, minimum.converged) = (summary.lower_bound, converged);
            minimum.evaluations = R::from_f64(f64::from(search.evaluations));
        }
        MinimaSummary { is_complete, evaluations: search.evaluations, ..summary }
    }
}

fn lower<R: Float, const N: usize>(a: Minimum<R, N>, b: Minimum<R, N>) -> Minimum<R, N> {
    if b.sample.value < a.sample.value { b } else { a }
}

/// Sorts the first `count` minima, of which all but one are in order.
fn sort<R: Float, const N: usize>(minima: &mut [Minimum<R, N>], count: usize) {
    for index in (1..count).rev() {
        if let Some([a, b]) = minima.get_mut(index.wrapping_sub(1)..=index)
            && b.sample.value < a.sample.value
        {
            core::mem::swap(a, b);
        }
    }
}

/// The minimum on a cell, from a certified search.
struct CellMinimum<R, const N: usize> {
    target: WeightedValue<R, N>,
    lower_bound: R,
}

struct MinimaSearch<'a, R: Float, F, const N: usize> {
    field: &'a F,
    simplex: &'a Simplex<R, N>,
    certified: &'a Certified,
    /// ε/3: how far a gentle path may rise.
    max_rise: R,
    evaluations: u32,
    is_complete: bool,
}

impl<R: Float, F: EnclosedSdf, const N: usize> MinimaSearch<'_, R, F, N> {
    /// Fills the front of `cells` with cells that have a target, and that cover all points with values of at most the
    /// level. Returns their number.
    fn subdivide(&mut self, max_cells: u32, level: R, cells: &mut [SimplexCell<R, N>]) -> usize {
        let Some(first) = cells.first_mut() else {
            self.is_complete = false;
            return 0;
        };
        *first = SimplexCell::default();
        let (mut index, mut used) = (0, 1_usize);
        let mut budget = max_cells;
        while index < used {
            let last = cells.get(used.wrapping_sub(1)).copied();
            let Some(part) = cells.get(index).map(|cell| cell.part) else { break };
            let corners = part.embed(self.simplex).corners;
            let enclosure = self.field.enclosure(mean(&corners), &corners);
            self.evaluations = self.evaluations.saturating_add(1);
            if level < enclosure.range.lower {
                if let (Some(cell), Some(last)) = (cells.get_mut(index), last) {
                    *cell = last;
                }
                used = used.wrapping_sub(1);
                continue;
            }
            let is_convex = self.field.is_convex_on(&corners);
            let (cell, is_gentle) = self.cell(part, &Simplex { corners }, is_convex);
            // A convex cell is not cut: a minimum that is hard to find in it is as hard to find in either half.
            let may_cut = !is_gentle && !is_convex && budget > 0 && used < cells.len();
            budget = budget.saturating_sub(1);
            if let Some([half, other]) = may_cut.then(|| part.bisect(self.simplex)).flatten() {
                let free = cells.iter_mut().skip(used).take(1);
                free.for_each(|cell| *cell = SimplexCell { part: other, ..SimplexCell::default() });
                cells.iter_mut().skip(index).take(1).for_each(|cell| cell.part = half);
                used = used.saturating_add(1);
            } else {
                self.is_complete &= is_gentle && enclosure.range.lower <= enclosure.value;
                cells.iter_mut().skip(index).take(1).for_each(|slot| *slot = cell);
                index = index.saturating_add(1);
            }
        }
        used
    }

    /// A cell with its target, and whether the paths there are gentle.
    fn cell(&mut self, part: SubSimplex<R, N>, corners: &Simplex<R, N>, is_convex: bool) -> (SimplexCell<R, N>, bool) {
        let values = corners.corners.map(|corner| self.field.value(corner));
        self.evaluations = self.evaluations.saturating_add(N as u32);
        let cell = SimplexCell { part, ..SimplexCell::default() };
        if is_convex {
            let minimum = self.cell_minimum(&part);
            let is_gentle = minimum.target.value - self.max_rise <= minimum.lower_bound;
            return (SimplexCell { target: minimum.target, corner_values: values, ..cell }, is_gentle);
        }
        let rises = self.field.max_rise_to_corners(&corners.corners);
        self.evaluations = self.evaluations.saturating_add(1);
        let mut corner_values = [R::from_f64(f64::INFINITY); N];
        let mut lowest = WeightedValue { weights: part.corners[0], value: values[0] };
        for (((gentle, weights), value), rise) in corner_values.iter_mut().zip(part.corners).zip(values).zip(rises) {
            let corner = WeightedValue { weights, value };
            lowest = if corner.is_below(&lowest) { corner } else { lowest };
            if rise <= self.max_rise {
                *gentle = value;
            }
        }
        let gentle = part.corners.iter().zip(corner_values);
        let gentle = gentle.map(|(weights, value)| WeightedValue { weights: *weights, value });
        let target = gentle.fold(None, |best: Option<WeightedValue<R, N>>, corner| match best {
            _ if !corner.value.is_finite() => best,
            Some(best) if !corner.is_below(&best) => Some(best),
            _ => Some(corner),
        });
        (SimplexCell { target: target.unwrap_or(lowest), corner_values, ..cell }, target.is_some())
    }

    /// Does a chain of cells lead from a target to a lower one, over corners at most ε/3 above it?
    fn leads_lower(&self, flood: usize, from: &WeightedValue<R, N>, cells: &mut [SimplexCell<R, N>]) -> bool {
        let highest = from.value + self.max_rise;
        let mut corners = [from.weights; N];
        let mut values = [from.value; N];
        loop {
            for (corner, value) in corners.iter().zip(values) {
                for cell in cells.iter_mut().filter(|cell| value <= highest && cell.flood != flood) {
                    if cell.part.contains(corner) {
                        if cell.target.is_below(from) {
                            return true;
                        }
                        (cell.flood, cell.is_visited) = (flood, false);
                    }
                }
            }
            let Some(next) = cells.iter_mut().find(|cell| cell.flood == flood && !cell.is_visited) else {
                return false;
            };
            next.is_visited = true;
            (corners, values) = (next.part.corners, next.corner_values);
        }
    }

    /// Does the straight path between two minima provably stay within ε/3 of the higher one?
    fn is_one_basin(&self, a: &Minimum<R, N>, b: &Minimum<R, N>) -> bool {
        let highest = Real::max(a.sample.value, b.sample.value) + self.max_rise;
        let offset = b.point - a.point;
        let point = |part: u32| a.point + offset * R::from_f64(f64::from(part) / f64::from(PATH_PARTS));
        (0..PATH_PARTS).all(|part| {
            let ends = [point(part), point(part.saturating_add(1))];
            let [from, to] = ends.map(|end| self.field.value(end));
            let upper = if self.field.is_convex_on(&ends) {
                Real::max(from, to)
            } else {
                from + self.field.max_rise_to_corners(&ends)[1]
            };
            upper <= highest
        })
    }

    fn cell_minimum(&mut self, part: &SubSimplex<R, N>) -> CellMinimum<R, N> {
        let minimum = self.certified.minimize(self.field, &part.embed(self.simplex));
        self.evaluations = self.evaluations.saturating_add(minimum.evaluations.to_f64() as u32);
        let weights = part.weights(minimum.weights);
        let target = WeightedValue { weights, value: minimum.sample.value };
        CellMinimum { target, lower_bound: minimum.lower_bound }
    }

    /// The lowest point found in the cells around a target, then around that point, until none is lower: of a point on the border of what
    /// was searched φ may fall further beyond it.
    fn descend(&mut self, target: &WeightedValue<R, N>, cells: &[SimplexCell<R, N>]) -> Minimum<R, N> {
        let (mut best, mut before) = (*target, None);
        for _ in 0..MAX_DESCENTS {
            let from = best;
            let is_searched = |cell: &SimplexCell<R, N>| before.is_some_and(|weights| cell.part.contains(&weights));
            for cell in cells.iter().filter(|cell| cell.part.contains(&from.weights) && !is_searched(cell)) {
                let lowest = self.cell_minimum(&cell.part).target;
                best = if lowest.value < best.value { lowest } else { best };
            }
            let is_lower = best.value < from.value;
            if !is_lower {
                break;
            }
            before = Some(from.weights);
        }
        let point = self.simplex.point(best.weights);
        let sample = self.field.evaluate(point);
        let [lower_bound, evaluations] = [sample.value, R::zero()];
        Minimum { weights: best.weights, point, sample, lower_bound, evaluations, converged: false }
    }
}
