//! Messages that refuse a scene: the file, the body by its number, what is wrong and what to give.

use std::path::Path;

use sdf_field::Threads;
use sdf_sim::scene::{self, Stage};

/// Builds a scene of these tables; the message that refuses it.
fn refused(tables: &str) -> String {
    let spec = scene::parse(&format!("title = \"all\"\nframes = 1\n{tables}"), "my.toml").unwrap();
    Stage::build(&spec, Path::new("."), Threads::ONE).map_or_else(|error| error.to_string(), |_| String::new())
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
