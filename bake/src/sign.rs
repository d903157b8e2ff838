//! Sign of the distance: is a point inside or outside?
//!
//! | method | for which meshes | file |
//! |---|---|---|
//! | angle-weighted pseudo-normal of the nearest feature | one closed shell that bounds a solid | `pseudo_normals` |
//! | generalized winding number w, inside where \|w\| ≥ 1/2 | all others | `winding` |
//!
//! Signs of a whole block of nodes by w come from a flood fill, which evaluates w at few nodes: `flood_fill`.

pub mod flood_fill;
pub mod pseudo_normals;
pub mod winding;
