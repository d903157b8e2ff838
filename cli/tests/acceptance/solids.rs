//! A mesh means the surface of the solid, without whiskers, without faces inside.

use crate::folder::{Folder, says};
use crate::meshes::Model;

fn value(folder: &Folder, field: &str, point: &str) -> f64 {
    folder.write("point.csv", point);
    folder.json(&format!("eval {field} --points point.csv"))["samples"][0]["distance"].as_f64().unwrap()
}

#[test]
fn a_whisker_through_a_cube_is_dropped_and_said() {
    let folder = Folder::new();
    folder.write("cube.obj", Model::cube().obj() + "f 1 8 1\n");
    let said = folder.done("bake cube.obj --res 8");
    says(&said, &["1 triangle without area dropped", "one shell; 1 face without area, dropped"]);
    assert_eq!(value(&folder, "cube.sdf.h5", "0.5,0.5,0.5"), -0.5);
    says(&folder.done("info cube.sdf.h5"), &["1 face without area, dropped"]);
    folder.done("verify cube.sdf.h5 cube.obj --points 2000");
}

#[test]
fn a_cube_in_a_cube_is_one_cube_unless_all_faces_are_to_be_kept() {
    let folder = Folder::new();
    let inner = Model::cube().moved(|p| p.map(|x| 0.25 + 0.5 * x));
    folder.write("nested.obj", Model::cube().and(&inner).obj());
    for layout in ["dense", "sparse"] {
        says(
            &folder.done(&format!("bake nested.obj --res 32 --layout {layout}")),
            &["12 triangles inside of the solid dropped", "1 shell inside of the solid, dropped"],
        );
        assert!((value(&folder, "nested.sdf.h5", "0.25,0.5,0.5") + 0.25).abs() < 0.02);
        folder.done("verify nested.sdf.h5 nested.obj --points 2000");
        folder.done(&format!("bake nested.obj --res 32 --layout {layout} --inner-faces keep -o kept.sdf.h5"));
        assert!(value(&folder, "kept.sdf.h5", "0.25,0.5,0.5").abs() < 1e-4);
        folder.done("verify kept.sdf.h5 nested.obj --points 2000");
        says(&folder.done("info kept.sdf.h5"), &["--inner-faces keep"]);
    }
    let json = folder.json("bake nested.obj --res 8");
    let counts =
        ["shells", "inner_shells", "inner_triangles", "entangled_shells"].map(|key| json[key].as_u64().unwrap());
    assert_eq!(counts, [1, 1, 12, 0]);
}

#[test]
fn crossing_cubes_are_said_to_keep_their_inner_faces() {
    let folder = Folder::new();
    let other = Model::cube().moved(|p| p.map(|x| 0.25 + x));
    folder.write("crossing.obj", Model::cube().and(&other).obj());
    says(
        &folder.done("bake crossing.obj --res 8"),
        &["2 shells cross or touch: their faces inside of the solid count"],
    );
}

#[test]
fn a_mesh_without_any_area_is_refused() {
    let folder = Folder::new();
    folder.write("line.obj", "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n");
    says(&folder.refused("bake line.obj --res 8"), &["line.obj", "no triangle of the mesh has an area"]);
}

#[test]
fn a_point_deep_inside_of_a_sparse_ball_is_as_deep_as_it_is() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 0.5, 5).obj());
    folder.done("bake ball.obj --res 128 --layout sparse");
    assert!((value(&folder, "ball.sdf.h5", "0.4,0,0") + 0.1).abs() < 1.0 / 128.0);
}
