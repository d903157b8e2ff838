//! What a grid costs and how far it is off: of every mesh, resolution, layout and precision one bake and one verification
//! by the program itself, each a process of its own. Writes docs/grids.md and docs/grids.csv.
//!
//! `cargo bench -p sdftool --bench grids -- dragon.obj stanford-bunny.obj …`, from anywhere in the repository.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

const SDFTOOL: &str = env!("CARGO_BIN_EXE_sdftool");
const RESOLUTIONS: [u32; 2] = [256, 512];
const KINDS: [(&str, &str); 4] = [
    ("dense f32", "--layout dense"),
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
    bytes_a_cell: f64,
    /// In voxels, as all that follow.
    p99_9: f64,
    max: f64,
    certified_median: f64,
    certified: f64,
}

fn main() {
    let meshes: Vec<PathBuf> =
        std::env::args().skip(1).filter(|word| !word.starts_with("--")).map(PathBuf::from).collect();
    if meshes.is_empty() {
        println!("name the meshes: cargo bench -p sdftool --bench grids -- dragon.obj …");
        return;
    }
    let folder = tempfile::TempDir::new().expect("a folder for the grids");
    let mut rows = vec![];
    for mesh in &meshes {
        for res in RESOLUTIONS {
            for (kind, options) in KINDS {
                let row = row(folder.path(), mesh, res, kind, options);
                println!("{}", line(&row));
                rows.push(row);
            }
        }
    }
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    std::fs::write(docs.join("grids.csv"), csv(&rows)).expect("docs/grids.csv");
    std::fs::write(docs.join("grids.md"), page(&rows)).expect("docs/grids.md");
}

fn row(folder: &Path, mesh: &Path, res: u32, kind: &'static str, options: &str) -> Row {
    let grid = folder.join("grid.sdf.h5");
    let [mesh_name, grid_name] = [mesh, &grid].map(|path| path.display().to_string());
    let baked = sdftool(&format!("bake {mesh_name} -o {grid_name} --res {res} {options} --json"));
    let verified = sdftool(&format!("verify {grid_name} {mesh_name} --json"));
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let spacing = number(&baked["spacing"]);
    let file_bytes = number(&baked["file_bytes"]);
    Row {
        mesh: mesh.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        res,
        kind,
        seconds: number(&baked["seconds"]["bake"]),
        peak_mib: number(&baked["peak_memory_bytes"]) / f64::from(1 << 20),
        file_mb: file_bytes / 1e6,
        bytes_a_cell: file_bytes / number(&baked["stored_cells"]),
        p99_9: number(&verified["points"]["p99_9"]) / spacing,
        max: number(&verified["points"]["max"]) / spacing,
        certified_median: number(&baked["median_error_bound"]) / spacing,
        certified: number(&baked["error_bound"]) / spacing,
    }
}

/// What the program says, parted by spaces. Its paths have none.
fn sdftool(words: &str) -> Value {
    let output = Command::new(SDFTOOL).args(words.split(' ')).output().expect("sdftool runs");
    if !output.status.success() {
        eprintln!("sdftool {words}: {}", String::from_utf8_lossy(&output.stderr));
    }
    serde_json::from_slice(&output.stdout).unwrap_or(Value::Null)
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
    let Row { mesh, res, kind, seconds, peak_mib, file_mb, bytes_a_cell, p99_9, max, certified_median, certified } =
        row;
    let median = if certified_median.is_nan() { "–".to_owned() } else { format!("{certified_median:.3}") };
    [
        mesh.clone(),
        res.to_string(),
        (*kind).to_owned(),
        format!("{seconds:.2}"),
        format!("{peak_mib:.0}"),
        format!("{file_mb:.1}"),
        format!("{bytes_a_cell:.2}"),
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
        "# What a grid costs, and how far it is off\n\n\
         Made by `cargo bench -p sdftool --bench grids -- MESH…` on {threads} threads; the numbers stand in `grids.csv` too.\n\n\
         The time is that of the bake alone, without reading the mesh and writing the file; the peak is that of the whole\n\
         process. A cell counts as stored where all its corners are. Errors are in voxels: measured at 100,000 random points\n\
         by `sdftool verify` (of a dense grid in all of its box, of a sparse one within its band of 3 voxels), and certified\n\
         (docs/error-bounds.md), for the median brick and for the worst.\n\n"
    );
    let _ = writeln!(text, "| {} |", HEAD.join(" | "));
    let _ = writeln!(text, "|{}", "---|".repeat(HEAD.len()));
    for row in rows {
        let _ = writeln!(text, "{}", line(row));
    }
    text
}
