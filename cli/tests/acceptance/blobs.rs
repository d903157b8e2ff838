//! Blobs claim no more than the grid that they were exported from, and no command takes them for closed forms.

use crate::folder::{Folder, says};
use crate::meshes::Model;

/// A ball of radius 1 in a sparse grid, `ball.sdf.h5`, whose band of 3 cells is a small part of its padding.
fn scene() -> Folder {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    folder.write("away.obj", Model::ball([0.0, 0.0, 1.9], 0.2, 1).obj());
    folder.done("bake ball.obj --res 24 --layout sparse --padding 16");
    folder
}

/// Standard error of a run that finds a mismatch.
fn mismatch(folder: &Folder, words: &str) -> String {
    let output = folder.sdftool(words).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{words}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_grid_sampled_again_has_distances_within_its_band_alone() {
    let folder = scene();
    folder.done("export ball.sdf.h5 --res 100 -o again.sdfb");
    let band = folder.json("info ball.sdf.h5")["band"].clone();
    assert_eq!(folder.json("info again.sdfb")["band"], band);
    for margin in ["0.8", "-0.8"] {
        for words in ["contacts away.obj", "compare away.obj"] {
            says(
                &folder.refused(&format!("{words} again.sdfb --margin {margin}")),
                &["again.sdfb: a margin of", "has distances"],
            );
        }
    }
    folder.done("contacts away.obj again.sdfb --margin 0.2");
    folder.done("export ball.sdf.h5 --res 100 -o again.raw");
    says(&String::from_utf8(folder.read("again.raw.json")).unwrap(), &[&format!("\"band\": {band}")]);
    // Cut to the grid's, which the report says.
    let json = folder.json("export ball.sdf.h5 --res 100 --band 50 -o again.nvdb");
    assert_eq!(json["band"], band);
    says(&folder.done("export ball.sdf.h5 --band 50 -o again.nvdb"), &["band  ", "3.000000 voxels"]);
    folder.write(
        "more.sdf.toml",
        "[field]\nshape = 'offset'\ndistance = 0.7\nof = { shape = 'grid', file = 'ball.sdf.h5' }\n",
    );
    for format in ["npy", "glb", "blob", "nvdb"] {
        says(
            &folder.refused(&format!("export more.sdf.toml --format {format}")),
            &["more.sdf.toml: its surface lies beyond"],
        );
    }
}

#[test]
fn verify_refuses_a_blob_of_another_mesh() {
    let folder = scene();
    folder.write("larger.obj", Model::ball([0.0; 3], 1.2, 3).obj());
    for bake in ["", "--precision u16", "--layout sparse", "--layout sparse --precision u8"] {
        folder.done(&format!("bake ball.obj --res 24 {bake} -o of.sdf.h5"));
        for precision in ["", "--precision u8"] {
            folder.done(&format!("export of.sdf.h5 -o of.sdfb {precision}"));
            let shown = folder.done("verify of.sdfb ball.obj --points 2000 --all-nodes");
            says(&shown, &["nodes  ", "certified  at most", "slope  "]);
            let said = mismatch(&folder, "verify of.sdfb larger.obj --points 2000 --all-nodes");
            says(&said, &["of.sdfb does not match larger.obj", "more than the certified"]);
        }
    }
    says(&folder.misused("verify of.sdfb ball.obj --tight"), &["--tight", "a blob does not say"]);
    // Nothing is certified of what was sampled.
    folder.done("export ball.sdf.h5 --res 30 -o again.sdfb");
    says(&folder.done("verify again.sdfb ball.obj --points 2000"), &["no error is certified"]);
}

#[test]
fn a_mismatch_is_one_object() {
    let folder = scene();
    folder.write("larger.obj", Model::ball([0.0; 3], 1.2, 3).obj());
    let assert = folder.sdftool("verify ball.sdf.h5 larger.obj --points 2000 --json").assert().code(1);
    let printed = String::from_utf8_lossy(&assert.get_output().stdout).into_owned();
    let object: serde_json::Value = serde_json::from_str(&printed).unwrap();
    assert_eq!(object["schema"], "sdftool.verify/1");
    assert!(!object["faults"].as_array().unwrap().is_empty(), "{object}");
}

#[test]
fn a_surface_of_a_blob_is_that_of_its_grid() {
    let folder = scene();
    folder.done("export ball.sdf.h5 -o ball.sdfb");
    folder.write("moved.sdf.toml", "[field]\nshape = 'grid'\nfile = 'ball.sdfb'\npose = { translation = [1, 0, 0] }\n");
    for field in ["ball.sdf.h5", "ball.sdfb", "moved.sdf.toml"] {
        for level in ["0.8", "-0.8"] {
            let line = folder.refused(&format!("surface {field} --level {level} -o x.ply"));
            says(&line, &[field, "lies beyond the band"]);
        }
    }
    for words in ["", "--level 0.1", "--res 40"] {
        let surfaces = ["ball.sdf.h5", "ball.sdfb"].map(|field| {
            folder.done(&format!("surface {field} {words} -o x.ply"));
            folder.read("x.ply")
        });
        assert!(surfaces[0] == surfaces[1], "{words}");
    }
}

#[test]
fn a_blob_keeps_what_it_states() {
    let folder = scene();
    folder.done("export ball.sdf.h5 -o ball.sdfb");
    let bound = folder.json("info ball.sdf.h5")["error_bound"].clone();
    folder.done("view ball.sdfb -o ball.html");
    let page = String::from_utf8(folder.read("ball.html")).unwrap();
    assert!(page.contains("certified error") && !page.contains("a closed form"));
    folder.done("export ball.sdfb -o ball.raw");
    let facts: serde_json::Value = serde_json::from_slice(&folder.read("ball.raw.json")).unwrap();
    assert_eq!(facts["error_bound"], bound);
    folder.done("export ball.sdfb -o again.sdfb");
    assert!(folder.read("again.sdfb") == folder.read("ball.sdfb"));
}

#[test]
fn view_refuses_the_margins_that_contacts_refuses() {
    let folder = scene();
    folder.done("export ball.sdf.h5 -o ball.sdfb");
    folder.write("moved.sdf.toml", "[field]\nshape = 'grid'\nfile = 'ball.sdfb'\n");
    for (field, margin) in
        [("ball.sdf.h5", "0.8"), ("ball.sdf.h5", "-0.8"), ("ball.sdfb", "0.8"), ("moved.sdf.toml", "-0.8")]
    {
        for words in ["view FIELD away.obj -o x.html", "contacts away.obj FIELD"] {
            let line = folder.refused(&format!("{} --margin {margin}", words.replace("FIELD", field)));
            says(&line, &[field, "has distances"]);
        }
    }
}

/// Voxels are 1/50 wide: beyond 3,400 from the origin f32 rounds coordinates by more than a hundredth of that.
#[test]
fn tables_that_firmware_cannot_count_in_have_a_warning() {
    let folder = Folder::new();
    for (name, away, size, wanted) in [
        ("near", 1e3, 1.0, None),
        ("far", 1e5, 1.0, Some("counts in f32, in which coordinates here are off by up to 0.")),
        ("huge", 0.0, 1e20, Some("counts in f32 and answers to nothing beyond 1e18")),
    ] {
        folder.write(&format!("{name}.obj"), Model::ball([away, 0.0, 0.0], size, 2).obj());
        folder.done(&format!("bake {name}.obj --res 100"));
        for format in ["blob", "c", "rust"] {
            let words = format!("export {name}.sdf.h5 --format {format}");
            let output = folder.sdftool(&words).output().unwrap();
            let told = String::from_utf8(output.stderr).unwrap();
            assert!(output.status.success() && told.contains(wanted.unwrap_or_default()), "{words}: {told}");
            assert_eq!(told.is_empty(), wanted.is_none(), "{words}: {told}");
        }
        assert!(folder.json(&format!("export {name}.sdf.h5 --format npy"))["warning"].is_null());
    }
}
