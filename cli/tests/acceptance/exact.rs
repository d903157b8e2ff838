//! `bake --keep-mesh` and `contacts --exact`.

use crate::folder::{Folder, says};
use crate::meshes::Model;

/// A triangle that cuts a corner off the unit cube: (0.97, 0.97, 0.97) is 0.03 deep, and nothing deeper.
const CUT: &str = "v 1.97 0.47 0.47\nv 0.47 1.97 0.47\nv 0.47 0.47 1.97\nf 1 2 3\n";

#[test]
fn a_grid_that_keeps_its_mesh_answers_exactly() {
    let folder = Folder::new();
    folder.write("cube.obj", Model::cube().obj());
    folder.write("cut.obj", CUT);
    folder.done("bake cube.obj --res 6 -o plain.sdf.h5");
    says(&folder.done("info plain.sdf.h5"), &["not kept"]);
    for layout in ["dense", "sparse"] {
        folder.done(&format!("bake cube.obj --res 6 --layout {layout} --keep-mesh"));
        says(&folder.done("info cube.sdf.h5"), &["8 vertices, 12 triangles kept", "mesh_vertices", "--keep-mesh"]);
        assert_eq!(folder.json("info cube.sdf.h5")["mesh"]["triangles"], 12);
        folder.done("verify cube.sdf.h5 cube.obj --points 2000");

        says(&folder.done("contacts cut.obj cube.sdf.h5 --exact"), &["by the triangles of the kept mesh"]);
        let exact = folder.json("contacts cut.obj cube.sdf.h5 --exact");
        let contact = &exact["contacts"][0];
        let number = |name: &str| contact[name].as_f64().unwrap();
        assert!((number("distance") + 0.03).abs() < 1e-6, "{contact}");
        assert!((number("lower_bound") + 0.03).abs() < 1e-6 && number("error_bound") < 1e-12, "{contact}");
        let on_cube: Vec<f64> =
            contact["surface_point"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        assert!(on_cube.iter().any(|x| (x - 1.0).abs() < 1e-9), "{contact}");
        let grid = folder.json("contacts cut.obj cube.sdf.h5");
        let by_grid = grid["contacts"].as_array().unwrap().first().map_or(0.0, |it| it["distance"].as_f64().unwrap());
        assert!((by_grid + 0.03).abs() > 1e-3, "the grid is right already: {by_grid}");
    }
}

#[test]
fn an_exact_search_says_what_it_needs() {
    let folder = Folder::new();
    folder.write("cube.obj", Model::cube().obj());
    folder.write("cut.obj", CUT);
    folder.write("ball.sdf.toml", "[field]\nshape = \"sphere\"\nradius = 1.0\n");
    folder.done("bake cube.obj --res 6");
    let refused = folder.refused("contacts cut.obj cube.sdf.h5 --exact");
    says(&refused, &["cube.sdf.h5 keeps no mesh for --exact: bake it again by bake --keep-mesh"]);
    says(&folder.refused("contacts cut.obj ball.sdf.toml --exact"), &["exact already: remove --exact"]);
    folder.write(
        "named.sdf.toml",
        "[field]\nshape = 'offset'\ndistance = 0.1\nof = { shape = 'grid', file = 'cube.sdf.h5' }\n",
    );
    says(
        &folder.refused("contacts cut.obj named.sdf.toml --exact"),
        &["named.sdf.toml: --exact needs the file of the grid itself"],
    );
    says(&folder.misused("contacts cut.obj cube.sdf.h5 --exact --method fw"), &["remove --method"]);
    says(&folder.misused("contacts cut.obj cube.sdf.h5 --exact --all-minima"), &["remove --all-minima"]);
    says(&folder.misused("contacts ball.sdf.toml ball.sdf.toml --exact"), &["--exact needs a mesh"]);
}
