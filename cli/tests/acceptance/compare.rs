//! `compare` judges every method by the certified answer; `completions` and `man` print what they promise.

use crate::folder::{Folder, says};
use crate::meshes::Model;

/// A spike whose apex pokes through the middle of large triangles, where samples do not look.
const SPIKE: &str = "[field]\nshape = 'cone'\nhalf_angle_deg = 5.0\nheight = 1.0\n";

/// A triangle with the apex at weights that no regular sample has.
const SHEET: &str = "v -1 -1.1 -0.02\nv 1.3 -1 -0.02\nv 0.1 1.2 -0.02\nf 1 2 3\n";

#[test]
fn compare_counts_what_samples_miss_and_recommends_a_method_that_misses_nothing() {
    let folder = Folder::new();
    folder.write("spike.sdf.toml", SPIKE);
    folder.write("sheet.obj", SHEET);
    let report = folder.json("compare sheet.obj spike.sdf.toml --rounds 1 -o report.html");
    assert_eq!((&report["schema"], &report["contacts"]), (&"sdftool.compare/1".into(), &1.into()));
    let methods = report["methods"].as_array().unwrap();
    let of = |name: &str| methods.iter().find(|method| method["method"] == name).unwrap();
    assert_eq!(of("sample16")["missed"], 1, "{report}");
    assert!(of("sample16")["error_worst"].as_f64().unwrap() > 0.01, "{report}");
    assert_eq!(of("auto")["missed"], 0, "{report}");
    assert!(of("auto")["error_worst"].as_f64().unwrap() < 3e-3, "{report}");
    let recommended = of(report["recommended"].as_str().unwrap());
    assert_eq!(recommended["missed"], 0, "{report}");
    let page = String::from_utf8(folder.read("report.html")).unwrap();
    says(&page, &["<svg", "sheet.obj on spike.sdf.toml", "recommended", "sample64", "</html>"]);
    assert!(!page.contains("http://") && !page.contains("https://"), "the page loads nothing");
}

#[test]
fn compare_offers_faces_and_edges_alone() {
    let folder = Folder::new();
    says(&folder.done("compare --help"), &["faces or edges", "[possible values: faces, edges]"]);
    folder.write("spike.sdf.toml", SPIKE);
    folder.write("sheet.obj", SHEET);
    let line = folder.misused("compare sheet.obj spike.sdf.toml --elements vertices");
    says(&line, &["every method is the same on vertices: use faces or edges"]);
}

#[test]
fn without_contacts_auto_is_recommended_however_fast_the_others_are() {
    let folder = Folder::new();
    folder.write("spike.sdf.toml", SPIKE);
    folder.write("far.obj", Model::hills(40).moved(|[x, y, z]| [x, y, z + 9.0]).obj());
    for _ in 0..8 {
        let report = folder.json("compare far.obj spike.sdf.toml --rounds 1");
        assert_eq!((&report["contacts"], &report["recommended"]), (&0.into(), &"auto".into()), "{report}");
    }
    says(&folder.done("compare far.obj spike.sdf.toml"), &["recommended: auto: there are no contacts here"]);
}

#[test]
fn compare_names_edges_methods_and_refuses_vertices_and_margins_beyond_the_grid() {
    let folder = Folder::new();
    folder.write("sphere.sdf.toml", "[field]\nshape = 'sphere'\nradius = 1.0\n");
    folder.write("sheet.obj", Model::hills(4).obj());
    let edges = folder.json("compare sheet.obj sphere.sdf.toml --elements edges --rounds 1 --margin 1");
    assert!(edges["methods"].as_array().unwrap().iter().any(|method| method["method"] == "gss"), "{edges}");
    says(&folder.misused("compare sheet.obj sphere.sdf.toml --elements vertices"), &["vertices", "faces or edges"]);
    folder.write("ball.obj", Model::cube().obj());
    folder.done("bake ball.obj --res 8");
    says(&folder.refused("compare sheet.obj ball.sdf.h5 --margin 100"), &["ball.sdf.h5", "--margin", "--padding"]);
}

#[test]
fn completions_and_manual_pages_name_every_command() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish"] {
        says(&folder.done(&format!("completions {shell}")), &["bake", "contacts", "compare"]);
    }
    says(&folder.done("man"), &[".TH sdftool", "bake"]);
    folder.done("man -o pages");
    says(&String::from_utf8(folder.read("pages/sdftool-compare.1")).unwrap(), &["rounds"]);
}
