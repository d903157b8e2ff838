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
fn crossing_cubes_are_one_solid_unless_all_faces_are_to_be_kept() {
    let folder = Folder::new();
    let other = Model::cube().moved(|p| p.map(|x| 0.25 + x));
    folder.write("crossing.obj", Model::cube().and(&other).obj());
    // The point lies on a face of the other cube, a quarter below those of the first that are outside of it.
    let point = "0.5,0.5,0.25";
    for size in ["--res 32", "--res 32 --layout sparse", "--max-error 2%"] {
        says(
            &folder.done(&format!("bake crossing.obj {size} --keep-mesh")),
            &["12 triangles cut where others meet them", "12 faces cut", "inside of the solid, dropped"],
        );
        assert!((value(&folder, "crossing.sdf.h5", point) + 0.25).abs() < 0.04, "{size}");
        folder.done("verify crossing.sdf.h5 crossing.obj --points 2000");
        folder.write("vertex.obj", "v 0.5 0.5 0.25\nv 0.5 0.5 0.26\nv 0.5 0.51 0.25\nf 1 2 3\n");
        let exact = folder.json("contacts vertex.obj crossing.sdf.h5 --elements vertices --exact");
        let distance = exact["contacts"][0]["distance"].as_f64().unwrap();
        assert!((distance + 0.25).abs() < 1e-12, "{size}: {distance}");
    }
    let json = folder.json("bake crossing.obj --res 8");
    let [cut, kept, dropped, entangled, uncertain] =
        ["crossing_triangles", "kept_pieces", "dropped_pieces", "entangled_shells", "uncertain_pieces"]
            .map(|key| json[key].as_u64().unwrap());
    assert!(cut == 12 && kept >= 12 && dropped >= 12 && entangled == 0 && uncertain == 0, "{json}");
    folder.done("bake crossing.obj --res 32 --inner-faces keep");
    // Between nodes, at most half a cell of 1.25/32 off the kink at the face.
    assert!(value(&folder, "crossing.sdf.h5", point).abs() < 0.02);
    folder.done("verify crossing.sdf.h5 crossing.obj --points 2000");
    // Pseudo-normals know no other side of a cut.
    says(
        &folder.done("bake crossing.obj --res 8 --sign pseudo-normal"),
        &[
            "2 shells cross or touch: their faces inside of the solid count",
            "error  unknown: pseudo-normals do not fit this mesh",
        ],
    );
    says(&folder.done("info crossing.sdf.h5"), &["unknown: pseudo-normals do not fit this mesh"]);
    says(
        &folder.refused("contacts vertex.obj crossing.sdf.h5 --elements vertices --complete"),
        &["error bound is known"],
    );
    assert!(folder.json("info crossing.sdf.h5")["error_bound"].is_null());
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

/// A cube of side 1 without the two triangles of one face.
fn box_without_lid() -> String {
    let text = Model::cube().obj();
    let faces: Vec<&str> = text.lines().filter(|line| line.starts_with("f ")).collect();
    let kept = |line: &&str| !faces[..2].contains(line);
    text.lines().filter(kept).map(|line| line.to_owned() + "\n").collect()
}

#[test]
fn a_hole_is_told_by_region_and_closed_when_asked() {
    let folder = Folder::new();
    folder.write("open.obj", box_without_lid());
    let sign = "proven with the sign of a cell's corners where they agree";
    says(&folder.done("bake open.obj --res 16"), &[sign, "regions", "% of", "cells are within"]);
    let open = folder.json("bake open.obj --res 16");
    let [cells, within] = ["cells", "cells_within"].map(|key| open["error_regions"][key].as_u64().unwrap());
    assert!(within > cells * 9 / 10 && within < cells, "{within} of {cells}");
    let region = &open["error_regions"]["largest_regions"][0];
    assert!(region["error_bound"].as_f64().unwrap() > open["error_regions"]["error_bound_within"].as_f64().unwrap());
    // The file keeps it.
    for layout in ["dense", "sparse"] {
        let baked = folder.json(&format!("bake open.obj --res 16 --layout {layout} -o kept.sdf.h5"));
        assert_eq!(folder.json("info kept.sdf.h5")["error_regions"], baked["error_regions"]);
        says(&folder.done("info kept.sdf.h5"), &["regions", "cells are within"]);
    }
    says(&folder.refused("bake open.obj --max-error 2%"), &["--weld or --close"]);

    // The lid's boundary has a diagonal of √2.
    says(&folder.done("bake open.obj --res 16 --close 1.4"), &["1 boundary loop not capped, too large"]);
    says(
        &folder.done("bake open.obj --max-error 2% --close 1.42"),
        &["2 triangles added by caps", "closed, consistently wound, one shell; 1 boundary loop capped", "proven"],
    );
    says(&folder.done("info open.sdf.h5"), &["--close 1.42"]);
    folder.done("verify open.sdf.h5 open.obj --points 2000");
    let closed = folder.json("bake open.obj --res 16 --close 1.42");
    let counts = ["capped_loops", "cap_triangles", "open_loops", "boundary_edges"].map(|key| closed[key].as_u64());
    assert_eq!(counts, [Some(1), Some(2), Some(0), Some(0)]);
    assert!(closed["error_regions"].is_null() && folder.json("info open.sdf.h5")["error_regions"].is_null());
    says(&folder.wrong_usage("bake open.obj --res 16 --close 0"), &["--close"]);
}

#[test]
fn a_crack_is_welded_when_asked() {
    let folder = Folder::new();
    let nut = sdf_procedural::CrackedNut { cells: 6, cracks: [18, 12], gap: 1e-3 }.mesh();
    folder.write("nut.obj", Model { points: nut.points, triangles: nut.triangles }.obj());
    says(&folder.refused("bake nut.obj --max-error 1%"), &["boundary edges", "--weld"]);
    says(
        &folder.done("bake nut.obj --max-error 1% --weld 0.01"),
        &["28 points welded", "28 vertices welded to others"],
    );
    folder.done("verify nut.sdf.h5 nut.obj --points 2000");
    says(&folder.done("bake nut.obj --res 16 --weld 1e-6 --close 1e-6"), &["no points to weld", "no loop to cap"]);
    let json = folder.json("bake nut.obj --res 16 --weld 0.01");
    assert_eq!((json["merged_points"].as_u64(), json["boundary_edges"].as_u64()), (Some(28), Some(0)));
}

#[test]
fn a_solid_between_all_nodes_is_told_and_one_that_is_thicker_or_open_is_not() {
    let folder = Folder::new();
    let plate = |thickness: f64| Model::cube().moved(|[x, y, z]| [x, y, z * thickness]).obj();
    folder.write("plate.obj", plate(0.01));
    folder.write("thick.obj", plate(0.1));
    let warning = "no node is inside the solid: it is thinner than a voxel of ";
    let sizes = [
        "--res 64",
        "--res 33 --precision u8",
        "--res 40 --layout sparse",
        "--max-error 2%",
        "--res 300 --layout sparse",
    ];
    for size in &sizes[..4] {
        says(&folder.done(&format!("bake plate.obj {size}")), &["warning  ", warning, ": bake with smaller voxels"]);
        says(folder.json(&format!("bake plate.obj {size}"))["warning"].as_str().unwrap(), &[warning]);
        assert!(folder.json(&format!("bake thick.obj {size}"))["warning"].is_null(), "{size}");
    }
    assert!(folder.json(&format!("bake plate.obj {}", sizes[4]))["warning"].is_null());
    // Streamed, of many meshes, and of parts.
    folder.write("thin.obj", plate(0.001));
    let json = folder.json("bake thin.obj --res 240 --layout sparse --band 20 --padding 24");
    assert_eq!(json["streamed"], true, "{json}");
    says(json["warning"].as_str().unwrap(), &[warning]);
    let listed = folder.done("bake thick.obj plate.obj --res 64");
    assert_eq!(listed.matches(warning).count(), 1, "{listed}");
    folder.done("bake plate.obj --res 64 --layout sparse --shard 0/1 -o part.h5");
    says(&folder.done("merge part.h5 -o merged.sdf.h5"), &["warning  ", warning]);
    says(folder.json("merge part.h5 -o merged.sdf.h5")["warning"].as_str().unwrap(), &[warning]);
    // A sheet has no inside.
    folder.write("sheet.obj", Model::hills(4).obj());
    assert!(folder.json("bake sheet.obj --res 8")["warning"].is_null());
}
