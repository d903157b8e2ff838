//! Which reflex corners lie in a box? A uniform grid over the polygon's box, with about as many cells as the polygon has corners.

use robust::Coord;

/// End of a list.
const NONE: u32 = u32::MAX;

/// Corners of a polygon by cell.
#[derive(Default)]
pub(super) struct ReflexGrid {
    low: [f64; 2],
    /// Cells in a unit of length along each axis; zero along an axis without extent.
    per_unit: [f64; 2],
    counts: [usize; 2],
    /// For each cell its corner that was inserted last.
    first: Vec<u32>,
    /// For each corner the one inserted before it in its cell.
    next: Vec<u32>,
    is_inserted: Vec<bool>,
}

impl ReflexGrid {
    /// Empties the grid, and lays it over these points.
    pub fn lay_out(&mut self, points: &[Coord<f64>]) {
        let [mut low, mut high] = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for point in points {
            for (axis, x) in [point.x, point.y].into_iter().enumerate() {
                (low[axis], high[axis]) = (low[axis].min(x), high[axis].max(x));
            }
        }
        let extents = [high[0] - low[0], high[1] - low[1]];
        let count = points.len().max(1);
        // Roots first: products of small extents underflow.
        let side = extents[0].sqrt() / (count as f64).sqrt() * extents[1].sqrt();
        for axis in 0..2 {
            // NaN becomes 0, and so 1. However that was rounded, there are at most four cells for each corner.
            let most = if axis == 0 { count } else { (4 * count / self.counts[0]).clamp(1, count) };
            self.counts[axis] = ((extents[axis] / side).ceil() as usize).clamp(1, most);
            let per_unit = self.counts[axis] as f64 / extents[axis];
            self.per_unit[axis] = if per_unit.is_finite() { per_unit } else { 0.0 };
        }
        self.low = low;
        self.first.clear();
        self.first.resize(self.counts[0] * self.counts[1], NONE);
        self.next.clear();
        self.next.resize(points.len(), NONE);
        self.is_inserted.clear();
        self.is_inserted.resize(points.len(), false);
    }

    /// Takes a corner, unless it is there.
    pub fn insert(&mut self, corner: usize, point: Coord<f64>) {
        if std::mem::replace(&mut self.is_inserted[corner], true) {
            return;
        }
        let [x, y] = self.cell(point);
        let first = &mut self.first[y * self.counts[0] + x];
        self.next[corner] = std::mem::replace(first, corner as u32);
    }

    /// Is there a corner that passes the test, in a cell that meets the box? And how many cells and corners were looked at.
    /// Corners outside of the box are among them.
    pub fn find(&self, low: Coord<f64>, high: Coord<f64>, mut test: impl FnMut(usize) -> bool) -> (bool, u64) {
        let ([from_x, from_y], [to_x, to_y]) = (self.cell(low), self.cell(high));
        let mut looked_at = 0;
        for y in from_y..=to_y {
            for first in &self.first[y * self.counts[0] + from_x..=y * self.counts[0] + to_x] {
                looked_at += 1;
                let mut corner = *first;
                while corner != NONE {
                    looked_at += 1;
                    if test(corner as usize) {
                        return (true, looked_at);
                    }
                    corner = self.next[corner as usize];
                }
            }
        }
        (false, looked_at)
    }

    /// The cell of a point. It rises with each coordinate, so that a point in a box is in a cell between those of its corners.
    fn cell(&self, point: Coord<f64>) -> [usize; 2] {
        let index = |axis: usize, x: f64| {
            let cells = (x - self.low[axis]) * self.per_unit[axis];
            (cells as usize).min(self.counts[axis] - 1)
        };
        [index(0, point.x), index(1, point.y)]
    }
}
