use std::fs;
use std::time::Instant;

use anyhow::Result;
use sdf_field::{GridOnDisk, merge_parts};
use serde_json::{Value, json};

use crate::args::MergeArgs;
use crate::commands::bake::facts::warning;
use crate::error_regions::bound_row;
use crate::failure::misuse;
use crate::mesh_input::is_standard_input;
use crate::report::{Report, counted, counts, number, seconds};
use crate::{output, progress, standard_output};

pub fn run(args: &MergeArgs) -> Result<()> {
    if standard_output::is_standard_output(&args.output) {
        misuse!("merge writes a file: name one with -o");
    }
    if args.parts.iter().any(|part| is_standard_input(part)) {
        misuse!("a part cannot be standard input, since it is read in pieces: name its file");
    }
    let parts: Vec<_> = args.parts.iter().map(|part| part.as_path()).collect();
    output::ensure_writable(&args.output, &parts)?;
    let started = Instant::now();
    let grid = progress::on_threads(args.threads, || merge_parts(&args.parts, &args.output))??;
    report(args, &grid, started.elapsed().as_secs_f64()).print(args.json)
}

fn report(args: &MergeArgs, grid: &GridOnDisk, time: f64) -> Report<Value> {
    let GridOnDisk { lattice, info, precision, slope_bound, slots, is_sign_continuous, .. } = grid;
    let file = fs::metadata(&args.output).map_or(0, |file| file.len());
    let warning = warning(grid.thin_voxel());
    let mut rows = vec![
        ("mesh", format!("{}, {}", info.source.name, counted(info.source.triangles, "triangle"))),
        ("grid", format!("{} nodes, spacing {}", counts(lattice.nodes()), number(lattice.spacing()))),
        ("bricks", format!("{} in {}, of {}", slots.len(), precision.name(), counted(args.parts.len(), "part"))),
        ("error", bound_row(info.error_bound, "", *is_sign_continuous)),
    ];
    rows.extend(warning.iter().map(|warning| ("warning", warning.clone())));
    rows.extend([("time", seconds(time)), ("file", format!("{}, {file} bytes", args.output.display()))]);
    let json = json!({
        "schema": "sdftool.merge/1",
        "output": args.output.display().to_string(),
        "parts": args.parts.len(),
        "precision": precision.name(),
        "counts": lattice.nodes(),
        "origin": lattice.origin(),
        "spacing": lattice.spacing(),
        "band": info.band,
        "bricks": slots.len(),
        "slope_bound": slope_bound,
        "error_bound": info.error_bound,
        "warning": warning,
        "file_bytes": file,
        "peak_memory_bytes": sdf_field::memory::peak_bytes(),
        "seconds": time,
    });
    Report { rows, json }
}
