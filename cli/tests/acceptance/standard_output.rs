//! `-o -`: the file goes to standard output and the report to standard error, so that commands can be joined by pipes.

use std::process::{Command, ExitStatus, Stdio};

use crate::folder::{Folder, SDFTOOL, says};
use crate::meshes::Model;

fn scene() -> Folder {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    folder.write("other.obj", Model::ball([0.0, 0.0, 1.5], 1.0, 3).obj());
    folder.done("bake ball.obj --res 16");
    folder.done("bake other.obj --res 16");
    folder
}

/// Standard output and standard error of a run that must succeed and leave no file.
fn piped(folder: &Folder, words: &str) -> (Vec<u8>, String) {
    let before = folder.names();
    let assert = folder.sdftool(words).assert().success();
    assert_eq!(folder.names(), before, "{words}: left files behind");
    let output = assert.get_output();
    (output.stdout.clone(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn a_dash_writes_what_the_file_would_hold() {
    let folder = scene();
    for (words, name) in [
        ("contacts other.obj ball.sdf.h5 --margin 0.1", "contacts.csv"),
        ("contacts other.sdf.h5 ball.sdf.h5 --resolution 0.1", "overlap.csv"),
        ("surface ball.sdf.h5", "surface.obj"),
        ("slice ball.sdf.h5 --pixels 32", "slice.png"),
        ("bake ball.obj --res 16", "again.sdf.h5"),
        ("bake ball.obj --res 16 --compress none", "none.sdf.h5"),
        ("export ball.sdf.h5 --format npy", "ball.npy"),
        ("import ball.npy --spacing 0.1", "imported.sdf.h5"),
        ("export ball.sdf.h5 --format vtkhdf", "ball.vtkhdf"),
    ] {
        folder.done(&format!("{words} -o {name}"));
        let (bytes, report) = piped(&folder, &format!("{words} -o -"));
        assert!(bytes == folder.read(name), "{words}: {} bytes", bytes.len());
        assert!(bytes.len() > 100 && report.lines().count() >= 2, "{words}: {report}");
    }
    let (_, report) = piped(&folder, "surface ball.sdf.h5 -o -");
    says(&report, &["triangles", "standard output"]);
}

#[test]
fn commands_are_joined_by_pipes() {
    let folder = scene();
    let (mesh, _) = piped(&folder, "surface ball.sdf.h5 -o -");
    let assert =
        folder.sdftool("contacts - other.sdf.h5 --elements vertices -o -").write_stdin(mesh.clone()).assert().success();
    let found = String::from_utf8_lossy(&assert.get_output().stdout).into_owned();
    let (grid, _) = piped(&folder, "bake ball.obj --res 16 -o -");
    let assert = folder.sdftool("surface - -o -").write_stdin(grid).assert().success();
    assert!(assert.get_output().stdout == mesh);
    folder.done("surface ball.sdf.h5 -o surface.obj");
    folder.done("contacts surface.obj other.sdf.h5 --elements vertices -o contacts.csv");
    assert!(found.lines().count() > 10);
    assert_eq!(found.as_bytes(), folder.read("contacts.csv"));
}

#[test]
fn two_things_on_standard_output_are_refused() {
    let folder = scene();
    for words in [
        "bake ball.obj --res 16",
        "contacts other.obj ball.sdf.h5",
        "contacts other.sdf.h5 ball.sdf.h5",
        "surface ball.sdf.h5",
        "slice ball.sdf.h5",
        "export ball.sdf.h5 --format npy",
    ] {
        let line = folder.sdftool(&format!("{words} -o - --json")).assert().code(2);
        let line = String::from_utf8_lossy(&line.get_output().stderr).into_owned();
        says(&line, &["--output - and --json", "name a file"]);
    }
    says(&folder.misused("export ball.sdf.h5 --format raw -o -"), &["two files"]);
    says(&folder.misused("export ball.sdf.h5 -o -"), &["--format"]);
}

#[test]
fn a_dash_for_several_files_is_refused_and_a_folder_of_any_name_is_not() {
    let folder = scene();
    for words in ["man -o -", "demo -o -", "bake ball.obj --res 8 --out-dir -"] {
        says(
            &folder.wrong_usage(words),
            &["invalid value '-'", "standard output takes one: give the name of a folder"],
        );
    }
    says(
        &folder.wrong_usage("simulate scene.toml -o -"),
        &["invalid value '-'", "name OUT.vtkhdf, OUT.html, OUT.png or a folder"],
    );
    says(&folder.wrong_usage("view ball.sdf.h5 -o -"), &["invalid value '-'", "use a name that ends in .html"]);
    says(&folder.misused("merge ball.sdf.h5 -o -"), &["merge writes a file: name one with -o"]);
    // A path that looks like an option is a path to the end.
    folder.done("demo -o=-x");
    assert!(folder.at("-x/contacts.png").is_file());
}

/// The exit status of a run whose standard output nobody reads.
fn unread(folder: &Folder, words: &str) -> ExitStatus {
    let mut command = Command::new(SDFTOOL);
    command.args(words.split(' ')).current_dir(folder.path()).stderr(Stdio::null()).stdout(Stdio::piped());
    let mut child = command.spawn().unwrap();
    drop(child.stdout.take());
    child.wait().unwrap()
}

#[test]
fn work_and_verdict_do_not_depend_on_a_reader() {
    let folder = scene();
    for options in ["", " --json"] {
        assert!(unread(&folder, &format!("info ball.sdf.h5{options}")).success());
        assert!(unread(&folder, &format!("verify ball.sdf.h5 ball.obj --points 100{options}")).success());
        let status = unread(&folder, &format!("verify ball.sdf.h5 other.obj --points 100{options}"));
        assert_eq!(status.code(), Some(1), "verify{options}");
        let words = format!("bake ball.obj missing.obj other.obj --res 8 --out-dir out --threads 1{options}");
        assert_eq!(unread(&folder, &words).code(), Some(3), "bake{options}");
        let out = ["out/ball.sdf.h5", "out/other.sdf.h5"];
        assert!(out.iter().all(|name| folder.at(name).is_file()), "{:?}", folder.names());
        std::fs::remove_dir_all(folder.at("out")).unwrap();
    }
}

/// A shell opened the file, and what it and others write there must stay.
#[cfg(target_os = "linux")]
#[test]
fn a_device_that_stands_for_a_file_is_not_replaced() {
    let folder = scene();
    std::os::unix::fs::symlink("/dev/stdout", folder.at("link.npy")).unwrap();
    for (words, name) in [
        ("export ball.sdf.h5 --format npy", "/dev/stdout"),
        ("export ball.sdf.h5 --format npy", "/proc/self/fd/1"),
        ("export ball.sdf.h5 --format npy", "/dev/fd/1"),
        ("export ball.sdf.h5", "link.npy"),
    ] {
        let script = format!("(echo before; {} {words} -o {name}; echo after) > all.bin", SDFTOOL);
        let output = Command::new("sh").args(["-c", &script]).current_dir(folder.path()).output().unwrap();
        says(&String::from_utf8_lossy(&output.stderr), &[name, "is not a regular file"]);
        assert_eq!(folder.read("all.bin"), b"before\nafter\n", "{name}");
    }
}

/// Where standard error cannot be written to, the work is done and the status says how it ended.
#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_error_changes_no_status() {
    let folder = scene();
    folder.write("junk.obj", "f 1 2 3\n");
    let status = |words: &str| {
        let script = format!("exec {} {words} 2>/dev/full", SDFTOOL);
        let mut command = Command::new("sh");
        command.args(["-c", &script]).current_dir(folder.path()).output().unwrap().status.code()
    };
    assert_eq!(status("info missing.sdf.h5"), Some(1));
    // With a warning: this level has an end at the box.
    assert_eq!(status("surface ball.sdf.h5 --level 0.3 -o open.obj"), Some(0));
    assert_eq!(status("bake junk.obj ball.obj other.obj --res 8 --out-dir grids"), Some(3));
    assert!(["open.obj", "grids/ball.sdf.h5", "grids/other.sdf.h5"].iter().all(|name| folder.at(name).is_file()));
}
