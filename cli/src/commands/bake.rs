//! Bakes a mesh and reports on the grid. Errors of the library become messages that name the option to change.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Result, anyhow, bail};
use indicatif::ProgressDrawTarget;
use sdf_core::grid::Lattice;
use sdf_core::grid::owned::{Layout, OwnedGrid};
use sdf_core::grid::sparse::BRICK;
use sdf_field::page::Scene;
use sdf_field::{BakeError, Baked, ErrorBudgetError, Field, GridInfo, MeshReport, MeshView, Progress, Source};
use serde_json::json;

use crate::args::BakeArgs;
use crate::commands::bake_many;
use crate::commands::export::stem;
use crate::mesh_input::{self, MeshFacts, MeshInput};
use crate::page;
use crate::report::{Report, counts, many, number, seconds};
use crate::{error_regions, memory, output, progress};

/// The program and its version, as a grid that it baked states them.
pub const TOOL: &str = concat!("sdftool ", env!("CARGO_PKG_VERSION"));

pub fn run(args: &BakeArgs) -> Result<()> {
    if args.fleet.is_wanted() {
        return bake_many::run(args);
    }
    let output = match &args.output {
        Some(output) => output.clone(),
        None if mesh_input::is_standard_input(&args.mesh) => bail!("a mesh from standard input has no name: add -o"),
        None => default_output(&args.mesh),
    };
    output::ensure_writable(&output, &[&args.mesh])?;
    output::ensure_alone(&output, args.json)?;
    if let Some(page) = &args.view {
        output::ensure_writable(page, &[&args.mesh, &output])?;
    }
    progress::on_threads(args.threads, || bake_into(args, &output))?
}

fn bake_into(args: &BakeArgs, output: &Path) -> Result<()> {
    let started = Instant::now();
    let input = mesh_input::read(&args.mesh)?;
    bake_read(args, input, output, started)?.print_beside(Some(output), args.json)
}

/// Bakes a mesh that was read into a file.
pub fn bake_file(args: &BakeArgs, input: MeshInput, output: &Path) -> Result<Report<serde_json::Value>> {
    bake_read(args, input, output, Instant::now())
}

fn bake_read(args: &BakeArgs, input: MeshInput, output: &Path, started: Instant) -> Result<Report<serde_json::Value>> {
    let read = started.elapsed().as_secs_f64();
    let (baked, input) = bake(args, input)?;
    let bake = started.elapsed().as_secs_f64() - read;
    let file = output::save(&baked.field, output, args.compress)?;
    if let Some(path) = &args.view {
        page::write(path, &Scene::of_field(stem(output), &baked.field))?;
    }
    let write = started.elapsed().as_secs_f64() - read - bake;
    Ok(Report {
        rows: rows(args, &baked, &input, [read, bake, write], &format!("{}, {file} bytes", output::shown(output)))?,
        json: document(&baked, &input, [read, bake, write], output, file)?,
    })
}

/// Bakes `input` and frees its points and triangles.
pub fn bake(args: &BakeArgs, input: MeshInput) -> Result<(Baked, MeshFacts)> {
    let MeshInput { mesh, facts } = input;
    mesh.require_triangles(&args.mesh.display().to_string())?;
    let source = Source { name: facts.name.clone(), sha256: facts.sha256, triangles: facts.triangles as u64 };
    let options = args.options(source)?;
    let bar = progress::bar("baking", 0);
    // Bars of several meshes would overwrite each other.
    if args.fleet.is_wanted() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    let on_progress = |progress: Progress| match progress {
        Progress::Total(steps) => bar.inc_length(steps),
        Progress::Done(steps) => bar.inc(steps),
    };
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    let baked = Field::bake_with_progress(view, &options, &on_progress);
    bar.finish_and_clear();
    Ok((baked.map_err(|error| refusal(args, error))?, facts))
}

