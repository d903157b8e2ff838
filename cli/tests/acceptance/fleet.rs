//! Many meshes in one command: nothing lost, nothing partial, nothing baked twice.

use std::process::{Child, Command, Stdio};

use serde_json::Value;

use crate::folder::{Folder, SDFTOOL, says};
use crate::meshes::Model;

/// Balls `mesh/0.obj` and on, and `list.txt` of them.
fn fleet(count: usize) -> Folder {
    let folder = Folder::new();
    std::fs::create_dir(folder.at("mesh")).unwrap();
    let names: Vec<String> = (0..count).map(|index| format!("mesh/{index}.obj")).collect();
    for (index, name) in names.iter().enumerate() {
        folder.write(name, Model::ball([0.0; 3], 1.0 + index as f64, 2).obj());
    }
    folder.write("list.txt", names.join("\n") + "\n# done\n\n");
    folder
}

/// One object a line.
fn objects(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"))).collect()
}

fn with_status<'a>(objects: &'a [Value], status: &str) -> Vec<&'a Value> {
    objects.iter().filter(|object| object["status"] == status).collect()
}

#[test]
fn each_mesh_has_its_grid_and_its_line_and_a_failure_stops_no_other() {
    let folder = fleet(4);
    folder.write("mesh/broken.obj", "v 0 0 zero\n");
    let words = "bake mesh/0.obj mesh/broken.obj mesh/1.obj mesh/missing.obj --res 8 --out-dir out --jobs 2 --json";
    let output = folder.sdftool(words).output().unwrap();
    assert_eq!(output.status.code(), Some(3), "some");
    let lines = objects(&String::from_utf8(output.stdout).unwrap());
    assert_eq!((lines.len(), with_status(&lines, "baked").len()), (4, 2));
    let failed = with_status(&lines, "failed");
    assert!(failed.iter().any(|line| line["error"].as_str().unwrap().contains("broken.obj")), "{failed:?}");
    says(&String::from_utf8_lossy(&output.stderr), &["2 of 4 meshes were not baked"]);
    for name in ["0", "1"] {
        folder.done(&format!("verify out/{name}.sdf.h5 mesh/{name}.obj --points 100"));
        // The same bytes as a bake by itself.
        folder.done(&format!("bake mesh/{name}.obj --res 8"));
        assert!(folder.read(&format!("{name}.sdf.h5")) == folder.read(&format!("out/{name}.sdf.h5")));
    }
    // A field is no mesh, wherever it stands.
    for words in ["out/0.sdf.h5 mesh/1.obj", "mesh/1.obj out/0.sdf.h5"] {
        let output = folder.sdftool(&format!("bake {words} --res 8 --out-dir out")).output().unwrap();
        assert_eq!(output.status.code(), Some(3), "{words}");
    }
    let none = folder.sdftool("bake mesh/broken.obj mesh/missing.obj --res 8 --out-dir out").output().unwrap();
    assert_eq!(none.status.code(), Some(1), "none");
    // A byte order mark is no part of a name.
    let list = [b"\xef\xbb\xbf", &folder.read("list.txt")[..]].concat();
    std::fs::write(folder.at("list.txt"), list).unwrap();
    says(&folder.done("bake --list list.txt --res 8 --out-dir out"), &["out/3.sdf.h5: ", "4 baked, 0 kept, 0 failed"]);
}

/// Names on Unix are bytes.
#[cfg(unix)]
#[test]
fn a_name_in_a_list_that_is_not_utf_8_stops_no_other_mesh() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let folder = fleet(2);
    let name = OsStr::from_bytes(b"mesh/b\xe9.obj");
    let list = [&folder.read("list.txt")[..], name.as_bytes(), b"\r\nmesh/\xff.obj\n# \xfe\n"].concat();
    folder.write("list.txt", list);
    // A disk may take names in UTF-8 alone.
    let has_name = std::fs::copy(folder.at("mesh/0.obj"), folder.path().join(name)).is_ok();
    let output = folder.sdftool("bake --list list.txt --res 8 --out-dir out --json").output().unwrap();
    assert_eq!(output.status.code(), Some(3), "some");
    let lines = objects(&String::from_utf8(output.stdout).unwrap());
    assert_eq!((lines.len(), with_status(&lines, "baked").len()), (4, if has_name { 3 } else { 2 }));
    assert_eq!(has_name, folder.path().join(OsStr::from_bytes(b"out/b\xe9.sdf.h5")).exists());
}

#[test]
fn what_is_baked_again_is_what_changed() {
    let folder = fleet(3);
    let kept = |words: &str| -> Vec<String> {
        let lines = objects(&folder.done(&format!("bake --list list.txt --out-dir out --resume --json {words}")));
        with_status(&lines, "kept").iter().map(|line| line["mesh"].as_str().unwrap().to_owned()).collect()
    };
    assert!(kept("--res 8").is_empty());
    assert_eq!(kept("--res 8").len(), 3);
    folder.write("mesh/1.obj", Model::ball([0.0; 3], 7.0, 2).obj());
    assert_eq!(kept("--res 8"), ["mesh/0.obj", "mesh/2.obj"]);
    folder.write("out/2.sdf.h5", "half a grid");
    assert_eq!(kept("--res 8"), ["mesh/0.obj", "mesh/1.obj"]);
    assert!(kept("--res 9").is_empty(), "other options");
    assert_eq!(kept("--res 9 --shard 1/2"), ["mesh/1.obj"]);
}

