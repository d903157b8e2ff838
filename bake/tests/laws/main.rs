//! Laws that hold of every baked grid.

mod bounds;
mod bricks_of_shells;
mod budgets;
mod certified_errors;
mod distances;
mod error_regions;
mod flat_meshes;
mod flood_fill;
mod inner_faces;
mod inner_shells;
mod lattices;
mod mesh_surface;
mod meshes;
mod oracle;
mod partial_lattices;
mod random;
mod repairs;
mod repeatable;
mod scanned_meshes;
mod signs;
mod sparse;
mod sparse_parts;
mod topologies;
mod triangle_meshes;
mod winding_numbers;
mod without_area;
