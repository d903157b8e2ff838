//! Extracted surfaces agree with the field.

use sdf_formats::mesh;
use serde_json::json;

use crate::folder::{Folder, says};
use crate::meshes::Model;

/// Distances of all points from a center, and the number of triangles that face it. (Where the surface meets a node, triangles have
/// no area.)
fn radii_and_inward(folder: &Folder, name: &str, center: [f64; 3]) -> (Vec<f64>, usize) {
    let mesh = mesh::read(&folder.at(name)).unwrap();
    let offset = |point: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| point[k] - center[k]) };
    let radii = mesh.points.iter().map(|point| offset(*point).iter().map(|x| x * x).sum::<f64>().sqrt()).collect();
    let inward = mesh.triangles.iter().filter(|corners| {
        let [a, b, c] = corners.map(|corner| offset(mesh.points[corner as usize]));
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        (0..3).map(|k| a[k] * cross[k]).sum::<f64>() < -1e-9
    });
    (radii, inward.count())
}

#[test]
fn the_surface_of_a_baked_ball_is_closed_and_within_a_cell_of_it() {
    let folder = Folder::new();
    let center = [3.0, -2.0, 0.5];
    folder.write("ball.obj", Model::ball(center, 1.0, 4).obj());
    let spacing = folder.json("bake ball.obj --res 24")["spacing"].as_f64().unwrap();
    for name in ["out.obj", "out.ply", "out.stl"] {
        let json = folder.json(&format!("surface ball.sdf.h5 -o {name}"));
        assert_eq!((&json["schema"], &json["output"]), (&json!("sdftool.surface/1"), &json!(name)));
        let (radii, inward) = radii_and_inward(&folder, name, center);
        // Reading an STL file welds the points of triangles without area.
        assert!(json["points"] == radii.len() || name == "out.stl", "{name}");
        assert!(radii.iter().all(|radius| (radius - 1.0).abs() < 0.25 * spacing), "{name}");
        assert_eq!(inward, 0, "{name}");
        let verdict = folder.json(&format!("bake {name} --res 8 -o again.sdf.h5"))["sign_verdict"].clone();
        // The surface has faces without area, where a corner of a cell lies on it.
        let verdict = verdict.as_str().unwrap();
        assert!(verdict.starts_with("pseudo-normal: closed, consistently wound, one shell"), "{name}: {verdict}");
    }
    says(&folder.done("surface ball.sdf.h5 -o out.obj"), &["points", "triangles", "out.obj"]);
}

#[test]
fn another_level_and_another_res_give_another_surface() {
    let folder = Folder::new();
    folder.write("sphere.sdf.toml", "[field]\nshape = \"sphere\"\nradius = 1.0\n");
    for (words, radius) in [("--res 20", 1.0), ("--res 40 --level 0.5", 1.5), ("--res 40 --level -0.5", 0.5)] {
        let json = folder.json(&format!("surface sphere.sdf.toml -o out.ply {words}"));
        let (radii, inward) = radii_and_inward(&folder, "out.ply", [0.0; 3]);
        assert!(radii.iter().all(|found| (found - radius).abs() < 0.02), "{words}");
        assert_eq!(inward, 0);
        assert!(json["triangles"].as_u64().unwrap() > 500);
    }
    let [coarse, fine] = [8, 32]
        .map(|res| folder.json(&format!("surface sphere.sdf.toml -o out.ply --res {res}"))["points"].as_u64().unwrap());
    assert!(fine > 8 * coarse);
    says(&folder.refused("surface sphere.sdf.toml -o none.obj --res 8 --level -1.5"), &["nowhere", "-1.5"]);
    says(&folder.wrong_usage("surface sphere.sdf.toml -o out.txt"), &["out.txt", ".obj, .ply, .stl or .off"]);
    folder.wrong_usage("surface sphere.sdf.toml -o out.obj --res 100000");
    folder.write("plane.sdf.toml", "[field]\nshape = \"half_space\"\nnormal = [1, 0, 0]\noffset = 0\n");
    says(&folder.refused("surface plane.sdf.toml -o plane.obj"), &["plane.sdf.toml", "unbounded", "intersect"]);
}
