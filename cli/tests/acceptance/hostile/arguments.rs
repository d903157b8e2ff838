//! Bad points, extreme numbers and file names of any bytes on the command line.

use super::scene;
use crate::folder::{refused, says};
use crate::meshes::Model;

#[test]
fn a_bad_line_of_points_is_named() {
    let folder = scene();
    for (text, words) in [
        ("x,y,z\n0,0,0\n0,zero,0\n", ["line 3", "0,zero,0"]),
        ("0,0,0\n1,2\n", ["line 2", "found 2"]),
        ("0,0,0\n1,2,nan\n", ["line 2", "finite"]),
        ("1,2,inf\n", ["line 1", "finite"]),
        // The first line, but not a header.
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
    assert_eq!(folder.done("eval sphere.sdf.toml --points none.csv"), "x,y,z,distance,gx,gy,gz,status\n");
}

#[test]
fn extreme_numbers_on_the_command_line_do_no_harm() {
    let folder = scene();
    says(
        &folder.refused("contacts cube.obj cube.sdf.h5 --margin 1e300"),
        &["--margin 1.0000e300", "use a smaller --margin"],
    );
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
