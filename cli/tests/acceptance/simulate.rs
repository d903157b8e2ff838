//! `simulate`: what it prints and writes, and how it refuses.

use std::process::{Command, Stdio};

use crate::folder::{Folder, SDFTOOL, says};
use crate::meshes::Model;

const SCENE: &str = r#"
title = "A small cloth on a ball"
frames = 8
substeps = 4
thickness = 0.01
reach = { deep_faces = 0, stretch = 1.0 }

[[cloth]]
mesh.sheet = { cells = [6, 6], size = [1.0, 1.0], height = 0.52, bend = 0.0, floor = 0.0 }

[[obstacle]]
file = "ball.sdf.toml"
"#;

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("small.toml", SCENE);
    folder.write("ball.sdf.toml", "[field]\nshape = 'sphere'\nradius = 0.5\n");
    folder
}

#[test]
fn a_scene_is_measured_and_recorded() {
    let folder = folder();
    says(&folder.done("simulate small.toml"), &["A small cloth on a ball", "deep faces", "stretch: 1.0"]);
    let object = folder.json("simulate small.toml -o run.html --threads 1");
    assert_eq!((&object["schema"], &object["scene"]), (&"sdftool.simulate/1".into(), &"small".into()));
    assert_eq!((&object["frames"], &object["finite"], &object["deep_faces"]), (&8.into(), &true.into(), &0.into()));
    // What is asked for and not reached: a stiff sheet stretches a little.
    assert_eq!(object["missed"]["stretch"][1], 1.0);
    let page = String::from_utf8(folder.read("run.html")).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.contains("A small cloth on a ball"));
    folder.done("simulate small.toml -o run.png --frames 3 --method vertices");
    let mut reader = png::Decoder::new(std::io::Cursor::new(folder.read("run.png"))).read_info().unwrap();
    assert_eq!(reader.info().animation_control.unwrap().num_frames, 4);
    // A frame takes 16.67 ms.
    reader.next_frame(&mut vec![0; reader.output_buffer_size().unwrap()]).unwrap();
    assert_eq!(reader.info().frame_control.unwrap().delay_num, 17);
    folder.done("simulate small.toml -o run.vtkhdf --frames 3");
    assert!(folder.at("run.vtkhdf").is_file() && folder.at("run.still.vtkhdf").is_file());
    folder.done("simulate small.toml -o frames/ --frames 2");
    assert!(folder.at("frames/frame_0002.obj").is_file() && folder.at("frames/still.obj").is_file());
}

/// The example of the document, with a post in place of the dragon, as high and off the cloth's middle: most of it ends on the floor.
#[test]
fn the_cloth_of_the_document_comes_to_rest() {
    let folder = Folder::new();
    let (_, section) = include_str!("../../../docs/scenes.md").split_once("## A scene of your own").unwrap();
    folder.write("mine.toml", section.split("```toml\n").nth(1).unwrap().split("```").next().unwrap());
    let post = |[x, y, z]: [f64; 3]| [0.7 + 0.4 * x, 1.76 * (y - 0.5), 0.4 * (z - 0.5)];
    folder.write("dragon.obj", Model::cube().moved(post).obj());
    let object = folder.json("simulate mine.toml --small");
    assert_eq!((&object["finite"], &object["deep_faces"]), (&true.into(), &0.into()), "{object}");
    // What falls is faster than 1 after a tenth of a second.
    assert!(object["jitter"].as_f64().unwrap() < 0.1, "{object}");
}

#[test]
fn a_run_without_anything_still_removes_what_stood_still_before() {
    let folder = folder();
    folder.done("simulate small.toml -o run.vtkhdf --frames 2");
    assert!(folder.at("run.still.vtkhdf").is_file());
    let (cloth, _) = SCENE.split_once("[[obstacle]]").unwrap();
    folder.write("small.toml", cloth);
    folder.done("simulate small.toml -o run.vtkhdf --frames 2");
    assert!(folder.at("run.vtkhdf").is_file() && !folder.at("run.still.vtkhdf").exists());
}

