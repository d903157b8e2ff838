//! Signed distance fields as a program holds them.
//!
//! A [`Field`] is any grid or closed form: baked from a mesh, opened from a file or from bytes, saved to either, sampled at many
//! points, searched for contacts with a mesh given as slices or with
//! another field, on as many threads as asked, in the widest vectors that the
//! processor has. It is all that a program depends on; [`core`] is there for what it does not cover.
//!
//! Features: `bake` (fields from meshes), `files` (files and bytes), `threads`. Without them it depends on the core and two
//! crates more, and knows no file format.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

#[cfg(feature = "bake")]
mod bake;
pub mod compare;
mod contact_batches;
mod contacts;
mod engine;
mod field;
#[cfg(feature = "files")]
pub mod file;
mod info;
#[cfg(feature = "bake")]
pub mod memory;
mod mesh_view;
mod options;
mod overlap;
mod threads;

#[cfg(feature = "bake")]
pub use bake::{
    BakeError, BakeOptions, Baked, ErrorBudgetError, ErrorRegion, ErrorRegions, GridSize, InnerFaces, InvalidMesh,
    MaxError, MeshReport, Progress, Topology,
};
pub use contacts::{Contacts, QueryError};
pub use field::Field;
pub use info::{GridInfo, SignMethod, Source};
pub use mesh_view::{MeshView, VertexOutOfRange};
pub use options::{ContactOptions, Elements, Method};
pub use overlap::{Overlap, OverlapError, OverlapOptions, OverlapVerdict};
pub use sdf_core as core;
pub use threads::Threads;
