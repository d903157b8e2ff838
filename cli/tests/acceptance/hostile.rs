//! Promise 13: no input makes the program crash, hang, or use memory out of proportion. Each is refused with one line that says
//! what is wrong, where, and what to do.

use std::time::Instant;

use sdf_procedural::random::Random;

use crate::folder::{Folder, refused, says};
use crate::meshes::Model;

const SPHERE: &str = "[field]\nshape = 'sphere'\nradius = 1.0\n";

/// A folder with a valid file of every kind.
fn scene() -> Folder {
    let folder = Folder::new();
    folder.write("cube.obj", Model::cube().obj());
    folder.write("sphere.sdf.toml", SPHERE);
    folder.write("points.csv", "x,y,z\n0,0,2\n");
    folder.done("bake cube.obj --res 8");
    folder
}

/// Checks that every command that reads a mesh refuses `name`. Returns the message of `bake`.
fn bad_mesh(folder: &Folder, name: &str) -> String {
    let lines = [
        folder.refused(&format!("bake {name} --res 8 -o out.sdf.h5")),
        folder.refused(&format!("contacts {name} sphere.sdf.toml -o list.csv")),
        folder.refused(&format!("verify cube.sdf.h5 {name} --points 10")),
    ];
    assert!(lines.iter().all(|line| line.contains(name)), "{lines:?}");
    lines.into_iter().next().unwrap()
}

/// Checks that every command that reads a field refuses `name` with the same message. Returns it.
fn bad_field(folder: &Folder, name: &str) -> String {
    let line = folder.refused(&format!("eval {name} --points points.csv"));
    for words in [
        format!("contacts cube.obj {name} -o list.csv"),
        format!("verify {name} cube.obj --points 10"),
        format!("slice {name} -o slice.png"),
        format!("surface {name} -o surface.obj"),
    ] {
        assert_eq!(folder.refused(&words), line);
    }
    assert!(line.starts_with(name), "{line}");
    line
}

