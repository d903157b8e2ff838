//! Scene files and recordings: every scene of the folder is read and built small, wrong ones get a message, recordings hold all frames.

use std::ops::ControlFlow;
use std::path::Path;

use sdf_field::Threads;
use sdf_sim::record::{self, Recording};
use sdf_sim::scene::{self, ElementMethod, Stage};

const SCENE: &str = r#"
title = "A small <cloth>"
frames = 6
substeps = 4
thickness = 0.01
reach = { deep_faces = 0, stretch = 1.2 }

[[cloth]]
mesh.sheet = { cells = [6, 6], size = [1.0, 1.0], height = 0.52, bend = 0.0, floor = 0.0 }

[[obstacle]]
shape = 'field = { shape = "sphere", radius = 0.5 }'
"#;

fn message(change: impl Fn(String) -> String) -> String {
    scene::parse(&change(SCENE.to_owned()), "my.toml").map(|_| ()).unwrap_err().to_string()
}

#[test]
fn every_scene_of_the_folder_is_one() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let mut count = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let mut spec = scene::read(&path).unwrap_or_else(|error| panic!("{error}"));
        spec.shrink();
        spec.obstacle.iter_mut().for_each(|obstacle| obstacle.cells = obstacle.mesh.as_ref().map(|_| 8));
        spec.rigid.iter_mut().for_each(|rigid| rigid.cells = 8);
        spec.soft.iter_mut().for_each(|soft| soft.cells = 8);
        let stage =
            Stage::build(&spec, &folder, Threads::ONE).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert!(!stage.surfaces.is_empty(), "{}: nothing moves", path.display());
        count += 1;
    }
    assert!(count > 10, "{count}");
}

#[test]
fn a_wrong_scene_is_told_with_its_line_and_what_is_known() {
    let unknown = message(|text| text.replace("substeps", "substep"));
    assert!(unknown.starts_with("my.toml: line 4: ") && unknown.contains("substeps"), "{unknown}");
    let negative = message(|text| text.replace("thickness = 0.01", "thickness = -0.01"));
    assert_eq!(negative, "my.toml: thickness = -0.01: give a number from 0 to 1e9");
    let both = message(|text| text + "file = \"a.sdf.h5\"\n");
    assert!(both.contains("give one of them"), "{both}");
    assert!(message(|text| text.replace("frames = 6", "frames = 0")).contains("from 1 to"));
    let huge = scene::parse(&SCENE.replace("[6, 6]", "[60000, 60000]"), "huge").unwrap();
    let refused = Stage::build(&huge, Path::new("."), Threads::ONE).unwrap_err().to_string();
    assert!(refused.contains("take less than"), "{refused}");
    let build = |text: String| {
        let spec = scene::parse(&text, "my.toml").unwrap();
        Stage::build(&spec, Path::new("."), Threads::ONE).map(|_| ()).unwrap_err().to_string()
    };
    let ropes = "mesh.rope = { strands = 4000000000, edges = 0, length = 1.0, radius = 0.1, turns = 1.0, height = 1.0, bend = 0.0 }";
    let many = build(format!("{}\n[[cloth]]\n{ropes}\n", SCENE));
    assert!(many.contains("take less than"), "{many}");
    let soft = "mesh.cuboid = { half = [1.0, 1.0, 1.0] }\ncell = 1e-3\ndensity = 1.0\nyoung = 1.0\npoisson = 0.3\n";
    for (soft, wanted) in [(soft.to_owned(), "cubes"), (soft.replace("1e-3", "1e-30"), "cubes")] {
        let fine = build(format!("{SCENE}\n[[soft]]\n{soft}"));
        assert!(fine.contains(wanted) && fine.contains("larger cell"), "{fine}");
    }
    let device = build(SCENE.replace("shape = 'field = { shape = \"sphere\", radius = 0.5 }'", "file = \"/dev/zero\""));
    assert!(device.contains("not a regular file"), "{device}");
    assert!("vertex".parse::<ElementMethod>().unwrap_err().to_string().contains("samples64"));
}