#[test]
fn a_folder_holds_the_frames_of_the_last_run_and_what_others_put_there() {
    let folder = folder();
    folder.done("simulate small.toml -o frames/ --frames 5");
    // Names that the program does not give, and a folder that has one.
    let others = [
        "frame_3.obj",
        "frame_00005.obj",
        "frame_0004.obj.bak",
        "frame_0004.ply",
        "frame_+005.obj",
        "my_frame_0004.obj",
    ];
    others.iter().for_each(|name| folder.write(&format!("frames/{name}"), "mine"));
    std::fs::create_dir(folder.at("frames/frame_0009.obj")).unwrap();
    folder.done("simulate small.toml -o frames/ --frames 2");
    let entries = std::fs::read_dir(folder.at("frames")).unwrap();
    let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    let frames = ["frame_0000.obj", "frame_0001.obj", "frame_0002.obj", "frame_0009.obj", "still.obj"];
    let mut wanted: Vec<&str> = others.into_iter().chain(frames).collect();
    wanted.sort_unstable();
    assert_eq!(names, wanted);
}

#[test]
fn a_folder_of_frames_does_not_replace_what_the_scene_reads() {
    let folder = folder();
    folder.done("simulate small.toml -o frames/ --frames 4");
    let sheet = "mesh.sheet = { cells = [6, 6], size = [1.0, 1.0], height = 0.52, bend = 0.0, floor = 0.0 }";
    for (name, frames) in [("frame_0002.obj", 4), ("frame_0004.obj", 2), ("still.obj", 2)] {
        let before = folder.read(&format!("frames/{name}"));
        folder.write("again.toml", SCENE.replace(sheet, &format!("mesh.file = \"frames/{name}\"")));
        let line = folder.refused(&format!("simulate again.toml -o frames/ --frames {frames}"));
        says(&line, &[name, "would replace a file that again.toml names"]);
        assert!(folder.read(&format!("frames/{name}")) == before);
    }
}

#[test]
fn each_figure_is_explained_in_the_document() {
    let document = include_str!("../../../docs/scenes.md");
    let object = folder().json("simulate small.toml --frames 1");
    for key in
        object.as_object().unwrap().keys().filter(|key| !["schema", "scene", "title", "method"].contains(&key.as_str()))
    {
        assert!(document.contains(&format!("`{key}`")), "{key}");
    }
    assert_eq!(object["warnings"], serde_json::json!([]));
}

/// The plate is 0.01 thick; its voxels are 1 / 32 with 64 cells, and 1 / 256 with 512.
#[test]
fn a_body_that_is_thinner_than_its_voxels_is_warned_of() {
    let folder = Folder::new();
    folder.write("plate.obj", Model::cube().moved(|[x, y, z]| [2.0 * x, 2.0 * y, 0.01 * z]).obj());
    let scene = |bodies: &str| format!("title = 'thin'\nframes = 1\n{bodies}");
    let sphere = "[[obstacle]]\nshape = \"field = { shape = 'sphere', radius = 0.1 }\"\n";
    let cube = "[[rigid]]\nmesh.cuboid = { half = [0.1, 0.1, 0.1] }\nstart.translate = [0.0, 0.0, 5.0]\n";
    let plate = "mesh.file = 'plate.obj'\n";
    let soft = format!("[[soft]]\n{plate}cell = 0.5\ndensity = 1.0\nyoung = 1e3\npoisson = 0.3\n");
    let warning =
        "no node is inside the solid: it is thinner than a voxel of 3.12e-2: others pass through it: give more cells";
    for (bodies, more, name) in [
        (
            format!("{cube}{sphere}[[obstacle]]\nmesh.cuboid = {{ half = [1.0, 1.0, 0.005] }}\n"),
            "cells = 512\n",
            "obstacle 2",
        ),
        (format!("{sphere}[[rigid]]\nstart.translate = [0.0, 0.0, 5.0]\n{plate}"), "cells = 512\n", "rigid 1"),
        (format!("{soft}cells = 64\n"), "", "soft 1"),
    ] {
        folder.write("thin.toml", scene(&bodies));
        let object = folder.json("simulate thin.toml");
        assert_eq!(object["warnings"], serde_json::json!([format!("{name}: {warning}")]), "{name}");
        says(&folder.done("simulate thin.toml"), &["warning  ", name, warning]);
        if !more.is_empty() {
            folder.write("thin.toml", scene(&bodies) + more);
            assert_eq!(folder.json("simulate thin.toml")["warnings"], serde_json::json!([]), "{name}");
        }
    }
}

