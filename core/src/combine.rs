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