#[test]
fn numbers_that_no_scene_can_be_run_with_are_refused_by_their_key() {
    for (from, to, wanted) in [
        ("height = 0.52", "height = nan", "height = NaN"),
        ("size = [1.0, 1.0]", "size = [1.0, -inf]", "size = -inf"),
        ("radius = 0.5", "radius = 1e200", ""),
        ("thickness = 0.01", "loaded_rounds = 101", "loaded_rounds = 101: give a number from 0 to 100"),
        ("thickness = 0.01", "contacts_per_pair = 0", "contacts_per_pair = 0: give a number from 1 to 64"),
        ("thickness = 0.01", "contacts_per_pair = 65", "contacts_per_pair = 65: give a number from 1 to 64"),
        ("thickness = 0.01", "friction = 2e9", "friction = 2000000000: give a number from 0 to 1e9"),
        ("[[cloth]]", "[[cloth]]\nstretch = -1", "stretch = -1: give a number from 0 to 1e9"),
        ("[[cloth]]", "[[cloth]]\nbend = -1e-3", "bend = -0.001: give a number from 0 to 1e9"),
        ("[[cloth]]", "[[cloth]]\nstretch = nan", "stretch = NaN"),
        ("size = [1.0, 1.0]", "size = [1.0, 0.0]", "size = 0: give a positive number"),
        ("[[cloth]]", "[[cloth]]\nstart.spin = [0.0, 0.0, 1.0]", "spin: rigid bodies alone take one"),
        ("thickness = 0.01", "fails = { foo = 1 }", "fails: unknown method \"foo\": take auto, "),
        ("thickness = 0.01", "rate = 5e-324", "rate = 5e-324: it is too small to divide by: give a larger number"),
        ("thickness = 0.01", "vary = { substeps = [4, 0] }", "vary: substeps = 0"),
        ("thickness = 0.01", "vary = { rate = [60.0, -1.0] }", "vary: rate = -1"),
        ("thickness = 0.01", "vary = { speed = [0.0] }", "vary: speed = 0"),
        ("thickness = 0.01", "vary = { friction = [-0.5] }", "friction = -0.5"),
        ("thickness = 0.01", "vary = { seeds = 4000000000 }", "4000000000 combinations"),
    ] {
        if wanted.is_empty() {
            // A shape is a text of its own, read when the scene is built.
            assert!(scene::parse(&SCENE.replace(from, to), "my.toml").is_ok());
            continue;
        }
        let refused = message(|text| text.replace(from, to));
        assert!(refused.starts_with("my.toml: ") && refused.contains(wanted), "{to}: {refused}");
    }
}

#[test]
fn limits_of_figures_that_a_scene_does_not_have_are_refused() {
    let limit = "stretch = 1.2";
    for (limits, more, wanted) in [
        ("momentum_error = 1e-12", "pins = [0]", "reach: momentum_error: what holds pins is not known"),
        ("beyond = 0", "", "reach: beyond: give the region as [beyond], with below or nearer"),
        ("beyond = 0", "[beyond]", "reach: beyond: give the region as [beyond], with below or nearer"),
        ("calm = 0.9", "", "reach: calm: give calm_speed"),
        ("calm_speed = 3.0", "", "reach: calm_speed: give calm"),
        ("momentum_error = 1e-12", "pins = []", ""),
        ("beyond = 0", "[beyond]\nbelow = 0.0", ""),
        ("calm = 0.9, calm_speed = 3.0", "", ""),
    ] {
        // Keys after the title are the scene's; those of the cloth come before the obstacle.
        let text = SCENE.replace(limit, limits).replace("\n[[obstacle]]", &format!("{more}\n[[obstacle]]"));
        match scene::parse(&text, "my.toml") {
            Ok(_) => assert!(wanted.is_empty(), "{limits} {more} is taken"),
            Err(refused) => {
                let refused = refused.to_string();
                assert!(!wanted.is_empty() && refused.contains(wanted), "{limits} {more}: {refused}");
                assert_eq!(refused.lines().count(), 1, "{refused}");
            }
        }
    }
}

/// Found by fuzzing: a file of 500 bytes took a second to build.
#[test]
fn copies_of_a_body_beyond_all_memory_are_refused() {
    let scene = |kind: &str| {
        format!(
            "title = \"many\"\nframes = 1\n[[rigid]]\n{kind}\ncells = 8\ncount = [100, 100, 100]\napart = [9.0, 9.0, 9.0]\n"
        )
    };
    for kind in
        ["mesh.spiked-ball = { radius = 0.99, levels = 2 }", "mesh.bowl = { around = 8, along = 8, thickness = 0.1 }"]
    {
        let spec = scene::parse(&scene(kind), "many.toml").unwrap();
        let refused = Stage::build(&spec, Path::new("."), Threads::ONE).map(|_| ()).unwrap_err().to_string();
        assert!(
            refused.starts_with("many.toml: rigid 1: 1000000 times ") && refused.contains("at most 10000000"),
            "{refused}"
        );
        assert_eq!(refused.lines().count(), 1, "{refused}");
    }
}

