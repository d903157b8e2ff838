use core::array::from_fn;

use crate::Simplex;
use crate::number::{Float, Real};
use crate::simplex::corner_weights;
use crate::vector::norm;

/// A part of a simplex, by its corners' weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SubSimplex<R, const N: usize> {
    pub corners: [[R; N]; N],
}

impl<R: Float, const N: usize> SubSimplex<R, N> {
    /// All of the simplex.
    pub fn whole() -> Self {
        Self { corners: from_fn(corner_weights) }
    }

    /// The simplex shrunk towards a point of it.
    pub fn around(weights: [R; N], share: R) -> Self {
        let Self { corners } = Self::whole();
        Self { corners: corners.map(|corner| from_fn(|k| weights[k] + (corner[k] - weights[k]) * share)) }
    }

    /// Where it lies.
    pub fn of(&self, simplex: &Simplex<R, N>) -> Simplex<R, N> {
        Simplex { corners: self.corners.map(|weights| simplex.point(weights)) }
    }

    /// The weights of its mean.
    pub fn middle(&self) -> [R; N] {
        self.weights([R::from_f64(1.0 / N as f64); N])
    }

    /// The simplex's weights of a point that has these in the piece.
    pub fn weights(&self, in_piece: [R; N]) -> [R; N] {
        from_fn(|k| self.corners.iter().zip(in_piece).fold(R::zero(), |sum, (corner, share)| sum + corner[k] * share))
    }

    /// In two, at the middle of the longest edge; `None` if that is no longer than rounding.
    pub fn cut(&self, simplex: &Simplex<R, N>) -> Option<[Self; 2]> {
        let mut longest = (R::zero(), 0, 0);
        let (mut from, mut to) = (self.corners[0], self.corners[0]);
        for (a, at_a) in self.corners.iter().enumerate() {
            for (b, at_b) in self.corners.iter().enumerate() {
                let length = norm(simplex.point(*at_b) - simplex.point(*at_a));
                if longest.0 < length {
                    longest = (length, a, b);
                    (from, to) = (*at_a, *at_b);
                }
            }
        }
        let (_, a, b) = longest;
        let mut middle = from;
        middle.iter_mut().zip(to).for_each(|(weight, other)| *weight = (*weight + other) * R::from_f64(0.5));
        let without = |end: usize| {
            let mut corners = self.corners;
            corners
                .iter_mut()
                .enumerate()
                .filter(|(corner, _)| *corner == end)
                .for_each(|(_, weights)| *weights = middle);
            Self { corners }
        };
        (middle != from && middle != to).then(|| [without(a), without(b)])
    }

    /// Whether a point of a simplex of up to three corners lies in it or on its boundary.
    pub fn contains(&self, weights: &[R; N]) -> bool {
        // For a point on a side that no number of halvings leads to.
        let slack = R::from_f64(8.0 * R::EPSILON);
        match self.corners.as_slice() {
            [_] => true,
            [a, b] => {
                let [a, b, at] = [a, b, weights].map(|weights| weights[N - 1]);
                Real::min(a, b) - slack <= at && at <= Real::max(a, b) + slack
            }
            [a, b, c] => {
                let turns = [side(a, b, weights), side(b, c, weights), side(c, a, weights)];
                turns.iter().all(|turn| -slack <= *turn) || turns.iter().all(|turn| *turn <= slack)
            }
            _ => self.corners.contains(weights),
        }
    }
}

/// On which side of a line through two points of a triangle a third one lies.
fn side<R: Float, const N: usize>(from: &[R; N], to: &[R; N], at: &[R; N]) -> R {
    let way = |end: &[R; N]| [end[0] - from[0], end[N - 1] - from[N - 1]];
    let ([ax, ay], [bx, by]) = (way(to), way(at));
    ax * by - ay * bx
}
