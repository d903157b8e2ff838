//! Fields made of fields: [`Field::union`], [`intersection`](Field::intersection), [`difference`](Field::difference),
//! [`smooth_union`](Field::smooth_union), [`offset`](Field::offset), [`shell`](Field::shell), [`placed`](Field::placed).
//!
//! The parts share their samples with the fields that they were made of. Combinations nest as deep as a file of closed forms may:
//! each level takes stack to evaluate.

use sdf_core::AnyField;
use sdf_core::combine::{Difference, Intersection, Offset, Shell, SmoothUnion};
use sdf_core::placed::Similarity;

use crate::Field;
use crate::reach::parts;

/// Largest nesting of combinations and placements: with the shape within it is that of a file.
const MAX_DEPTH: usize = 63;

/// Why fields cannot be combined.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum CombineError {
    /// The union of no fields is not a field.
    NoParts,
    /// Combinations would be nested more than 63 deep.
    TooDeep,
    /// An offset that is NaN or infinite.
    NotFinite(f64),
    /// A blend or thickness that is not positive and finite.
    NotPositive(f64),
}

impl std::fmt::Display for CombineError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoParts => f.write_str("a union needs one field at least"),
            Self::TooDeep => {
                write!(f, "more than {MAX_DEPTH} combinations in each other: join many parts by one union")
            }
            Self::NotFinite(length) => write!(f, "{length} is not a finite length"),
            Self::NotPositive(length) => write!(f, "{length} is not a positive finite length"),
        }
    }
}

impl std::error::Error for CombineError {}

impl Field {
    /// The points of any part: min φᵢ. A distance outside, a bound of smaller magnitude inside.
    pub fn union(parts: &[Field]) -> Result<Self, CombineError> {
        if let [part] = parts {
            return Ok(part.clone());
        }
        let parts = parts.iter().map(|part| part.as_any().clone()).collect();
        nested(AnyField::union(parts).ok_or(CombineError::NoParts)?)
    }

    /// The points of both: max(φ_A, φ_B). A distance inside, a lower bound of it outside.
    pub fn intersection(&self, other: &Field) -> Result<Self, CombineError> {
        nested(AnyField::Intersection(Box::new(Intersection(self.as_any().clone(), other.as_any().clone()))))
    }

    /// The points of this field that are not of the other: max(φ_A, −φ_B).
    pub fn difference(&self, other: &Field) -> Result<Self, CombineError> {
        nested(AnyField::Difference(Box::new(Difference(self.as_any().clone(), other.as_any().clone()))))
    }

    /// The union with its seam filled over a width of `blend`, a positive length.
    pub fn smooth_union(&self, other: &Field, blend: f64) -> Result<Self, CombineError> {
        let union = SmoothUnion::new(self.as_any().clone(), other.as_any().clone(), blend);
        nested(AnyField::SmoothUnion(Box::new(union.ok_or(CombineError::NotPositive(blend))?)))
    }

    /// The body grown by `distance`, shrunk where that is negative: φ − distance.
    pub fn offset(&self, distance: f64) -> Result<Self, CombineError> {
        let offset = Offset::new(self.as_any().clone(), distance);
        nested(AnyField::Offset(Box::new(offset.ok_or(CombineError::NotFinite(distance))?)))
    }

    /// The points about the surface, in a layer of this thickness: |φ| − thickness / 2.
    pub fn shell(&self, thickness: f64) -> Result<Self, CombineError> {
        let shell = Shell::new(self.as_any().clone(), thickness);
        nested(AnyField::Shell(Box::new(shell.ok_or(CombineError::NotPositive(thickness))?)))
    }

    /// The field scaled, turned and moved: φ(x) = s φ₀(Rᵀ (x − t) / s).
    pub fn placed(&self, placement: Similarity) -> Result<Self, CombineError> {
        nested(self.as_any().clone().placed(placement))
    }
}

fn nested(field: AnyField) -> Result<Field, CombineError> {
    if depth(&field) <= MAX_DEPTH { Ok(Field::new(field)) } else { Err(CombineError::TooDeep) }
}

/// Combinations and placements in each other. The recursion is as deep as the field: every field made here is within the limit, but
/// for the one level that is looked at.
fn depth(field: &AnyField) -> usize {
    parts(field).into_iter().map(|part| 1 + depth(part)).max().unwrap_or(0)
}
