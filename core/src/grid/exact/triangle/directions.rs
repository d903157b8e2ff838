//! Four directions in the triangle, and intervals of the directional derivative along each.
//!
//! If ∇φ·d lies in \[L_d, U_d\] in every cell that the triangle meets, then along a path p to p + d in the triangle φ
//! changes by at least L_d and at most U_d. From this follow a lower bound on an edge, one on the whole triangle, and
//! the monotonicity test (Hansen and Walster 2003, "Global Optimization Using Interval Analysis"): where 0 is outside
//! of an interval, φ is strictly monotonic along that direction and has no stationary point.

use nalgebra::Vector3;

use super::grid_triangle::GridTriangle;
use crate::number::{Float, Real};
use crate::rounding::{DIRECTIONAL_DERIVATIVE, MIN_SINE_SQ, PROJECTED_VECTOR};

/// Length of a direction, in cells, below which f32 holds too few of its digits.
const SHORTEST: f64 = 1e-30;

/// Index of u = b − a in arrays by direction.
pub(super) const U: usize = 0;
/// Index of v = c − a.
pub(super) const V: usize = 1;
/// Index of w = c − b.
pub(super) const W: usize = 2;

/// The directions u, v, w and the gradient at the centroid, projected into the plane. Arrays are by direction, so
/// that a processor takes several at once.
pub(super) struct Directions<R> {
    pub x: [R; 4],
    pub y: [R; 4],
    pub z: [R; 4],
    /// Bound of the rounding in ∇φ·d.
    pub rounding: [R; 4],
}

impl<R: Float> Directions<R> {
    /// `gradient` is that at the centroid. `slope_bound` is in cell coordinates.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn new(triangle: &GridTriangle<R>, gradient: Vector3<R>, slope_bound: R) -> Self {
        let [a, b, c] = triangle.corners;
        let (u, v, normal) = (b - a, c - a, triangle.normal);
        let normal_sq = normal.dot(&normal);
        // |n|² = |u|²|v|² sin²: the normal of a thinner triangle may be mere rounding.
        let is_well_conditioned = u.dot(&u) * v.dot(&v) * R::from_f64(MIN_SINE_SQ) < normal_sq;
        let uphill = if is_well_conditioned {
            gradient - normal * (normal.dot(&gradient) / normal_sq)
        } else {
            Vector3::zeros()
        };
        let directions = [u, v, c - b, uphill];
        let unit_rounding = slope_bound * R::from_f64(DIRECTIONAL_DERIVATIVE * R::EPSILON);
        let mut rounding = directions.map(|d| sum_of_magnitudes(d) * unit_rounding);
        // Of a gradient along the normal little but rounding is left, and that points out of the plane.
        rounding[3] += sum_of_magnitudes(gradient) * slope_bound * R::from_f64(PROJECTED_VECTOR * R::EPSILON);
        Self { x: directions.map(|d| d.x), y: directions.map(|d| d.y), z: directions.map(|d| d.z), rounding }
    }
}

impl<R: Float> Directions<R> {
    /// The same directions in single precision, and zero in place of one so short that its digits would be lost.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn to_single(&self, slope_bound: R) -> Directions<f32> {
        let shortest = R::from_f64(SHORTEST);
        let is_long: [bool; 4] =
            core::array::from_fn(|k| shortest < self.x[k % 4].abs() + self.y[k % 4].abs() + self.z[k % 4].abs());
        let single = |components: &[R; 4]| {
            core::array::from_fn(|k| R::select(is_long[k % 4], components[k % 4], R::zero()).to_single())
        };
        let (x, y, z): ([f32; 4], [f32; 4], [f32; 4]) = (single(&self.x), single(&self.y), single(&self.z));
        let unit_rounding = slope_bound.to_single() * (DIRECTIONAL_DERIVATIVE * <f32 as Real>::EPSILON) as f32;
        let rounding = core::array::from_fn(|k| {
            let length = x[k % 4].abs() + y[k % 4].abs() + z[k % 4].abs();
            length * unit_rounding + self.rounding[k % 4].to_single()
        });
        Directions { x, y, z, rounding }
    }
}

#[inline(always)]
fn sum_of_magnitudes<R: Float>(vector: Vector3<R>) -> R {
    vector.x.abs() + vector.y.abs() + vector.z.abs()
}

/// Interval of ∇φ·d for each of the [`Directions`], over some part of the grid.
#[derive(Clone, Copy)]
pub(super) struct DirectionalBounds<R> {
    pub lower: [R; 4],
    pub upper: [R; 4],
}

impl<R: Float> DirectionalBounds<R> {
    /// Empty intervals.
    pub fn empty() -> Self {
        Self { lower: [R::from_f64(f64::INFINITY); 4], upper: [R::from_f64(f64::NEG_INFINITY); 4] }
    }

    /// The same intervals as single ones, which numbers of any type hold.
    #[inline(always)]
    pub fn from_single(single: DirectionalBounds<f32>) -> Self {
        Self { lower: single.lower.map(R::from_stored), upper: single.upper.map(R::from_stored) }
    }

    /// Does φ rise everywhere along a direction?
    #[inline(always)]
    pub fn is_rising(&self, direction: usize) -> bool {
        R::zero() < self.lower[direction % 4]
    }

    /// Does φ fall everywhere along a direction?
    #[inline(always)]
    pub fn is_falling(&self, direction: usize) -> bool {
        self.upper[direction % 4] < R::zero()
    }

    /// Is φ strictly monotonic along one of the directions? Then no point is stationary.
    #[inline(always)]
    pub fn is_monotonic(&self) -> bool {
        let is_monotonic = |k: usize| R::zero() < self.lower[k % 4] || self.upper[k % 4] < R::zero();
        is_monotonic(0) || is_monotonic(1) || is_monotonic(2) || is_monotonic(3)
    }

    /// Lower bound of φ on the edge along `direction`, from its end values, where L ≤ 0 ≤ U:
    ///
    /// φ(t) ≥ max(start + L t, end − U (1 − t)), lowest where both are equal: t = (end − start − U) / (L − U).
    pub fn edge_lower_bound(&self, direction: usize, [start, end]: [R; 2]) -> R {
        let (lower, upper) = (self.lower[direction % 4], self.upper[direction % 4]);
        let t = Real::clamp((end - start - upper) / (lower - upper), R::zero(), R::one());
        Real::min(start + lower * t, end - upper * (R::one() - t))
    }

    /// Lower bound of φ(x) − φ(centroid) for x in the triangle.
    ///
    /// x − centroid is a mean of the corner_k − centroid, which are −(u + v)/3, (u − w)/3 and (v + w)/3. So the bound
    /// is min(−U_u − U_v, L_u − U_w, L_v + L_w) / 3.
    pub fn min_rise_from_centroid(&self) -> R {
        let [[u, v, w, _], [upper_u, upper_v, upper_w, _]] = [self.lower, self.upper];
        Real::min(-upper_u - upper_v, Real::min(u - upper_w, v + w)) * R::from_f64(1.0 / 3.0)
    }
}
