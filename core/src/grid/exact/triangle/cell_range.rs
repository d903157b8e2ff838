use super::cell::Cell;
use super::face::Face;
use crate::grid::exact::polynomial::Polynomial;
use crate::number::{Float, Real};

/// The cells of a triangle's box, numbered from its first on, x fastest.
pub(super) struct CellRange<R> {
    pub first: [R; 3],
    /// Cells along x, and one over them; the same in a layer.
    row: R,
    per_row: R,
    layer: R,
    per_layer: R,
    low: [R; 3],
    high: [R; 3],
    pub count: usize,
}

/// A cell, and the part of it in the triangle's box.
pub(super) struct ClippedCell<R> {
    pub first: [R; 3],
    /// From the first corner.
    pub middle: [R; 3],
    pub half: [R; 3],
}

impl<R: Float> CellRange<R> {
    #[inline(always)]
    pub fn new(face: &Face<R>) -> Self {
        let cells = |axis: usize| face.last[axis % 3].wrapping_sub(face.first[axis % 3]).wrapping_add(1);
        let [x, y, z] = [cells(0), cells(1), cells(2)];
        let layer = x.wrapping_mul(y);
        let number = |count: u32| R::from_f64(f64::from(count));
        Self {
            first: face.first.map(number),
            row: number(x),
            per_row: R::one() / number(x),
            layer: number(layer),
            per_layer: R::one() / number(layer),
            low: face.low.into(),
            high: face.high.into(),
            count: layer.wrapping_mul(z) as usize,
        }
    }

    /// Of the cell of a number.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn part(&self, number: R) -> ClippedCell<R> {
        let half = R::from_f64(0.5);
        let [x, y, z] = self.place(number);
        let first = [self.first[0] + x, self.first[1] + y, self.first[2] + z];
        let within = |axis: usize| {
            let from = Real::clamp(self.low[axis % 3] - first[axis % 3], R::zero(), R::one());
            let to = Real::clamp(self.high[axis % 3] - first[axis % 3], R::zero(), R::one());
            [(from + to) * half, (to - from) * half]
        };
        let [x, y, z] = [within(0), within(1), within(2)];
        ClippedCell { first, middle: [x[0], y[0], z[0]], half: [x[1], y[1], z[1]] }
    }

    /// Along each axis, from the first.
    #[inline(always)]
    fn place(&self, number: R) -> [R; 3] {
        // Numbers are small: half of one keeps rounding away from the next whole number.
        let half = R::from_f64(0.5);
        let z = ((number + half) * self.per_layer).trunc();
        let in_layer = number - z * self.layer;
        let y = ((in_layer + half) * self.per_row).trunc();
        [in_layer - y * self.row, y, z]
    }
}

impl<R: Float> ClippedCell<R> {
    #[inline(always)]
    pub fn of(&self, field: Polynomial<R>) -> Cell<R> {
        Cell { first: self.first.into(), field, middle: self.middle.into(), half: self.half.into() }
    }
}