/// The error in the words of the command line: what, where, and which option to change.
fn refusal(args: &BakeArgs, error: BakeError) -> anyhow::Error {
    let (size, smaller) = match (args.res, args.voxel_size, args.max_error) {
        (Some(res), ..) => (format!("--res {res}"), "use a smaller --res"),
        (None, Some(voxel), _) => (format!("--voxel-size {voxel:?}"), "use a larger --voxel-size"),
        (None, None, max_error) => {
            (max_error.map_or(String::new(), |error| format!("--max-error {error}")), "use a larger --max-error")
        }
    };
    let shown = args.mesh.display();
    match error {
        BakeError::InvalidMesh(invalid) => anyhow!("{shown}: {invalid}"),
        BakeError::VoxelTooLarge { side } => {
            anyhow!("{size}: the whole mesh is {} long: use a smaller --voxel-size", number(side))
        }
        BakeError::ErrorBudget(ErrorBudgetError::SignJumps { .. }) => {
            anyhow!("{shown}: {size}: {error}: use --res or --voxel-size, or close the mesh by --weld or --close")
        }
        BakeError::ErrorBudget(_) => anyhow!("{shown}: {size}: {error}: {smaller}"),
        BakeError::TooLarge { bricks: Some(bricks), bytes, free, .. } => {
            let smaller = "use a smaller --res, a larger --voxel-size, a smaller --band or --precision u8";
            anyhow!("{shown}: {bricks} bricks {}: {smaller}", memory::shortage(bytes, free))
        }
        BakeError::TooLarge { nodes, bytes, free, .. } => {
            let is_padded = 2.0 * f64::from(args.padding) > nodes.iter().fold(0.0, |a: f64, b| a.max(*b)) / 2.0;
            let (size, smaller) = if is_padded {
                (format!("{size} --padding {}", args.padding), "use a smaller --padding")
            } else {
                (size, smaller)
            };
            let or_sparse = if args.layout() == Layout::Dense { ", or --layout sparse" } else { "" };
            let nodes = nodes.map(many).join(" × ");
            anyhow!("{size}: a grid of {nodes} nodes {}: {smaller}{or_sparse}", memory::shortage(bytes, free))
        }
        other => anyhow!("{shown}: {other}"),
    }
}

/// The grid that was baked, and its info.
fn parts(baked: &Baked) -> Result<(&OwnedGrid, &GridInfo)> {
    match (baked.field.grid(), baked.field.info()) {
        (Some(grid), Some(info)) => Ok((grid, info)),
        _ => bail!("a bake made no grid: please report this"),
    }
}

