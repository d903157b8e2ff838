//! Malformed, empty, vast and tiny meshes.

use std::time::Instant;
#[cfg(target_os = "linux")]
use std::{
    fs,
    io::Write,
    path::{Path, PathBuf},
};

#[cfg(target_os = "linux")]
use assert_cmd::Command;

use super::{bad_mesh, scene};
use crate::folder::says;
#[cfg(target_os = "linux")]
use crate::folder::{SDFTOOL, done};
use crate::meshes::Model;

#[test]
fn a_malformed_mesh_is_refused_with_the_line() {
    let folder = scene();
    let points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (name, text, words) in [
        ("nan.obj", format!("{points}v nan 0 0\nf 1 2 3\n"), ["line 4", "nan"]),
        ("inf.obj", format!("{points}v 0 inf 0\nf 1 2 3\n"), ["line 4", "inf"]),
        ("huge.obj", format!("{points}v 0 1e999 0\nf 1 2 3\n"), ["line 4", "1e999"]),
        ("range.obj", format!("{points}f 1 2 3\nf 1 2 4\n"), ["line 5", "up to 3"]),
        ("back.obj", format!("{points}f -1 -2 -4\n"), ["line 4", "-4"]),
        ("zero.obj", format!("{points}f 0 1 2\n"), ["line 4", "count from 1"]),
        ("two.obj", format!("{points}f 1 2\n"), ["line 4", "at least 3"]),
        ("words.obj", format!("{points}f one two three\n"), ["line 4", "one"]),
        ("short.obj", "v 0 0\nf 1 1 1\n".to_owned(), ["line 1", "found 2"]),
        ("cut.ply", "ply\nformat ascii 1.0\nelement vertex 1000000000000\n".to_owned(), ["cut.ply", "expected"]),
        (
            "boast.ply",
            "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty double x\nproperty double y\n\
             property double z\nelement face 4000000000\nproperty list uchar int vertex_indices\nend_header\n"
                .to_owned(),
            ["boast.ply", "expected"],
        ),
        (
            "cut.stl",
            "solid ball\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0".to_owned(),
            ["cut.stl", "expected"],
        ),
    ] {
        folder.write(name, text);
        says(&bad_mesh(&folder, name), &words);
    }
    let stl = Model::cube().stl();
    folder.write("half.stl", &stl[..stl.len() - 30]);
    says(&bad_mesh(&folder, "half.stl"), &["half.stl"]);
}

/// So far out that no triangle may be there: it is taken where none is, by every command that reads a mesh.
#[test]
fn a_vertex_that_no_face_uses_may_be_anywhere() {
    let folder = scene();
    let ball = Model::ball([0.0; 3], 1.0, 2).obj();
    folder.write("clean.obj", &ball);
    folder.write("far.obj", format!("{ball}v 1e200 0 -1e40\n"));
    let outcomes = ["clean.obj", "far.obj"].map(|name| {
        let mut keys = vec![];
        for words in [
            "bake M --res 16 --keep-mesh -o M.h5",
            "bake M --res 16 --layout sparse --weld 1e-6 --close 1 -o sparse.sdf.h5",
            "verify M.h5 M --points 500",
            "contacts M cube.sdf.h5 -o list.csv",
            "contacts M sphere.sdf.toml",
            "contacts cube.obj M.h5 --exact",
            "contacts M cube.sdf.h5 --complete --one-per-feature",
            "compare M cube.sdf.h5",
        ] {
            let words = words.replace('M', name);
            let json = folder.json(&words);
            keys.push(["error_bound", "counts", "triangles", "contacts", "deepest"].map(|key| json[key].clone()));
        }
        keys
    });
    assert_eq!(outcomes[0], outcomes[1]);
    folder.write("used.obj", format!("{ball}v 1e200 0 0\nf 1 2 -1\n"));
    says(&folder.refused("bake used.obj --res 16"), &["used.obj: the point [1e200, 0.0, 0.0] is too far out"]);
}

#[test]
fn a_mesh_without_faces_is_refused() {
    let folder = scene();
    folder.write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    says(&bad_mesh(&folder, "points.obj"), &["no triangles in points.obj"]);
    folder.write("lines.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n");
    says(&bad_mesh(&folder, "lines.obj"), &["no triangles in lines.obj"]);
}

