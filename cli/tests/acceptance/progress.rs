//! Progress of a bake, shown on a terminal only. (Every other test asserts that standard error is empty.)

#[cfg(target_os = "linux")]
#[test]
fn bake_draws_the_time_left_on_a_terminal() {
    use crate::folder::{Folder, SDFTOOL};
    use crate::meshes::Model;
    use std::process::Command;

    if Command::new("script").arg("--version").output().is_err() {
        println!("skipped: no `script` here, which emulates a terminal");
        return;
    }
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 4).obj());
    let line = format!("stty cols 80; {SDFTOOL} bake ball.obj --res 128 > printed");
    let mut command = Command::new("script");
    command.args(["-qec", &line, "/dev/null"]).env("TERM", "xterm").env_remove("NO_COLOR").current_dir(folder.path());
    let output = command.output().unwrap();
    let drawn = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{drawn}");
    assert!(drawn.contains("baking") && drawn.contains(" %, ") && drawn.contains("s left"), "{drawn:?}");
    // Before anything is done there is nothing to tell the time from.
    assert!(drawn.split('%').next().unwrap().ends_with("  0 "), "{drawn:?}");
    // From one percent on it is drawn.
    let shares: Vec<&str> = drawn.split(" %").collect();
    for pair in shares.windows(2) {
        let digits = pair[0].rsplit(|c: char| !c.is_ascii_digit()).next().unwrap();
        assert_eq!(pair[1].starts_with(", "), digits != "0", "{digits:?} of {drawn:?}");
    }
    let printed = String::from_utf8(folder.read("printed")).unwrap();
    assert!(printed.contains("ball.sdf.h5") && !printed.contains("left"), "{printed}");
}