/// Faces that are deep from the start are not worse at the end, also in a scene of one run.
#[test]
fn what_is_deep_from_the_start_is_not_worse() {
    let folder = folder();
    let scene = SCENE.replace("height = 0.52", "height = 0.3").replace("deep_faces = 0, stretch = 1.0", "worse = 0");
    folder.write("deep.toml", scene.replace("substeps = 4", "substeps = 4\nrecovery = 0.0"));
    let object = folder.json("simulate deep.toml --frames 1");
    assert!(object["deep_at_start"].as_u64() > Some(0), "{object}");
    assert!(object["deep_faces"].as_u64() <= object["deep_at_start"].as_u64());
    says(&object["warnings"][0].to_string(), &["faces are deep at the start"]);
    says(&folder.done("simulate deep.toml --frames 1"), &["warning", "faces are deep at the start"]);
    assert_eq!((&object["worse"], &object["missed"]), (&0.into(), &serde_json::json!({})));
}

#[test]
fn the_same_scene_is_recorded_in_the_same_bytes_on_any_number_of_threads() {
    let folder = folder();
    folder.done("simulate small.toml -o one.html --threads 1");
    folder.done("simulate small.toml -o three.html --threads 3");
    assert_eq!(folder.read("one.html"), folder.read("three.html"));
}

#[test]
fn all_scenes_of_a_folder_make_a_report() {
    let folder = folder();
    std::fs::create_dir(folder.at("mine")).unwrap();
    folder.write("mine/a.toml", SCENE.replace("file = \"ball.sdf.toml\"", "file = \"../ball.sdf.toml\""));
    // A field beside the scenes is none of them.
    std::fs::copy(folder.at("ball.sdf.toml"), folder.at("mine/ball.sdf.toml")).unwrap();
    let lines = folder.done("simulate mine --suite --small --methods auto,vertices --json -o report");
    assert_eq!(lines.lines().filter(|line| line.contains("\"schema\":\"sdftool.simulate/1\"")).count(), 2, "{lines}");
    let report = String::from_utf8(folder.read("report/report.md")).unwrap();
    assert!(report.contains("| a | vertices |") && folder.at("report/a.png").is_file());
}

#[test]
fn scenes_that_are_not_as_they_say_are_listed_in_one_line() {
    let folder = folder();
    std::fs::create_dir(folder.at("mine")).unwrap();
    let scene = SCENE.replace("ball.sdf", "../ball.sdf").replace("reach", "fails = { vertices = 1000 }\nreach");
    ["a", "b"].iter().for_each(|name| folder.write(&format!("mine/{name}.toml"), &scene));
    let output = folder.sdftool("simulate mine --suite").output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    says(
        &said,
        &["not as they say: a: auto misses stretch; a: vertices must fail by 1000, and fails by ", "; b: auto "],
    );
    assert_eq!((output.status.code(), said.lines().count()), (Some(1), 1), "{said}");
    assert!(!said.contains(char::REPLACEMENT_CHARACTER), "{said}");
    // Smaller scenes are others.
    folder.done("simulate mine --suite --small");
}

#[test]
fn a_scene_that_cannot_be_run_is_a_fault_of_it_and_the_others_are_run() {
    let folder = folder();
    std::fs::create_dir(folder.at("mine")).unwrap();
    let scene = SCENE.replace("ball.sdf", "../ball.sdf").replace(", stretch = 1.0", "");
    folder.write("mine/a.toml", scene.replace("thickness", "thicknes"));
    folder.write("mine/b.toml", scene.replace("ball.sdf", "bell.sdf"));
    folder.write("mine/c.toml", &scene);
    folder.write("mine/d.toml", scene.replace("reach", "fails = { vertices = 0 }\nreach"));
    for small in ["", "--small"] {
        let output = folder.sdftool(&format!("simulate mine --suite {small} --json -o report")).output().unwrap();
        let [said, printed] = [output.stderr, output.stdout].map(|text| String::from_utf8(text).unwrap());
        let lines: Vec<&str> = said.lines().collect();
        assert_eq!((output.status.code(), lines.len()), (Some(1), 3), "{said}");
        says(lines[0], &["sdftool: mine/a.toml: line 5: unknown field"]);
        says(lines[1], &["sdftool: ", "bell.sdf.toml"]);
        assert_eq!(lines[2], "sdftool: scenes that are not as they say: a: cannot be run; b: cannot be run");
        let runs = printed.lines().filter(|line| line.contains("\"schema\":\"sdftool.simulate/1\"")).count();
        assert_eq!(runs, 3, "{printed}");
        let report = String::from_utf8(folder.read("report/report.md")).unwrap();
        says(
            &report,
            &["| a |  | cannot be run: mine/a.toml: line 5: ", "| b | auto | cannot be run: ", "| c | auto |"],
        );
        says(&report, &["| d | vertices |", "![c](c.png)"]);
        assert!(!report.contains("![b]") && folder.at("report/c.png").is_file());
        std::fs::remove_dir_all(folder.at("report")).unwrap();
    }
}

