//! Scenes that are refused before anything moves, and what `--small` makes of their pins.

use std::path::Path;

use sdf_field::Threads;
use sdf_sim::scene::{self, SceneError, SceneSpec, Stage};

const HEAD: &str = "title = \"all\"\nframes = 1\n";

fn parsed(tables: &str) -> Result<SceneSpec, SceneError> {
    scene::parse(&format!("{HEAD}{tables}"), "my.toml")
}

#[test]
fn a_scene_of_more_than_a_mebibyte_is_refused_whole() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("long.toml");
    // Cut off, it would be a scene too.
    let padded = |length: usize| HEAD.to_owned() + &"#".repeat(length - HEAD.len() - 1) + "\n";
    std::fs::write(&path, padded(1 << 20)).unwrap();
    assert!(scene::read(&path).is_ok());
    std::fs::write(&path, padded((1 << 20) + 1)).unwrap();
    let refused = scene::read(&path).unwrap_err().to_string();
    assert_eq!(refused, format!("{}: a scene has at most 1048576 bytes (1 MiB): shorten it", path.display()));
    std::fs::write(&path, b"title = \"\xff\"").unwrap();
    let refused = scene::read(&path).unwrap_err().to_string();
    assert!(refused.contains("it is not a text: invalid utf-8"), "{refused}");
}

#[test]
fn limits_that_no_run_reaches_are_refused_by_their_key() {
    for (limit, wanted) in [
        ("deepest = -0.1", "reach: deepest = -0.1: it is never below 0: give a larger limit"),
        ("stretch = 0.9", "reach: stretch = 0.9: it is never below 1: give a larger limit"),
        ("jitter = -1.0", "reach: jitter = -1: it is never below 0"),
        ("drift = -1.0", "reach: drift = -1: it is never below 0"),
        ("turn = -1.0", "reach: turn = -1: it is never below 0"),
        ("energy_gain = -1.0", "reach: energy_gain = -1: it is never below 0"),
        ("momentum_error = -1.0", "reach: momentum_error = -1: it is never below 0"),
        ("volume = 1.5", "reach: volume = 1.5: it is 1 before anything moves: give a smaller limit"),
        ("freed = 1.5", "reach: freed = 1.5: it is a share of runs: give a number from 0 to 1"),
        ("freed = -0.5", "reach: freed = -0.5: it is a share of runs"),
        ("calm = 90.0, calm_speed = 1.0", "reach: calm = 90: it is a share of runs"),
        ("calm = 0.9, calm_speed = -1.0", "reach: calm_speed = -1: it is never below 0"),
    ] {
        let refused = parsed(&format!("reach = {{ {limit} }}\n")).unwrap_err().to_string();
        assert!(refused.starts_with("my.toml: ") && refused.contains(wanted), "{limit}: {refused}");
    }
    for limit in ["deepest = 0.0", "stretch = 1.0", "volume = 1.0", "volume = -0.5", "freed = 1.0", "energy_gain = 0.0"]
    {
        assert!(parsed(&format!("reach = {{ {limit} }}\n")).is_ok(), "{limit}");
    }
}

#[test]
fn a_number_beyond_all_measure_is_refused_by_its_line() {
    let body = "[[rigid]]\nmesh.cuboid = { half = [0.1, 0.1, 0.1] }\nmass = 2.0\n";
    for (tables, wanted) in [
        (
            format!("{body}start = {{ spin = [0.0,\n  nan, 0.0] }}\n"),
            "line 7: spin = NaN: give a number of at most 1e100",
        ),
        (format!("{body}{}", body.replace("2.0", "1e101")), "line 8: mass = 1"),
        ("drag = -inf\n".to_owned(), "line 3: drag = -inf: give a number"),
        ("gravity = [0.0, 0.0, +nan]\n".to_owned(), "line 3: gravity = NaN: give a number"),
    ] {
        let refused = parsed(&tables).unwrap_err().to_string();
        assert!(refused.starts_with(&format!("my.toml: {wanted}")), "{refused}");
    }
    assert!(parsed("gravity = [0.0, -1_0.0e+99, 1e-300]\n").is_ok());
}

