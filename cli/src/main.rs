//! `sdftool`: arguments, progress, tables and pictures. The algorithms are in sdf-core, sdf-bake, sdf-formats and
//! sdf-field.

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

/// Exit status after Ctrl-C: 128 + SIGINT.
const INTERRUPTED: i32 = 130;

/// Locked by the thread that ends the program, so that nothing is printed after Ctrl-C.
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
    // The lock is never released.
    std::mem::forget(ENDING.lock().unwrap_or_else(PoisonError::into_inner));
    match result {
        Ok(()) => ExitCode::SUCCESS,
        // The reader closed the pipe, as `head` does.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("sdftool: {}", on_one_line(&format!("{error:#}")));
            ExitCode::FAILURE
        }
    }
}

/// Replaces control characters: a file's name may contain line feeds and escape sequences.
fn on_one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }).collect()
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let io = error.chain().find_map(|cause| cause.downcast_ref::<std::io::Error>());
    io.is_some_and(|io| io.kind() == ErrorKind::BrokenPipe)
}
