//! Cargo commands, paths and links in the documents lead somewhere.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Name and text of README.md, ARCHITECTURE.md, CONTRIBUTING.md and the pages of docs.
fn documents() -> Vec<(String, String)> {
    let pages = fs::read_dir(root().join("docs")).unwrap();
    let pages = pages.map(|entry| format!("docs/{}", entry.unwrap().file_name().to_string_lossy()));
    let names = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"].map(str::to_owned).into_iter();
    let names = names.chain(pages.filter(|name| name.ends_with(".md")));
    names.map(|name| (name.clone(), fs::read_to_string(root().join(name)).unwrap())).collect()
}

/// Lines of code blocks without comments, and code spans of all other lines.
fn code(text: &str) -> Vec<&str> {
    let (mut pieces, mut in_block) = (Vec::new(), false);
    for line in text.lines() {
        if line.starts_with("```") {
            in_block = !in_block;
        } else if in_block {
            pieces.push(line.split(" #").next().unwrap().trim());
        } else {
            pieces.extend(line.split('`').skip(1).step_by(2));
        }
    }
    pieces
}

/// Name, whether it is a default member, and targets as (kind, name) of each package.
struct Package {
    name: String,
    is_default: bool,
    targets: Vec<(String, String)>,
}

/// The packages of the workspace with this manifest.
fn packages(manifest: &str) -> Vec<Package> {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(["metadata", "--no-deps", "--offline", "--locked", "--format-version", "1"]);
    cargo.args(["--manifest-path", manifest]).current_dir(root());
    let output = cargo.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    let read = |package: &Value| Package {
        name: text(&package["name"]),
        is_default: metadata["workspace_default_members"].as_array().unwrap().contains(&package["id"]),
        targets: package["targets"]
            .as_array()
            .unwrap()
            .iter()
            .map(|target| (text(&target["kind"][0]), text(&target["name"])))
            .collect(),
    };
    metadata["packages"].as_array().unwrap().iter().map(read).collect()
}

/// `cargo run` must mean exactly one program. `packages` are those of the project, unless the command names another manifest.
fn run_is_clear(command: &str, packages: &[Package]) -> bool {
    let words: Vec<&str> = command.split_whitespace().take_while(|word| *word != "--").collect();
    let value = |option: &str| words.windows(2).find(|pair| pair[0] == option).map(|pair| pair[1]);
    let others = value("--manifest-path").map(self::packages);
    let packages = others.as_deref().unwrap_or(packages);
    let chosen = packages.iter().filter(|package| match value("-p") {
        Some(name) => package.name == name,
        None => package.is_default,
    });
    let (kind, name) = value("--example").map_or(("bin", value("--bin")), |name| ("example", Some(name)));
    let targets = chosen.flat_map(|package| &package.targets);
    targets.filter(|target| target.0 == kind && name.is_none_or(|name| target.1 == name)).count() == 1
}

#[test]
fn every_cargo_run_in_the_documents_names_one_program() {
    let (packages, mut count) = (packages("Cargo.toml"), 0);
    for (name, text) in documents() {
        for command in code(&text).into_iter().filter(|piece| piece.starts_with("cargo run")) {
            count += 1;
            assert!(run_is_clear(command, &packages), "{name}: `{command}` names no program, or several");
        }
    }
    assert!(count > 5, "{count} commands");
}

/// Paths below a folder, relative to the root, without what is built.
fn read_paths(folder: &Path, paths: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        paths.push(path.strip_prefix(root()).unwrap().to_owned());
        if path.is_dir() && !path.ends_with("target") && !path.ends_with(".git") && !path.ends_with("shared") {
            read_paths(&path, paths);
        }
    }
}

#[test]
fn every_path_in_the_guides_to_the_code_exists() {
    let mut paths = Vec::new();
    read_paths(&root(), &mut paths);
    for name in ["ARCHITECTURE.md", "CONTRIBUTING.md"] {
        let text = fs::read_to_string(root().join(name)).unwrap();
        let words = code(&text).into_iter().flat_map(str::split_whitespace);
        // A path's last part alone will do, such as `engine.rs` beside the path of its folder.
        let named: Vec<&str> = words
            .filter(|word| !word.contains("NAME") && word.is_ascii() && !word.contains("::"))
            .filter(|word| word.contains('/') || [".rs", ".md", ".sh", ".toml"].iter().any(|end| word.ends_with(end)))
            .collect();
        let missing: Vec<&&str> = named.iter().filter(|word| !paths.iter().any(|path| path.ends_with(word))).collect();
        assert!(named.len() > 10 && missing.is_empty(), "{name}: {} named, missing: {missing:?}", named.len());
    }
}

#[test]
fn every_link_in_the_documents_leads_to_a_file() {
    let mut count = 0;
    for (name, text) in documents() {
        let folder = root().join(&name).parent().unwrap().to_owned();
        let links = text.split("](").skip(1).map(|rest| rest.split([')', '#']).next().unwrap());
        for link in links.filter(|link| !link.is_empty() && !link.contains("://")) {
            count += 1;
            assert!(folder.join(link).exists(), "{name}: {link} does not exist");
        }
    }
    assert!(count > 20, "{count} links");
}
