//! Fields made of fields. The gradient is that of the part that decides; where two decide, it is a choice.
//!
//! Distances of a union, a shell and a positive offset are exact outside, those of an intersection, a difference and a negative offset
//! inside. Elsewhere, and those of a smooth union, they are bounds of smaller magnitude, never steeper than the steepest part.

mod boolean;
mod compound;
mod offset;
mod shell;
mod smooth_union;

pub use boolean::{Difference, Intersection, Union};
pub use compound::Compound;
pub use offset::Offset;
pub use shell::Shell;
pub use smooth_union::SmoothUnion;

use nalgebra::Vector3;

use crate::number::Float;
use crate::simplex::mean;
use crate::{EnclosedSdf, Enclosure};

/// Both fields' enclosures on the hull of a few points, each about their mean.
fn enclosures<A: EnclosedSdf, B: EnclosedSdf, R: Float>(a: &A, b: &B, corners: &[Vector3<R>]) -> [Enclosure<R>; 2] {
    let middle = mean(corners);
    [a.enclosure(middle, corners), b.enclosure(middle, corners)]
}
