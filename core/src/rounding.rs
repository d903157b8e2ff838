//! Rounding constants of the crate, in one place.
//!
//! A computation of n operations whose intermediate results do not exceed L in magnitude has an error of at most
//! about n·ε·L (Higham 2002, "Accuracy and Stability of Numerical Algorithms", §3.1), with ε = [`Real::EPSILON`],
//! twice the unit roundoff. Every bound of this crate is widened by such an n·ε·L before it is compared. Below stands
//! n for each kind of computation, rounded up to a power of two, and its L.
//!
//! Too small an n makes a bound wrong in rare cases, too large an n only makes culls and searches stop a little later.

use nalgebra::Vector3;

use crate::Sdf;
use crate::number::Real;

/// φ at a point: some thirty operations, few of which round at the size of the coordinates. L: see [`rounding`].
pub(crate) const EVALUATION: f64 = 32.0;

/// Difference of two f32 samples interpolated at neighbouring nodes: at each, seven interpolations of a product and
/// two sums. L: the largest sample.
pub(crate) const INTERPOLATION: f64 = 32.0;

/// A coordinate of a box after conversion to node indices and back. L: the largest coordinate.
pub(crate) const BOX_COORDINATE: f64 = 8.0;

/// A coordinate of a box after one pose or two of a rotation and a sum. L: the largest coordinate before and after.
pub(crate) const POSED_COORDINATE: f64 = 32.0;

/// A coordinate in cells, (x − origin) / spacing. L: the largest coordinate over the spacing.
pub(crate) const CELL_COORDINATE: f64 = 16.0;

/// Distance of a point from a plane of a triangle, times the length of its normal, a cross product of cross products.
/// L: the triangle's extent times the lengths of the factors.
pub(crate) const PLANE_DISTANCE: f64 = 32.0;

/// Directional derivative ∇φ·d over a cell. L: |∇φ| |d|.
pub(crate) const DIRECTIONAL_DERIVATIVE: f64 = 1024.0;

/// Determinant of the second derivatives along a triangle. L: (the sum of the mixed derivatives' magnitudes · |u| |v|)².
pub(crate) const HESSIAN_DETERMINANT: f64 = 32.0;

/// A vector that is projected into the plane of a triangle, by a normal whose direction is off by ε over the sine of an angle. L: the
/// vector's length before, however little is left of it.
pub(crate) const PROJECTED_VECTOR: f64 = 4096.0;

/// sin² of the angle between two edges below which rounding dominates the normal of a triangle.
pub(crate) const MIN_SINE_SQ: f64 = 1e-6;

/// Bounds of a box that holds all points where a field is low. L: the largest coordinate.
pub(crate) const FIELD_BOUNDS: f64 = 64.0;

/// Barycentric weight of a point on a side of a sub-simplex, after many halvings. L = 1.
pub(crate) const SIDE_WEIGHT: f64 = 8.0;

/// Difference of two computed barycentric weights of one point. L = 1.
pub(crate) const SAME_WEIGHT: f64 = 16.0;

/// Largest singular value of a 3 × 3 matrix by six sweeps of Jacobi's rotations. L: that value.
pub(crate) const SPECTRAL_NORM: f64 = 64.0;

/// Largest ‖J A − 1‖ of a matrix A and its computed inverse J: A is then invertible, its condition below about 1e9.
pub(crate) const INVERSE_RESIDUAL: f64 = 1e-6;

/// Largest entry of D⁻¹ D − 1, with D the edges of a tetrahedron: weights are off by three times that, a quarter of [`BARYCENTRIC`].
pub(crate) const TET_RESIDUAL: f64 = 0.25 / 3.0 * BARYCENTRIC;

/// Barycentric weight by which a point or a part of an element may be outside of a tetrahedron and still counts as inside: so that
/// none falls between two. It exceeds the error of weights in every tetrahedron whose inverse is accepted.
pub(crate) const BARYCENTRIC: f64 = 1e-9;

/// Multiple of [`rounding`] in a lower bound: one per nested field (each [`Placed`](crate::placed::Placed) or
/// combination widens the bound again), seven at most, and one of the value that it is compared with.
pub(crate) const NESTED_FIELDS: f64 = 8.0;

/// Multiple of [`rounding`] in a comparison of two bounds: [`NESTED_FIELDS`] on either side.
pub(crate) const NESTED_FIELDS_TWICE: f64 = 16.0;

/// Bound of |computed φ − exact φ| = [`EVALUATION`]·ε·max(|φ|, slope bound · max(`distance`, |x|, |y|, |z|, magnitude)): for
/// `value` at `point`, and for every value no larger than it within `distance` of `point`.
#[inline(always)]
pub(crate) fn rounding<R: Real>(field: FieldScale<R>, point: Vector3<R>, distance: R, value: R) -> R {
    let length = field.magnitude.max(distance).max(point.x.abs()).max(point.y.abs()).max(point.z.abs());
    (length * field.slope_bound).max(value.abs()) * R::from_f64(EVALUATION * R::EPSILON)
}

/// Numbers of a field that the rounding of its values follows from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FieldScale<R> {
    /// [`Sdf::slope_bound`].
    pub slope_bound: R,
    /// [`Sdf::magnitude`].
    pub magnitude: R,
}

impl<R: Real> FieldScale<R> {
    #[inline(always)]
    pub fn new<F: Sdf + ?Sized>(field: &F) -> Self {
        Self { slope_bound: field.slope_bound_as(), magnitude: field.magnitude() }
    }

    /// The larger of both, for values of either field.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self { slope_bound: self.slope_bound.max(other.slope_bound), magnitude: self.magnitude.max(other.magnitude) }
    }
}
