//! Simplices: points, segments and triangles, and their barycentric weights.
//!
//! A point of the simplex is x = Σ_k w_k x_k with w_k ≥ 0 and Σ w_k = 1. A minimizer needs two formulas of Macklin et
//! al. 2020, "Local Optimization for Robust Signed Distance Field Collision", both here for any number of corners:
//! the derivatives of φ by the weights, eq. (4), and the projection of arbitrary weights onto the valid ones, eq.
//! (5).

use core::array::from_fn;

use nalgebra::Vector3;

use crate::Aabb;
use crate::number::kernel::{LaneBundle, LaneKernel};
use crate::number::{Float, Mask, Real};
use crate::rounding::{FieldScale, rounding};
use crate::vector::norm_squared;

/// The convex hull of `N` corners: a point, segment, triangle or tetrahedron. Corners may coincide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Simplex<R: Real, const N: usize> {
    /// Positions of the corners.
    pub corners: [Vector3<R>; N],
}

impl<R: Real, const N: usize> Simplex<R, N> {
    /// The point with the given barycentric weights: x₀ + Σ_k w_k (x_k − x₀). Edges, unlike positions, keep their
    /// digits far from the origin.
    #[inline(always)]
    pub fn point(&self, weights: [R; N]) -> Vector3<R> {
        let mut point = self.corners[0];
        for corner in 1..N {
            point += (self.corners[corner] - self.corners[0]) * weights[corner];
        }
        point
    }

    /// Mean of the corners.
    #[inline(always)]
    pub fn centroid(&self) -> Vector3<R> {
        mean(&self.corners)
    }

    /// Largest distance from a point to a point of the simplex. A corner attains it.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn max_distance_from(&self, point: Vector3<R>) -> R {
        max_distance(point, &self.corners)
    }

    /// Length of the longest edge.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn longest_edge(&self) -> R {
        let mut largest = R::zero();
        for corner in 1..N {
            for other in 0..corner {
                largest = largest.max(norm_squared(self.corners[corner] - self.corners[other]));
            }
        }
        largest.sqrt()
    }

    /// Lower bound of φ on the simplex, rounding included, from the value at a point of it and the slope bound there:
    /// φ ≥ value − slope_bound · max_k |x_k − point| − rounding. `field` is the scale of the whole field.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn lower_bound(&self, field: FieldScale<R>, slope_bound: R, point: Vector3<R>, value: R) -> R {
        let distance = self.max_distance_from(point);
        // In R a slope bound may overflow to infinity: the one corner of a point is the point itself.
        let fall = if N == 1 { R::zero() } else { distance * slope_bound };
        value - fall - rounding(field, point, distance, value)
    }

    /// Derivative of φ by each weight minus that by the first: ∂φ/∂w_k − ∂φ/∂w₀ = ∇φ·(x_k − x₀). Eq. (4) of the paper
    /// has ∇φ·x_k. The constant difference cancels, because weights always sum to one.
    #[inline(always)]
    pub fn slopes(&self, gradient: Vector3<R>) -> [R; N] {
        let mut slopes = [R::zero(); N];
        for corner in 1..N {
            slopes[corner] = gradient.dot(&(self.corners[corner] - self.corners[0]));
        }
        slopes
    }

    /// Are all coordinates within ±[`Real::MAX_COORDINATE`]?
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
    /// The smallest box that holds the simplex.
    #[inline(always)]
    pub fn bounds(&self) -> Aabb {
        Aabb::from_corners(&self.corners)
    }
}

/// Mean of the points: x₀ + Σ_k (x_k − x₀)/n, which keeps digits far from the origin.
#[inline(always)]
pub(crate) fn mean<R: Real>(points: &[Vector3<R>]) -> Vector3<R> {
    let Some(first) = points.first() else { return Vector3::zeros() };
    let fraction = R::from_f64(1.0 / points.len() as f64);
    points.iter().skip(1).fold(*first, |mean, point| mean + (point - first) * fraction)
}

/// Upper bound of the largest distance from `from` to one of the points: the root of the largest square, which is the largest root,
/// and what squares lose that are too small for a number.
#[inline(always)]
pub(crate) fn max_distance<R: Real>(from: Vector3<R>, points: &[Vector3<R>]) -> R {
    let mut largest = R::zero();
    for point in points {
        largest = largest.max(norm_squared(point - from));
    }
    largest.sqrt() + R::from_f64(R::LOST_LENGTH)
}

/// [`Simplex::lower_bound`] as a kernel: from the simplex, the scale of the whole field and the slope bound there, a point and its value.
pub(crate) struct LowerBound<const N: usize>;

impl<const N: usize> LaneKernel for LowerBound<N> {
    type From<R: Real> = (Simplex<R, N>, [R; 3], Vector3<R>, [R; 1]);
    type To<R: Real> = [R; 1];

    #[inline(always)]
    fn apply<R: Real>(
        &self,
        (simplex, [field_slope_bound, magnitude, slope_bound], point, [value]): Self::From<R>,
    ) -> [R; 1] {
        let field = FieldScale { slope_bound: field_slope_bound, magnitude };
        [simplex.lower_bound(field, slope_bound, point, value)]
    }
}

/// [`Simplex::longest_edge`] as a kernel.
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

/// Barycentric weights of a corner: 1 there, 0 elsewhere.
#[inline(always)]
pub(crate) fn corner_weights<R: Real, const N: usize>(corner: usize) -> [R; N] {
    from_fn(|i| if i == corner { R::one() } else { R::zero() })
}

/// Euclidean projection onto the valid barycentric weights {w : w_k ≥ 0, Σ w_k = 1}: the operator ℙ of the paper's
/// eq. (5), for any number of corners. w_k = max(v_k − τ, 0), with τ from `excess`; divided by the sum, which
/// rounding moves from 1.
///
/// Values are up to 1/(4 ε) in magnitude, some 10¹⁵ in f64 and 2·10⁶ in f32: of larger ones 1 less is the same number, and the
/// weights are NaN.
#[inline(always)]
pub fn project_weights<R: Real, const N: usize>(weights: [R; N]) -> [R; N] {
    let excess = excess(weights, R::one());
    let positive = weights.map(|weight| (weight - excess).max(R::zero()));
    let sum = positive.iter().fold(R::zero(), |sum, weight| sum + *weight);
    let inverse = R::one() / sum;
    positive.map(|weight| weight * inverse)
}

/// The threshold τ with Σ max(v_i − τ, 0) = `total`: subtracting it projects `values` onto a scaled simplex.
///
/// With v sorted in descending order, τ = max_k (Σ_{i ≤ k} v_i − `total`) / k (Held, Wolfe and Crowder 1974,
/// "Validation of subgradient optimization", §3).
#[inline(always)]
pub(crate) fn excess<R: Real, const N: usize>(values: [R; N], total: R) -> R {
    let mut sorted = values;
    for end in (1..N).rev() {
        for i in 0..end {
            let (a, b) = (sorted[i], sorted[i + 1]);
            (sorted[i], sorted[i + 1]) = (a.max(b), a.min(b));
        }
    }
    let mut sum = sorted[0] - total;
    let mut excess = sum;
    for (count, value) in (2..).zip(&sorted[1..]) {
        sum += *value;
        excess = excess.max(sum * (R::one() / R::from_f64(f64::from(count))));
    }
    excess
}
