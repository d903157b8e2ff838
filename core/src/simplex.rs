use core::array::from_fn;

use nalgebra::Vector3;

use crate::Aabb;
use crate::number::kernel::{LaneBundle, LaneKernel};
use crate::number::{Float, Mask, Real};
use crate::rounding::rounding;
use crate::vector::norm;

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
    pub fn max_distance_from(&self, point: Vector3<R>) -> R {
        max_distance(point, &self.corners)
    }

    /// The length of the longest edge.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn longest_edge(&self) -> R {
        let mut longest = R::zero();
        for corner in 0..N {
            longest = longest.max(self.max_distance_from(self.corners[corner]));
        }
        longest
    }

    /// Lower bound of φ on the simplex, rounding included, from the value at a point of it and the slope bound there:
    /// φ ≥ value − slope_bound · max_k |corner_k − point|. `field_slope_bound` is that of the whole field.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn lower_bound(&self, field_slope_bound: f64, slope_bound: R, point: Vector3<R>, value: R) -> R {
        let distance = self.max_distance_from(point);
        // A slope can exceed the largest number of this type, and 0 · ∞ is NaN.
        let fall = R::select(distance.is_zero(), R::zero(), distance * slope_bound);
        value - fall - rounding(field_slope_bound, point, distance, value)
    }

    /// The derivative of φ by each weight, less that by the first: ∇φ·(x_k − x_0). Eq. (4) of the paper has ∇φ·x_k; the two
    /// differ by a constant, which no method here depends on.
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

impl<R: Float, const N: usize> Simplex<R, N> {
    /// The smallest box around it.
    #[inline(always)]
    pub fn bounds(&self) -> Aabb {
        Aabb::around_corners(&self.corners)
    }
}

/// The mean, summed over edges from the first point, so that no digits are lost far from the origin.
#[inline(always)]
pub(crate) fn mean<R: Real>(points: &[Vector3<R>]) -> Vector3<R> {
    let Some(first) = points.first() else { return Vector3::zeros() };
    let fraction = R::from_f64(1.0 / points.len() as f64);
    points.iter().skip(1).fold(*first, |mean, point| mean + (point - first) * fraction)
}

/// The largest distance from a point to the others.
#[inline(always)]
pub(crate) fn max_distance<R: Real>(from: Vector3<R>, points: &[Vector3<R>]) -> R {
    let mut largest = R::zero();
    for point in points {
        largest = largest.max(norm(point - from));
    }
    largest
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
