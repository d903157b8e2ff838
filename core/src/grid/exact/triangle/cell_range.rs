//! The cells of a triangle's box, numbered x fastest, and each cell's part in that box.
//!
//! All arithmetic is on [`Float`]s, integers included, so that lanes run it: number → (x, y, z) multiplies by the
//! reciprocals of the counts and truncates.

use super::cell::Cell;
use super::grid_triangle::GridTriangle;
use crate::grid::exact::polynomial::Polynomial;
use crate::number::{Float, Real};
use crate::rounding::CELL_COORDINATE;

/// The cells of a triangle's box.
pub(super) struct CellRange<R> {
    /// Index of the first cell.
    first: [R; 3],
    /// Cells in a row along x.
    row_len: R,
    inv_row_len: R,
    /// Cells in a layer across z.
    layer_len: R,
    inv_layer_len: R,
    /// The triangle's box, counted from the first cell.
    lower: [R; 3],
    upper: [R; 3],
    pub count: usize,
}

/// A cell clipped to the triangle's box.
pub(super) struct ClippedCell<R> {
    /// The cell's first corner, which is also its index.
    pub origin: [R; 3],
    /// The same, counted from the first cell.
    pub offset: [R; 3],
    /// Centre of the clipped part, counted from `origin`.
    pub center: [R; 3],
    pub half_extents: [R; 3],
}

impl<R: Float> CellRange<R> {
    /// The cells of a triangle in numbers of another type, rounding included.
    #[inline(always)]
    pub fn new<T: Float>(triangle: &GridTriangle<T>) -> Self {
        let [x, y, z] = triangle.cell_counts();
        let layer_len = x.wrapping_mul(y);
        let to_float = |count: u32| R::from_f64(f64::from(count));
        let first = triangle.first_node();
        let extent = f64::from(x.max(y).max(z));
        let rounding = R::from_f64(CELL_COORDINATE * R::EPSILON * extent);
        let local = |x: T| R::from_f64(x.to_f64());
        Self {
            first: triangle.first_cell.map(to_float),
            row_len: to_float(x),
            inv_row_len: R::one() / to_float(x),
            layer_len: to_float(layer_len),
            inv_layer_len: R::one() / to_float(layer_len),
            lower: (triangle.lower - first).map(|x| local(x) - rounding).into(),
            upper: (triangle.upper - first).map(|x| local(x) + rounding).into(),
            count: layer_len.wrapping_mul(z) as usize,
        }
    }

    /// The cell with this number.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn clip(&self, number: R) -> ClippedCell<R> {
        let half = R::from_f64(0.5);
        let offset = self.offset(number);
        let origin = [self.first[0] + offset[0], self.first[1] + offset[1], self.first[2] + offset[2]];
        let center_and_half = |axis: usize| {
            let lower = Real::clamp(self.lower[axis % 3] - offset[axis % 3], R::zero(), R::one());
            let upper = Real::clamp(self.upper[axis % 3] - offset[axis % 3], R::zero(), R::one());
            [(lower + upper) * half, (upper - lower) * half]
        };
        let [x, y, z] = [center_and_half(0), center_and_half(1), center_and_half(2)];
        ClippedCell { origin, offset, center: [x[0], y[0], z[0]], half_extents: [x[1], y[1], z[1]] }
    }

    /// Index of a cell relative to the first: z = ⌊(n + ½) / layer⌋, y = ⌊(n − z·layer + ½) / row⌋. The ½ keeps
    /// rounding away from the next integer, because n is small.
    #[inline(always)]
    pub fn offset(&self, number: R) -> [R; 3] {
        let half = R::from_f64(0.5);
        let z = ((number + half) * self.inv_layer_len).trunc();
        let in_layer = number - z * self.layer_len;
        let y = ((in_layer + half) * self.inv_row_len).trunc();
        [in_layer - y * self.row_len, y, z]
    }
}

impl<R: Float> ClippedCell<R> {
    #[inline(always)]
    pub fn with_polynomial(&self, polynomial: Polynomial<R>) -> Cell<R> {
        Cell {
            origin: self.origin.into(),
            polynomial,
            center: self.center.into(),
            half_extents: self.half_extents.into(),
        }
    }
}
