//! How the program says that it failed: one line on standard error; with --json, an object on standard output too, unless the command
//! has printed its own.

use std::ffi::OsStr;
use std::io::{ErrorKind, Write, stdout};
use std::process::ExitCode;

use anyhow::Context;
use clap::error::ErrorKind as Usage;
use serde_json::json;

use crate::report::{complain, print_json};

/// Prints help, the version, or what is wrong with the arguments. Returns the exit status: 2 for wrong arguments.
pub fn end_on_usage(error: &clap::Error) -> ExitCode {
    if matches!(error.kind(), Usage::DisplayHelp | Usage::DisplayVersion) {
        return end(error.print().and_then(|()| stdout().flush()).context("standard output"));
    }
    if is_json_wanted() {
        let text = error.render().to_string();
        print_object(&usage_sentence(&text));
    }
    // Where standard error cannot be written to, the exit status remains.
    let _ = error.print();
    ExitCode::from(2)
}

/// Reports an error, unless the reader of our output has seen enough. Returns the exit status.
pub fn end(result: anyhow::Result<()>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            report(&error);
            ExitCode::from(status(&error))
        }
    }
}

/// The first paragraph on one line, without the usage and advice that follow. Its later lines name arguments or values.
fn usage_sentence(text: &str) -> String {
    let mut lines = text.lines().map(str::trim).take_while(|line| !line.is_empty());
    let first = lines.next().unwrap_or_default().trim_start_matches("error: ");
    let named = lines.collect::<Vec<_>>().join(", ");
    format!("{first} {named}").trim_end().to_owned()
}

/// Wrong usage that a command finds when it begins; status 2.
#[derive(Debug)]
pub struct WrongUsage(pub String);

impl std::fmt::Display for WrongUsage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for WrongUsage {}

/// Returns with [`WrongUsage`]; takes what `format!` takes.
macro_rules! misuse {
    ($($text:tt)*) => { return Err($crate::failure::WrongUsage(format!($($text)*)).into()) };
}
pub(crate) use misuse;

/// Reports what went wrong.
pub fn report(error: &anyhow::Error) {
    let sentence = sentence(error);
    // Of several meshes each has had its object, and so has a field that does not match.
    if is_json_wanted() && !error.is::<FleetFailure>() && !error.is::<Mismatch>() {
        print_object(&sentence);
    }
    complain(&sentence);
}

/// Some of several meshes were not baked.
#[derive(Debug)]
pub struct FleetFailure {
    pub failed: usize,
    pub all: usize,
}

impl std::fmt::Display for FleetFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} of {} meshes were not baked", self.failed, self.all)
    }
}

impl std::error::Error for FleetFailure {}

/// A field does not match its mesh, as the command's own object says.
#[derive(Debug)]
pub struct Mismatch(pub String);

impl std::fmt::Display for Mismatch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Mismatch {}

/// Exit status: 2 for wrong usage, 3 where some of several meshes were baked and others not, else 1.
fn status(error: &anyhow::Error) -> u8 {
    let some = error.downcast_ref::<FleetFailure>().is_some_and(|fleet| fleet.failed < fleet.all);
    match error.is::<WrongUsage>() {
        true => 2,
        false if some => 3,
        false => 1,
    }
}

/// `true` if the reader of our output has seen enough, as `head` does.
fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let io = error.chain().find_map(|cause| cause.downcast_ref::<std::io::Error>());
    io.is_some_and(|io| io.kind() == ErrorKind::BrokenPipe)
}

/// The error and its causes on one line. Many errors end with their cause, which then is not said again.
pub fn sentence(error: &anyhow::Error) -> String {
    let mut sentence = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if sentence.is_empty() {
            sentence = cause;
        } else if !sentence.ends_with(&cause) {
            sentence = format!("{sentence}: {cause}");
        }
    }
    on_one_line(&sentence)
}

/// A file's name may hold line feeds, and what a terminal would act on.
pub fn on_one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }).collect()
}

/// Whether an argument before `--` is --json: asked before the arguments are known to be right.
fn is_json_wanted() -> bool {
    std::env::args_os().take_while(|argument| argument != OsStr::new("--")).any(|argument| argument == "--json")
}

fn print_object(sentence: &str) {
    // Where standard output cannot be written to, the line on standard error remains.
    let _ = print_json(&json!({"schema": "sdftool.error/1", "error": sentence}));
}
