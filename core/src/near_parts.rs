//! The parts of a union that can be its value on an element: [`NearParts`].
//!
//! With L a slope bound and r no less than the distance of any two points of the element, φ_i lies within φ_i(x) ± L r on it, for
//! each of its points x. So a part with
//!
//! ```text
//! φ_i(x) − L r  >  min_j (φ_j(x) + L r)
//! ```
//!
//! is never the minimum on the element, nor equal to it: a search without that part has the same bits. Mostly one or two are left.

use nalgebra::Vector3;

use crate::number::{Mask, Real};
use crate::rounding::{FieldScale, NESTED_FIELDS, rounding};

/// A set of a union's parts: part i is in it if bit i modulo 32 is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PartSet(u32);

impl PartSet {
    /// Every part of any union.
    pub const ALL: Self = Self(u32::MAX);

    /// The first part from `part` on that is in the set, or a number beyond the last part. It may be a part that is not in the set,
    /// which does no harm, so that there always is one and a processor need not ask.
    #[inline(always)]
    pub fn next_from(self, part: usize) -> usize {
        let ahead = self.0.rotate_right(part as u32) | 1 << 31;
        part.wrapping_add(ahead.trailing_zeros() as usize)
    }
}

/// Knowledge that a search of one element, or of one in each lane, gains of a union: which parts can be the minimum.
///
/// See [`EnclosedSdf::narrow`](crate::EnclosedSdf::narrow).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearParts<R> {
    pub(crate) parts: PartSet,
    /// Upper bound of the union on the element.
    upper: R,
}

/// Every part.
impl<R: Real> Default for NearParts<R> {
    #[inline(always)]
    fn default() -> Self {
        Self { parts: PartSet::ALL, upper: R::from_f64(f64::INFINITY) }
    }
}

impl<R: Real> NearParts<R> {
    /// No part yet, of a union that is at most as high as `self` knows.
    #[inline(always)]
    pub(crate) fn emptied(&self) -> Self {
        Self { parts: PartSet(0), ..*self }
    }

    /// No part has been added.
    #[inline(always)]
    pub(crate) fn is_empty(&self) -> bool {
        self.parts.0 == 0
    }

    /// Adds a part that lies within `value` ± `spread` on the element, unless another is lower everywhere.
    #[inline(always)]
    pub(crate) fn add(&mut self, part: usize, value: R, spread: R) {
        self.upper = self.upper.min(value + spread);
        self.add_above(part, value - spread);
    }

    /// Adds a part that lies above `lower` on the element, unless another is lower everywhere.
    #[inline(always)]
    pub(crate) fn add_above(&mut self, part: usize, lower: R) {
        // Not by ≤, which is false of NaN.
        let is_excluded = self.upper.lt(lower);
        self.parts.0 |= u32::from((!is_excluded).any()).rotate_left(part as u32);
    }
}

/// How far a part's values on an element can be from `value`, its value at `point`, all of it computed. The radius is no less than
/// the distance of any two points.
#[inline(always)]
pub(crate) fn spread<R: Real>(union: FieldScale<R>, point: Vector3<R>, radius: R, value: R) -> R {
    let spread = union.slope_bound * radius;
    spread + rounding(union, point, radius, value.abs() + spread) * R::from_f64(NESTED_FIELDS)
}

#[cfg(test)]
mod tests;
