//! Names in the documents exist in the code, and the reverse. Sources keep the rules of CONTRIBUTING.md that can be counted.

use std::collections::{BTreeMap, BTreeSet};
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

struct Source {
    path: PathBuf,
    text: String,
}

fn read_sources(folder: &Path, sources: &mut Vec<Source>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("target") {
            read_sources(&path, sources);
        } else if path.extension().is_some_and(|end| end == "rs") {
            let text = fs::read_to_string(&path).unwrap();
            sources.push(Source { path, text });
        }
    }
}

/// Every Rust file of the workspace.
fn sources() -> Vec<Source> {
    let mut sources = Vec::new();
    members().iter().for_each(|folder| read_sources(&root().join(folder), &mut sources));
    sources
}

#[test]
fn every_test_that_a_promise_names_exists() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let promises = text.split("## Promises").nth(1).unwrap();
    // Test names are sentences of several words.
    let names: BTreeSet<&str> =
        promises.split('`').skip(1).step_by(2).filter(|name| name.matches('_').count() > 2).collect();
    let sources = sources();
    let is_missing = |name: &&&str| !sources.iter().any(|source| source.text.contains(&format!("fn {name}(")));
    let missing: Vec<&&str> = names.iter().filter(is_missing).collect();
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

#[test]
fn no_source_file_has_more_than_400_lines() {
    let sources = sources();
    let is_long = |source: &&Source| source.text.lines().count() > 400;
    let long: Vec<&PathBuf> = sources.iter().filter(is_long).map(|source| &source.path).collect();
    assert!(sources.len() > 300 && long.is_empty(), "split these files: {long:#?}");
}

#[test]
fn doc_comments_begin_with_a_noun_or_a_verb() {
    let wrong = ["Of ", "That ", "Those ", "What ", "By ", "More than ", "Less than ", "For which ", "For whom "];
    let mut found = Vec::new();
    for Source { path, text } in sources() {
        let mut is_inside = false;
        for (number, line) in (1..).zip(text.lines()) {
            let line = line.trim_start();
            let comment = line.strip_prefix("///").or(line.strip_prefix("//!"));
            if !is_inside && comment.is_some_and(|text| wrong.iter().any(|word| text.trim_start().starts_with(word))) {
                found.push(format!("{}:{number}: {line}", path.display()));
            }
            is_inside = comment.is_some();
        }
    }
    assert!(found.is_empty(), "rewrite these comments: {found:#?}");
}

#[test]
fn no_two_public_types_of_a_crate_share_a_name() {
    let mut all = 0;
    for member in members() {
        let mut sources = Vec::new();
        read_sources(&root().join(&member).join("src"), &mut sources);
        let mut files = BTreeMap::<&str, Vec<&PathBuf>>::new();
        for Source { path, text } in &sources {
            let public = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
            for name in public.lines().filter_map(type_name) {
                files.entry(name).or_default().push(path);
            }
        }
        all += files.len();
        files.retain(|_, files| files.len() > 1);
        assert!(files.is_empty(), "{member}: rename all but one of these types: {files:#?}");
    }
    assert!(all > 100, "found {all} public types only");
}

/// The name of the public type that a line declares.
fn type_name(line: &str) -> Option<&str> {
    let (kind, rest) = line.trim_start().strip_prefix("pub ")?.split_once(' ')?;
    let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
    ["struct", "enum", "union", "trait", "type"].contains(&kind).then_some(&rest[..end]).filter(|name| !name.is_empty())
}