#[test]
fn counts_below_those_of_the_document_are_refused_by_their_key() {
    let meshes = [
        ("serpent = { rings = 4, slices = 4, spine = 0.1, every = 2 }", vec!["rings", "slices", "every"]),
        ("bowl = { around = 3, along = 3, thickness = 0.2 }", vec!["around", "along"]),
        ("pot = { around = 3, along = 3 }", vec!["around", "along"]),
    ];
    for (mesh, keys) in meshes {
        assert!(parsed(&format!("[[rigid]]\nmesh.{mesh}\n")).is_ok(), "{mesh}");
        for key in keys {
            let (before, after) = mesh.split_once(&format!("{key} = ")).unwrap();
            let least: u32 = after[..1].parse().unwrap();
            let refused = parsed(&format!("[[rigid]]\nmesh.{before}{key} = {}{}\n", least - 1, &after[1..]));
            let wanted = format!("my.toml: rigid 1: {key} = {}: give a whole number of at least {least}", least - 1);
            assert_eq!(refused.unwrap_err().to_string(), wanted, "{mesh}");
        }
    }
    let net = "[[cloth]]\nmesh.sheet = { cells = [2, 2], size = [1.0, 1.0], height = 9.0, bend = 0.0, floor = 0.0, \
               holes = { period = 0, strand = 1 } }\n";
    assert_eq!(parsed(net).unwrap_err().to_string(), "my.toml: cloth 1: period = 0: give a whole number of at least 1");
}

#[test]
fn a_soft_body_of_an_open_or_inverted_mesh_is_refused() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let points = "v 0 0 1\nv 1 0 1\nv 0 1 1\nv 0 0 2\n";
    let refused = |faces: &str| {
        std::fs::write(folder.join("soft.obj"), format!("{points}{faces}")).unwrap();
        let soft = "[[soft]]\nmesh.file = \"soft.obj\"\ncell = 0.5\ndensity = 1.0\nyoung = 1.0\npoisson = 0.3\n";
        Stage::build(&parsed(soft).unwrap(), folder, Threads::ONE)
            .map_or_else(|error| error.to_string(), |_| String::new())
    };
    assert_eq!(refused("f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"), "");
    let open = refused("f 1 3 2\nf 1 2 4\nf 1 4 3\n");
    assert!(open.starts_with("my.toml: soft 1: its mesh is open at 3 edges, one from ["), "{open}");
    let inverted = refused("f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
    assert_eq!(inverted, "my.toml: soft 1: its mesh encloses no volume: turn its faces outward");
}

#[test]
fn the_pins_of_a_smaller_scene_are_at_the_same_places() {
    let small = |mesh: &str, pins: &[u32]| {
        let mut spec = parsed(&format!("[[cloth]]\nmesh.{mesh}\npins = {pins:?}\n")).unwrap();
        let points = |spec: &SceneSpec| {
            let stage = Stage::build(spec, Path::new("."), Threads::ONE).map_err(|error| error.to_string())?;
            Ok::<_, String>(stage.surfaces[0].points(&stage.world))
        };
        let before = points(&spec);
        spec.shrink();
        let after = points(&spec);
        (spec.cloth[0].pins.clone(), before, after)
    };
    let sheet = |cells: u32, more: &str| {
        format!(
            "sheet = {{ cells = [{cells}, {cells}], size = [1.0, 1.0], height = 0.0, bend = 0.0, floor = 0.0{more} }}"
        )
    };
    let rope = "rope = { strands = 1, edges = 9, length = 1.0, radius = 0.0, turns = 0.0, height = 0.0, bend = 0.0 }";
    for (mesh, pins, wanted) in [
        (sheet(10, ""), vec![0, 10, 60, 110, 120], vec![0, 5, 14, 30, 35]),
        (sheet(9, ""), vec![0, 9, 90, 99], vec![0, 5, 30, 35]),
        // All corners but one of a net, which has points missing.
        (sheet(8, ", holes = { period = 4, strand = 1 }"), vec![0, 8], vec![0, 4]),
        (rope.to_owned(), vec![0, 9], vec![0, 5]),
    ] {
        let (pins_after, before, after) = small(&mesh, &pins);
        let (before, after) = (before.unwrap(), after.unwrap());
        assert_eq!(pins_after, wanted, "{mesh}");
        for (old, new) in pins.iter().zip(pins_after).filter(|(old, _)| **old != 60) {
            assert_eq!(before[*old as usize], after[new as usize], "{mesh}");
        }
    }
    // One that is not there is refused as before.
    let (_, before, after) = small(&sheet(10, ""), &[121]);
    assert!(
        before.unwrap_err().contains("no vertex 121 to pin") && after.unwrap_err().contains("no vertex 121 to pin")
    );
    let mut bowl = parsed("[[rigid]]\nmesh.bowl = { around = 4, along = 3, thickness = 0.2 }\ncells = 8\n").unwrap();
    bowl.shrink();
    assert!(Stage::build(&bowl, Path::new("."), Threads::ONE).is_ok());
}