/// Files that are neither mesh nor field: empty, a picture, a page, an archive, zeros, a folder.
fn foreign_files(folder: &Folder) -> [&'static str; 6] {
    folder.write("empty", "");
    folder.write("picture", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01\0\0\0\x01\x08\x02\0\0\0\x90wS\xde");
    folder.write("page", "<!DOCTYPE html>\n<html><body>404 Not Found</body></html>\n");
    folder.write("archive", b"PK\x03\x04\x14\0\0\0\x08\0");
    folder.write("zeros", [0; 5000]);
    std::fs::create_dir(folder.at("folder")).unwrap();
    ["empty", "picture", "page", "archive", "zeros", "folder"]
}

#[test]
fn a_file_that_is_not_a_mesh_is_refused_by_its_kind() {
    let folder = scene();
    let said = foreign_files(&folder).map(|name| bad_mesh(&folder, name));
    for (line, word) in
        said.iter().zip(["empty file", "PNG", "HTML", "zip archive, unpack it", "not an OBJ", "directory"])
    {
        says(line, &[word]);
    }
    // `contacts` alone accepts a field in place of a mesh.
    says(&folder.refused("bake cube.sdf.h5 --res 8"), &["HDF5"]);
    says(&bad_mesh(&folder, "missing.obj"), &["missing.obj", "No such file"]);
    says(&bad_mesh(&folder, "cube.obj/cube.obj"), &["Not a directory"]);
}

#[test]
fn a_file_that_is_not_a_field_is_refused_by_its_kind() {
    let folder = scene();
    let said = foreign_files(&folder).map(|name| {
        let line = bad_field(&folder, name);
        assert_eq!(folder.refused(&format!("info {name}")), line);
        line
    });
    for (line, word) in
        said.iter().zip(["empty file", "neither HDF5 nor TOML", "not TOML", "TOML", "TOML", "directory"])
    {
        says(line, &[word]);
    }
    says(&said[1], &["give a baked grid (.sdf.h5) or shapes in TOML (.sdf.toml)"]);
    says(&bad_field(&folder, "missing.sdf.h5"), &["No such file"]);
}

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
    says(&folder.refused("bake vast.obj --res 8"), &["vast.obj", "too far out"]);
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

#[test]
fn a_grid_file_with_a_flipped_bit_is_refused_or_equal_in_content() {
    for layout in ["dense", "sparse --precision u8"] {
        check_flipped_bits(layout);
    }
}

fn check_flipped_bits(layout: &str) {
    let folder = scene();
    folder.done(&format!("bake cube.obj --res 8 --layout {layout}"));
    let good = folder.read("cube.sdf.h5");
    folder.write("points.csv", "0.1,0.2,0.3\n0.6,1.2,-0.2\n-0.4,0.1,0.1\n1.4,1.4,1.4\n");
    let [eval, info] = ["eval damaged.sdf.h5 --points points.csv", "info damaged.sdf.h5"];
    folder.write("damaged.sdf.h5", &good);
    let expected = [eval, info].map(|words| folder.done(words));
    // This command reads the whole file, the others do not.
    let surface = "surface damaged.sdf.h5 -o surface.obj";
    folder.done(surface);
    let expected_surface = folder.read("surface.obj");
    let mut random = Random::new(3);
    let (mut refusals, flips) = (0, 100);
    for _ in 0..flips {
        let mut damaged = good.clone();
        let at = random.below(damaged.len());
        damaged[at] ^= 1 << random.below(8);
        folder.write("damaged.sdf.h5", &damaged);
        if folder.sdftool(eval).output().unwrap().status.success() {
            assert_eq!(folder.done(eval), expected[0], "byte {at}");
            assert_eq!(folder.done(info), expected[1], "byte {at}");
        } else {
            says(&bad_field(&folder, "damaged.sdf.h5"), &["damaged.sdf.h5: "]);
        }
        if folder.sdftool(surface).output().unwrap().status.success() {
            assert!(folder.read("surface.obj") == expected_surface, "byte {at}");
        } else {
            says(&folder.refused(surface), &["damaged.sdf.h5: "]);
            refusals += 1;
        }
    }
    // The rest of the file is unused space.
    assert!(refusals > flips / 10, "{refusals}");
}

#[test]
fn a_grid_file_cut_short_is_refused() {
    let folder = scene();
    let good = folder.read("cube.sdf.h5");
    for cut in (0..good.len()).step_by(good.len() / 40).chain([7, 8, 9, 95, 96, good.len() - 1]) {
        folder.write("cut.sdf.h5", &good[..cut]);
        bad_field(&folder, "cut.sdf.h5");
        folder.refused("info cut.sdf.h5");
    }
}

#[test]
fn random_bytes_are_refused_as_every_kind_of_file() {
    let folder = scene();
    let mut random = Random::new(11);
    for length in [1, 7, 8, 84, 134, 500, 3000] {
        for beginning in [&b""[..], b"\x89HDF\r\n\x1a\n", b"ply\n", b"solid ", b"v 0 0 0\nf ", b"[field]\n"] {
            let mut bytes = beginning.to_vec();
            bytes.extend((0..length).map(|_| random.below(256) as u8));
            folder.write("noise", bytes);
            folder.refused("bake noise --res 4 -o out.sdf.h5");
            folder.refused("info noise");
            folder.refused("eval noise --points points.csv");
        }
    }
}

#[test]
fn an_invalid_field_table_is_refused_with_its_location() {
    let folder = scene();
    folder.write("notgrid.toml", SPHERE);
    let part = "{ shape = 'sphere', radius = 1 }";
    for (text, words) in [
        ("", ["empty file", "give a baked grid"]),
        ("# nothing\n", ["needs field", "table"]),
        ("shape = 'sphere'\nradius = 1\n", ["needs field", "table"]),
        ("field = 'sphere'\n", ["field must be a table", "string"]),
        ("[field]\n", ["field: needs shape", "string"]),
        ("[field]\nshape = 3\n", ["shape must be a string", "integer"]),
        ("[field]\nshape = 'spere'\nradius = 1\n", ["spere", "known shapes: sphere, half_space"]),
        ("[field]\nshape = 'sphere'\n", ["needs radius", "number"]),
        ("[field]\nshape = 'sphere'\nradius = '1'\n", ["radius must be a finite number", "string"]),
        ("[field]\nshape = 'sphere'\nradius = nan\n", ["radius must be a finite number", "field"]),
        ("[field]\nshape = 'sphere'\nradius = inf\n", ["radius must be a finite number", "field"]),
        ("[field]\nshape = 'sphere'\nradius = -1\n", ["not a valid sphere", "more than 0"]),
        ("[field]\nshape = 'sphere'\nradius = 0\n", ["not a valid sphere", "more than 0"]),
        ("[field]\nshape = 'sphere'\nradius = 1e400\n", ["not TOML from line 3 on", "overflow"]),
        ("[field]\nshape = 'sphere'\nradius = 1\nheight = 2\n", ["unknown key \"height\"", "known here: "]),
        ("[field]\nshape = 'sphere'\nradius = 1\n[fields]\n", ["unknown key \"fields\"", "field"]),
        ("[field]\nshape = 'sphere'\nradius = 1\nradius = 2\n", ["line 4", "duplicate"]),
        ("[field\nshape = 'sphere'\n", ["not TOML", "line 1"]),
        ("[field]\nshape = 'box'\nhalf_extents = [1, 2]\n", ["half_extents", "3 finite numbers"]),
        ("[field]\nshape = 'box'\nhalf_extents = [1, 2, 'x']\n", ["half_extents", "3 finite numbers"]),
        ("[field]\nshape = 'half_space'\nnormal = [0, 0, 0]\noffset = 1\n", ["half_space", "normal must not be zero"]),
        ("[field]\nshape = 'cone'\nhalf_angle_deg = 90\nheight = 1\n", ["not a valid cone", "between 0 and 90"]),
        ("[field]\nshape = 'torus'\nmajor_radius = 1\nminor_radius = 2\n", ["not a valid torus", "no less than"]),
        ("[field]\nshape = 'bowl'\nradius = 1\ncut_height = 1\nthickness = 0.1\n", ["not a valid bowl", "cut_height"]),
        ("[field]\nshape = 'union'\nof = []\n", ["of must be a list", "at least one"]),
        ("[field]\nshape = 'union'\nof = [3]\n", ["of[0]", "table"]),
        ("[field]\nshape = 'shell'\nthickness = 0.1\n", ["needs of", "table"]),
        ("[field]\nshape = 'sphere'\nradius = 1\npose.scale = 0\n", ["field.pose", "scale must be positive"]),
        ("[field]\nshape = 'sphere'\nradius = 1\npose.rotation = [0, 0, 0, 0]\n", ["field.pose", "rotation"]),
        ("[field]\nshape = 'sphere'\nradius = 1\npose.rotate = [0, 0, 1]\n", ["unknown key \"rotate\"", "translation"]),
        ("[field]\nshape = 'grid'\nfile = 'missing.sdf.h5'\n", ["bad.sdf.toml: field: missing.sdf.h5", "No such file"]),
        ("[field]\nshape = 'grid'\nfile = 'bad.sdf.toml'\n", ["bad.sdf.toml", "not an HDF5 file"]),
        ("[field]\nshape = 'grid'\nfile = 'notgrid.toml'\n", ["notgrid.toml", "not an HDF5 file"]),
        ("[field]\nshape = 'grid'\nfile = '.'\n", ["bad.sdf.toml: field: ", "not a regular file"]),
        ("[field]\nshape = 'grid'\nfile = ''\n", ["bad.sdf.toml: field: ", "No such file"]),
        ("[field]\nshape = 'grid'\n", ["needs file", "string"]),
    ] {
        folder.write("bad.sdf.toml", text);
        let line = folder.refused("eval bad.sdf.toml --points points.csv");
        says(&line, &words);
        assert_eq!(folder.refused("info bad.sdf.toml"), line);
    }
    folder.write(
        "bad.sdf.toml",
        format!("[field]\nshape = 'union'\nof = [{part}, {{ shape = 'shell', thickness = 1, of = 7 }}]\n"),
    );
    says(&bad_field(&folder, "bad.sdf.toml"), &["field.of[1]: of must be a table, not integer"]);
}

#[test]
fn tables_within_tables_do_not_exhaust_the_stack() {
    let folder = scene();
    let nested = |levels: usize| {
        let tables =
            (0..levels).map(|level| format!("[field{}]\nshape = 'shell'\nthickness = 0.1\n", ".of".repeat(level)));
        format!("{}[field{}]\nshape = 'sphere'\nradius = 1\n", tables.collect::<String>(), ".of".repeat(levels))
    };
    folder.write("deep.sdf.toml", nested(63));
    folder.done("contacts cube.obj deep.sdf.toml");
    folder.done("surface deep.sdf.toml -o out.obj --res 8 --level 0.01");
    for (text, words) in [
        (nested(64), ["nested too deep", "of"]),
        (format!("[field]\nshape = {}{}\n", "[".repeat(100_000), "]".repeat(100_000)), ["not TOML", "recur"]),
        (format!("[field]\n{}a = 1\n", "a.".repeat(100_000)), ["not TOML", "recur"]),
        (format!("[{}a]\nb = 1\n", "field.".repeat(100_000)), ["not TOML", "recur"]),
    ] {
        folder.write("deep.sdf.toml", text);
        says(&bad_field(&folder, "deep.sdf.toml"), &words);
    }
    // Depth grows with the logarithm of the number of parts.
    let part = "{ shape = 'sphere', radius = 1 },";
    folder.write(
        "wide.sdf.toml",
        format!("[field]\nshape = 'smooth_union'\nblend = 0.1\nof = [{}]\n", part.repeat(20_000)),
    );
    folder.done("contacts cube.obj wide.sdf.toml --elements vertices");
    folder.write("vast.sdf.toml", vec![b'#'; (16 << 20) + 1]);
    says(&bad_field(&folder, "vast.sdf.toml"), &["16777216 bytes"]);
}

#[test]
fn a_bad_line_of_points_is_named() {
    let folder = scene();
    for (text, words) in [
        ("x,y,z\n0,0,0\n0,zero,0\n", ["line 3", "0,zero,0"]),
        ("0,0,0\n1,2\n", ["line 2", "found 2"]),
        ("0,0,0\n1,2,nan\n", ["line 2", "finite"]),
        ("1,2,inf\n", ["line 1", "finite"]),
        ("0,0,0\n1;2;3\n", ["line 2", "1;2;3"]),
        // The first line, but not a header.
        ("1 2 3\n4 5 6\n", ["line 1", "1 2 3"]),
        ("1,2,three\n", ["line 1", "1,2,three"]),
        ("x,y,z\nx,y,z\n", ["line 2", "expected x,y,z"]),
        ("1,2,3\n\x1b[2J,1,2\n", ["line 2", "expected"]),
    ] {
        folder.write("bad.csv", text);
        let line = folder.refused("eval sphere.sdf.toml --points bad.csv");
        says(&line, &["bad.csv"]);
        says(&line, &words);
    }
    folder.write("bad.csv", b"0,0,0\n\xff\xfe,1,2\n");
    says(&folder.refused("eval sphere.sdf.toml --points bad.csv"), &["bad.csv", "line 2", "UTF-8"]);
    folder.write("long.csv", vec![b'1'; 3 << 20]);
    says(&folder.refused("eval sphere.sdf.toml --points long.csv"), &["long.csv", "line 1"]);
    std::fs::create_dir(folder.at("folder")).unwrap();
    says(&folder.refused("eval sphere.sdf.toml --points folder"), &["folder", "directory"]);
    says(&folder.refused("eval sphere.sdf.toml --points missing.csv"), &["missing.csv", "No such file"]);
    // An empty list of points is valid.
    folder.write("none.csv", "x,y,z\n");
    assert_eq!(folder.done("eval sphere.sdf.toml --points none.csv"), "x,y,z,distance,gx,gy,gz\n");
}

#[test]
fn extreme_numbers_on_the_command_line_do_no_harm() {
    let folder = scene();
    says(&folder.refused("contacts cube.obj cube.sdf.h5 --margin 1e300"), &["--margin 1.0000e300", "--padding"]);
    for words in [
        "contacts cube.obj cube.sdf.h5 --margin -1e300",
        "contacts cube.obj cube.sdf.h5 --translate 1e308,-1e308,1e308",
        "contacts cube.obj cube.sdf.h5 --rotate 1e-320,0,0,1e-320",
        "contacts cube.obj cube.sdf.h5 --rotate 1e308,1e308,1e308,1e308",
        "contacts cube.obj cube.sdf.h5 --iterations 0",
        "contacts cube.obj cube.sdf.h5 --iterations 0 --elements edges --method gss",
        "contacts cube.obj cube.sdf.h5 --iterations 4294967295 --method pgd",
        "contacts cube.obj cube.sdf.h5 --iterations 4294967295 --method gss --elements edges",
        "contacts cube.obj cube.sdf.h5 --threads 1024",
        "slice cube.sdf.h5 -o out.png --at 1e308 --pixels 16",
        "slice cube.sdf.h5 -o out.png --at -1e308 --pixels 16",
        "verify cube.sdf.h5 cube.obj --points 1 --seed 18446744073709551615",
        "surface cube.sdf.h5 -o out.obj --res 6 --level 0.1",
    ] {
        let json = folder.json(words);
        assert!(!json.to_string().contains("null"), "{words}: a number is null: {json}");
    }
    // Shapes of extreme sizes.
    for size in ["1e-300", "1e-30", "1e30", "1e140", "1e300"] {
        folder.write("size.sdf.toml", format!("[field]\nshape = 'box'\nhalf_extents = [{size}, {size}, {size}]\n"));
        for words in [
            "info size.sdf.toml",
            "eval size.sdf.toml --points points.csv",
            "contacts cube.obj size.sdf.toml",
            "slice size.sdf.toml -o out.png --pixels 16",
            "surface size.sdf.toml -o out.obj --res 4",
        ] {
            let output = folder.sdftool(words).output().unwrap();
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(matches!(output.status.code(), Some(0 | 1)), "{words} at {size}: {} {said}", output.status);
            assert!(!said.contains("panicked") && said.lines().count() <= 1, "{words} at {size}: {said}");
        }
    }
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

#[cfg(unix)]
#[test]
fn file_names_of_any_bytes_are_accepted() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let folder = scene();
    let name = OsStr::from_bytes(b"k\xf6rper \x1b[31m\n.obj");
    std::fs::write(folder.path().join(name), Model::cube().obj()).unwrap();
    let bake = |mesh: &OsStr| {
        let mut command = folder.sdftool("bake --res 8");
        command.arg(mesh);
        command
    };
    bake(name).assert().success();
    let grid = OsStr::from_bytes(b"k\xf6rper \x1b[31m\n.sdf.h5");
    assert!(folder.path().join(grid).is_file());
    folder.sdftool("info").arg(grid).assert().success();
    folder.sdftool("verify --points 10").arg(grid).arg(name).assert().success();
    // A message with such a name is still one line, without control characters.
    let missing = OsStr::from_bytes(b"k\xf6rper\n\x1b[31m.obj");
    says(&refused(&mut bake(missing), "a missing file"), &["No such file"]);
    says(&refused(folder.sdftool("info").arg(missing), "a missing file"), &["No such file"]);
    std::fs::write(folder.path().join(missing), "v 0 0 0\n").unwrap();
    says(&refused(&mut bake(missing), "a mesh without faces"), &["no triangles"]);
}

/// A device reports no size but has endless data.
#[cfg(target_os = "linux")]
#[test]
fn an_endless_file_is_refused_as_a_field() {
    let folder = scene();
    let started = Instant::now();
    says(&folder.refused("info /dev/zero"), &["/dev/zero", "TOML"]);
    assert!(started.elapsed().as_secs() < 20);
}
