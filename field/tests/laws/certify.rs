//! The two bounds of a sparse grid's error.

use sdf_field::core::grid::owned::Layout;
use sdf_field::{BakeOptions, Certify, Field, GridInfo, GridSize, MeshView};
use sdf_procedural::SpikedBall;

fn baked(certify: Certify) -> GridInfo {
    let mesh = SpikedBall { levels: 4, radius: 1.0 }.mesh();
    let options = BakeOptions { size: GridSize::Cells(40), layout: Layout::Sparse, certify, ..BakeOptions::default() };
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    Field::bake(view, &options).unwrap().field.info().unwrap().clone()
}

#[test]
fn the_tight_bound_of_a_smooth_mesh_is_smaller_and_the_options_say_so() {
    let (fast, tight) = (baked(Certify::Fast), baked(Certify::Tight));
    assert!(0.0 < tight.error_bound && tight.error_bound < fast.error_bound, "{tight:?} {fast:?}");
    assert!(tight.options.contains("--certify tight") && !fast.options.contains("--certify"), "{tight:?} {fast:?}");
}
