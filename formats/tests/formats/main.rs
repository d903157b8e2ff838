//! All integration tests of the crate, in one program.

mod atomic_write;
mod blobs;
mod contact_files;
mod field_round_trip;
mod fields;
mod forged;
mod grid_blocks;
mod grid_bytes;
mod grid_damage;
mod grid_golden;
mod grid_hostile;
mod grid_needed;
mod grid_round_trip;
mod grid_samples;
mod grid_threads;
mod grid_uncompressed;
mod memory;
mod mesh_bytes;
mod mesh_hostile;
mod mesh_models;
mod mesh_obj;
mod mesh_off;
mod mesh_ply;
mod mesh_polygons;
mod mesh_stl;
mod random;