#[test]
fn a_body_that_begins_beyond_f32_is_refused_by_its_name() {
    let far = "start.translate = [1e100, 0.0, 0.0]\n";
    let sheet =
        "[[cloth]]\nmesh.sheet = { cells = [4, 4], size = [0.4, 0.4], height = 0.0, bend = 0.0, floor = 0.0 }\n";
    let cube = "mesh.cuboid = { half = [0.1, 0.1, 0.1] }\n";
    let ball = "shape = 'field = { shape = \"sphere\", radius = 0.1 }'\ntranslate = [1e100, 0.0, 0.0]\n";
    for (tables, name) in [
        (format!("{sheet}{sheet}{far}"), "cloth 2"),
        (format!("[[rigid]]\n{cube}{far}"), "rigid 1"),
        (format!("[[rigid]]\n{cube}count = [2, 1, 1]\napart = [1e60, 0.0, 0.0]\n"), "rigid 1"),
        (format!("[[soft]]\n{cube}cell = 0.1\ndensity = 1e3\nyoung = 1e6\npoisson = 0.3\n{far}"), "soft 1"),
        (format!("[[rigid]]\n{cube}[[obstacle]]\n{ball}"), "obstacle 1"),
        (format!("[[rigid]]\n{cube}[[obstacle]]\n{cube}translate = [1e100, 0.0, 0.0]\n"), "obstacle 1"),
    ] {
        let build = |spec: SceneSpec| Stage::build(&spec, Path::new("."), Threads::ONE);
        let refused = parsed(&tables).and_then(build).unwrap_err().to_string();
        let at = if tables.contains("1e60") { "1.000e60" } else { "1.000e100" };
        let wanted = format!("my.toml: {name}: a coordinate is {at}: give one within 3.4e38, as recordings hold f32");
        assert_eq!(refused, wanted, "{tables}");
    }
}

#[test]
fn keys_without_effect_are_refused() {
    let cube = "[[rigid]]\nmesh.cuboid = { half = [0.1, 0.1, 0.1] }\n";
    let ball = "[[obstacle]]\nshape = 'field = { shape = \"sphere\", radius = 0.1 }'\n";
    let copies = |count: &str| format!("{cube}count = {count}\napart = [1.0, 1.0, 1.0]\n");
    for (tables, wanted) in [
        (
            copies("[200, 200, 200]"),
            "rigid 1: count = [200, 200, 200]: that is 8000000: give a number from 1 to 1000000",
        ),
        (copies("[100000, 100000, 1]"), "rigid 1: count = [100000, 100000, 1]: that is 10000000000: give "),
        (
            copies("[4000000000, 4000000000, 4000000000]"),
            "rigid 1: count = [4000000000, 4000000000, 4000000000]: that is 64000000000000000000000000000: give ",
        ),
        (copies("[0, 1, 1]"), "rigid 1: count = [0, 1, 1]: that is 0: give "),
        (format!("{cube}{ball}period = 2.0\n"), "obstacle 1: period: only an obstacle with becomes has one"),
        (format!("{cube}{ball}cells = 256\n"), "obstacle 1: cells: only an obstacle that is baked from mesh has them"),
        (
            format!("{cube}[vary]\nmass_ratio = [1.0, 10.0]\n"),
            "vary: mass_ratio: it is that of vertices: give a cloth or a soft body",
        ),
        (format!("{cube}[vary]\nrate = []\n"), "vary: rate: an empty list: give values, or leave it out"),
        (format!("{cube}[vary]\nsubsteps = []\n"), "vary: substeps: an empty list: "),
        (format!("{cube}[vary]\nmass_ratio = []\n"), "vary: mass_ratio: an empty list: "),
        (format!("{cube}[vary]\nseeds = 0\n"), "line 6: vary: seeds = 0: give at least 1, or leave it out"),
    ] {
        let refused = parsed(&tables).unwrap_err().to_string();
        assert!(refused.starts_with("my.toml: ") && refused.contains(wanted), "{tables}: {refused}");
    }
    let sheet =
        "[[cloth]]\nmesh.sheet = { cells = [4, 4], size = [0.4, 0.4], height = 0.0, bend = 0.0, floor = 0.0 }\n";
    let becomes = "becomes = 'field = { shape = \"sphere\", radius = 0.2 }'\nperiod = 2.0\n";
    let warnings =
        |tables: &str| Stage::build(&parsed(tables).unwrap(), Path::new("."), Threads::ONE).unwrap().warnings;
    for tables in [format!("{sheet}[vary]\nmass_ratio = [2.0]\nseeds = 2\n"), format!("{cube}{ball}{becomes}")] {
        assert_eq!(warnings(&tables), [""; 0], "{tables}");
    }
    for tables in ["", ball] {
        assert_eq!(warnings(tables), ["nothing moves: give a [[cloth]], [[rigid]] or [[soft]]"], "{tables}");
    }
}
