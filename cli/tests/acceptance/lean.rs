//! `contacts --lean` and `compare --lean`.

use serde_json::Value;

use crate::folder::{Folder, says};
use crate::meshes::Model;

fn scene() -> Folder {
    let folder = Folder::new();
    folder.write("cube.obj", Model::cube().obj());
    folder.write("sheet.obj", Model::hills(12).obj());
    folder.done("bake cube.obj --res 16");
    folder
}

#[test]
fn lean_contacts_have_the_points_and_distances_of_full_ones() {
    let folder = scene();
    for words in ["--method fw", "", "--elements edges --method gss", "--elements vertices", "--one-per-feature"] {
        let query = format!("contacts sheet.obj cube.sdf.h5 --margin 0.05 {words}");
        let [full, lean] = ["", " --lean"].map(|lean| folder.json(&format!("{query}{lean}")));
        let contacts = |report: &Value| report["contacts"].as_array().unwrap().clone();
        assert_eq!((contacts(&full).len(), &full["passed_cull"]), (contacts(&lean).len(), &lean["passed_cull"]));
        assert!(contacts(&full).len() > 10, "{words}: {}", contacts(&full).len());
        for (full, lean) in contacts(&full).iter().zip(&contacts(&lean)) {
            for name in ["id", "feature", "weights", "point", "distance", "lower_bound", "evaluations", "key"] {
                assert_eq!(full[name], lean[name], "{words}: {name} of {lean} in place of {full}");
            }
            assert!(full["error_bound"].is_number() && lean["error_bound"].is_null(), "{lean}");
            assert!(lean["shape_lower_bound"].is_null(), "{lean}");
        }
    }
    folder.done("contacts sheet.obj cube.sdf.h5 --margin 0.05 --lean -o lean.h5");
    folder.done("contacts sheet.obj cube.sdf.h5 --margin 0.05 --lean -o lean.csv");
    assert!(String::from_utf8(folder.read("lean.csv")).unwrap().lines().nth(1).unwrap().contains("inf"));
}

#[test]
fn what_lean_leaves_out_cannot_be_asked_for() {
    let folder = scene();
    for option in ["--all-minima", "--complete", "--exact"] {
        let refused = folder.misused(&format!("contacts sheet.obj cube.sdf.h5 --lean {option}"));
        says(&refused, &["--lean leaves out", option]);
    }
    says(&folder.misused("contacts cube.sdf.h5 cube.sdf.h5 --lean"), &["--lean needs a mesh"]);
}

#[test]
fn methods_are_compared_by_their_lean_contacts() {
    let folder = scene();
    let [full, lean] = ["", "--lean"]
        .map(|lean| folder.json(&format!("compare sheet.obj cube.sdf.h5 --margin 0.05 --rounds 1 {lean}")));
    let counts = |report: &Value| -> Vec<Value> {
        let rows = report["methods"].as_array().unwrap().iter();
        rows.map(|row| serde_json::json!([row["method"], row["contacts"], row["missed"], row["error_worst"]])).collect()
    };
    assert_eq!(counts(&full), counts(&lean));
}
