//! Signed distance fields, and the contacts of points, segments and triangles with them.
//!
//! A field ([`Sdf`]) answers φ and ∇φ at a point: a [shape](shapes), a [combination](combine) of fields, a
//! [grid] of samples, or one of them [put into the world](placed), [moving] or in a deformed [cage]. A [minimizer](minimize) finds where on a
//! simplex φ is least, and [`contact`](contact::contact) makes that a contact.
//!
//! Distances are negative inside and in the unit of the points; gradients are the derivative of the value and point
//! outward. Nothing here allocates, recurses or panics.

#![no_std]
#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(all(feature = "core-math", not(feature = "std")), feature(core_float_math))]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(any(feature = "std", test))]
extern crate std;

mod aabb;
#[cfg(feature = "alloc")]
mod any_field;
mod best_first;
pub mod cage;
pub mod combine;
pub mod contact;
mod delegate;
mod enclosure;
mod error_bound;
pub mod grid;
pub mod hilbert;
pub mod minimize;
pub mod moving;
mod near_parts;
mod number;
pub mod overlap;
pub mod placed;
mod relaxation;
mod rounding;
mod sdf;
pub mod shapes;
mod simplex;
mod vector;

pub use aabb::Aabb;
#[cfg(feature = "alloc")]
pub use any_field::AnyField;
pub use enclosure::{BoxEnclosure, EnclosedSdf, Enclosure, ExactMinimum, Goal, GradientBox, PartVisitor};
pub use error_bound::ErrorBound;
pub use nalgebra;
pub use near_parts::NearParts;
pub use num_traits;
pub use number::interval::Interval;
pub use number::kernel::{LaneBundle, LaneKernel};
pub use number::lanes::{LaneMask, Lanes};
pub use number::{Float, Gather, Mask, Parameter, Real};
pub use relaxation::Relaxation;
pub use sdf::{DynSdf, Sample, Sdf, Status};
pub use simplex::{Simplex, project_weights};
