//! Signed distance fields as colliders of parry and rapier, without a fork of either: a [`SdfShape`], and a [`SdfDispatcher`] that
//! answers for pairs with one. All other pairs stay with parry.
//!
//! ```
//! use parry3d::math::{Pose, Vector};
//! use parry3d::query::{DefaultQueryDispatcher, QueryDispatcher};
//! use parry3d::shape::Ball;
//! use sdf_core::shapes::Torus;
//! use sdf_parry::{SdfDispatcher, SdfShape};
//!
//! let torus = SdfShape::new(Torus::new(1.0, 0.25).unwrap()).unwrap();
//! let dispatcher = SdfDispatcher::default().chain(DefaultQueryDispatcher);
//! // A ball in the hole of the torus, and one above its ring.
//! let contact = |x, z| dispatcher.contact(&Pose::from_translation(Vector::new(x, 0.0, z)), &torus, &Ball::new(0.5), 0.1).unwrap();
//! assert!(contact(0.0, 0.0).is_none());
//! assert!((contact(1.0, 0.7).unwrap().dist + 0.05).abs() < 1e-4);
//! ```
//!
//! rapier takes the dispatcher in `NarrowPhase::with_query_dispatcher`, and the shape in `ColliderBuilder::new(SharedShape::new(…))`.
//! A field baked by `sdf-field` is made one by `Field::into_any`.
//!
//! | step | question | file |
//! |---|---|---|
//! | 1 | Which of a pair is the field, and which triangles has the other shape? | `pair`, `triangles` |
//! | 2 | Where does the field touch these triangles? Balls and capsules are searched about their axes, too | `touch`, by `sdf_core::contact`; `round` |
//! | | On which points does it stand, if a triangle is wide? On its own vertices, where it has a mesh, and on corners of its box | `footprint`, `vertices` |
//! | 3 | Which points does a solver get? Grouped by normal, at most four each, with last step's impulses | `manifolds` |
//! | 4 | When does a moving shape arrive? | `cast` |
//!
//! Not answered: a field in a `Compound`, deformable meshes, two fields of which neither has a mesh.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

mod body_part;
mod cast;
mod convert;
mod dispatcher;
mod footprint;
mod manifolds;
mod nearest;
mod pair;
mod round;
mod search;
mod shape;
mod surface;
mod touch;
mod triangles;
mod vertices;

pub use dispatcher::SdfDispatcher;
pub use sdf_core as core;
pub use search::Search;
pub use shape::{InvalidShape, SdfShape};
