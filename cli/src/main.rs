//! `sdftool`: arguments, progress, tables and pictures. What is computed is computed in sdf-core, sdf-bake and
//! sdf-formats.

#![forbid(unsafe_code)]

mod args;
mod commands;
mod csv_points;
mod histogram;
mod memory;
mod mesh_input;
mod output;
mod pictures;
mod progress;
mod read_summary;
mod report;

use std::io::ErrorKind;
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

use clap::error::ErrorKind as Usage;
use clap::{CommandFactory, Parser};

use args::{Args, Command};

/// What a program that Ctrl-C ended answers: 128 and the signal's number.
const INTERRUPTED: i32 = 130;

/// Held by whoever ends the program: after Ctrl-C nothing more is said, of the file that is gone least of all.
static ENDING: Mutex<()> = Mutex::new(());

fn main() -> ExitCode {
    let Args { command } = Args::parse();
    if let Err(what) = command.check() {
        Args::command().error(Usage::ArgumentConflict, what).exit();
    }
    let handled = ctrlc::set_handler(|| {
        let _ending = ENDING.lock().unwrap_or_else(PoisonError::into_inner);
        let _removed = sdf_formats::remove_temporaries();
        std::process::exit(INTERRUPTED);
    });
    let result = handled.map_err(anyhow::Error::from).and_then(|()| match command {
        Command::Bake(args) => commands::bake::run(&args),
        Command::Contacts(args) if sdf_formats::field_file::is_field(&args.mesh) => commands::overlap::run(&args),
        Command::Contacts(args) => commands::contacts::run(&args),
        Command::Compare(args) => commands::compare::run(&args),
        Command::Eval(args) => commands::eval::run(&args),
        Command::Info(args) => commands::info::run(&args),
        Command::Verify(args) => commands::verify::run(&args),
        Command::Slice(args) => commands::slice::run(&args),
        Command::Surface(args) => commands::surface::run(&args),
        Command::Demo(args) => commands::demo::run(&args),
        Command::Completions(args) => commands::shell::completions(&args),
        Command::Man(args) => commands::shell::man(&args),
    });
    // Never given back.
    std::mem::forget(ENDING.lock().unwrap_or_else(PoisonError::into_inner));
    match result {
        Ok(()) => ExitCode::SUCCESS,
        // The reader of our output has seen enough, as `head` does.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("sdftool: {}", on_one_line(&format!("{error:#}")));
            ExitCode::FAILURE
        }
    }
}

/// A file's name may hold line feeds, and what a terminal would act on.
fn on_one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }).collect()
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let io = error.chain().find_map(|cause| cause.downcast_ref::<std::io::Error>());
    io.is_some_and(|io| io.kind() == ErrorKind::BrokenPipe)
}