#[test]
fn copies_of_a_body_at_one_place_are_refused() {
    let body = |more: &str| format!("[[rigid]]\nmesh.cuboid = {{ half = [0.1, 0.1, 0.1] }}\n{more}");
    let refused = message(|text| text + &body("count = [1, 3, 1]\napart = [1.0, 0.0, 1.0]\n"));
    assert_eq!(refused, "my.toml: rigid 1: apart: 3 bodies along y would be at one place: give their distance");
    for taken in ["count = [1, 3, 1]\napart = [0.0, 1.0, 0.0]\n", "count = [1, 3, 1]\nstart = { random = 1.0 }\n"] {
        assert!(scene::parse(&format!("{SCENE}{}", body(taken)), "my.toml").is_ok(), "{taken}");
    }
}

/// Its mesh has twelve faces, and cells of an eighth of their side: what carries it is not its corners alone.
#[test]
fn a_soft_box_of_few_faces_rests_on_a_floor() {
    let scene = r#"
title = "a soft box"
frames = 40
substeps = 10
thickness = 0.002
[[soft]]
mesh.cuboid = { half = [0.2, 0.2, 0.2] }
cell = 0.05
cells = 16
density = 1000.0
young = 1e5
poisson = 0.3
start = { translate = [0.0, 0.0, 0.203] }
[[obstacle]]
shape = 'field = { shape = "half_space", normal = [0.0, 0.0, 1.0], offset = 0.0 }'
"#;
    let spec = scene::parse(scene, "box.toml").unwrap();
    let mut stage = Stage::build(&spec, Path::new("."), Threads::ONE).unwrap();
    let on_frame = |_: u32, _: &Stage| ControlFlow::Continue(());
    let figures = scene::run(&spec, &mut stage, "auto".parse().unwrap(), Threads::ONE, on_frame).unwrap();
    assert!(figures.volume > 0.8 && figures.warnings().is_empty(), "{figures:?}");
    // No deeper in the floor than the thickness.
    let lowest = stage.world.x.iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
    assert!(lowest > -0.002, "{lowest}");
}

#[test]
fn a_ball_turned_inside_out_is_refused_before_it_is_baked() {
    for list in ["obstacle", "rigid", "cloth"] {
        let ball = format!("[[{list}]]\nmesh.spiked-ball = {{ levels = 1, radius = -0.45 }}\n");
        let refused = message(|text| format!("{text}\n{ball}"));
        let number = if list == "rigid" { 1 } else { 2 };
        assert_eq!(refused, format!("my.toml: {list} {number}: radius = -0.45: give a positive number"));
    }
}

#[test]
fn a_formula_that_makes_no_surface_is_refused_by_its_key() {
    for (mesh, wanted) in [
        ("cuboid = { half = [1.0, 0.0, 1.0] }", "half = 0: give a positive number"),
        (
            "bowl = { around = 8, along = 8, thickness = 2.0 }",
            "thickness = 2: give a number between 0 and 2 for a bowl",
        ),
        ("bowl = { around = 8, along = 8, thickness = -0.1 }", "thickness = -0.1: give a number between"),
        ("serpent = { rings = 8, slices = 8, spine = -0.1, every = 2 }", "spine = -0.1: give a number from 0"),
        (
            "rope = { strands = 2, edges = 2, length = 0.0, radius = 0.1, turns = 0.0, height = 1.0, bend = 0.0 }",
            "length = 0: give a positive number",
        ),
    ] {
        let refused = message(|text| format!("{text}\n[[rigid]]\nmesh.{mesh}\n"));
        assert!(refused.starts_with("my.toml: ") && refused.contains(wanted), "{mesh}: {refused}");
    }
}

/// A rigid body of a mesh file of this text: built, or the message that refuses it.
fn rigid_of_file(text: &str) -> Result<(), String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(folder.join("body.obj"), text).unwrap();
    let scene = "title = \"one\"\nframes = 1\n[[rigid]]\nmesh.file = \"body.obj\"\ncells = 8\n";
    let spec = scene::parse(scene, "my.toml").unwrap();
    Stage::build(&spec, folder, Threads::ONE).map(|_| ()).map_err(|error| error.to_string())
}

