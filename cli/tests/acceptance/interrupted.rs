//! Promise 12: a write that fails or is killed leaves the old file as it was, and Ctrl-C leaves nothing behind.

#![cfg(unix)]

use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::folder::{Folder, SDFTOOL, says};
use crate::meshes::Model;

const OLD: &[u8] = b"what was there before";

/// Commands that write, with the file that each writes.
const WRITERS: [(&str, &str); 10] = [
    ("bake ball.obj --res 64", "ball.sdf.h5"),
    ("bake ball.obj --res 128 --layout sparse", "ball.sdf.h5"),
    ("contacts sheet.obj small.sdf.h5 --margin 9 -o list.csv", "list.csv"),
    ("contacts sheet.obj small.sdf.h5 --margin 9 -o list.json", "list.json"),
    ("contacts sheet.obj small.sdf.h5 --margin 9 -o list.ply", "list.ply"),
    ("contacts sheet.obj small.sdf.h5 --margin 9 -o list.h5", "list.h5"),
    ("slice small.sdf.h5 -o slice.png --pixels 2048", "slice.png"),
    ("surface small.sdf.h5 -o surface.stl --res 80", "surface.stl"),
    ("export small.sdf.h5 -o small.npy", "small.npy"),
    ("view small.sdf.h5", "small.html"),
];

fn scene() -> Folder {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 4).obj());
    folder.write("sheet.obj", Model::hills(20).obj());
    folder.done("bake ball.obj --res 10 --padding 50 -o small.sdf.h5");
    folder
}

/// Runs the program with files limited to 4 KiB.
fn with_small_files(folder: &Folder, words: &str) -> Output {
    let script = format!("ulimit -f 8; exec {SDFTOOL} {words}");
    Command::new("sh").args(["-c", &script]).current_dir(folder.path()).output().unwrap()
}

#[test]
fn a_file_that_may_not_grow_is_told_and_leaves_the_old_file_and_no_other() {
    let folder = scene();
    for (words, name) in WRITERS {
        folder.write(name, OLD);
        let before = folder.names();
        let output = with_small_files(&folder, words);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{words}: {said}");
        let lines: Vec<&str> = said.lines().collect();
        assert_eq!(lines.len(), 1, "{words}: {said}");
        says(lines[0], &["sdftool: ", name, "File too large"]);
        assert!(output.stdout.is_empty(), "{words}: reported success");
        assert!(folder.read(name) == OLD && folder.names() == before, "{words}");
    }
    let output = with_small_files(&folder, "demo -o demo");
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(std::fs::read_dir(folder.at("demo")).unwrap().count(), 0);
}

/// The program, with no signal ignored: what runs the tests may ignore some, as shells do for jobs in the background.
fn program(folder: &Folder) -> Command {
    let mut command = Command::new("env");
    command.args(cfg!(target_os = "linux").then_some("--default-signal=HUP,INT,TERM"));
    command.arg(SDFTOOL).current_dir(folder.path());
    command
}

/// Kills the program as soon as its temporary file has content; `false` if it ended before.
fn is_killed_in_a_write(folder: &Folder, words: &str) -> bool {
    // What earlier ones left.
    let before = folder.names();
    let mut child = program(folder).args(words.split_whitespace()).stdout(Stdio::null()).spawn().unwrap();
    let has_content = |name: &String| {
        let file = folder.at(name).join("file");
        name.ends_with(".tmp") && std::fs::metadata(file).is_ok_and(|file| file.len() > 0)
    };
    while !folder.names().iter().any(|name| !before.contains(name) && has_content(name)) {
        if child.try_wait().unwrap().is_some() {
            return false;
        }
        // Lets the program run where there is one processor, and comes back in the middle of a write.
        sleep(Duration::from_micros(20));
    }
    child.kill().unwrap();
    child.wait().unwrap().signal() == Some(9)
}

#[test]
fn a_program_killed_in_the_middle_of_a_write_leaves_the_old_file() {
    let folder = scene();
    for (words, name) in WRITERS {
        // Where the kill comes too late, the new file is there, whole.
        let is_killed = (0..100).any(|_| {
            folder.write(name, OLD);
            is_killed_in_a_write(&folder, words) && folder.read(name) == OLD
        });
        assert!(is_killed, "{words}: the write is too short to be killed");
        // The next run is not disturbed by leftover files, and removes them.
        let names = folder.names();
        assert!(names.iter().any(|name| name.ends_with(".tmp")), "{words}: nothing is left behind");
        folder.done(words);
        assert!(folder.read(name) != OLD, "{words}");
        let left: Vec<String> = folder.names().into_iter().filter(|name| name.ends_with(".tmp")).collect();
        assert_eq!(left, [] as [&str; 0], "{words}");
    }
}

