//! Meshes to grids of exact signed distances.
//!
//! [`TriangleMesh`] takes slices of points and indices. [`MeshDistance`] is the exact signed distance at any point.
//! [`dense`] and [`sparse`] sample it at the nodes of a grid and certify the error between them. [`error_budget`]
//! chooses the grid by the error that is allowed.
//!
//! ```
//! use sdf_bake::{MeshDistance, TriangleMesh, dense, lattice_around};
//! let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
//! let mesh = TriangleMesh::new(&corners, &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).unwrap();
//! let distance = MeshDistance::new(&mesh, None);
//! assert_eq!(distance.sign_reason(), "pseudo-normal: closed, consistently wound, one shell");
//! let lattice = lattice_around(&mesh.bounds(), 1.0 / 8.0, 2).unwrap();
//! let grid = dense::bake(&distance, &lattice, &|_| ());
//! assert_eq!(grid.distances.len(), 13 * 13 * 13);
//! ```
//!
//! | question | room |
//! |---|---|
//! | Is the mesh valid, closed, oriented, free of intersections? | `mesh` |
//! | How are its cracks and holes closed? | `repair` |
//! | How far is a point from one triangle? | `triangle` |
//! | Which triangle of the mesh is nearest to a point? | `bvh` |
//! | Which are nearest to 8 × 8 × 8 nodes at once? | `nearest` |
//! | Is a point inside? | `sign` |
//! | What is nearest to a point or a triangle, once a mesh is baked? | `mesh_surface` |
//! | How far is the interpolant from the distance, between nodes? | `error` |
//! | What stands in a grid? | [`dense`], [`sparse`] |

#![forbid(unsafe_code)]
#![warn(missing_docs)]

mod baked_grid;
mod bvh;
mod curve_order;
pub mod dense;
mod error;
pub mod error_budget;
mod mesh;
mod mesh_distance;
mod mesh_surface;
mod nearest;
mod progress;
mod repair;
mod rounding;
mod sign;
mod simd;
pub mod sparse;
#[cfg(test)]
mod testing;
mod triangle;
mod union_find;

pub use baked_grid::BakedGrid;
pub use dense::{DenseGrid, lattice_around};
pub use error::beyond_band::least_brick_error_rounded_again;
pub use error::regions::MAX_REGIONS;
pub use mesh::topology::Topology;
pub use mesh::{InvalidMesh, MeshReport, TriangleMesh};
pub use mesh_distance::{MeshDistance, SignMethod};
pub use mesh_surface::{ClosestPoints, Deepest, DepthLimits, MeshSurface, Probe, SurfacePoint};
pub use progress::Progress;
pub use repair::Repairs;
pub use sdf_core::grid::owned::{ErrorRegion, ErrorRegions};
pub use sparse::SparseGrid;
