//! The command line of the measurements of accuracy.

use std::io::{Write, stdout};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Parser;
use sdf_bench::accuracy::{self, Page};
use sdf_bench::{exit_code, on_threads, print_json, progress_bar};
use serde_json::json;

/// Measure every method: error against steps, evaluations and time, missed contacts, and whole scenes.
///
/// Writes index.html, a report with its pictures in it, study.json, and the numbers of each picture as CSV. All but the times
/// is the same from run to run. The whole takes minutes.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 110)]
struct Args {
    /// Folder to write into; created if missing.
    #[arg(short, long, value_name = "FOLDER", default_value = "sdftool-study")]
    output: PathBuf,
    /// Measure a few problems and small scenes, in seconds.
    #[arg(long)]
    short: bool,
    /// Also write study.md, and its pictures in pictures/study, into this folder.
    #[arg(long, value_name = "FOLDER")]
    docs: Option<PathBuf>,
    /// Scene file to measure too, such as those in bench/scenes/; may be given several times.
    #[arg(long = "scene", value_name = "FILE.toml")]
    scenes: Vec<PathBuf>,
    /// Number of threads; the result does not depend on it [default: one per core].
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

fn main() -> ExitCode {
    exit_code(run(&Args::parse()))
}

fn run(args: &Args) -> Result<()> {
    let scenes = accuracy::read_scenes(&args.scenes)?;
    let folders = [Some(&args.output), args.docs.as_ref()];
    folders.into_iter().flatten().try_for_each(|folder| ensure_writable(folder))?;
    let bar = progress_bar("measuring", accuracy::part_count(&scenes) as u64);
    let threads = args.threads.map_or(0, usize::from);
    let study = on_threads(threads, || accuracy::run(&scenes, args.short, &|| bar.inc(1)))??;
    bar.finish_and_clear();
    accuracy::folder(&study)?.iter().try_for_each(|page| write(&args.output, page))?;
    if let Some(docs) = &args.docs {
        accuracy::docs(&study)?.iter().try_for_each(|page| write(docs, page))?;
    }
    let report = args.output.join("index.html");
    if args.json {
        return print_json(&json!({
            "schema": "sdftool.study/1",
            "folder": args.output.display().to_string(),
            "report": report.display().to_string(),
            "short": args.short,
            "seconds": study.seconds,
        }));
    }
    let mut out = stdout().lock();
    writeln!(out, "report  {}", report.display())?;
    writeln!(out, "  sets  {} of {} problems", study.sets.len(), study.apexes.problems)?;
    writeln!(out, "scenes  {}", study.scenes.len())?;
    writeln!(out, "  time  {:.1} s", study.seconds)?;
    Ok(())
}

/// Creates the folder and a probe in it, before minutes are spent on the measurement.
fn ensure_writable(folder: &Path) -> Result<()> {
    let probe = folder.join(format!(".sdf-bench-{}.probe", std::process::id()));
    let created = std::fs::create_dir_all(&probe).and_then(|()| std::fs::remove_dir(&probe));
    created.with_context(|| folder.display().to_string())
}

fn write(folder: &Path, page: &Page) -> Result<()> {
    let path = folder.join(&page.name);
    let folder_of_page = path.parent().unwrap_or(folder);
    let written = std::fs::create_dir_all(folder_of_page).and_then(|()| std::fs::write(&path, &page.content));
    written.with_context(|| path.display().to_string())
}
