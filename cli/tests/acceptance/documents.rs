//! The program accepts every command line and every option that the documents show.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::folder::Folder;

/// README.md, CONTRIBUTING.md and the pages of docs.
fn documents() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let pages = fs::read_dir(root.join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let pages = pages.filter(|path| path.extension().is_some_and(|end| end == "md"));
    let pages = ["README.md", "CONTRIBUTING.md"].map(|name| root.join(name)).into_iter().chain(pages);
    pages.map(|path| fs::read_to_string(path).unwrap()).collect()
}

/// Lines of the shell blocks, without comments.
fn shell_lines(text: &str) -> impl Iterator<Item = &str> {
    let blocks = text.split("```sh\n").skip(1).map(|rest| rest.split("```").next().unwrap());
    blocks.flat_map(str::lines).map(|line| line.split('#').next().unwrap().trim())
}

/// Words such as `--margin` in the code spans that show the program's own options.
fn options(text: &str) -> BTreeSet<&str> {
    let spans = text.lines().flat_map(|line| line.split('`').skip(1).step_by(2));
    let own = spans.filter(|span| span.starts_with("--") || span.starts_with("sdftool "));
    own.flat_map(str::split_whitespace).filter(|word| word.starts_with("--")).collect()
}

#[test]
fn every_command_line_in_the_documents_is_accepted() {
    let text = documents();
    let starts = ["sdftool ", "cargo run --release -- "];
    let commands: Vec<&str> =
        shell_lines(&text).filter_map(|line| starts.iter().find_map(|start| line.strip_prefix(start))).collect();
    assert!(commands.len() > 10, "{commands:?}");
    for words in commands {
        // The files are missing, which is status 1. Wrong usage is 2.
        let output = Folder::new().sdftool(words).output().unwrap();
        let status = output.status.code();
        assert!(matches!(status, Some(0 | 1)), "{words}: {status:?}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn every_option_in_the_documents_is_in_the_help_of_a_command() {
    let folder = Folder::new();
    let commands = [
        "bake", "contacts", "compare", "eval", "info", "verify", "slice", "surface", "export", "import", "view",
        "simulate", "demo", "man",
    ];
    let help: String = commands.iter().map(|command| folder.done(&format!("help {command}"))).collect();
    let known: BTreeSet<&str> = help.split(|c: char| !c.is_ascii_alphanumeric() && c != '-').collect();
    let text = documents();
    let named = options(&text);
    let unknown: Vec<&&str> = named.iter().filter(|option| !known.contains(**option)).collect();
    assert!(named.len() > 10 && unknown.is_empty(), "{} named, unknown: {unknown:?}", named.len());
}
