//! The examples run, and their own assertions hold.

#[path = "../examples/04_own_field.rs"]
mod own_field;

#[path = "../examples/02_grid_in_flash.rs"]
mod grid_in_flash;

#[path = "../examples/03_mesh_batch.rs"]
mod mesh_batch;

#[path = "../examples/01_one_triangle.rs"]
mod one_triangle;

#[test]
fn one_triangle_against_a_closed_form() {
    one_triangle::main();
}

#[test]
fn a_grid_in_flash() {
    grid_in_flash::main();
}

#[test]
fn a_mesh_in_a_batch() {
    mesh_batch::main();
}

#[test]
fn a_field_of_ones_own() {
    own_field::main();
}