type Rows = Vec<(&'static str, String)>;

fn rows(args: &BakeArgs, baked: &Baked, input: &MeshFacts, times: [f64; 3], file: &str) -> Result<Rows> {
    let (grid, info) = parts(baked)?;
    let lattice = grid.lattice();
    let median = median_error(grid).map_or(String::new(), |error| format!(", {} in half of the bricks", number(error)));
    // Away from the triangles of an open mesh, the sign may change within a cell.
    let proof = if baked.is_proven { "proven" } else { "proven except where the sign changes unseen within a cell" };
    let [read, bake, write] = times.map(seconds);
    let mut rows = vec![
        ("mesh", mesh_row(input, &baked.mesh)),
        ("sign", info.sign_reason.clone()),
        ("grid", format!("{} nodes, spacing {}", counts(lattice.nodes()), number(lattice.spacing()))),
    ];
    if args.max_error.is_some() {
        rows.push(("picked", format!("a voxel of {}, a band of {} voxels", number(lattice.spacing()), args.band())));
    }
    if let (Some(bricks), Some(band)) = (grid.storage().brick_count(), info.band) {
        let precision = grid.storage().precision().name();
        rows.push(("bricks", format!("{bricks} in {precision}, with distances within {}", number(band))));
    }
    rows.push(("error", format!("at most {}{median}, {proof}", number(info.error_bound))));
    rows.extend(baked.regions.as_ref().map(|regions| ("regions", error_regions::row(regions))));
    rows.extend([("time", format!("{read} to read, {bake} to bake, {write} to write")), ("file", file.to_owned())]);
    Ok(rows)
}

fn document(
    baked: &Baked,
    input: &MeshFacts,
    [read, bake, write]: [f64; 3],
    output: &Path,
    file: u64,
) -> Result<serde_json::Value> {
    let (grid, info) = parts(baked)?;
    let (lattice, storage) = (grid.lattice(), grid.storage());
    let [stored_nodes, stored_cells] = stored(grid);
    Ok(json!({
        "schema": "sdftool.bake/1",
        "output": output.display().to_string(),
        "triangles": input.triangles,
        "objects": input.objects,
        "polygons": input.polygon_counts.total,
        "polygons_cut_blindly": input.polygon_counts.unverified,
        "degenerate_triangles": baked.mesh.degenerate_triangles,
        "repeated_triangles": baked.mesh.repeated_triangles,
        "inner_shells": baked.mesh.inner_shells,
        "inner_triangles": baked.mesh.inner_triangles,
        "entangled_shells": baked.mesh.entangled_shells,
        "crossing_triangles": baked.mesh.crossing_triangles,
        "kept_pieces": baked.mesh.kept_pieces,
        "dropped_pieces": baked.mesh.dropped_pieces,
        "uncertain_pieces": baked.mesh.uncertain_pieces,
        "merged_points": baked.mesh.merged_points,
        "capped_loops": baked.mesh.capped_loops,
        "cap_triangles": baked.mesh.cap_triangles,
        "open_loops": baked.mesh.open_loops,
        "unreferenced_points": baked.mesh.unreferenced_points,
        "welded_points": baked.mesh.welded_points,
        "boundary_edges": baked.topology.boundary_edges,
        "non_manifold_edges": baked.topology.non_manifold_edges,
        "wrongly_wound": baked.topology.wrongly_wound,
        "shells": baked.topology.shells,
        "intersecting_pairs": baked.topology.intersecting_pairs,
        "sign_method": info.sign_method.name(),
        "sign_verdict": info.sign_reason,
        "layout": storage.layout().name(),
        "precision": storage.precision().name(),
        "nodes": lattice.node_count(),
        "counts": lattice.nodes(),
        "origin": lattice.origin(),
        "spacing": lattice.spacing(),
        "padding": info.padding,
        "band": info.band,
        "bricks": storage.brick_count(),
        "stored_nodes": stored_nodes,
        "stored_cells": stored_cells,
        "slope_bound": baked.field.slope_bound(),
        "error_bound": info.error_bound,
        "median_error_bound": median_error(grid),
        "error_regions": baked.regions.as_ref().map(error_regions::document),
        "file_bytes": file,
        "peak_memory_bytes": memory::peak(),
        "seconds": {"read": read, "bake": bake, "write": write},
    }))
}

/// Median of the bricks' error bounds; `None` for a dense grid.
fn median_error(grid: &OwnedGrid) -> Option<f64> {
    let mut errors = grid.storage().brick_errors().to_vec();
    errors.sort_unstable_by(f32::total_cmp);
    errors.get(errors.len() / 2).copied().map(f64::from)
}

/// Nodes that have a sample, and cells with all corners among them.
fn stored(grid: &OwnedGrid) -> [usize; 2] {
    let lattice = grid.lattice();
    if grid.storage().layout() == Layout::Dense {
        return [lattice.node_count(), lattice.cells().iter().fold(1, |count: usize, n| count * *n as usize)];
    }
    stored_in_bricks(grid, lattice)
}

/// Counts for each brick the cells whose first corner it has. Their other corners are in the same brick or in the next ones.
fn stored_in_bricks(grid: &OwnedGrid, lattice: &Lattice) -> [usize; 2] {
    let nodes = lattice.nodes();
    let mut stored = [0, 0];
    for slot in grid.storage().slots() {
        let sides: [u32; 3] = std::array::from_fn(|axis| (nodes[axis] - slot[axis] * BRICK).min(BRICK));
        stored[0] += sides.iter().map(|n| *n as usize).product::<usize>();
        for next in 0..8_u32 {
            let step: [u32; 3] = std::array::from_fn(|axis| next >> axis & 1);
            if grid.storage().brick_at(std::array::from_fn(|axis| slot[axis] + step[axis])).is_some() {
                // Along axes with a step: one layer of cells, which need the next brick; along the others all but that layer.
                let cells = |axis: usize| if step[axis] == 1 { 1 } else { sides[axis] as usize - 1 };
                stored[1] += cells(0) * cells(1) * cells(2);
            }
        }
    }
    stored
}

/// The mesh's stem with .sdf.h5, in the current folder.
fn default_output(mesh: &Path) -> PathBuf {
    let mut name = mesh.file_stem().unwrap_or_default().to_owned();
    name.push(".sdf.h5");
    name.into()
}

fn mesh_row(mesh: &MeshFacts, report: &MeshReport) -> String {
    let mut row = format!("{} points, {} triangles", mesh.points, mesh.triangles);
    let objects = if mesh.objects > 1 { mesh.objects } else { 0 };
    let rest = [
        (objects, "object", "objects"),
        (report.welded_points, "duplicate point", "duplicate points"),
        (report.merged_points, "point welded", "points welded"),
        (report.cap_triangles, "triangle added by caps", "triangles added by caps"),
        (report.unreferenced_points, "unused point", "unused points"),
        (report.degenerate_triangles, "triangle without area dropped", "triangles without area dropped"),
        (report.repeated_triangles, "repeated triangle", "repeated triangles"),
        (report.inner_triangles, "triangle inside of the solid dropped", "triangles inside of the solid dropped"),
        (report.crossing_triangles, "triangle cut where others meet it", "triangles cut where others meet them"),
        (mesh.polygon_counts.unverified, "polygon cut unverified", "polygons cut unverified"),
    ];
    for (count, one, several) in rest.into_iter().filter(|(count, ..)| *count > 0) {
        row.push_str(&format!(", {count} {}", if count == 1 { one } else { several }));
    }
    row
}
