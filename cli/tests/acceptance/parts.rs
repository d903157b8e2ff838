//! One mesh baked in parts, and grids larger than memory: the bytes of one bake, or nothing.

use std::process::{Command, Stdio};
use std::time::Duration;

use crate::folder::{Folder, SDFTOOL, says};
use crate::meshes::Model;

/// A closed body, and an open one whose hole is closed by bricks far from any triangle.
fn bodies() -> Folder {
    let folder = Folder::new();
    folder.write("closed.obj", Model::ball([0.3, 0.0, 0.0], 1.0, 4).obj());
    let ball = Model::ball([0.0; 3], 1.0, 4).obj();
    let is_face = |line: &&str| line.starts_with("f ");
    let faces = ball.lines().filter(is_face).count();
    let (mut seen, mut open) = (0, String::new());
    for line in ball.lines() {
        seen += usize::from(is_face(&line));
        if !is_face(&line) || seen <= faces * 3 / 5 {
            open += line;
            open += "\n";
        }
    }
    folder.write("open.obj", open);
    folder
}

/// Bakes all parts and joins them, the last first.
fn merged(folder: &Folder, words: &str, count: usize) -> Vec<u8> {
    let names: Vec<String> = (0..count).map(|index| format!("part{index}.h5")).collect();
    for (index, name) in names.iter().enumerate() {
        folder.done(&format!("{words} --shard {index}/{count} -o {name}"));
    }
    let reversed: Vec<&str> = names.iter().rev().map(String::as_str).collect();
    folder.done(&format!("merge {} -o merged.sdf.h5", reversed.join(" ")));
    names.iter().for_each(|name| std::fs::remove_file(folder.at(name)).unwrap());
    folder.read("merged.sdf.h5")
}

/// Checks that two files have the same bytes: of an open mesh but for the regions of large errors, which only a bake in memory has.
fn assert_same(found: &[u8], whole: &[u8], words: &str) {
    if !words.contains("open") {
        assert!(found == whole, "{words}");
        return;
    }
    let [found, mut whole] =
        [found, whole].map(|bytes| sdf_formats::grid_file::read_bytes(bytes, words).expect("a grid that was written"));
    // Pseudo-normals of an open mesh have no certain sign, and no error to tell.
    assert_ne!(whole.about.error_regions.take().is_some(), words.contains("pseudo-normal"), "{words}");
    assert!(found.about.error_regions.is_none(), "{words}");
    assert_eq!(found.about, whole.about, "{words}");
    assert!((found.grid, found.sparse, found.mesh) == (whole.grid, whole.sparse, whole.mesh), "{words}");
}

#[test]
fn parts_joined_in_any_order_are_the_bytes_of_one_bake() {
    let folder = bodies();
    let kinds = [
        ("closed", "--res 80"),
        ("closed", "--res 48 --precision f32 --compress none --keep-mesh"),
        ("closed", "--res 50 --precision u8 --band 1 --certify tight --sign winding"),
        ("open", "--res 90"),
        ("open", "--res 70 --precision f32 --keep-mesh"),
        ("open", "--res 60 --compress none --padding 0"),
        ("open", "--res 50 --sign pseudo-normal"),
    ];
    for (mesh, options) in kinds {
        let words = format!("bake {mesh}.obj --layout sparse {options}");
        folder.done(&format!("{words} -o whole.sdf.h5"));
        let whole = folder.read("whole.sdf.h5");
        for count in [1, 4] {
            assert_same(&merged(&folder, &words, count), &whole, &format!("{words} in {count} parts"));
        }
    }
    // More parts than blocks of bricks: some are empty.
    let words = "bake closed.obj --layout sparse --res 6";
    folder.done(&format!("{words} -o whole.sdf.h5"));
    assert!(merged(&folder, words, 40) == folder.read("whole.sdf.h5"));
    let ours: Vec<String> = folder.names().into_iter().filter(|name| name.contains("tmp")).collect();
    assert!(ours.is_empty(), "{ours:?}");
}

