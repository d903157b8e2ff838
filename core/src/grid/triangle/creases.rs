use core::array::from_fn;

use super::face::Face;
use crate::grid::segment::Line;
use crate::real::{Float, Real};
use crate::simplex::corner_weights;

/// Where faces of cells cross a triangle, axis by axis.
pub(super) struct Creases<'a, R: Real> {
    face: &'a Face<R>,
    axis: usize,
    /// Across the axis, the last one that was crossed.
    plane: u32,
}

impl<'a, R: Float> Creases<'a, R> {
    #[inline(always)]
    pub fn new(face: &'a Face<R>) -> Self {
        Self { face, axis: 0, plane: face.first[0] }
    }
}

impl<R: Float> Iterator for Creases<'_, R> {
    type Item = Line<R>;

    fn next(&mut self) -> Option<Line<R>> {
        while self.axis < 3 {
            if self.plane < self.face.last[self.axis % 3] {
                self.plane = self.plane.wrapping_add(1);
                let crease = self.face.crease(self.axis, R::lift(f64::from(self.plane)));
                if crease.is_some() {
                    return crease;
                }
            } else {
                self.axis = self.axis.wrapping_add(1);
                self.plane = self.face.first[self.axis % 3];
            }
        }
        None
    }
}

impl<R: Float> Face<R> {
    /// Where a plane across an axis crosses it.
    fn crease(&self, axis: usize, plane: R) -> Option<Line<R>> {
        let heights = self.corners.map(|corner| corner[axis % 3] - plane);
        let [a, b, c] = heights.map(|height| R::zero() <= height);
        let (alone, others) = match () {
            () if a == b && b == c => return None,
            () if b == c => (0, [1, 2]),
            () if a == c => (1, [2, 0]),
            () => (2, [0, 1]),
        };
        let ends = others.map(|other| {
            let share = heights[alone % 3] / (heights[alone % 3] - heights[other % 3]);
            let (from, to): ([R; 3], [R; 3]) = (corner_weights(alone), corner_weights(other));
            from_fn(|k| from[k % 3] * (R::one() - share) + to[k % 3] * share)
        });
        let [mut from, mut way] = [self.point(ends[0]), self.point(ends[1]) - self.point(ends[0])];
        (from[axis % 3], way[axis % 3]) = (plane, R::zero());
        Some(Line { from, way, ends, bound: R::lift(f64::NEG_INFINITY) })
    }
}
