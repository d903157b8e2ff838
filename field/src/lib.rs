//! Signed distance fields as a program holds them.
//!
//! A [`Field`] is any grid or closed form: baked from a mesh, opened from a file or from bytes, saved to either, sampled at many
//! points, searched for contacts with a mesh given as slices or with
//! another field, on as many threads as requested, in the widest vectors that the
//! processor has. It is all that a program depends on; [`core`] is there for what it does not cover.
//!
//! Features: `bake` (fields from meshes), `files` (files and bytes), `exchange` (files of other programs, surfaces), `threads`; not by
//! default `page` (a page to look at) and `cuda` (contacts on NVIDIA GPUs). Without them it depends on the core and on pulp alone, and knows no
//! file format.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

#[cfg(feature = "bake")]
mod bake;
mod combine;
pub mod compare;
mod contact_batches;
#[cfg(feature = "files")]
mod contact_row;
mod contacts;
#[cfg(feature = "cuda")]
pub mod cuda;
mod engine;
#[cfg(feature = "bake")]
mod exact;
#[cfg(feature = "exchange")]
pub mod export;
mod field;
#[cfg(feature = "files")]
pub mod file;
mod first_touch;
#[cfg(feature = "exchange")]
pub mod import;
mod info;
mod kept_mesh;
#[cfg(feature = "bake")]
pub mod memory;
mod mesh_in_motion;
#[cfg(feature = "bake")]
mod mesh_sdf;
mod mesh_view;
mod method;
mod not_finite;
mod options;
mod overlap;
#[cfg(feature = "page")]
pub mod page;
mod query_error;
mod reach;
mod reduce;
#[cfg(feature = "exchange")]
mod requantize;
#[cfg(feature = "exchange")]
mod surface;
mod threads;

#[cfg(feature = "bake")]
pub use bake::{
    BakeError, BakeOptions, Baked, Certify, CheckedMesh, ErrorBudgetError, ErrorRegion, ErrorRegions, GridSize,
    InnerFaces, InvalidMesh, MaxError, MeshReport, Progress, Topology,
};
#[cfg(all(feature = "bake", feature = "files"))]
pub use bake::{BakeFileError, BakeOutcome, BakeTarget, BakedFile, BrickShard, GridOnDisk, merge_parts};
pub use combine::CombineError;
#[cfg(feature = "files")]
pub use contact_row::ContactRow;
pub use contacts::Contacts;
pub use field::{Field, status_bits};
pub use first_touch::{FirstTouchOptions, FirstTouches, MeshPath, TimedContact};
pub use info::{GridInfo, MarginOutOfReach, SignMethod, Source};
pub use kept_mesh::KeptMesh;
pub use mesh_in_motion::{MeshClusters, MeshInMotion};
pub use mesh_view::{MeshView, VertexOutOfRange};
pub use method::{Method, UnknownMethod};
pub use not_finite::NotFinite;
pub use options::{ContactOptions, Elements};
pub use overlap::{Overlap, OverlapError, OverlapOptions, OverlapVerdict};
pub use query_error::QueryError;
pub use sdf_core as core;
#[cfg(feature = "files")]
pub use sdf_formats::clear_leftovers;
#[cfg(feature = "exchange")]
pub use surface::SurfaceMesh;
pub use threads::Threads;
