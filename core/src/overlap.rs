//! Two fields against each other, without a mesh on either side (the paper's §10): where both bodies are deepest at once,
//! and the patch in which they meet.
//!
//! What is asked of a point is max(φ_A, φ_B), which says how far it is from lying in both. Its least value is half of the
//! gap between two convex bodies, or minus half of the depth of one in the other along the shortest way out. Where it is at
//! most a margin, the bodies touch: the gap there is at most twice the margin.
//!
//! - [`Pair`] is the two fields, the margin, and a box that holds every point in which they touch.
//! - [`Pair::deepest`] finds the least value by branch and bound, and proves it.
//! - [`Pair::minima`] finds every isolated deepest point.
//! - [`Pair::patch`] cuts the middle surface φ_A = φ_B into pieces with a point, a normal and an area each: the contact
//!   surface of hydroelastic contact with both bodies equally stiff (Elandt et al. 2019, "A pressure field model for fast,
//!   robust approximation of net contact force and moment between nominally rigid objects"; Masterjohn et al. 2022,
//!   "Velocity level approximation of pressure field contact patches").
//!
//! A normal points out of B and into A, as that of a mesh's contact with a field points out of the field: it is
//! (∇φ_B − ∇φ_A) / |∇φ_B − ∇φ_A|, the direction in which A must move to come free.
//!
//! ```
//! use sdf_core::overlap::{Pair, Piece, Search};
//! use sdf_core::placed::{Placed, Rigid};
//! use sdf_core::shapes::Sphere;
//! let ball = Sphere::new(1.0).unwrap();
//! let lifted = Placed { field: ball, placement: Rigid::new([0.0, 0.0, 1.75], [0.0, 0.0, 0.0, 1.0]).unwrap() };
//! let pair = Pair::new(&lifted, &ball, 0.0).unwrap();
//! let deepest = pair.deepest::<f64>(&Search::default(), &mut [Piece::EMPTY; 256]);
//! let at = deepest.at.unwrap();
//! assert!((at.separation() + 0.25).abs() < 1e-3 && deepest.lower_bound <= at.value);
//! assert!((at.normal.z - 1.0).abs() < 1e-3);
//! ```

mod bounds;
mod deepest;
mod leaves;
mod minima;
mod overlap_point;
mod pair;
mod patch;
mod polygon;

pub use deepest::{Deepest, Piece, Search};
pub use minima::{Leaf, Minima};
pub use overlap_point::OverlapPoint;
pub use pair::{NoRegion, Pair};
pub use patch::{Patch, PatchPoint};
