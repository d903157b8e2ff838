//! Intervals of real numbers (Moore 1966, "Interval Analysis").
//!
//! Endpoints are computed in round-to-nearest. Callers widen results by the bounds of `rounding`.

use super::Real;

/// The closed interval [`lower`, `upper`]; empty where `upper` < `lower`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval<R> {
    /// Lower end.
    pub lower: R,
    /// Upper end.
    pub upper: R,
}

impl Interval<f64> {
    /// (−∞, ∞): nothing is known.
    pub const EVERYTHING: Self = Self { lower: f64::NEG_INFINITY, upper: f64::INFINITY };
}

impl Interval<f32> {
    /// The neutral element of [`hull`](Self::hull).
    pub const EMPTY: Self = Self { lower: f32::INFINITY, upper: f32::NEG_INFINITY };
}

impl<R: Real> Interval<R> {
    /// −x for all x of the interval.
    #[inline(always)]
    pub fn negate(self) -> Self {
        Self { lower: -self.upper, upper: -self.lower }
    }

    /// The smallest interval around both.
    #[inline(always)]
    pub fn hull(self, other: Self) -> Self {
        Self { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper) }
    }

    /// min(x, y) for all x of this interval and all y of the other.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self { lower: self.lower.min(other.lower), upper: self.upper.min(other.upper) }
    }

    /// x + `distance` for all x of the interval.
    #[inline(always)]
    pub fn shift(self, distance: R) -> Self {
        Self { lower: self.lower + distance, upper: self.upper + distance }
    }

    /// x · `factor` for all x of the interval. `factor` must not be negative.
    #[inline(always)]
    pub fn scale(self, factor: R) -> Self {
        Self { lower: self.lower * factor, upper: self.upper * factor }
    }

    /// \[lower − `distance`, upper + `distance`\].
    #[inline(always)]
    pub fn widen(self, distance: R) -> Self {
        Self { lower: self.lower - distance, upper: self.upper + distance }
    }
}
