//! `sdftool`: arguments, progress, tables and pictures. The algorithms are in sdf-core, sdf-bake, sdf-formats,
//! sdf-field and sdf-sim.

#![forbid(unsafe_code)]
// The document of a bake is one large object in `json!`.
#![recursion_limit = "256"]

mod args;
mod commands;
mod csv_points;
mod device;
mod error_regions;
mod failure;
mod field_input;
mod histogram;
mod memory;
mod mesh_input;
mod output;
mod page;
mod pictures;
mod progress;
mod read_summary;
mod report;
mod roles;
mod signals;
mod standard_output;

use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

use clap::error::ErrorKind as Usage;
use clap::{CommandFactory, Parser};

use args::{Args, Command};

/// Locked by the thread that ends the program, so that nothing is printed after Ctrl-C.
static ENDING: Mutex<()> = Mutex::new(());

fn main() -> ExitCode {
    let command = match Args::try_parse() {
        Ok(Args { command }) => command,
        Err(error) => return failure::end_on_usage(&error),
    };
    if let Err(what) = command.check() {
        return failure::end_on_usage(&conflict(what));
    }
    let ending = || (ENDING.lock().unwrap_or_else(PoisonError::into_inner), sdf_formats::remove_temporaries());
    let result = signals::end_with(ending).and_then(|()| roles::check(&command)).and_then(|()| run(&command));
    // Never given back.
    std::mem::forget(ENDING.lock().unwrap_or_else(PoisonError::into_inner));
    match (&result, signals::status()) {
        (Ok(()), Some(status)) => ExitCode::from(status),
        _ => failure::end(result),
    }
}

/// An error with the usage of the command, which is the first argument.
fn conflict(what: &str) -> clap::Error {
    let mut program = Args::command();
    program.build();
    let name = std::env::args_os().nth(1).unwrap_or_default();
    match program.find_subcommand_mut(name) {
        Some(command) => command.error(Usage::ArgumentConflict, what),
        None => program.error(Usage::ArgumentConflict, what),
    }
}

fn run(command: &Command) -> anyhow::Result<()> {
    match command {
        Command::Bake(args) if args.fleet.is_wanted() => commands::bake_many::run(args),
        Command::Bake(args) => commands::bake::run(args),
        Command::Merge(args) => commands::merge::run(args),
        Command::Contacts(args) if field_input::is_field(&args.mesh) => commands::overlap::run(args),
        Command::Contacts(args) => commands::contacts::run(args),
        Command::Compare(args) => commands::compare::run(args),
        Command::Eval(args) => commands::eval::run(args),
        Command::Info(args) => commands::info::run(args),
        Command::Verify(args) => commands::verify::run(args),
        Command::Slice(args) => commands::slice::run(args),
        Command::Surface(args) => commands::surface::run(args),
        Command::Export(args) => commands::export::run(args),
        Command::Import(args) => commands::import::run(args),
        Command::View(args) => commands::view::run(args),
        Command::Simulate(args) => commands::simulate::run(args),
        Command::Demo(args) => commands::demo::run(args),
        Command::Completions(args) => commands::shell::completions(args),
        Command::Man(args) => commands::shell::man(args),
    }
}