#[test]
fn a_target_that_cannot_be_replaced_is_refused_before_any_work() {
    let folder = scene();
    for (words, name) in WRITERS {
        std::fs::create_dir(folder.at(name)).unwrap();
        says(&folder.refused(words), &[name, "is a folder"]);
        std::fs::remove_dir(folder.at(name)).unwrap();
        let words = format!("{} -o missing/{name}", words.split(" -o ").next().unwrap());
        says(&folder.refused(&words), &["missing", "No such file or directory"]);
        let words = words.replace("missing/", "ball.obj/");
        says(&folder.refused(&words), &["ball.obj", "folder"]);
    }
    says(&folder.refused("demo -o ball.obj"), &["ball.obj"]);
    std::os::unix::fs::symlink("/dev/null", folder.at("null.png")).unwrap();
    says(&folder.refused("slice small.sdf.h5 -o null.png"), &["null.png", "not a regular file"]);
    // The link leads into a folder that does not exist. The error names it, not the mesh, which does not exist either.
    std::os::unix::fs::symlink("missing/there.sdf.h5", folder.at("link.sdf.h5")).unwrap();
    says(&folder.refused("bake none.obj --res 8 -o link.sdf.h5"), &["link.sdf.h5", "cannot be written"]);
}

#[test]
fn a_read_only_target_is_refused_before_any_work() {
    use std::os::unix::fs::PermissionsExt;
    let folder = scene();
    for (words, name) in WRITERS {
        folder.write(name, OLD);
        std::fs::set_permissions(folder.at(name), std::fs::Permissions::from_mode(0o444)).unwrap();
        let line = folder.refused(words);
        assert_eq!(line, format!("{name}: is read-only: make it writable, or choose another name with -o"), "{words}");
        assert!(folder.read(name) == OLD, "{words}");
        std::fs::remove_file(folder.at(name)).unwrap();
    }
}

/// A running bake that will replace an old file.
struct Baking {
    child: Child,
    folder: Folder,
    before: Vec<String>,
}

impl Baking {
    fn start(model: &Model, res: u32, words: &str) -> Self {
        let folder = Folder::new();
        folder.write("mesh.obj", model.obj());
        folder.write("mesh.sdf.h5", OLD);
        let before = folder.names();
        let mut command = program(&folder);
        command.args(format!("bake mesh.obj --padding 0 --res {res} {words}").split_whitespace());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        Self { child: command.spawn().unwrap(), folder, before }
    }

    /// Waits until the temporary file exists or the bake has ended.
    fn wait_for_write(&mut self) {
        let deadline = Instant::now() + Duration::from_secs(120);
        while self.folder.names() == self.before && self.child.try_wait().unwrap().is_none() {
            assert!(Instant::now() < deadline, "wrote nothing");
            sleep(Duration::from_micros(200));
        }
    }

    /// Sends a signal, unless the bake has ended.
    fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        let _ = Command::new("kill").args([&format!("-{name}"), &id]).stderr(Stdio::null()).status().unwrap();
    }

    fn end(self) -> (Output, Folder, Vec<String>) {
        (self.child.wait_with_output().unwrap(), self.folder, self.before)
    }

    fn assert_interrupted(self, status: i32) {
        let (output, folder, before) = self.end();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((output.status.code(), said.as_str()), (Some(status), ""));
        assert!(output.stdout.is_empty());
        assert!(folder.read("mesh.sdf.h5") == OLD, "the old file is gone");
        assert_eq!(folder.names(), before);
    }
}

/// Waits until the program handles the signal.
fn wait_for_handler(child: &Child) {
    wait_for_block(child, 2);
}

