//! Fields made of fields. Gradients follow the part that decides; where two decide, the gradient is a choice.
//!
//! Distances of a union are exact outside, those of an intersection or difference inside; elsewhere they are bounds of
//! smaller magnitude, never steeper than the steepest part.

mod boolean;
mod offset;
mod shell;
mod smooth_union;

pub use boolean::{Difference, Intersection, Union};
pub use offset::Offset;
pub use shell::Shell;
pub use smooth_union::SmoothUnion;

use nalgebra::Vector3;

use crate::enclosure::mean;
use crate::number::Float;
use crate::{Enclosure, Sdf};

/// What is certain of two fields on the hull of a few points, each about their mean.
fn surveys<A: Sdf, B: Sdf, R: Float>(a: &A, b: &B, corners: &[Vector3<R>]) -> [Enclosure<R>; 2] {
    let middle = mean(corners);
    [a.enclosure(middle, corners), b.enclosure(middle, corners)]
}
