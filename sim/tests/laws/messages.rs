//! Messages that refuse a scene: the file, the body by its number, what is wrong and what to give.

use std::path::Path;

use sdf_field::{BakeOptions, Field, GridSize, MeshView, Threads};
use sdf_sim::scene::{self, Stage};

/// Parses and builds a scene of these tables; the message that refuses it.
fn refused(tables: &str) -> String {
    let spec = scene::parse(&format!("title = \"all\"\nframes = 1\n{tables}"), "my.toml");
    let stage = spec.and_then(|spec| Stage::build(&spec, Path::new("."), Threads::ONE));
    stage.map_or_else(|error| error.to_string(), |_| String::new())
}

#[test]
fn a_body_is_told_by_its_number_from_one_on_and_by_what_is_wrong() {
    let body = "mesh.cuboid = { half = [0.1, 0.1, 0.1] }\n";
    let small = refused(&format!("[[rigid]]\n{body}[[rigid]]\n{body}mass = 1e-200\n"));
    assert_eq!(
        small,
        "my.toml: rigid 2: mass = 1e-200: its moments of inertia are beyond f64: give a mass nearer to 1"
    );
    let sheet = "mesh.sheet = { cells = [2, 2], size = [1.0, 1.0], height = 9.0, bend = 0.0, floor = 0.0 }\n";
    let pinned = refused(&format!("[[cloth]]\n{sheet}[[cloth]]\n{sheet}pins = [8, 9]\n"));
    assert_eq!(pinned, "my.toml: cloth 2: it has no vertex 9 to pin: it has 9, from 0 on");
    let lost = refused("[[cloth]]\nmesh.file = \"none.obj\"\n");
    assert!(lost.starts_with("my.toml: cloth 1: ") && lost.contains("none.obj"), "{lost}");
}

/// All refusals that are about one body: of the second of its kind, where the first is right. Each with its keys and what the message has.
#[test]
fn every_refusal_of_a_body_names_it() {
    const CUBE: &str = "{ cuboid = { half = [0.1, 0.1, 0.1] } }";
    let sheet = |size: &str| {
        format!("{{ sheet = {{ cells = [2, 2], size = {size}, height = 9.0, bend = 0.0, floor = 0.0 }} }}")
    };
    let net = sheet("[1.0, 1.0]").replace("floor = 0.0", "floor = 0.0, holes = { period = 0, strand = 1 }");
    let rope = |sizes: &str| {
        format!("{{ rope = {{ strands = 2, edges = 2, {sizes}, turns = 0.0, height = 1.0, bend = 0.0 }} }}")
    };
    let meshes = [
        ("half = -1: ", CUBE.replacen("0.1", "-1.0", 1)),
        ("size = 0: ", sheet("[1.0, 0.0]")),
        ("period = 0: ", net),
        ("radius = -1: ", "{ spiked-ball = { levels = 1, radius = -1.0 } }".to_owned()),
        ("rings = 3: ", "{ serpent = { rings = 3, slices = 4, spine = 0.1, every = 2 } }".to_owned()),
        ("slices = 3: ", "{ serpent = { rings = 4, slices = 3, spine = 0.1, every = 2 } }".to_owned()),
        ("every = 1: ", "{ serpent = { rings = 4, slices = 4, spine = 0.1, every = 1 } }".to_owned()),
        ("spine = -1: ", "{ serpent = { rings = 4, slices = 4, spine = -1.0, every = 2 } }".to_owned()),
        ("thickness = 2: ", "{ bowl = { around = 8, along = 8, thickness = 2.0 } }".to_owned()),
        ("around = 2: ", "{ bowl = { around = 2, along = 8, thickness = 0.2 } }".to_owned()),
        ("along = 2: ", "{ pot = { around = 8, along = 2 } }".to_owned()),
        ("length = 0: ", rope("length = 0.0, radius = 0.1")),
        ("radius = -1: ", rope("length = 1.0, radius = -1.0")),
        ("none.obj: ", "{ file = \"none.obj\" }".to_owned()),
        ("a mesh of about ", "{ pot = { around = 100000, along = 100000 } }".to_owned()),
    ];
    let soft = [("cell", "0.1"), ("density", "1.0"), ("young", "1.0"), ("poisson", "0.3")];
    let still = "{ velocity = [0.0, 0.0, 1.0] }";
    let spin = ("start", "{ spin = [0.0, 0.0, 1.0] }", "spin: ");
    let kinds = [
        (
            "cloth",
            vec![("start", still)],
            vec![
                ("mass", "0.0", "mass = 0: "),
                ("stretch", "-1.0", "stretch = -1: "),
                ("bend", "-1.0", "bend = -1: "),
                ("pins", "[1000]", "it has no vertex 1000 to pin"),
                spin,
            ],
        ),
        (
            "rigid",
            vec![("start", spin.1)],
            vec![
                ("mass", "-1.0", "mass = -1: "),
                ("mass", "1e-200", "mass = 1e-200: "),
                ("count", "[0, 1, 1]", "count = [0, 1, 1]: that is 0: "),
                ("count", "[1, 2, 1]", "apart: "),
                ("cells", "0", "cells = 0: "),
            ],
        ),
        (
            "soft",
            soft.to_vec(),
            vec![
                ("cell", "0.0", "cell = 0: "),
                ("density", "0.0", "density = 0: "),
                ("young", "0.0", "young = 0: "),
                ("padding", "-1.0", "padding = -1: "),
                ("cells", "0", "cells = 0: "),
                ("poisson", "0.5", "poisson = 0.5: "),
                ("cell", "1e-30", "a box of "),
                spin,
            ],
        ),
        (
            "obstacle",
            vec![("cells", "8")],
            vec![
                ("cells", "0", "cells = 0: "),
                ("period", "0.0", "period = 0: "),
                ("becomes", "''", "becomes: "),
                ("shape", "''", "give one of them"),
                ("file", "''", "give one of them"),
            ],
        ),
    ];
    for (kind, keys, faults) in kinds {
        let body = |changed: (&str, &str)| {
            let mut keys: std::collections::BTreeMap<_, _> = keys.iter().copied().chain([("mesh", CUBE)]).collect();
            keys.insert(changed.0, changed.1);
            keys.iter().fold(format!("[[{kind}]]\n"), |text, (key, value)| format!("{text}{key} = {value}\n"))
        };
        let right = body(("mesh", CUBE));
        assert_eq!(refused(&right), "", "{kind}");
        let meshes = meshes.iter().map(|(wanted, mesh)| ("mesh", mesh.as_str(), *wanted));
        for (key, value, wanted) in faults.into_iter().chain(meshes) {
            let message = refused(&(right.clone() + &body((key, value))));
            let is_named = message.starts_with(&format!("my.toml: {kind} 2: ")) && message.contains(wanted);
            assert!(is_named, "{kind}: {key} = {value}: {message:?}");
        }
    }
}

