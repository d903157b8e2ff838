//! Names in the documents exist in the code, and the reverse.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use sdf_tests::methods::methods;
use sdf_tests::stability::cases::CASES;
use sdf_tests::stability::problem::{BUDGET, name};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Folders of the workspace's crates.
fn members() -> Vec<String> {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let list = manifest.split("\nmembers = [").nth(1).unwrap().split(']').next().unwrap();
    list.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

fn read_sources(folder: &Path, sources: &mut Vec<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("target") {
            read_sources(&path, sources);
        } else if path.extension().is_some_and(|end| end == "rs") {
            sources.push(fs::read_to_string(path).unwrap());
        }
    }
}

#[test]
fn every_test_that_a_promise_names_exists() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let promises = text.split("## Promises").nth(1).unwrap();
    // Test names are sentences of several words.
    let names: BTreeSet<&str> =
        promises.split('`').skip(1).step_by(2).filter(|name| name.matches('_').count() > 2).collect();
    let mut code = Vec::new();
    members().iter().for_each(|folder| read_sources(&root().join(folder), &mut code));
    let missing: Vec<&&str> =
        names.iter().filter(|name| !code.iter().any(|source| source.contains(&format!("fn {name}(")))).collect();
    assert!(names.len() > 20 && missing.is_empty(), "{} named, missing: {missing:?}", names.len());
}

#[test]
fn every_promise_has_its_number() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    assert!((1..=13).all(|number| text.contains(&format!("\n{number}. "))));
}

#[test]
fn the_report_on_stability_names_every_case_and_method() {
    let text = fs::read_to_string(root().join("docs/stability.md")).unwrap();
    let cases = CASES.iter().map(|case| format!("| {} |", case.name));
    let methods = methods(2, BUDGET).iter().map(|method| format!("| {} |", name(method))).collect::<Vec<_>>();
    let missing: Vec<String> = cases.chain(methods).filter(|named| !text.contains(named)).collect();
    assert!(missing.is_empty(), "run cargo run -p sdf-tests --example stability, for {missing:?}");
}
