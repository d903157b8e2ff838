//! The examples run, and their own assertions hold.

#[path = "../../examples/01_bake.rs"]
mod bake;

#[path = "../../examples/02_contacts.rs"]
mod contacts;

#[path = "../../examples/03_many_frames.rs"]
mod many_frames;

#[test]
fn a_mesh_is_baked() {
    bake::main().unwrap();
}

#[test]
fn a_cloth_touches_a_body() {
    contacts::main().unwrap();
}

#[test]
fn a_body_moves_for_many_frames() {
    many_frames::main().unwrap();
}