#[test]
fn all_scenes_of_a_suite_are_run_though_nobody_reads() {
    let folder = folder();
    std::fs::create_dir(folder.at("mine")).unwrap();
    let scene = SCENE.replace("ball.sdf", "../ball.sdf");
    ["a", "b"].iter().for_each(|name| folder.write(&format!("mine/{name}.toml"), &scene));
    let mut command = Command::new(SDFTOOL);
    command.args(["simulate", "mine", "--suite", "--small", "-o", "report"]).current_dir(folder.path());
    let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    assert!(child.wait().unwrap().success());
    says(&String::from_utf8(folder.read("report/report.md")).unwrap(), &["| a | auto |", "| b | auto |"]);
}

#[test]
fn a_grid_that_a_field_of_the_scene_names_is_not_replaced() {
    let folder = folder();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 2).obj());
    folder.done("bake ball.obj --res 8 -o run.still.vtkhdf.sdf.h5");
    std::fs::rename(folder.at("run.still.vtkhdf.sdf.h5"), folder.at("run.still.vtkhdf")).unwrap();
    folder.write("grid.sdf.toml", "[field]\nshape = 'grid'\nfile = 'run.still.vtkhdf'\n");
    folder.write("scene.toml", SCENE.replace("ball.sdf", "grid.sdf"));
    says(
        &folder.refused("simulate scene.toml -o run.vtkhdf"),
        &["run.still.vtkhdf: would replace a file that scene.toml names"],
    );
}

#[test]
fn frames_that_are_asked_for_are_not_halved() {
    let folder = folder();
    assert_eq!(folder.json("simulate small.toml --small")["frames"], 4);
    assert_eq!(folder.json("simulate small.toml --small --frames 5")["frames"], 5);
}

#[test]
fn wrong_scenes_and_outputs_are_refused_in_one_line() {
    let folder = folder();
    folder.write("wrong.toml", SCENE.replace("thickness", "thicknes"));
    let unknown = folder.refused("simulate wrong.toml");
    assert!(unknown.contains("wrong.toml: line 5: ") && unknown.contains("thickness"), "{unknown}");
    folder.write("lost.toml", SCENE.replace("ball.sdf", "bell.sdf"));
    assert!(folder.refused("simulate lost.toml").contains("bell.sdf.toml"));
    for obstacle in ["file = 'bell.sdf.toml'", "shape = \"field = { shape = 'cone' }\"\nbecomes = ''"] {
        folder.write("second.toml", format!("{SCENE}\n[[obstacle]]\n{obstacle}\n"));
        says(&folder.refused("simulate second.toml"), &["second.toml: obstacle 2: "]);
    }
    assert!(folder.refused("simulate no.toml").contains("no.toml"));
    folder.write(
        "large.toml",
        SCENE.replace("[6, 6]", "[400, 400]").replace("thickness", "vary.speed = [0.1]\nthickness"),
    );
    // What begins slowly takes ten times as many frames.
    let recording = folder.refused("simulate large.toml -o run.html --frames 100000");
    assert!(recording.contains("a recording of 1000000 frames needs 1929") && recording.contains("TB"), "{recording}");
    assert!(!folder.at("run.html").exists());
    assert!(folder.misused("simulate small.toml -o run.gif").contains("OUT.html"));
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_told_with_the_frames_that_were_kept() {
    let folder = folder();
    // Without an obstacle, whose file would be the larger one.
    let (cloth, _) = SCENE.split_once("[[obstacle]]").unwrap();
    folder.write("small.toml", cloth.replace("frames = 8", "frames = 2000"));
    let script = format!("trap '' XFSZ; ulimit -f 200; exec {SDFTOOL} simulate small.toml -o run.vtkhdf");
    let output = Command::new("sh").args(["-c", &script]).current_dir(folder.path()).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    says(&said, &["sdftool: run.vtkhdf: the first 2 frames were kept, and no more: File too large"]);
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(folder.at("run.vtkhdf").is_file());
}