#[test]
fn a_grid_that_does_not_fit_into_memory_is_streamed_into_the_same_bytes() {
    let folder = bodies();
    for (mesh, options, memory) in [
        ("closed", "--res 160 --keep-mesh", "3500kB"),
        ("open", "--res 160 --compress none", "3500kB"),
        ("closed", "--res 110 --precision f32", "4MB"),
    ] {
        let words = format!("bake {mesh}.obj --layout sparse {options}");
        let whole = folder.json(&format!("{words} -o whole.sdf.h5"));
        let streamed = folder.json(&format!("{words} --memory {memory} -o streamed.sdf.h5"));
        assert_eq!((whole.get("streamed"), &streamed["streamed"]), (None, &true.into()), "{words}");
        assert!(folder.read("streamed.sdf.h5") == folder.read("whole.sdf.h5"), "{words}");
        assert_eq!(whole["error_regions"].is_null(), mesh == "closed", "{words}");
        for key in ["bricks", "error_bound", "error_regions", "median_error_bound", "slope_bound", "stored_cells"] {
            assert_eq!(whole[key], streamed[key], "{key} of {words}");
        }
    }
    // The grid replaces the one before it, and there is no page.
    let view = "bake closed.obj --layout sparse --res 160 --memory 3500kB -o streamed.sdf.h5 --view page.html";
    says(&folder.refused(view), &["streamed.sdf.h5: is written, but too large for --view"]);
    says(&folder.refused("bake closed.obj --layout sparse --res 160 --memory 1MB"), &["--memory allows", " bricks"]);
    says(&folder.wrong_usage("bake closed.obj --res 8 --memory much"), &["--memory", "500MB"]);
    says(&folder.refused("bake closed.obj --res 64 --memory 100kB"), &["--memory allows", "--layout sparse"]);
}

/// A grid for standard output is baked in memory.
#[test]
fn a_large_grid_is_streamed_into_the_bytes_of_a_bake_in_memory() {
    let folder = bodies();
    for options in [
        "closed.obj --keep-mesh",
        "closed.obj --precision f32 --compress none --threads 1",
        "open.obj",
        "open.obj --precision f32 --keep-mesh --threads 1",
    ] {
        let words = format!("bake --layout sparse --res 240 {options}");
        let streamed = folder.json(&format!("{words} -o ball.sdf.h5 --view page.html"));
        assert_eq!(streamed["streamed"], true, "{words}");
        let whole = folder.sdftool(&format!("{words} -o -")).output().unwrap();
        assert!(whole.stdout == folder.read("ball.sdf.h5"), "{words}");
        folder.done("view ball.sdf.h5 -o again.html");
        assert!(folder.read("page.html") == folder.read("again.html"), "{words}");
    }
}

/// The memory for a mesh's faces is the same in memory and streamed, and no smaller grid saves it.
#[test]
fn many_faces_do_not_make_a_small_grid_large() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 7).obj());
    let words = "bake ball.obj --layout sparse --res 4 --padding 0";
    let baked = folder.json(words);
    assert!(baked["triangles"].as_u64().unwrap() > 60_000, "{baked}");
    assert_eq!(baked.get("streamed"), None);
    let line = folder.refused(&format!("{words} --memory 8MB"));
    says(&line, &["--memory allows", "are for the mesh's faces, at any --res", "a larger --memory", "--layout dense"]);
    assert!(!line.contains("smaller --res") && !line.contains("--precision"), "{line}");
}