/// Waits until the program has blocked this signal.
#[cfg(target_os = "linux")]
fn wait_for_block(child: &Child, signal: u32) {
    let deadline = Instant::now() + Duration::from_secs(60);
    let catches = || {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let blocked = status.lines().find_map(|line| line.strip_prefix("SigBlk:")).map(str::trim).unwrap_or("0");
        u64::from_str_radix(blocked, 16).unwrap() >> (signal - 1) & 1 == 1
    };
    while !catches() {
        assert!(Instant::now() < deadline);
        sleep(Duration::from_millis(1));
    }
}

#[cfg(not(target_os = "linux"))]
fn wait_for_block(_: &Child, _: u32) {
    sleep(Duration::from_millis(500));
}

#[test]
fn a_signal_to_end_during_a_bake_leaves_nothing_behind_and_is_told_by_the_status() {
    let cases = [("--threads 1", "INT", 130), ("--sign winding", "INT", 130), ("", "TERM", 143), ("", "HUP", 129)];
    for (words, signal, status) in cases {
        let baking = Baking::start(&Model::ball([0.0; 3], 1.0, 5), 300, words);
        wait_for_handler(&baking.child);
        sleep(Duration::from_millis(100));
        baking.signal(signal);
        baking.assert_interrupted(status);
    }
}

/// As `nohup` and shells do.
#[cfg(target_os = "linux")]
#[test]
fn a_signal_that_the_program_is_started_to_ignore_does_not_end_it() {
    for signal in ["HUP", "INT"] {
        let folder = Folder::new();
        folder.write("mesh.obj", Model::ball([0.0; 3], 1.0, 4).obj());
        let script = format!("trap '' {signal}; exec {SDFTOOL} bake mesh.obj --res 150");
        let mut command = Command::new("sh");
        command.args(["-c", &script]).current_dir(folder.path()).stdout(Stdio::null());
        let mut child = command.spawn().unwrap();
        wait_for_block(&child, 15);
        let id = child.id().to_string();
        assert!(Command::new("kill").args([&format!("-{signal}"), &id]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(0), "{signal}");
        assert!(folder.at("mesh.sdf.h5").is_file());
    }
}

/// Times after the start of a write at which it is interrupted, in milliseconds. A write takes about 60; where the signal comes too
/// late, the new file must be complete.
const DELAYS: [u64; 8] = [0, 0, 3, 7, 12, 20, 35, 60];

#[test]
fn ctrl_c_during_a_write_leaves_one_file_whole_and_no_other() {
    let mut in_time = 0;
    for delay in DELAYS {
        let mut baking = Baking::start(&Model::cube(), 120, "");
        baking.wait_for_write();
        sleep(Duration::from_millis(delay));
        baking.signal("INT");
        let (output, folder, before) = baking.end();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((said.as_str(), folder.names()), ("", before), "after {delay} ms");
        if folder.read("mesh.sdf.h5") == OLD {
            assert_eq!(output.status.code(), Some(130), "after {delay} ms");
            assert!(output.stdout.is_empty(), "reported success");
            in_time += 1;
        } else {
            assert!(matches!(output.status.code(), Some(0 | 130)), "after {delay} ms");
            folder.done("verify mesh.sdf.h5 mesh.obj --points 100");
        }
    }
    assert!(in_time >= 2, "{in_time}: the write is too short to be interrupted");
}

/// A scene that runs for hours.
const LONG: &str = r#"
title = "A sheet that falls for ever"
frames = 1000000
substeps = 4

[[cloth]]
mesh.sheet = { cells = [12, 12], size = [1.0, 1.0], height = 1.0, bend = 0.0, floor = 0.0 }

[[obstacle]]
shape = 'field = { shape = "sphere", radius = 0.2 }'
"#;

#[test]
fn a_signal_during_a_run_leaves_a_recording_that_opens() {
    let cases =
        [("run.html", "INT", 130), ("run.png", "TERM", 143), ("run.vtkhdf", "HUP", 129), ("frames/", "INT", 130)];
    for (output, signal, status) in cases {
        let folder = Folder::new();
        folder.write("long.toml", LONG);
        let mut command = program(&folder);
        command.args(["simulate", "long.toml", "-o", output, "--threads", "1"]);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let first = if output == "frames/" { folder.at("frames/still.obj") } else { folder.at(output) };
        let deadline = Instant::now() + Duration::from_secs(120);
        while !first.exists() {
            assert!(Instant::now() < deadline && child.try_wait().unwrap().is_none(), "{output}: nothing was recorded");
            sleep(Duration::from_millis(5));
        }
        sleep(Duration::from_millis(100));
        let id = child.id().to_string();
        assert!(Command::new("kill").args([&format!("-{signal}"), &id]).status().unwrap().success());
        let output_of = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output_of.stderr).into_owned();
        assert_eq!(output_of.status.code(), Some(status), "{output}: {said}");
        assert!(output_of.stdout.is_empty(), "{output}: reported success");
        let frames =
            said.split("after ").nth(1).and_then(|rest| rest.split(' ').next()?.parse::<usize>().ok()).unwrap();
        assert!(frames > 0, "{said}");
        // Pictures of a file, the start and the end among them.
        let most = [("run.html", 150), ("run.png", 60)].into_iter().find(|(name, _)| *name == output);
        let kept = most.map_or(frames + 1, |(_, most)| frames.div_ceil(frames.div_ceil(most - 1)) + 1);
        let holds = match kept - 1 {
            kept if kept < frames => format!("of which {output} holds {kept}, evenly over the run"),
            _ => format!("which {output} holds"),
        };
        assert_eq!(said, format!("sdftool: ended by a signal after {frames} frames, {holds}\n"));
        assert!(folder.names().iter().all(|name| !name.ends_with(".tmp")), "{output}: {:?}", folder.names());
        match output {
            "run.html" => says(
                &String::from_utf8(folder.read(output)).unwrap(),
                &[format!("\"frames\":{kept},").as_str(), "</html>"],
            ),
            "run.png" => {
                let reader = png::Decoder::new(std::io::Cursor::new(folder.read(output))).read_info().unwrap();
                assert_eq!(reader.info().animation_control.unwrap().num_frames as usize, kept);
            }
            "run.vtkhdf" => assert!(folder.read(output).starts_with(b"\x89HDF\r\n\x1a\n")),
            _ => assert_eq!(std::fs::read_dir(folder.at("frames")).unwrap().count(), frames + 2),
        }
    }
}

