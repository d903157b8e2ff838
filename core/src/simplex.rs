use core::array::from_fn;

use nalgebra::Vector3;

use crate::Sdf;
use crate::real::Real;
use crate::survey::{mean, reach, rounding};

/// The convex hull of `N` corners: a point, a segment, a triangle, a tetrahedron. Corners may coincide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Simplex<R: Real, const N: usize> {
    pub corners: [Vector3<R>; N],
}

impl<R: Real, const N: usize> Simplex<R, N> {
    /// The point of the given barycentric weights. Summed over edges from one corner, so that digits are not lost far
    /// from the origin.
    #[inline]
    pub fn point(&self, weights: [R; N]) -> Vector3<R> {
        let mut point = self.corners[0];
        for (corner, weight) in self.corners.iter().zip(weights).skip(1) {
            point += (corner - self.corners[0]) * weight;
        }
        point
    }

    #[inline]
    pub fn centroid(&self) -> Vector3<R> {
        mean(&self.corners)
    }

    /// The largest distance from a point to a corner: no point of the simplex is farther.
    #[inline]
    pub fn reach(&self, from: Vector3<R>) -> R {
        reach(from, &self.corners)
    }

    /// The length of the longest edge.
    #[inline]
    pub fn longest_edge(&self) -> R {
        self.corners.iter().fold(R::zero(), |longest, corner| longest.max(self.reach(*corner)))
    }

    /// What no value of the field on the simplex is below, by a bound of its slope there and its value at a point of the
    /// simplex, rounding included.
    #[inline]
    pub(crate) fn lower_bound<F: Sdf>(&self, field: &F, slope_bound: f64, point: Vector3<R>, value: R) -> R {
        let reach = self.reach(point);
        // A slope can be beyond the numbers of this type, and no way times infinity is no number.
        let fall = R::select(reach.is_zero(), R::zero(), reach * R::lift(slope_bound));
        value - fall - rounding(field.slope_bound(), point, reach, value)
    }

    /// How fast a function with this gradient changes by each weight, less its change by the first: eq. (4) of the
    /// paper with edges for corners, which differ by a constant that no method here minds.
    #[inline]
    pub fn slopes(&self, gradient: Vector3<R>) -> [R; N] {
        self.corners.map(|corner| gradient.dot(&(corner - self.corners[0])))
    }

    /// The simplex in one of the lanes.
    pub(crate) fn lane(&self, lane: usize) -> Simplex<R::Lane, N> {
        Simplex { corners: self.corners.map(|corner| corner.map(|x| x.lane(lane))) }
    }

    pub fn is_in_reach(&self) -> R::Mask {
        use crate::real::Mask;
        self.corners.iter().flat_map(|corner| corner.iter()).fold(!R::Mask::NONE, |all, x| all & x.is_in_reach())
    }
}

/// The weights of a corner: 1 there, 0 elsewhere.
#[inline]
pub(crate) fn corner_weights<R: Real, const N: usize>(corner: usize) -> [R; N] {
    from_fn(|i| if i == corner { R::one() } else { R::zero() })
}

/// The nearest weights that are barycentric, none negative and their sum one: ℙ of the paper's eq. (5), in any number
/// of corners.
#[inline]
pub fn project_weights<R: Real, const N: usize>(weights: [R; N]) -> [R; N] {
    let excess = excess(weights, R::one());
    let positive = weights.map(|weight| (weight - excess).max(R::zero()));
    let sum = positive.iter().fold(R::zero(), |sum, weight| sum + *weight);
    positive.map(|weight| weight / sum)
}

/// What to take from each of `values`, and leave none below zero, so that the rest sums to `total`.
///
/// With the values in falling order and the k largest kept, their excess over `total` is shared by k; the right k gives
/// the most. (Held, Wolfe, Crowder 1974, "Validation of subgradient optimization", §3.)
#[inline]
pub(crate) fn excess<R: Real, const N: usize>(values: [R; N], total: R) -> R {
    let mut falling = values;
    for end in (1..N).rev() {
        for i in 0..end {
            let (a, b) = (falling[i], falling[i + 1]);
            (falling[i], falling[i + 1]) = (a.max(b), a.min(b));
        }
    }
    let mut sum = falling[0] - total;
    let mut excess = sum;
    for (kept, value) in (2..).zip(&falling[1..]) {
        sum += *value;
        excess = excess.max(sum * R::lift(1.0 / f64::from(kept)));
    }
    excess
}
