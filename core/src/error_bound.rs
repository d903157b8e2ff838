//! How far can a field be from the shape that it was made from?

use crate::number::Float;
use crate::{Aabb, EnclosedSdf, Status};

/// Bounds of the difference between φ and d in a region, where d is the signed distance to the shape that the field was made from:
/// for a baked grid, the mesh. A closed form is its own shape, without error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBound {
    /// φ − d ≤ `near` at every point whose |d| is within the band of a sparse grid, for other fields at every point; and d − φ too,
    /// where the point is not outside a grid.
    pub near: f64,
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
        Self { near: error, above: error, below: error }
    }

    /// Bound of either: of two regions together, and of the minimum of two fields.
    pub fn max(self, other: Self) -> Self {
        let Self { near, above, below } = other;
        Self { near: self.near.max(near), above: self.above.max(above), below: self.below.max(below) }
    }

    /// Bound of −φ against −d.
    pub fn negate(self) -> Self {
        Self { above: self.below, below: self.above, ..self }
    }

    /// Bound of s φ against s d.
    pub fn scale(self, scale: f64) -> Self {
        Self { near: self.near * scale, above: self.above * scale, below: self.below * scale }
    }

    /// Bound of |φ − d| at one point.
    pub(crate) fn at_point<F: EnclosedSdf, R: Float>(field: &F, point: &Aabb, status: Status<bool>) -> R {
        let Self { near, above, below } = field.error_bound(point);
        R::from_f64(if status.beyond_band || status.outside_grid { above.max(below) } else { near })
    }
}
