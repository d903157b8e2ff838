//! A temporary folder in which a test runs the program, and checks of its refusals.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use assert_cmd::Command;
use predicates::prelude::*;
use serde_json::Value;
use tempfile::TempDir;

pub const SDFTOOL: &str = env!("CARGO_BIN_EXE_sdftool");

/// Longer than any test takes on a slow machine: a program that hangs is ended.
const PATIENCE: Duration = Duration::from_secs(300);

/// A temporary folder of one test, in which it runs the program.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    pub fn at(&self, name: &str) -> PathBuf {
        self.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.at(name), content).unwrap();
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.at(name)).unwrap()
    }

    /// Sorted names of all entries, hidden ones too.
    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// The program with these arguments, separated by spaces.
    pub fn sdftool(&self, words: &str) -> Command {
        let mut command = Command::new(SDFTOOL);
        command.args(words.split_whitespace()).current_dir(self.path()).timeout(PATIENCE);
        command
    }

    /// Standard output of a run that must succeed, with nothing on standard error.
    pub fn done(&self, words: &str) -> String {
        done(&mut self.sdftool(words), words)
    }

    /// The single JSON object on standard output.
    pub fn json(&self, words: &str) -> Value {
        let printed = self.done(&format!("{words} --json"));
        assert_eq!(printed.matches('\n').count(), 1, "{words}: more than one line: {printed}");
        let object: Value =
            serde_json::from_str(&printed).unwrap_or_else(|error| panic!("{words}: {error}: {printed}"));
        assert!(object.is_object(), "{words}: {object}");
        object
    }

    /// The one-line error of a run that must fail and leave the folder as it was.
    pub fn refused(&self, words: &str) -> String {
        self.refuses(&mut self.sdftool(words), words)
    }

    /// The one-line error of a run that finds wrong usage when it begins.
    pub fn misused(&self, words: &str) -> String {
        self.refuses_with(2, &mut self.sdftool(words), words)
    }

    pub fn refuses(&self, command: &mut Command, what: &str) -> String {
        self.refuses_with(1, command, what)
    }

    fn refuses_with(&self, status: i32, command: &mut Command, what: &str) -> String {
        let before = self.names();
        let line = refused_with(status, command, what);
        assert_eq!(self.names(), before, "{what}: left files behind");
        line
    }

    /// The message about a wrong command line.
    pub fn wrong_usage(&self, words: &str) -> String {
        let before = self.names();
        let assert = self.sdftool(words).assert().code(2).stdout("");
        let message = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
        assert!(message.starts_with("error: ") && !message.contains("panicked"), "{words}: {message}");
        assert_eq!(self.names(), before, "{words}: left files behind");
        message
    }
}

pub fn done(command: &mut Command, what: &str) -> String {
    let output = command.output().unwrap();
    let [stdout, stderr] = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    assert!(output.status.success() && stderr.is_empty(), "{what}: {}: {stderr}{stdout}", output.status);
    stdout
}

pub fn refused(command: &mut Command, what: &str) -> String {
    refused_with(1, command, what)
}

fn refused_with(status: i32, command: &mut Command, what: &str) -> String {
    let output = command.output().unwrap();
    let [stdout, stderr] = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    assert_eq!(output.status.code(), Some(status), "{what}: {}: {stderr}{stdout}", output.status);
    assert!(predicate::str::contains("panicked").not().eval(&stderr), "{what}: {stderr}");
    assert_eq!(stdout, "", "{what}");
    let line = stderr.strip_suffix('\n').unwrap_or_else(|| panic!("{what}: no end of line: {stderr:?}"));
    let sentence = line.strip_prefix("sdftool: ").unwrap_or_else(|| panic!("{what}: {line:?}"));
    assert!(!sentence.is_empty() && !sentence.contains(char::is_control), "{what}: not one line: {stderr:?}");
    assert!(sentence.chars().count() < 400, "{what}: too long: {sentence}");
    sentence.to_owned()
}

/// Asserts that a line contains all of these.
#[track_caller]
pub fn says(line: &str, words: &[&str]) {
    for word in words {
        assert!(line.contains(word), "{word:?} is missing in: {line}");
    }
}
