use super::directions::DirectionalBounds;
use super::face::Face;
use crate::grid::exact::segment::{Line, Lowest};
use crate::number::Float;
use crate::simplex::corner_weights;

/// The ways from the first corner to the second and to the third, and from the second to the third.
const U: usize = 0;
const V: usize = 1;
const W: usize = 2;

impl<R: Float> DirectionalBounds<R> {
    #[inline(always)]
    fn up(&self, way: usize) -> bool {
        R::zero() < self.least[way % 4]
    }

    #[inline(always)]
    fn down(&self, way: usize) -> bool {
        self.most[way % 4] < R::zero()
    }

    /// Of each corner, whether a way along the triangle leads downhill from it.
    #[inline(always)]
    fn leads_down_from_corners(&self) -> [bool; 3] {
        [self.down(U) | self.down(V), self.up(U) | self.down(W), self.up(V) | self.up(W)]
    }
}

/// The corners, but for those from which a way along the triangle leads downhill.
#[inline(always)]
pub(super) fn lower_to_corners<R: Float>(rises: &DirectionalBounds<R>, values: [R; 3], lowest: &mut Lowest<R>) {
    let leads_down = rises.leads_down_from_corners();
    for k in 0..3 {
        if !leads_down[k] {
            lowest.looks = lowest.looks.saturating_add(1);
            if values[k] < lowest.value {
                (lowest.weights, lowest.value) = (corner_weights(k), values[k]);
            }
        }
    }
}

/// The edges, of which one has no value below the lowest if a way along the triangle leads downhill from it.
#[inline(always)]
pub(super) fn edges<R: Float>(face: &Face<R>, rises: &DirectionalBounds<R>, values: [R; 3], lowest: R) -> [Line<R>; 3] {
    let nothing = R::from_f64(f64::INFINITY);
    let (up, down) = (|way| rises.up(way), |way| rises.down(way));
    let edge = |way: usize, [from, to]: [usize; 2], leads_down: bool| {
        let bound = rises.least_between(way, [values[from % 3], values[to % 3]]);
        Line {
            from: face.corners[from % 3],
            way: face.corners[to % 3] - face.corners[from % 3],
            ends: [corner_weights(from), corner_weights(to)],
            bound: if !leads_down && bound < lowest { bound } else { nothing },
        }
    };
    [
        edge(U, [0, 1], up(U) | down(U) | down(V) | down(W)),
        edge(V, [0, 2], up(V) | down(V) | down(U) | up(W)),
        edge(W, [1, 2], up(W) | down(W) | up(U) | up(V)),
    ]
}