/// Builds a scene of obstacles with files in this folder; its warnings.
fn warned(obstacles: &str, folder: &Path) -> Vec<String> {
    let spec = scene::parse(&format!("title = \"all\"\nframes = 1\n{obstacles}"), "my.toml").unwrap();
    Stage::obstacles(&spec, folder, Threads::ONE).unwrap().warnings
}

/// Slabs 0.01 and 0.5 thick, with voxels of 1/32: by themselves, placed, and beside a ball.
#[test]
fn a_grid_file_without_an_inside_is_warned_of() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let grid = |half: f64, file: &str| {
        let slab = sdf_procedural::Cuboid { half: [1.0, 1.0, half] }.mesh();
        let view = MeshView { points: &slab.points, faces: &slab.triangles };
        let options = BakeOptions { size: GridSize::Cells(64), ..BakeOptions::default() };
        Field::bake(view, &options).unwrap().field.save(folder.join(file)).unwrap();
    };
    grid(0.005, "thin.sdf.h5");
    grid(0.25, "thick.sdf.h5");
    let placed = |file: &str| format!("shape = 'grid'\nfile = '{file}'\npose.translation = [0.0, 0.0, 1.0]\n");
    let pair = |file: &str| {
        format!("shape = 'union'\n[[field.of]]\nshape = 'sphere'\nradius = 0.1\n[[field.of]]\n{}", placed(file))
    };
    for (file, is_thin) in [("thin.sdf.h5", true), ("thick.sdf.h5", false)] {
        std::fs::write(folder.join("placed.sdf.toml"), format!("[field]\n{}", placed(file))).unwrap();
        std::fs::write(folder.join("pair.sdf.toml"), format!("[field]\n{}", pair(file))).unwrap();
        for name in [file, "placed.sdf.toml", "pair.sdf.toml"] {
            let warnings = warned(&format!("[[obstacle]]\nfile = '{name}'\n"), folder);
            let wanted = "obstacle 1: no node of its grid is inside the solid: it is thinner than a voxel, or its mesh is open: \
                          others pass through it: bake a closed mesh with more cells";
            assert_eq!(warnings, if is_thin { vec![wanted.to_owned()] } else { vec![] }, "{name} of {file}");
        }
    }
}

