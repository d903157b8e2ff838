//! Promise 13: no input makes the program crash, hang, or use memory out of proportion. Each is refused with one line that says
//! what is wrong, where, and what to do.

mod arguments;
mod grids;
mod meshes;
mod shapes;

use std::time::Instant;

use sdf_procedural::random::Random;

use crate::folder::{Folder, says};
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
    for words in readers_of(name) {
        assert_eq!(folder.refused(&words), line);
    }
    assert!(line.starts_with(name), "{line}");
    line
}

/// Commands, beside `eval`, that read a field and the cube.
fn readers_of(name: &str) -> [String; 4] {
    [
        format!("contacts cube.obj {name} -o list.csv"),
        format!("verify {name} cube.obj --points 10"),
        format!("slice {name} -o slice.png"),
        format!("surface {name} -o surface.obj"),
    ]
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

/// A device reports no size but has endless data.
#[cfg(target_os = "linux")]
#[test]
fn an_endless_file_is_refused_as_a_field() {
    let folder = scene();
    let started = Instant::now();
    says(&folder.refused("info /dev/zero"), &["/dev/zero", "TOML"]);
    says(&folder.refused("eval cube.sdf.h5 --points /dev/zero"), &["/dev/zero", "a device"]);
    assert!(started.elapsed().as_secs() < 20);
}
