//! Elements that are skipped are counted, and what needs more memory than is free is refused before any work.

use crate::folder::{Folder, says};
use crate::meshes::Model;

fn scene() -> Folder {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 2).obj());
    folder.write("sphere.sdf.toml", "[field]\nshape = 'sphere'\nradius = 1\n");
    folder.done("bake ball.obj --res 8");
    folder
}

#[test]
fn elements_that_are_skipped_are_counted() {
    let folder = scene();
    folder.write("far.obj", "v 0 0 0.9\nv 0.3 0 1.1\nv 0 0.3 1.1\nv 1e200 0 0\nf 1 2 3\nf 1 2 4\n");
    says(&folder.done("contacts far.obj sphere.sdf.toml"), &["skipped", "1 element with coordinates"]);
    says(&folder.done("view sphere.sdf.toml far.obj -o page.html"), &["skipped", "1 element with coordinates"]);
    says(
        &folder.done("compare far.obj sphere.sdf.toml --rounds 1"),
        &["2 elements", "skipped: 1 element with coordinates"],
    );
    for words in [
        "contacts far.obj sphere.sdf.toml",
        "view sphere.sdf.toml far.obj -o page.html",
        "compare far.obj sphere.sdf.toml",
    ] {
        assert_eq!(folder.json(words)["not_finite"], 1, "{words}");
    }
}

/// More memory than any machine of the tests has, told before any work.
#[test]
fn what_needs_more_memory_than_is_free_is_refused() {
    let folder = scene();
    for (words, what) in [
        ("export sphere.sdf.toml --format npy --res 4096", "sphere.sdf.toml: 4105 × 4105 × 4105 nodes need"),
        ("verify ball.sdf.h5 ball.obj --points 4294967295", "--points 4294967295 needs"),
    ] {
        says(&folder.refused(words), &[what, "free", "use "]);
    }
}

/// Addresses may be limited to less than the machine has.
#[cfg(target_os = "linux")]
#[test]
fn a_limit_of_addresses_counts_as_memory() {
    let folder = scene();
    for words in ["slice sphere.sdf.toml --pixels 16384 -o out.png", "bake ball.obj --res 700 --threads 1"] {
        let script = format!("ulimit -v 800000; exec {} {words}", crate::folder::SDFTOOL);
        let mut command = assert_cmd::Command::new("sh");
        command.args(["-c", &script]).current_dir(folder.path());
        says(&folder.refuses(&mut command, words), &["bytes", "free"]);
    }
}

/// Each has a boundary of its own: their memory is in proportion to the file.
#[cfg(target_os = "linux")]
#[test]
fn a_mesh_of_many_separate_triangles_takes_little_memory() {
    let folder = Folder::new();
    let count = 20_000;
    let place = |triangle: usize| [triangle % 27, triangle / 27 % 27, triangle / 729];
    let corner = |triangle: usize, (dx, dy): (f64, f64)| {
        let [x, y, z] = place(triangle).map(|cell| cell as f64);
        format!("v {} {} {z}\n", x + dx, y + dy)
    };
    let corners = [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5)];
    let points: String = (0..count).flat_map(|triangle| corners.map(|offset| corner(triangle, offset))).collect();
    let faces: String =
        (0..count).map(|face| format!("f {} {} {}\n", 3 * face + 1, 3 * face + 2, 3 * face + 3)).collect();
    folder.write("leaves.obj", points + &faces);
    let script = format!("ulimit -v 400000; exec {} bake leaves.obj --res 24 --threads 1", crate::folder::SDFTOOL);
    assert_cmd::Command::new("sh").args(["-c", &script]).current_dir(folder.path()).assert().success();
}

#[test]
fn counts_that_are_not_whole_are_refused_by_what_they_may_be() {
    let folder = Folder::new();
    for (words, advice) in [
        ("bake a.obj --res 8.5", "give a whole number from 1 on"),
        ("bake a.obj --res 0", "give a whole number from 1 on"),
        ("bake a.obj --res 8 --band 4.5", "give a whole number from 1 to 1000"),
        ("export a.sdf.h5 --format nvdb --res 5000", "give a whole number from 1 to 4096"),
    ] {
        says(&folder.wrong_usage(words), &[advice]);
    }
}
