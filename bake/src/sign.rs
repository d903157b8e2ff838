//! Inside or outside: pseudo-normals for closed consistent meshes, winding numbers for all others, spread by flood fill.

pub mod flood_fill;
pub mod pseudo_normals;
pub mod winding;
