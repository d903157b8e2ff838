//! Meshes into grids of exact signed distances.
//!
//! [`TriangleMesh`] takes in plain slices, [`MeshDistance`] answers the exact signed distance at a point, [`dense`]
//! asks it at every node of a grid.
//!
//! ```
//! use sdf_bake::{MeshDistance, TriangleMesh, dense, lattice_around};
//! let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
//! let mesh = TriangleMesh::new(&corners, &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).unwrap();
//! let distance = MeshDistance::new(&mesh, None);
//! assert_eq!(distance.verdict(), "pseudo-normal: closed, consistently wound, one shell");
//! let lattice = lattice_around(&mesh.bounds(), 1.0 / 8.0, 2).unwrap();
//! let grid = dense::bake(&distance, &lattice, &|_| ());
//! assert_eq!(grid.distances.len(), 13 * 13 * 13);
//! ```

#![forbid(unsafe_code)]

mod bvh;
pub mod dense;
mod error;
pub mod error_budget;
mod into_grid;
mod mesh;
mod mesh_distance;
mod nearest;
mod rounding;
mod sign;
mod simd;
pub mod sparse;
#[cfg(test)]
mod testing;
mod triangle;

pub use dense::{DenseGrid, lattice_around};
pub use mesh::topology::Topology;
pub use mesh::{MeshError, MeshReport, TriangleMesh};
pub use mesh_distance::{MeshDistance, SignMethod};
pub use sparse::SparseGrid;