#[test]
fn a_damaged_grid_is_baked_anew() {
    let folder = fleet(1);
    for words in ["--res 40", "--res 40 --precision u8", "--res 40 --layout sparse --keep-mesh"] {
        let bake = || objects(&folder.done(&format!("bake --list list.txt --out-dir out --resume --json {words}")));
        assert_eq!(bake()[0]["status"], "baked", "{words}");
        let samples = |name: &str| {
            folder.done(&format!("export out/0.sdf.h5 -o {name}"));
            folder.read(name)
        };
        let (whole, of_whole) = (folder.read("out/0.sdf.h5"), samples("whole.npy"));
        // In tenths of the file: samples, coarse grid and mesh. Some bytes between them have no meaning.
        let mut anew = 0;
        for tenth in 1..10 {
            let mut damaged = whole.clone();
            damaged[whole.len() * tenth / 10..][..50].fill(0xa5);
            folder.write("out/0.sdf.h5", damaged);
            if bake()[0]["status"] == "kept" {
                assert!(samples("kept.npy") == of_whole, "{words}: damaged at {tenth} tenths");
                continue;
            }
            anew += 1;
            assert!(folder.read("out/0.sdf.h5") == whole, "{words}");
            assert_eq!(bake()[0]["status"], "kept", "{words}");
        }
        assert!(anew > 5, "{words}: {anew}");
    }
}

#[test]
fn a_fleet_that_cannot_be_is_refused_before_it_begins() {
    let folder = fleet(2);
    folder.write("0.obj", "");
    says(&folder.refused("bake mesh/0.obj 0.obj --res 8"), &["mesh/0.obj and 0.obj", "./0.sdf.h5"]);
    says(&folder.misused("bake mesh/0.obj mesh/1.obj --res 8 -o x.sdf.h5"), &["-o", "--out-dir"]);
    folder.write("empty.txt", "# nothing\n");
    says(&folder.refused("bake --list empty.txt --res 8"), &["empty.txt: no meshes"]);
    says(&folder.wrong_usage("bake --res 8"), &["a mesh is needed"]);
    says(&folder.wrong_usage("bake --list list.txt --res 8 --shard 2/2"), &["0 to N - 1"]);
}

/// A worker that bakes its share, slowed down so that it is killed in its middle.
fn worker(folder: &Folder, shard: usize) -> Child {
    let mut command = Command::new(SDFTOOL);
    let shard = format!("{shard}/3");
    command.args(["bake", "--list", "list.txt", "--res", "40", "--out-dir", "out", "--resume", "--shard", &shard]);
    command.current_dir(folder.path()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

#[test]
fn workers_that_are_killed_lose_nothing_and_the_next_run_does_the_rest() {
    let folder = fleet(30);
    let mut workers: Vec<Child> = (0..3).map(|shard| worker(&folder, shard)).collect();
    let grids = || {
        let names = std::fs::read_dir(folder.at("out")).into_iter().flatten().flatten();
        names.filter(|entry| entry.file_name().to_string_lossy().ends_with(".sdf.h5")).count()
    };
    while grids() < 4 && workers.iter_mut().any(|worker| worker.try_wait().unwrap().is_none()) {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    // SIGKILL.
    workers.iter_mut().for_each(|worker| worker.kill().unwrap());
    workers.iter_mut().for_each(|worker| assert!(!worker.wait().unwrap().success(), "it was done already"));
    let there = grids();
    assert!((4..30).contains(&there), "{there}");
    let run = || objects(&folder.done("bake --list list.txt --res 40 --out-dir out --resume --jobs 2 --json"));
    let lines = run();
    assert_eq!((with_status(&lines, "kept").len(), with_status(&lines, "baked").len()), (there, 30 - there));
    assert_eq!(with_status(&run(), "kept").len(), 30);
    folder.write("origin.csv", "0,0,0\n");
    (0..30).for_each(|index| drop(folder.done(&format!("eval out/{index}.sdf.h5 --points origin.csv"))));
    // What the killed left of targets that the last run wrote is gone.
    let names: Vec<String> = std::fs::read_dir(folder.at("out"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    assert_eq!(names.len(), 30, "{names:?}");
}

#[test]
fn the_time_to_read_is_told_of_each_mesh() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 5).obj());
    let document = folder.json("bake ball.obj --res 8 --out-dir grids");
    // What SHA-256 of the file takes at 3 GB/s; without the time to read it was 8e-6.
    assert!(document["seconds"]["read"].as_f64().unwrap() > folder.read("ball.obj").len() as f64 / 3e9, "{document}");
}
