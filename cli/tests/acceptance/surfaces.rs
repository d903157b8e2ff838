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
    // All nodes are outside of the ball.
    says(
        &folder.refused("surface sphere.sdf.toml -o none.obj --res 1"),
        &["sphere.sdf.toml: ", "between 6 × 6 × 6 nodes", "larger --res"],
    );
    says(&folder.wrong_usage("surface sphere.sdf.toml -o out.txt"), &["out.txt", ".obj, .ply, .stl or .off"]);
    folder.wrong_usage("surface sphere.sdf.toml -o out.obj --res 100000");
    folder.write("plane.sdf.toml", "[field]\nshape = \"half_space\"\nnormal = [1, 0, 0]\noffset = 0\n");
    says(&folder.refused("surface plane.sdf.toml -o plane.obj"), &["plane.sdf.toml", "unbounded", "intersect"]);
}

/// Edges of a mesh file with one triangle.
fn boundary_edges(folder: &Folder, name: &str) -> usize {
    let mut uses = std::collections::HashMap::new();
    for [a, b, c] in mesh::read(&folder.at(name)).unwrap().triangles {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            *uses.entry([from.min(to), from.max(to)]).or_insert(0) += 1;
        }
    }
    uses.into_values().filter(|count| *count == 1).count()
}

/// The object and the line on standard error of a run that succeeds.
fn warned(folder: &Folder, words: &str) -> (serde_json::Value, String) {
    let output = folder.sdftool(&format!("{words} --json")).output().unwrap();
    assert!(output.status.success(), "{words}");
    (serde_json::from_slice(&output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap())
}

#[test]
fn a_surface_that_leaves_the_box_says_so_and_up_to_its_faces_all_are_closed() {
    let folder = Folder::new();
    folder.write("cube.obj", Model::cube().obj());
    let spacing = folder.json("bake cube.obj --res 31")["spacing"].as_f64().unwrap();
    // The padding is of four cells; a level in the last layer of cells, and the last that closes.
    for level in [0.0, 3.1 * spacing, 3.9 * spacing] {
        let json = folder.json(&format!("surface cube.sdf.h5 -o out.ply --level {level}"));
        assert_eq!((boundary_edges(&folder, "out.ply"), &json["warning"]), (0, &json!(null)), "{level}");
    }
    let words = "surface cube.sdf.h5 -o out.ply --level";
    let (json, line) = warned(&folder, &format!("{words} {}", 4.5 * spacing));
    assert!(boundary_edges(&folder, "out.ply") > 0);
    says(&line, &["sdftool: warning: cube.sdf.h5: the surface is open", "--padding"]);
    assert!(line.contains(json["warning"].as_str().unwrap()), "{line}");
    // The level that it names closes.
    let highest = line.split("levels up to ").nth(1).unwrap().split(' ').next().unwrap();
    assert_eq!(folder.json(&format!("{words} {highest}"))["warning"], json!(null));
    assert_eq!(boundary_edges(&folder, "out.ply"), 0);
    // So do others between the same ends.
    for level in [4.2, 4.5] {
        let (json, line) =
            warned(&folder, &format!("surface cube.sdf.h5 -o out.ply --res 20 --level {}", level * spacing));
        let is_open = boundary_edges(&folder, "out.ply") > 0;
        assert_eq!((json["warning"].is_string(), line.is_empty()), (is_open, !is_open), "{level}: {line}");
    }
    folder.write("ball.obj", Model::ball([0.3, 0.2, 0.1], 1.0, 4).obj());
    folder.json("bake ball.obj --res 20 --padding 0");
    let glb = warned(&folder, "export ball.sdf.h5 --format glb -o ball.glb");
    let ply = warned(&folder, "surface ball.sdf.h5 -o ball.ply");
    for (json, line) in [glb, ply] {
        let is_open = boundary_edges(&folder, "ball.ply") > 0;
        assert_eq!((json["warning"].is_string(), line.is_empty()), (is_open, !is_open), "{line}");
    }
}

#[test]
fn an_stl_file_whose_triangles_are_flattened_by_f32_says_so() {
    let folder = Folder::new();
    folder.write("far.obj", Model::ball([1e6; 3], 0.01, 3).obj());
    folder.json("bake far.obj --res 24");
    let (json, line) = warned(&folder, "surface far.sdf.h5 -o far.stl");
    says(&line, &["warning: far.sdf.h5: STL rounds coordinates to f32", "no area left"]);
    assert!(json["warning"].is_string());
    assert_eq!(folder.json("surface far.sdf.h5 -o far.ply")["warning"], json!(null));
}

/// Outside of a grid's box values are lower bounds: no surface is drawn there as if they were distances.
#[test]
fn a_surface_outside_of_the_box_of_a_grid_in_a_combination_is_refused() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 2).obj());
    folder.done("bake ball.obj --res 20 --padding 3");
    let offset = |distance: f64| {
        format!("[field]\nshape = 'offset'\ndistance = {distance}\nof = {{ shape = 'grid', file = 'ball.sdf.h5' }}\n")
    };
    folder.write("far.sdf.toml", offset(0.8));
    folder.write("near.sdf.toml", offset(0.1));
    for words in ["surface far.sdf.toml -o x.obj", "view far.sdf.toml -o x.html", "export far.sdf.toml -o x.glb"] {
        says(&folder.refused(words), &["far.sdf.toml", "lies beyond the band or the box", "larger"]);
        folder.done(&words.replace("far", "near"));
    }
    let (json, line) = warned(&folder, "slice far.sdf.toml -o x.png");
    says(&line, &["far.sdf.toml: the line of distance 0 is no surface"]);
    says(json["warning"].as_str().unwrap(), &["is no surface"]);
    assert!(folder.json("slice near.sdf.toml -o x.png").get("warning").is_none());
    // On other nodes than its own, a grid ends at its box too: no level is said to close that does not.
    let closing = |words: &str| {
        let (json, _) = warned(&folder, &format!("surface ball.sdf.h5 --level 0.5 {words} -o x.obj"));
        let warning = json["warning"].as_str().unwrap().to_owned();
        warning.split(' ').find_map(|word| word.parse::<f64>().ok()).unwrap()
    };
    let (own, finer) = (closing(""), closing("--res 57"));
    assert!((own - finer).abs() < 0.01, "{own} by its own nodes, {finer} by others");
}

