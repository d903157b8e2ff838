//! Parts of a simplex, by the barycentric weights of their corners: what subdivision cuts and bounds.
//!
//! A part is bisected at the middle of its longest edge (Rivara 1984, "Algorithms for refining triangular grids
//! suitable for adaptive and multigrid techniques"), so that two bisections of a triangle halve its size.

use core::array::from_fn;

use crate::Simplex;
use crate::number::{Float, Real};
use crate::rounding::SIDE_WEIGHT;
use crate::simplex::corner_weights;
use crate::vector::norm;

/// A point of a simplex, and the value there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WeightedValue<R, const N: usize> {
    pub weights: [R; N],
    pub value: R,
}

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

    /// The simplex shrunk by a factor towards one of its points.
    pub fn shrunk(center: [R; N], factor: R) -> Self {
        let Self { corners } = Self::whole();
        Self { corners: corners.map(|corner| from_fn(|k| center[k] + (corner[k] - center[k]) * factor)) }
    }

    /// The part in space.
    pub fn embed(&self, simplex: &Simplex<R, N>) -> Simplex<R, N> {
        Simplex { corners: self.corners.map(|weights| simplex.point(weights)) }
    }

    /// The weights of the centroid.
    pub fn centroid(&self) -> [R; N] {
        self.weights([R::from_f64(1.0 / N as f64); N])
    }

    /// The weights in the whole simplex of a point given by its weights in the part.
    pub fn weights(&self, local: [R; N]) -> [R; N] {
        from_fn(|k| self.corners.iter().zip(local).fold(R::zero(), |sum, (corner, weight)| sum + corner[k] * weight))
    }

    /// Two halves, cut at the middle of the longest edge; `None` if that edge is no longer than rounding.
    pub fn bisect(&self, simplex: &Simplex<R, N>) -> Option<[Self; 2]> {
        let mut longest = (R::zero(), 0, 0);
        let (mut from, mut to) = (self.corners[0], self.corners[0]);
        for (a, weights_a) in self.corners.iter().enumerate() {
            for (b, weights_b) in self.corners.iter().enumerate() {
                let length = norm(simplex.point(*weights_b) - simplex.point(*weights_a));
                if longest.0 < length {
                    longest = (length, a, b);
                    (from, to) = (*weights_a, *weights_b);
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

    /// Is the point in the part or on its boundary? For simplices of up to three corners.
    pub fn contains(&self, weights: &[R; N]) -> bool {
        // Covers points on a side whose weights are not made by halving.
        let slack = R::from_f64(SIDE_WEIGHT * R::EPSILON);
        match self.corners.as_slice() {
            [_] => true,
            [a, b] => {
                let [a, b, point] = [a, b, weights].map(|weights| weights[N - 1]);
                Real::min(a, b) - slack <= point && point <= Real::max(a, b) + slack
            }
            [a, b, c] => {
                let areas = [signed_area(a, b, weights), signed_area(b, c, weights), signed_area(c, a, weights)];
                areas.iter().all(|area| -slack <= *area) || areas.iter().all(|area| *area <= slack)
            }
            _ => self.corners.contains(weights),
        }
    }
}

/// Twice the signed area of a triangle in the plane of the first and the last weight.
fn signed_area<R: Float, const N: usize>(a: &[R; N], b: &[R; N], c: &[R; N]) -> R {
    let edge = |end: &[R; N]| [end[0] - a[0], end[N - 1] - a[N - 1]];
    let ([bx, by], [cx, cy]) = (edge(b), edge(c));
    bx * cy - by * cx
}
