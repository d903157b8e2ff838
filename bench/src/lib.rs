//! Measurements of sdftool, for its developers.
//!
//! | program | question | page |
//! |---|---|---|
//! | `accuracy` | How far is the minimum that each method finds from the proven one, and which contacts does it miss? | docs/study.md |
//! | `speed` | How long do bakes, contact searches and reading take, beside other programs and the machine's limits? | docs/performance.md |
//! | `exact` | Which contacts does a grid's error hide, and what does it cost to settle them by triangles? | README.md |
//! | `gpu` | Are contacts on a GPU those of the CPU, and how long do they take? | docs/gpu.md |
//! | `motion` | What do clusters save for rigid bodies, and how long does a first touch take? | docs/motion.md |
//! | `grids` | How large is a grid file, and how far is the field off? | docs/grids.md |
//! | `stencils` | How far are normals off by which stencil? | docs/methods.md |

#![forbid(unsafe_code)]

pub mod accuracy;
pub mod gpu;
pub mod motion;
pub mod program;
pub mod speed;

mod bake;
mod machine;
mod statistics;
mod svg;
mod table;

use std::io::{Write, stdout};
use std::process::ExitCode;

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

/// Exit status of a program: 1 and one line on standard error if it failed.
pub fn exit_code(result: Result<()>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Prints one JSON object, alone on its line.
pub fn print_json(json: &impl Serialize) -> Result<()> {
    let line = serde_json::to_string(json)?;
    writeln!(stdout(), "{line}").context("standard output")
}

/// A progress bar on standard error, hidden if that is not a terminal.
pub fn progress_bar(what: &'static str, total: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {percent:>3} %, {eta} left");
    ProgressBar::new(total).with_message(what).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// Runs `work` on a pool of `threads` threads; 0 stands for one per core.
pub fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T> {
    Ok(rayon::ThreadPoolBuilder::new().num_threads(threads).build()?.install(work))
}

fn duration_text(seconds: f64) -> String {
    if seconds < 0.1 { format!("{:.1} ms", 1e3 * seconds) } else { format!("{seconds:.2} s") }
}