#[test]
fn a_shape_that_is_thinner_than_the_cells_is_never_lost_without_a_word() {
    let folder = Folder::new();
    folder.write("plate.sdf.toml", "[field]\nshape = \"box\"\nhalf_extents = [1.0, 1.0, 0.0065]\n");
    folder.write("plate.obj", Model::cube().moved(|[x, y, z]| [x, y, z * 0.006]).obj());
    let mut sheet = Model::cube();
    sheet.triangles.truncate(2);
    folder.write("sheet.obj", sheet.obj());
    folder.done("bake plate.obj --res 400 --padding 6 --layout sparse");
    folder.done("bake sheet.obj --res 16");
    let thin = "the shape is thinner than these cells, ";
    for (words, file, advice) in [
        ("view plate.sdf.toml", "plate.html", "take `surface` with a larger --res"),
        ("view plate.sdf.h5", "plate.html", "take `surface` with a larger --res"),
        ("export plate.sdf.toml --format npy", "plate.npy", "use a larger --res"),
        ("export plate.sdf.toml --format raw", "plate.raw", "use a larger --res"),
        ("export plate.sdf.toml --format nvdb", "plate.nvdb", "use a larger --res"),
        ("export plate.sdf.h5 --res 20 --format blob", "plate.sdfb", "use a larger --res"),
    ] {
        let (json, line) = warned(&folder, words);
        let name = words.split(' ').nth(1).unwrap();
        says(&line, &[&format!("sdftool: warning: {name}: the surface is empty: between "), thin, advice]);
        assert!(line.lines().count() == 1 && line.contains(json["warning"].as_str().unwrap()), "{words}: {line}");
        assert!(folder.at(file).exists(), "{words}");
    }
    // What they advise helps. A sheet has no inside to lose, and what is thick enough is not warned of.
    folder.done("surface plate.sdf.toml --res 512 -o plate.ply");
    for words in [
        "export plate.sdf.toml --res 512 --format nrrd",
        "export plate.sdf.h5 --format blob",
        "export sheet.sdf.h5 --res 8 --format npy",
    ] {
        assert!(folder.json(words)["warning"].is_null(), "{words}");
    }
    let (json, line) = warned(&folder, "view sheet.sdf.h5");
    says(
        &line,
        &["the surface is empty: between ", "an open mesh without an inside has a surface at distances above 0 alone"],
    );
    assert!(line.contains(json["warning"].as_str().unwrap()), "{line}");
}