#[test]
fn an_obstacle_of_an_open_mesh_is_warned_of() {
    let sheet = "mesh.sheet = { cells = [2, 1], size = [2.0, 1.0], height = 0.0, bend = 0.0, floor = 0.0 }\n";
    let solid = "[[obstacle]]\nmesh.cuboid = { half = [0.5, 0.5, 0.5] }\ncells = 8\n";
    let warnings = warned(&format!("{solid}[[obstacle]]\n{sheet}cells = 8\n"), Path::new("."));
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].starts_with("obstacle 2: its mesh is open at 6 edges, one from ["), "{warnings:?}");
    assert!(warnings[0].ends_with("others pass through it where it has no inside: close the mesh"), "{warnings:?}");
}

#[test]
fn a_mesh_that_makes_no_body_is_refused_by_its_cause() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let of_file = |name: &str, text: &str| {
        std::fs::write(folder.join(name), text).unwrap();
        let spec = format!("title = \"all\"\nframes = 1\n[[rigid]]\nmesh.file = \"{name}\"\ncells = 8\n");
        let spec = scene::parse(&spec, "my.toml").unwrap();
        Stage::build(&spec, folder, Threads::ONE).map_or_else(|error| error.to_string(), |_| String::new())
    };
    let solid = |size: f64| {
        let points = [[0.0, 0.0, 0.0], [size, 0.0, 0.0], [0.0, size, 0.0], [0.0, 0.0, size]];
        let points: String = points.iter().map(|[x, y, z]| format!("v {x:e} {y:e} {z:e}\n")).collect();
        points + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    };
    assert_eq!(of_file("solid.obj", &solid(1.0)), "");
    let lines = "its mesh has no triangles, and so no mass: give a closed mesh, or make lines a cloth";
    let large = "the volume of its mesh is beyond f64: scale it down";
    let heavy = "the moments of inertia of its mesh are beyond f64: scale it nearer to 1";
    let flat = "its mesh encloses no volume: it is flat, or too small for f64: give a solid, or scale it";
    let inverted = solid(1.0).replace("f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4", "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3");
    for (name, text, wanted) in [
        ("lines.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n".to_owned(), lines),
        ("points.obj", "v 0 0 0\nv 1 0 0\n".to_owned(), lines),
        ("large.obj", solid(1e120), large),
        ("heavy.obj", solid(1e80), heavy),
        ("small.obj", solid(1e-120), flat),
        ("inverted.obj", inverted, "its mesh encloses no volume: turn its faces outward"),
    ] {
        assert_eq!(of_file(name, &text), format!("my.toml: rigid 1: {wanted}"), "{name}");
    }
    let rope = "[[rigid]]\nmesh.rope = { strands = 2, edges = 4, length = 1.0, radius = 0.1, turns = 0.0, height = 0.0, bend = 0.0 }\n";
    assert_eq!(refused(rope), format!("my.toml: rigid 1: {lines}"));
}

#[test]
fn the_shapes_that_may_change_are_those_of_the_document() {
    let document = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/scenes.md")).unwrap();
    let (_, list) = document.split_once("`becomes`, the same shape with other parameters (").unwrap();
    let list = list.split(')').next().unwrap().replace('`', "");
    let why = format!(
        "my.toml: obstacle 1: becomes: give the same shape as shape has ({list}), with other parameters and the same pose"
    );
    for (name, keys) in [
        ("sphere", "radius = R"),
        ("torus", "major_radius = 9.0, minor_radius = R"),
        ("cylinder", "half_height = 1.0, radius = R"),
        ("capsule", "a = [0.0, 0.0, 0.0], b = [1.0, 0.0, 0.0], radius = R"),
        ("box", "half_extents = [1.0, 1.0, R]"),
        ("rounded_box", "half_extents = [1.0, 1.0, 1.0], radius = R"),
        ("half_space", "normal = [0.0, 0.0, 1.0], offset = R"),
        ("octahedron", "size = R"),
    ] {
        let field = |value: &str| format!("'field = {{ shape = \"{name}\", {} }}'", keys.replace('R', value));
        let message = refused(&format!("[[obstacle]]\nshape = {}\nbecomes = {}\n", field("0.1"), field("0.2")));
        let is_listed = list.split([',', ' ']).any(|word| word == name);
        assert_eq!(message, if is_listed { String::new() } else { why.clone() }, "{name}");
    }
}
