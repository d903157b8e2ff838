//! `contacts --all-minima`: an element that rests on several balls touches each.

use serde_json::Value;

use crate::folder::{Folder, says};

/// Three balls of radius 0.3 under a table, their tops 0.02, 0.05 and 0.01 above its lower side.
const BUMPS: &str = "[field]\nshape = \"union\"\nof = [\n\
    { shape = \"sphere\", radius = 0.3, pose.translation = [-1, -1, -0.28] },\n\
    { shape = \"sphere\", radius = 0.3, pose.translation = [1, -1, -0.25] },\n\
    { shape = \"sphere\", radius = 0.3, pose.translation = [-1, 1, -0.29] },\n]\n";

const TABLE: &str = "v -2 -2 0\nv 4 -2 0\nv -2 4 0\nf 1 2 3\n";

fn points(json: &Value) -> Vec<[f64; 2]> {
    let number = |value: &Value| value.as_f64().unwrap();
    let contacts = json["contacts"].as_array().unwrap();
    contacts.iter().map(|contact| [0, 1].map(|axis| number(&contact["point"][axis]))).collect()
}

#[test]
fn a_table_on_three_balls_touches_each_of_them_deepest_first() {
    let folder = Folder::new();
    folder.write("bumps.sdf.toml", BUMPS);
    folder.write("table.obj", TABLE);
    let one = folder.json("contacts table.obj bumps.sdf.toml");
    let all = folder.json("contacts table.obj bumps.sdf.toml --all-minima");
    assert_eq!((points(&one).len(), &one["passed_cull"]), (1, &1.into()));
    assert_eq!((&all["elements"], &all["passed_cull"]), (&1.into(), &1.into()));
    let expected = [[1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]];
    for (found, expected) in points(&all).iter().zip(expected) {
        assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 0.01), "{found:?} is not {expected:?}");
    }
    assert_eq!(points(&all).len(), 3);
    let contacts = all["contacts"].as_array().unwrap();
    assert!(contacts.iter().all(|contact| contact["id"] == 0 && contact["status"] == "converged"), "{all}");
    let mut keys: Vec<&Value> = contacts.iter().map(|contact| &contact["key"]).collect();
    keys.dedup();
    assert_eq!(keys.len(), 3);
    // A smaller margin excludes one of them.
    let two = folder.json("contacts table.obj bumps.sdf.toml --all-minima --margin=-0.015");
    assert_eq!(points(&two).len(), 2);
}

#[test]
fn all_minima_are_the_same_on_any_number_of_threads() {
    let folder = Folder::new();
    folder.write("bumps.sdf.toml", BUMPS);
    folder.write("table.obj", TABLE);
    for elements in ["faces", "edges", "vertices"] {
        let written = |threads: u32| {
            folder.done(&format!(
                "contacts table.obj bumps.sdf.toml --all-minima --elements {elements} --margin 0.3 --threads {threads} -o out.csv"
            ));
            folder.read("out.csv")
        };
        assert_eq!(written(1), written(3), "{elements}");
    }
}

#[test]
fn all_minima_by_a_local_method_is_wrong_usage() {
    let folder = Folder::new();
    folder.write("bumps.sdf.toml", BUMPS);
    folder.write("table.obj", TABLE);
    says(
        &folder.wrong_usage("contacts table.obj bumps.sdf.toml --all-minima --method fw"),
        &["--all-minima", "--method"],
    );
}

#[test]
fn a_table_that_a_spent_budget_leaves_open_is_told() {
    let folder = Folder::new();
    folder.write("bumps.sdf.toml", BUMPS);
    folder.write("table.obj", TABLE);
    let search = "contacts table.obj bumps.sdf.toml --method certified --margin=-0.049";
    let json = folder.json(&format!("{search} --iterations 4"));
    assert_eq!((points(&json).len(), &json["undecided"]), (0, &1.into()));
    says(
        &folder.done(&format!("{search} --iterations 4")),
        &["undecided  1 elements may be within the margin", "more --iterations or a smaller --tolerance", "--complete"],
    );
    // A closed form has no error that could leave it open.
    let listed = folder.done(&format!("{search} --iterations 4 --complete"));
    says(&listed, &["possible  1 of the contacts: the search leaves open"]);
    assert!(!listed.contains("grid"), "{listed}");
    let decided = folder.done(&format!("{search} --complete"));
    assert!(!decided.contains("possible"), "{decided}");
    let json = folder.json(search);
    assert_eq!((points(&json).len(), &json["undecided"]), (1, &0.into()));
}
