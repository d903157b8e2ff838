//! Size of a grid file and error of its field: one bake and one verification by sdftool for every mesh, resolution, layout
//! and precision. Writes docs/grids.md and docs/grids.csv.
//!
//! `cargo run --release -p sdf-bench --bin grids -- dragon.obj stanford-bunny.obj …`, after
//! `cargo build --release -p sdftool`.

use std::ffi::OsStr;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Parser;
use sdf_bench::exit_code;
use sdf_bench::program::sdftool;
use serde_json::Value;

/// Measure the size, the time and the error of grids of every layout and precision, and write docs/grids.md.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 110)]
struct Args {
    /// Meshes to bake: OBJ, PLY, STL or OFF.
    #[arg(required = true, value_name = "MESH")]
    meshes: Vec<PathBuf>,
}

const RESOLUTIONS: [u32; 2] = [256, 512];
const KINDS: [(&str, &str); 6] = [
    ("dense f32", "--layout dense"),
    ("dense u16", "--layout dense --precision u16"),
    ("dense u8", "--layout dense --precision u8"),
    ("sparse f32", "--layout sparse --precision f32"),
    ("sparse u16", "--layout sparse --precision u16"),
    ("sparse u8", "--layout sparse --precision u8"),
];

struct Row {
    mesh: String,
    res: u32,
    kind: &'static str,
    seconds: f64,
    peak_mib: f64,
    file_mb: f64,
    bytes_per_cell: f64,
    /// Errors in voxels, this one and all below.
    p99_9: f64,
    max: f64,
    certified_median: f64,
    certified: f64,
}

fn main() -> ExitCode {
    exit_code(run(&Args::parse()))
}

fn run(args: &Args) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let mut rows = vec![];
    for mesh in &args.meshes {
        for res in RESOLUTIONS {
            for (kind, options) in KINDS {
                let row = measure(folder.path(), mesh, res, kind, options)?;
                println!("{}", line(&row));
                rows.push(row);
            }
        }
    }
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    std::fs::write(docs.join("grids.csv"), csv(&rows)).context("docs/grids.csv")?;
    std::fs::write(docs.join("grids.md"), page(&rows)).context("docs/grids.md")
}

fn measure(folder: &Path, mesh: &Path, res: u32, kind: &'static str, options: &str) -> Result<Row> {
    let grid = folder.join("grid.sdf.h5");
    let bake = ["bake".as_ref(), mesh.as_os_str(), "-o".as_ref(), grid.as_os_str(), "--res".as_ref()];
    let res_word = res.to_string();
    let baked = sdftool(bake.into_iter().chain([res_word.as_ref()]).chain(options.split(' ').map(OsStr::new)))?;
    let verified = sdftool(["verify".as_ref(), grid.as_os_str(), mesh.as_os_str()])?;
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let spacing = number(&baked["spacing"]);
    let file_bytes = number(&baked["file_bytes"]);
    Ok(Row {
        mesh: mesh.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        res,
        kind,
        seconds: number(&baked["seconds"]["bake"]),
        peak_mib: number(&baked["peak_memory_bytes"]) / f64::from(1 << 20),
        file_mb: file_bytes / 1e6,
        bytes_per_cell: file_bytes / number(&baked["stored_cells"]),
        p99_9: number(&verified["points"]["p99_9"]) / spacing,
        max: number(&verified["points"]["max"]) / spacing,
        certified_median: number(&baked["median_error_bound"]) / spacing,
        certified: number(&baked["error_bound"]) / spacing,
    })
}

const HEAD: [&str; 11] = [
    "mesh",
    "res",
    "layout",
    "bake s",
    "peak MiB",
    "file MB",
    "bytes a cell",
    "99.9 %",
    "max",
    "certified median",
    "certified max",
];

fn cells(row: &Row) -> [String; 11] {
    let Row { mesh, res, kind, seconds, peak_mib, file_mb, bytes_per_cell, p99_9, max, certified_median, certified } =
        row;
    let median = if certified_median.is_nan() { "–".to_owned() } else { format!("{certified_median:.3}") };
    [
        mesh.clone(),
        res.to_string(),
        (*kind).to_owned(),
        format!("{seconds:.2}"),
        format!("{peak_mib:.0}"),
        format!("{file_mb:.1}"),
        format!("{bytes_per_cell:.2}"),
        format!("{p99_9:.3}"),
        format!("{max:.3}"),
        median,
        format!("{certified:.3}"),
    ]
}

fn line(row: &Row) -> String {
    format!("| {} |", cells(row).join(" | "))
}

fn csv(rows: &[Row]) -> String {
    let mut text = HEAD.join(",") + "\n";
    for row in rows {
        text += &(cells(row).join(",") + "\n");
    }
    text
}

fn page(rows: &[Row]) -> String {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut text = format!(
        "# Size and error of grids\n\n\
         Written by `cargo run --release -p sdf-bench --bin grids -- MESH…` on {threads} threads, with the numbers in `grids.csv`.\n\n\
         The time is that of the bake, without reading the mesh and writing the file. The peak memory is that of the whole\n\
         process. A cell counts as stored if all its corners are. Errors are in voxels. `sdftool verify` measures them at\n\
         100,000 random points: in the whole box of a dense grid, in the band of a sparse one (3 voxels). Certified errors\n\
         (docs/error-bounds.md) are those of the median brick and of the worst, by `--certify fast`.\n\n"
    );
    let _ = writeln!(text, "| {} |", HEAD.join(" | "));
    let _ = writeln!(text, "|{}", "---|".repeat(HEAD.len()));
    for row in rows {
        let _ = writeln!(text, "{}", line(row));
    }
    text
}