#[test]
fn parts_that_do_not_make_one_grid_are_refused_by_name() {
    let folder = bodies();
    let bake = |mesh: &str, words: &str, name: &str| {
        folder.done(&format!("bake {mesh}.obj --layout sparse {words} -o {name}"));
    };
    bake("closed", "--res 20 --shard 0/2", "a.h5");
    bake("closed", "--res 20 --shard 1/2", "b.h5");
    bake("open", "--res 20 --shard 1/2", "mesh.h5");
    bake("closed", "--res 21 --shard 1/2", "options.h5");
    bake("closed", "--res 20 --shard 1/2 --compress none", "packing.h5");
    bake("closed", "--res 20 --shard 1/3", "count.h5");
    bake("closed", "--res 20", "whole.h5");
    folder.write("out.sdf.h5", "old");
    for (parts, what) in [
        ("a.h5", &["a.h5: is one of 2 parts, and part 1/2 is missing"][..]),
        ("a.h5 b.h5 a.h5", &["a.h5: is part 0/2, and so is a.h5"]),
        ("a.h5 mesh.h5", &["mesh.h5: is of another mesh than a.h5: open.obj, there closed.obj"]),
        ("a.h5 options.h5", &["options.h5: ", "options --res 21", "there --res 20"]),
        ("a.h5 packing.h5", &["packing.h5: ", "--compress none, there deflate"]),
        ("a.h5 count.h5", &["count.h5: ", "number of parts 3, there 2"]),
        ("a.h5 whole.h5", &["whole.h5: a whole grid, not a part"]),
        ("a.h5 closed.obj", &["closed.obj: not an HDF5 file"]),
        ("a.h5 none.h5", &["none.h5: No such file"]),
    ] {
        says(&folder.refused(&format!("merge {parts} -o out.sdf.h5")), what);
        assert_eq!(folder.read("out.sdf.h5"), b"old", "{parts}");
    }
    says(&folder.refused("merge a.h5 b.h5 -o a.h5"), &["a.h5: would replace a.h5"]);
    for words in ["info a.h5", "contacts closed.obj a.h5", "verify a.h5 closed.obj", "view a.h5"] {
        says(
            &folder.refused(words),
            &["a.h5: part 0/2 of a bake, not a whole grid; join all 2 parts by `sdftool merge`"],
        );
    }
    for (words, what) in [
        ("--res 8 --shard 0/2", "--layout sparse"),
        ("--max-error 1% --shard 0/2", "--res or --voxel-size"),
        ("--res 8 --layout sparse --shard 0/2 --view page.html", "merge the parts"),
    ] {
        says(&folder.wrong_usage(&format!("bake closed.obj {words}")), &["--", what]);
    }
    says(&folder.misused("bake closed.obj --res 8 --layout sparse --shard 0/2 -o -"), &["--shard", "-o"]);
    // Without a name, a part has its number.
    folder.done("bake closed.obj --res 8 --layout sparse --shard 1/2");
    assert!(folder.names().contains(&"closed.part-1-of-2.h5".to_owned()));
}

/// A part is a file like any other to those who damage it: each change is noticed or changes nothing.
#[test]
fn a_byte_of_a_part_that_changed_never_goes_unnoticed() {
    let folder = bodies();
    let words = "bake closed.obj --layout sparse --res 6 --keep-mesh";
    folder.done(&format!("{words} -o whole.sdf.h5"));
    folder.done(&format!("{words} --shard 0/1 -o part.h5"));
    let (part, whole) = (folder.read("part.h5"), folder.read("whole.sdf.h5"));
    // A step that meets all places of a number.
    for at in (0..part.len()).step_by((part.len() / 150) | 1) {
        let mut bytes = part.clone();
        bytes[at] ^= 0x15;
        folder.write("part.h5", &bytes);
        let _ = std::fs::remove_file(folder.at("merged.sdf.h5"));
        let output = folder.sdftool("merge part.h5 -o merged.sdf.h5").output().unwrap();
        match output.status.code() {
            Some(0) => assert!(folder.read("merged.sdf.h5") == whole, "byte {at} of {}", part.len()),
            Some(1) => assert!(!folder.at("merged.sdf.h5").exists()),
            status => panic!("byte {at}: {status:?}, {}", String::from_utf8_lossy(&output.stderr)),
        }
    }
    folder.write("part.h5", &part[..part.len() / 2]);
    says(&folder.refused("merge part.h5 -o merged.sdf.h5"), &["part.h5: ", "damaged"]);
}

#[test]
fn a_streamed_bake_that_is_killed_leaves_the_old_file_and_the_next_clears_up() {
    let folder = bodies();
    let words = "bake closed.obj --layout sparse --res 160 --memory 3500kB -o out.sdf.h5";
    folder.write("out.sdf.h5", "old");
    let before = folder.names();
    for pause in [0, 20, 60, 120] {
        let mut bake = Command::new(SDFTOOL)
            .args(words.split(' '))
            .current_dir(folder.path())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        while folder.names() == before && bake.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_millis(pause));
        // SIGKILL.
        bake.kill().unwrap();
        let is_done = bake.wait().unwrap().success();
        assert!(is_done || folder.read("out.sdf.h5") == b"old", "after {pause} ms");
        folder.write("out.sdf.h5", "old");
    }
    folder.done(words);
    assert_eq!(folder.names(), before);
    folder.done("info out.sdf.h5");
}
