//! The command line of the measurements of speed.

use std::fs::File;
use std::io::stdout;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Parser;
use sdf_bench::speed::{self, Options, SpeedReport, page};
use sdf_bench::{exit_code, print_json};
use serde_json::json;

/// Measure how fast this machine bakes, finds contacts and reads meshes, beside the limits of the machine itself.
///
/// Bodies and cloths are made by formula; --mesh and --field measure the contacts of files. The works of a series take
/// turns, and every time is a median. Reading files is not counted, except where it is measured.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 110)]
struct Args {
    #[command(flatten)]
    options: Options,
    /// CSV file to write the table to [default: none].
    #[arg(long, value_name = "OUT.csv")]
    csv: Option<PathBuf>,
    /// Also write performance.md, and its numbers and pictures in performance/, into this folder.
    #[arg(long, value_name = "FOLDER")]
    docs: Option<PathBuf>,
    /// Measure nothing: write the page from the stored numbers.
    #[arg(long, requires = "docs")]
    rewrite: bool,
    /// Do one fixed work on one thread, for counting its instructions.
    #[arg(long, hide = true)]
    kernel: Option<String>,
    /// Number of times to do it; 0 only prepares it.
    #[arg(long, hide = true, default_value_t = 1)]
    times: u32,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

fn main() -> ExitCode {
    exit_code(run(&Args::parse()))
}

fn run(args: &Args) -> Result<()> {
    if let Some(kernel) = &args.kernel {
        return speed::kernels::run(kernel, args.times);
    }
    if let Some(docs) = &args.docs {
        let folder = docs.join(page::FOLDER);
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    }
    if !args.rewrite {
        // Opened first: minutes of measurement must not end at a path that cannot be written.
        let csv = args.csv.as_ref().map(|path| File::create(path).with_context(|| path.display().to_string()));
        let csv = csv.transpose()?;
        let report = speed::run(&args.options)?;
        print(args, &report)?;
        if let Some(mut csv) = csv {
            std::io::Write::write_all(&mut csv, speed::csv::text(&report).as_bytes())?;
        }
        if let Some(docs) = &args.docs {
            page::store(docs, &report)?;
        }
    }
    args.docs.as_ref().map_or(Ok(()), |docs| page::write(docs))
}

fn print(args: &Args, report: &SpeedReport) -> Result<()> {
    if args.json {
        return print_json(&json!({
            "schema": "sdftool.bench/1",
            "machine": report.machine,
            "rows": report.rows,
            "left_out": report.left_out,
        }));
    }
    speed::table::print(report, &mut stdout().lock())
}