#[test]
fn a_rigid_body_of_an_open_mesh_is_refused_and_seams_are_not_holes() {
    let points = "v 0 0 1\nv 1 0 1\nv 0 1 1\nv 0 0 2\n";
    let faces = ["f 1 3 2\n", "f 1 2 4\n", "f 1 4 3\n", "f 2 3 4\n"];
    assert_eq!(rigid_of_file(&format!("{points}{}", faces.concat())), Ok(()));
    // Each triangle with corners of its own, as along seams of a texture; one corner at −0.
    let corners = [[1, 3, 2], [1, 2, 4], [1, 4, 3], [2, 3, 4]].as_flattened();
    let lines: Vec<&str> = points.lines().collect();
    let mut seams: Vec<String> = corners.iter().map(|corner| format!("{}\n", lines[corner - 1])).collect();
    seams[0] = "v -0 0 1\n".to_owned();
    seams.extend((0..4).map(|face| format!("f {} {} {}\n", 3 * face + 1, 3 * face + 2, 3 * face + 3)));
    assert_eq!(rigid_of_file(&seams.concat()), Ok(()));
    // Without its last face, and with that face turned, three edges are open.
    for last in ["", "f 2 4 3\n"] {
        let refused = rigid_of_file(&format!("{points}{}{last}", faces[..3].concat())).unwrap_err();
        assert!(refused.starts_with("my.toml: rigid 1: its mesh is open at 3 edges, one from ["), "{refused}");
        assert!(refused.contains("close the mesh") && refused.lines().count() == 1, "{refused}");
    }
    let inward = ["f 1 2 3\n", "f 1 4 2\n", "f 1 3 4\n", "f 2 4 3\n"].concat();
    let refused = rigid_of_file(&format!("{points}{inward}")).unwrap_err();
    assert_eq!(refused, "my.toml: rigid 1: its mesh encloses no volume: turn its faces outward");
    let sheet =
        "[[rigid]]\nmesh.sheet = { cells = [4, 4], size = [1.0, 1.0], height = 0.5, bend = 1.0, floor = -1.0 }\n";
    let spec = scene::parse(&format!("{SCENE}\n{sheet}"), "my.toml").unwrap();
    let refused = Stage::build(&spec, Path::new("."), Threads::ONE).map(|_| ()).unwrap_err().to_string();
    assert!(refused.contains("my.toml: rigid 1: its mesh is open at 16 edges"), "{refused}");
}

const ALL_KINDS: &str = r#"
title = "all kinds"
frames = 1
gravity = [0.0, 0.0, 0.0]
vary = { speed = [1.0, 5.0], seeds = 2 }

[[cloth]]
mesh.sheet = { cells = [2, 2], size = [1.0, 1.0], height = 9.0, bend = 0.0, floor = 0.0 }
start = { velocity = [0.5, 0.0, 0.0], random = 0.5 }

[[rigid]]
mesh.cuboid = { half = [0.5, 0.5, 0.5] }
cells = 8
start = { velocity = [0.5, 0.0, 0.0], spin = [0.0, 0.0, 1.0], random = 0.5 }

[[soft]]
mesh.cuboid = { half = [0.5, 0.5, 0.5] }
cell = 0.5
density = 1.0
young = 1e3
poisson = 0.3
start = { velocity = [0.5, 0.0, 0.0], translate = [9.0, 0.0, 0.0], random = 0.5 }
"#;

#[test]
fn seeds_and_speeds_are_those_of_cloths_and_of_rigid_and_soft_bodies() {
    let spec = scene::parse(ALL_KINDS, "my.toml").unwrap();
    let stages: Vec<Stage> =
        scene::variants(&spec).map(|spec| Stage::build(&spec, Path::new("."), Threads::ONE).unwrap()).collect();
    let [slow, other_place, fast, _] = &stages[..] else { panic!("four variants") };
    for (surface, name) in ["cloth", "rigid", "soft"].into_iter().enumerate() {
        let points = |stage: &Stage| stage.surfaces[surface].points(&stage.world);
        assert_ne!(points(slow), points(other_place), "{name}");
        assert_eq!(points(slow), points(fast), "{name}");
        let [before, after] = [slow, fast].map(|stage| stage.surfaces[surface].max_speed(&stage.world));
        assert!((after - 5.0 * before).abs() < 1e-12, "{name}: {before} and {after}");
    }
}

