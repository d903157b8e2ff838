//! How far can a field be from the shape that it was made from?

use crate::number::Float;
use crate::{Aabb, EnclosedSdf, Interval, Status};

/// Bounds of the difference between φ and d in a region, where d is the signed distance to the shape that the field was made from:
/// for a baked grid, the mesh. A closed form is its own shape, without error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBound {
    /// φ − d ≤ `near` at every point whose |d| is within the band of a sparse grid, for other fields at every point.
    pub near: f64,
    /// d − φ ≤ `near_below` at these points, where they are not outside a grid.
    pub near_below: f64,
    /// φ − d ≤ `above` at every point.
    pub above: f64,
    /// d − φ ≤ `below` at every point.
    pub below: f64,
}

impl ErrorBound {
    /// The bound of a field that is its own shape.
    pub const EXACT: Self = Self::everywhere(0.0);

    /// Nothing is known.
    pub const UNKNOWN: Self = Self::everywhere(f64::INFINITY);

    /// |φ − d| ≤ `error` at every point.
    pub const fn everywhere(error: f64) -> Self {
        Self { near: error, near_below: error, above: error, below: error }
    }

    /// Bound of either: of two regions together, and of the minimum of two fields.
    pub fn max(self, other: Self) -> Self {
        let Self { near, near_below, above, below } = other;
        Self {
            near: self.near.max(near),
            near_below: self.near_below.max(near_below),
            above: self.above.max(above),
            below: self.below.max(below),
        }
    }

    /// Bound of −φ against −d.
    pub fn negate(self) -> Self {
        Self { near: self.near_below, near_below: self.near, above: self.below, below: self.above }
    }

    /// Bound of s φ against s d.
    pub fn scale(self, scale: f64) -> Self {
        let Self { near, near_below, above, below } = self;
        Self { near: near * scale, near_below: near_below * scale, above: above * scale, below: below * scale }
    }

    /// Bound of s φ against the distance D to a shape stretched by at least s and at most s + e, where φ is in `range`.
    ///
    /// A linear map whose singular values are in [s, s + e] takes a segment of length l to one of length s l to (s + e) l, and the
    /// nearest point of the shape to one of the stretched shape. So D has the sign of d, and s |d| ≤ |D| ≤ (s + e) |d|. With
    /// a ≥ φ − d and b ≥ d − φ,
    ///
    /// ```text
    /// outside, d ≥ 0:   s φ − D ≤ s (φ − d)            ≤ s a
    ///                   D − s φ ≤ s (d − φ) + e d      ≤ s b + e (φ + b)
    /// inside,  d < 0:   s φ − D ≤ s (φ − d) + e (−d)   ≤ s a + e (a − φ)
    ///                   D − s φ ≤ s (d − φ)            ≤ s b
    /// ```
    ///
    /// The parts with e count only where φ + b or a − φ is positive: outside or inside is empty otherwise. |D| ≤ s B means |d| ≤ B, so
    /// the same holds of `near` in a band of s B.
    pub(crate) fn stretch(self, range: Interval<f64>, scale: f64, excess: f64) -> Self {
        let scaled = self.scale(scale);
        let deeper = |above: f64| excess * (above - range.lower).max(0.0);
        let farther = |below: f64| excess * (range.upper + below).max(0.0);
        Self {
            near: scaled.near + deeper(self.near),
            near_below: scaled.near_below + farther(self.near_below),
            above: scaled.above + deeper(self.above),
            below: scaled.below + farther(self.below),
        }
    }

    /// Bound of |φ − d| at one point.
    pub(crate) fn at_point<F: EnclosedSdf, R: Float>(field: &F, point: &Aabb, status: Status<bool>) -> R {
        let Self { near, near_below, above, below } = field.error_bound(point);
        R::from_f64(if status.beyond_band || status.outside_grid { above.max(below) } else { near.max(near_below) })
    }
}