#[test]
fn a_mesh_without_extent_is_refused_and_a_flat_one_is_baked() {
    let folder = scene();
    folder.write("point.obj", "v 1 2 3\nv 1 2 3\nf 1 2 1\n");
    says(&folder.refused("bake point.obj --res 8"), &["point.obj", "no extent"]);
    says(&folder.refused("bake point.obj --voxel-size 0.1"), &["point.obj", "no extent"]);
    folder.write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.write("flat.obj", "v 0 0 5\nv 1 0 5\nv 1 1 5\nv 0 1 5\nf 1 2 3 4\n");
    folder.write("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    folder.write("slanted.obj", "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n");
    for name in ["line", "slanted"] {
        says(&folder.refused(&format!("bake {name}.obj --res 8")), &[name, "no triangle of the mesh has an area"]);
    }
    for name in ["one", "flat"] {
        for words in ["--res 8", "--res 1", "--res 1 --padding 0", "--voxel-size 0.3 --padding 0", "--voxel-size 90"] {
            let json = folder.json(&format!("bake {name}.obj {words}"));
            assert_eq!(json["sign_method"], "winding", "{name} {words}");
            folder.done(&format!("verify {name}.sdf.h5 {name}.obj --points 200"));
            folder.done(&format!("contacts cube.obj {name}.sdf.h5"));
        }
    }
}

#[test]
fn a_mesh_in_any_unit_is_baked_and_one_that_overflows_is_refused() {
    let folder = scene();
    let mut spacings = Vec::new();
    for scale in [1e-25, 1e-12, 1.0, 1e12, 1e25] {
        folder.write("scaled.obj", Model::cube().moved(|p| p.map(|x| x * scale)).obj());
        let json = folder.json("bake scaled.obj --res 8");
        spacings.push(json["spacing"].as_f64().unwrap() / scale);
        folder.done("verify scaled.sdf.h5 scaled.obj --points 200");
    }
    assert!(spacings.iter().all(|spacing| (spacing - 0.125).abs() < 1e-12));
    folder.write("vast.obj", Model::cube().moved(|p| p.map(|x| x * 1e200)).obj());
    says(&folder.refused("bake vast.obj --res 8"), &["vast.obj: the point [", "1e200", "too far out"]);
    folder.write("specks.obj", Model::cube().moved(|p| p.map(|x| x * 1e-310)).obj());
    says(
        &folder.refused("bake specks.obj --res 8"),
        &["specks.obj", "its longest side is 1e-310, and must be 1e-30 or more"],
    );
}

#[test]
fn a_grid_that_does_not_fit_into_memory_is_refused_at_once_with_its_size() {
    let folder = scene();
    let started = Instant::now();
    for (words, say) in [
        ("--res 100000 --sign pseudo-normal", ["4001240126004212 bytes (4.0 PB)", "smaller --res"]),
        // Includes the memory per thread of signs by winding number.
        ("--res 100000", ["bytes (4.0 PB)", "smaller --res"]),
        ("--res 4294967295", ["3.2e29 bytes", "smaller --res"]),
        ("--voxel-size 1e-6", ["4.0e18 bytes", "larger --voxel-size"]),
        ("--voxel-size 1e-300", ["--voxel-size 1e-300", "larger --voxel-size"]),
        ("--voxel-size 5e-324", ["--voxel-size 5e-324", "larger --voxel-size"]),
        ("--voxel-size 1e300", ["mesh is 1.000000 long", "smaller --voxel-size"]),
        ("--voxel-size 2000", ["mesh is 1.000000 long", "smaller --voxel-size"]),
        ("--res 8 --padding 4000000000", ["2.0e30 bytes", "smaller --padding"]),
        ("--res 8 --padding 4294967295", ["bytes", "smaller --padding"]),
        ("--voxel-size 900 --padding 4000000000", ["bytes", "smaller --padding"]),
    ] {
        says(&folder.refused(&format!("bake cube.obj {words}")), &say);
    }
    assert!(started.elapsed().as_secs() < 10);
    for words in ["--res 1", "--res 8 --padding 0", "--voxel-size 1000", "--voxel-size 1 --padding 0"] {
        folder.done(&format!("bake cube.obj {words}"));
        folder.done("verify cube.sdf.h5 cube.obj --points 200");
    }
}

/// A control group of its own with 64 MiB of memory; `None` where this process may not make one.
#[cfg(target_os = "linux")]
fn limited_group() -> Option<PathBuf> {
    let roots = [("/sys/fs/cgroup/memory", "memory.limit_in_bytes"), ("/sys/fs/cgroup", "memory.max")];
    roots.into_iter().find_map(|(root, limit)| {
        let group = Path::new(root).join(format!("sdftool-test-{}", std::process::id()));
        fs::create_dir(&group).ok()?;
        // `write` would make a file where the group has none.
        let set =
            fs::OpenOptions::new().write(true).open(group.join(limit)).and_then(|mut file| file.write_all(b"64M"));
        set.is_ok().then_some(group.clone()).or_else(|| {
            fs::remove_dir(&group).unwrap();
            None
        })
    })
}

#[cfg(target_os = "linux")]
#[test]
fn a_bake_beyond_the_limit_of_its_container_is_refused() {
    let Some(group) = limited_group() else {
        return eprintln!("not tested: this process may not make a control group");
    };
    let folder = scene();
    let bake = |words: &str| {
        let mut command = Command::new("sh");
        let enter = format!("echo $$ > {}/cgroup.procs && exec \"$0\" bake cube.obj {words}", group.display());
        command.args(["-c", &enter, SDFTOOL]).current_dir(folder.path());
        command
    };
    // 110 MB, which the machine has.
    let big = "--res 300 --padding 0 --sign pseudo-normal";
    let refused = folder.refuses(&mut bake(big), big);
    done(&mut bake("--res 64"), "bake within the limit");
    fs::remove_dir(&group).unwrap();
    says(&refused, &["needs 110533220 bytes (110.5 MB)", "are free here", "smaller --res"]);
    let free = refused.split("MB), and ").nth(1).unwrap().split_whitespace().next().unwrap();
    assert!(free.parse::<u64>().unwrap() <= 64 << 20, "{refused}");
}

/// A triangle smaller than the spacing of f64 numbers at the far corner of the grid.
#[test]
fn a_mesh_with_a_triangle_far_smaller_than_itself_is_baked() {
    let folder = scene();
    for size in [1e-12, 1e-20, 1e-29, 1e-100, 1e-300] {
        let mut speck = Model::cube();
        speck.points.extend([[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0]]);
        speck.triangles.push([8, 9, 10]);
        folder.write("speck.obj", speck.obj());
        folder.done("bake speck.obj --res 8");
    }
}