#[test]
fn variants_are_all_combinations_and_the_last_list_changes_fastest() {
    let vary = "vary = { rate = [30.0, 60.0], substeps = [1, 2, 3], speed = [0.5], seeds = 2 }\nthickness = 0.01";
    let spec = scene::parse(&SCENE.replace("thickness = 0.01", vary), "my.toml").unwrap();
    let all: Vec<_> = scene::variants(&spec).map(|spec| (spec.rate, spec.substeps, spec.seed, spec.frames)).collect();
    let wanted = [30.0, 60.0]
        .into_iter()
        .flat_map(|rate| (1..=3).flat_map(move |substeps| (0..2).map(move |seed| (rate, substeps, seed, 12))));
    assert_eq!(all, wanted.collect::<Vec<_>>());
    let alone = scene::parse(SCENE, "my.toml").unwrap();
    assert_eq!(scene::variants(&alone).map(|spec| spec.frames).collect::<Vec<_>>(), [6]);
}

/// The recording of the scene above, and what was measured.
fn recorded(threads: usize) -> (Recording, scene::Outcome) {
    let spec = scene::parse(SCENE, "my.toml").unwrap();
    let mut recording = Recording::default();
    let method = "auto".parse().unwrap();
    let outcome = scene::run_all(&spec, Path::new("."), method, Threads::new(threads), 1, |_, frame, stage| {
        if frame == 0 {
            recording = Recording::new(&spec.title, spec.rate, stage, 24);
        }
        recording.push(stage);
        ControlFlow::Continue(())
    });
    (recording, outcome.unwrap())
}

#[test]
fn a_recording_holds_every_frame_and_the_obstacle() {
    let (recording, outcome) = recorded(1);
    assert!(outcome.is_reached() && outcome.worst.frames == 6, "{outcome:?}");
    assert_eq!((recording.frames.len(), recording.frames[0].len()), (7, 49));
    // Marching tetrahedra: on the ball, and closed.
    assert!(recording.still_faces.len() > 1000);
    let off = |[x, y, z]: &[f32; 3]| ((x * x + y * y + z * z).sqrt() - 0.5).abs();
    assert!(recording.still_points.iter().all(|point| off(point) < 0.005));
    let sides = recording.still_faces.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
    let mut edges: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    edges.sort_unstable();
    assert!(edges.chunk_by(|a, b| a == b).all(|same| same.len() == 2));

    let page = record::page(&recording);
    assert!(page.contains("<title>A small &lt;cloth></title>") && !page.contains("%MOVING%"));
    assert!(!page.contains("http"), "it needs nothing from outside");
    let picture = record::contact_sheet(&recording, 4, 64);
    let reader = png::Decoder::new(std::io::Cursor::new(picture)).read_info().unwrap();
    assert_eq!((reader.info().width, reader.info().height), (256, 64));

    let folder = std::env::temp_dir().join(format!("sdf-sim-{}", std::process::id()));
    record::write_folder(&recording, 0, &folder).unwrap();
    let last = sdf_formats::mesh::read(&folder.join("frame_0006.obj")).unwrap();
    assert_eq!((last.points.len(), last.triangles), (49, recording.faces.clone()));
    // Frames that are there already are not written again.
    ["frame_0003.obj", "frame_0004.obj"].iter().for_each(|name| std::fs::write(folder.join(name), "mine").unwrap());
    record::write_folder(&recording, 4, &folder).unwrap();
    let is_mine = |name: &str| std::fs::read(folder.join(name)).unwrap() == b"mine";
    assert_eq!(["frame_0003.obj", "frame_0004.obj"].map(is_mine), [true, false]);
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_recording_does_not_depend_on_the_number_of_threads() {
    assert_eq!(recorded(1).0.frames, recorded(3).0.frames);
}

#[test]
fn methods_that_must_fail_do_and_faces_do_not() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let spec = scene::read(&folder.join("05-cone.toml")).unwrap();
    let run = |word: &str| {
        let method = word.parse().unwrap();
        scene::run_all(&spec, &folder, method, Threads::ONE, 1, |_, _, _| ControlFlow::Continue(())).unwrap()
    };
    assert!(spec.fails.len() > 2);
    for (word, least) in &spec.fails {
        let failures = run(word).failures(&spec);
        assert!(failures >= *least, "{word} must fail by {least}, and fails by {failures}");
    }
    let faces = run("auto");
    assert!(faces.is_reached() && faces.failures(&spec) == 0, "{faces:?}");
}