/// A process group gets Ctrl-C, and who watches over it sends SIGTERM too.
#[test]
fn signals_at_once_are_one_and_a_later_one_ends_a_run_at_once() {
    let start = |substeps: &str| {
        let folder = Folder::new();
        folder.write("long.toml", LONG.replace("substeps = 4", substeps));
        let mut command = program(&folder);
        command.args(["simulate", "long.toml", "-o", "run.html", "--threads", "1"]);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let deadline = Instant::now() + Duration::from_secs(120);
        while !folder.at("run.html").exists() {
            assert!(Instant::now() < deadline && child.try_wait().unwrap().is_none(), "nothing was recorded");
            sleep(Duration::from_millis(5));
        }
        sleep(Duration::from_millis(100));
        (folder, child)
    };
    let send = |child: &Child, signals: &[&str]| {
        let kills: String = signals.iter().map(|signal| format!("kill -{signal} {};", child.id())).collect();
        assert!(Command::new("sh").args(["-c", &kills]).status().unwrap().success());
    };
    // A frame of about a tenth of a second: both come before its end.
    let (folder, child) = start("substeps = 4000");
    send(&child, &["INT", "TERM"]);
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(130), "{said}");
    says(&said, &["ended by a signal after ", "run.html"]);
    assert!(String::from_utf8(folder.read("run.html")).unwrap().contains("</html>"));

    // A frame of seconds.
    let (_folder, child) = start("substeps = 100000");
    send(&child, &["INT"]);
    sleep(Duration::from_millis(700));
    send(&child, &["TERM"]);
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr)), (Some(143), "".into()));
}

#[test]
fn a_kill_during_a_write_leaves_one_file_whole() {
    let mut in_time = 0;
    for delay in DELAYS {
        let mut baking = Baking::start(&Model::cube(), 120, "");
        baking.wait_for_write();
        sleep(Duration::from_millis(delay));
        baking.signal("KILL");
        let (output, folder, _) = baking.end();
        if folder.read("mesh.sdf.h5") == OLD {
            assert_eq!(output.status.signal(), Some(9));
            in_time += 1;
        } else {
            folder.done("verify mesh.sdf.h5 mesh.obj --points 100");
        }
        folder.done("bake mesh.obj --res 8");
    }
    assert!(in_time >= 2, "{in_time}: the write is too short to be killed");
}
