use core::array::from_fn;

use nalgebra::Vector3;

use crate::enclosure::{mean, reach, rounding};
use crate::number::kernel::{LaneBundle, LaneKernel};
use crate::number::{Mask, Real};

/// The convex hull of `N` corners: a point, a segment, a triangle, a tetrahedron. Corners may coincide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Simplex<R: Real, const N: usize> {
    pub corners: [Vector3<R>; N],
}

impl<R: Real, const N: usize> Simplex<R, N> {
    /// The point of the given barycentric weights. Summed over edges from one corner, so that digits are not lost far
    /// from the origin.
    #[inline(always)]
    pub fn point(&self, weights: [R; N]) -> Vector3<R> {
        let mut point = self.corners[0];
        for corner in 1..N {
            point += (self.corners[corner] - self.corners[0]) * weights[corner];
        }
        point
    }

    #[inline(always)]
    pub fn centroid(&self) -> Vector3<R> {
        mean(&self.corners)
    }

    /// The largest distance from a point to a corner: no point of the simplex is farther.
    #[inline(always)]
    pub fn reach(&self, from: Vector3<R>) -> R {
        reach(from, &self.corners)
    }

    /// The length of the longest edge.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn longest_edge(&self) -> R {
        let mut longest = R::zero();
        for corner in 0..N {
            longest = longest.max(self.reach(self.corners[corner]));
        }
        longest
    }

    /// What no value of the field on the simplex is below, by a bound of its slope there and its value at a point of the
    /// simplex, rounding included.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn lower_bound(&self, of_field: f64, slope_bound: R, point: Vector3<R>, value: R) -> R {
        let reach = self.reach(point);
        // A slope can be beyond the numbers of this type, and no way times infinity is no number.
        let fall = R::select(reach.is_zero(), R::zero(), reach * slope_bound);
        value - fall - rounding(of_field, point, reach, value)
    }

    /// How fast a function with this gradient changes by each weight, less its change by the first: eq. (4) of the
    /// paper with edges for corners, which differ by a constant that no method here minds.
    #[inline(always)]
    pub fn slopes(&self, gradient: Vector3<R>) -> [R; N] {
        let mut slopes = [R::zero(); N];
        for corner in 0..N {
            slopes[corner] = gradient.dot(&(self.corners[corner] - self.corners[0]));
        }
        slopes
    }

    #[inline(always)]
    pub fn is_representable(&self) -> R::Mask {
        let mut all = !R::Mask::NONE;
        for corner in &self.corners {
            all = all & corner.x.is_representable() & corner.y.is_representable() & corner.z.is_representable();
        }
        all
    }
}

/// [`Simplex::lower_bound`] of a field with this slope bound, from the simplex, the slope bound there, a point and its value.
pub(crate) struct LowerBound<const N: usize> {
    pub slope_bound: f64,
}

impl<const N: usize> LaneKernel for LowerBound<N> {
    type From<R: Real> = (Simplex<R, N>, [R; 1], Vector3<R>, [R; 1]);
    type To<R: Real> = [R; 1];

    #[inline(always)]
    fn apply<R: Real>(&self, (simplex, [slope_bound], point, [value]): Self::From<R>) -> [R; 1] {
        [simplex.lower_bound(self.slope_bound, slope_bound, point, value)]
    }
}

/// [`Simplex::longest_edge`].
pub(crate) struct LongestEdge<const N: usize>;

impl<const N: usize> LaneKernel for LongestEdge<N> {
    type From<R: Real> = Simplex<R, N>;
    type To<R: Real> = [R; 1];

    #[inline(always)]
    fn apply<R: Real>(&self, simplex: Simplex<R, N>) -> [R; 1] {
        [simplex.longest_edge()]
    }
}

impl<R: Real, const N: usize> LaneBundle<R> for Simplex<R, N> {
    type Lane = Simplex<R::Lane, N>;
    #[inline(always)]
    fn zero() -> Self {
        Self { corners: LaneBundle::zero() }
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> Self::Lane {
        Simplex { corners: self.corners.lane(lane) }
    }
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, one: Self::Lane) {
        self.corners.set_lane(lane, one.corners);
    }
}

/// The weights of a corner: 1 there, 0 elsewhere.
#[inline(always)]
pub(crate) fn corner_weights<R: Real, const N: usize>(corner: usize) -> [R; N] {
    from_fn(|i| if i == corner { R::one() } else { R::zero() })
}

/// The nearest weights that are barycentric, none negative and their sum one: ℙ of the paper's eq. (5), in any number
/// of corners.
#[inline(always)]
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
#[inline(always)]
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
        excess = excess.max(sum * R::from_f64(1.0 / f64::from(kept)));
    }
    excess
}
