//! Two fields against each other, without a mesh on either side (the paper's §10): where do both bodies lie deepest in
//! each other, and in which patch do they meet?
//!
//! Both questions are about f(x) = max(φ_A, φ_B), which is at most 0 where a point lies in both bodies. For two convex
//! bodies min f is half of the gap between them, or minus half of the penetration depth along the shortest way out. The
//! bodies touch where min f is at most a margin: there the gap is at most twice the margin.
//!
//! | step | question | file |
//! |---|---|---|
//! | 1 | In which box can the bodies touch? [`Pair::new`], [`Pair::shrink`] | `pair` |
//! | 2 | Lower bound of f in a box, from both fields' enclosures and one evaluation | `bounds` |
//! | 3 | min f, proven, by branch and bound: [`Pair::deepest`] | `deepest` |
//! | 4 | Every isolated minimum, by the merge tree of f on cubes: [`Pair::minima`] | `minima`, `merge_tree` |
//! | 5 | The middle surface φ_A = φ_B, cut into points with normals and areas: [`Pair::patch`] | `patch`, `polygon` |
//!
//! `leaves` visits the cubes of 4 and 5, `overlap_point` is what both fields answer at a point. The middle surface is
//! the contact surface of hydroelastic contact between bodies of equal stiffness (Elandt et al. 2019, "A pressure field
//! model for fast, robust approximation of net contact force and moment between nominally rigid objects"; Masterjohn et
//! al. 2022, "Velocity level approximation of pressure field contact patches").
//!
//! A normal points out of B and into A, as that of a mesh's contact points out of the field: (∇φ_B − ∇φ_A) / |∇φ_B −
//! ∇φ_A|, the direction in which A must move to come free.
//!
//! ```
//! use sdf_core::overlap::{BoxNode, DepthSearch, Pair};
//! use sdf_core::placed::{Placed, Rigid};
//! use sdf_core::shapes::Sphere;
//! let ball = Sphere::new(1.0).unwrap();
//! let lifted = Placed { field: ball, placement: Rigid::new([0.0, 0.0, 1.75], [0.0, 0.0, 0.0, 1.0]).unwrap() };
//! let pair = Pair::new(&lifted, &ball, 0.0).unwrap();
//! let deepest = pair.deepest::<f64>(&DepthSearch::default(), &mut [BoxNode::EMPTY; 256]);
//! let point = deepest.point.unwrap();
//! assert!((point.separation() + 0.25).abs() < 1e-3 && deepest.lower_bound <= point.value);
//! assert!((point.normal.z - 1.0).abs() < 1e-3);
//! ```

mod bounds;
mod deepest;
mod leaves;
mod merge_tree;
mod minima;
mod overlap_point;
mod pair;
mod patch;
mod polygon;

pub use deepest::{BoxNode, DeepestPoint, DepthSearch};
pub use merge_tree::MortonLeaf;
pub use minima::LocalMinima;
pub use overlap_point::OverlapPoint;
pub use pair::{NoRegion, Pair};
pub use patch::{Patch, PatchPoint};
