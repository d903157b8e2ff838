//! Bakes a mesh and reports on the grid. Errors of the library become messages that name the option to change.

pub mod facts;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Result, anyhow, bail};
use indicatif::{ProgressBar, ProgressDrawTarget};
use sdf_core::grid::owned::Layout;
use sdf_field::page::Scene;
use sdf_field::{
    BakeError, BakeFileError, BakeOptions, BakeOutcome, BakeTarget, Baked, BakedFile, BrickShard, CheckedMesh,
    ErrorBudgetError, Field, MeshView, Progress, Source,
};
use sdf_formats::mesh::Mesh;
use serde_json::json;

use crate::args::{BakeArgs, Sign};
use crate::commands::export::stem;
use crate::failure::misuse;
use crate::mesh_input::{self, MeshFacts, MeshInput};
use crate::page;
use crate::report::{Report, counted, counts, many, number, seconds};
use crate::{field_input, memory, output, progress, standard_output};
use facts::{GridFacts, document, mesh_row, rows};

/// The program and its version, as a grid that it baked states them.
pub const TOOL: &str = concat!("sdftool ", env!("CARGO_PKG_VERSION"));

/// Bakes one mesh; `bake_many` bakes several.
pub fn run(args: &BakeArgs) -> Result<()> {
    let output = match &args.output {
        Some(output) => output.clone(),
        None if mesh_input::is_standard_input(&args.mesh) => misuse!("a mesh from standard input has no name: add -o"),
        None => default_output(args),
    };
    let is_streamed = args.fleet.shard.is_some() || args.memory.is_some();
    if is_streamed && standard_output::is_standard_output(&output) {
        misuse!("--shard and --memory need a file to write bricks into as they come: name one with -o");
    }
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

/// Bakes a mesh that was read into a file. Its reading began when `started`.
pub fn bake_read(
    args: &BakeArgs,
    input: MeshInput,
    output: &Path,
    started: Instant,
) -> Result<Report<serde_json::Value>> {
    let read = started.elapsed().as_secs_f64();
    let MeshInput { mesh, facts: input } = input;
    mesh.require_triangles(&mesh_input::shown(&args.mesh))?;
    let options = args.options(source(&input))?;
    if let Some(shard) = args.shard_of_bricks() {
        let mesh = checked(args, mesh, &options)?;
        let baked = with_progress(args, |on_progress| {
            Field::bake_part(mesh, &options, target(args, output), shard, on_progress)
                .map_err(|error| failure(args, error))
        })?;
        let times = [read, started.elapsed().as_secs_f64() - read];
        return Ok(part_report(args, shard, &baked, &input, times, output));
    }
    let outcome = with_progress(args, |on_progress| bake_whole(args, mesh, &options, output, on_progress))?;
    let baked = match &outcome {
        BakeOutcome::InMemory(_) => Instant::now(),
        BakeOutcome::OnDisk(baked) => baked.baked,
    };
    let bake = (baked - started).as_secs_f64() - read;
    let file = match &outcome {
        BakeOutcome::InMemory(baked) => output::save(&baked.field, output, args.compress)?,
        BakeOutcome::OnDisk(_) => fs::metadata(output).map_or(0, |file| file.len()),
    };
    if let Some(path) = &args.view {
        let write = |field: &Field| page::write(path, output, &Scene::of_field(stem(output), field));
        match &outcome {
            BakeOutcome::InMemory(baked) => write(&baked.field)?,
            BakeOutcome::OnDisk(baked) if baked.fits => write(&field_input::read_whole(output)?)?,
            BakeOutcome::OnDisk(_) => {
                bail!("{}: is written, but too large for --view, which holds a grid in memory", output.display())
            }
        };
    }
    let write = started.elapsed().as_secs_f64() - read - bake;
    let facts = match &outcome {
        BakeOutcome::InMemory(baked) => GridFacts::of_baked(baked)?,
        BakeOutcome::OnDisk(baked) => GridFacts::of_file(baked),
    };
    let times = [read, bake, write];
    let mut rows = rows(args, &facts, &input, times, &format!("{}, {file} bytes", standard_output::shown(output)));
    let mut json = document(&facts, &input, times, output, file);
    if matches!(outcome, BakeOutcome::OnDisk(_)) {
        rows.push(("memory", "bricks were streamed into the file as they came".to_owned()));
        json["streamed"] = true.into();
    }
    Ok(Report { rows, json })
}

/// Bakes `input` in memory and frees its points and triangles.
pub fn bake(args: &BakeArgs, MeshInput { mesh, facts }: MeshInput) -> Result<(Baked, MeshFacts)> {
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    let options = args.options(source(&facts))?;
    let baked = with_progress(args, |on_progress| {
        Field::bake_with_progress(view, &options, on_progress).map_err(|error| refusal(args, error))
    });
    Ok((baked?, facts))
}

fn source(facts: &MeshFacts) -> Source {
    Source { name: facts.name.clone(), sha256: facts.sha256, triangles: facts.triangles as u64 }
}

fn target<'a>(args: &BakeArgs, path: &'a Path) -> BakeTarget<'a> {
    BakeTarget { path, compression: args.compress, max_bytes: args.memory }
}

/// Bakes a grid in memory, or into its file if it does not fit.
fn bake_whole(
    args: &BakeArgs,
    mesh: Mesh,
    options: &BakeOptions,
    output: &Path,
    on_progress: &(dyn Fn(Progress) + Sync),
) -> Result<BakeOutcome> {
    if standard_output::is_standard_output(output) {
        let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
        let baked = Field::bake_with_progress(view, options, on_progress);
        return baked.map(Box::new).map(BakeOutcome::InMemory).map_err(|error| refusal(args, error));
    }
    let mesh = checked(args, mesh, options)?;
    Field::bake_or_stream(mesh, options, target(args, output), on_progress).map_err(|error| failure(args, error))
}

/// The mesh to bake, when the file's is freed.
fn checked(args: &BakeArgs, mesh: Mesh, options: &BakeOptions) -> Result<CheckedMesh> {
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    CheckedMesh::new(view, options).map_err(|error| refusal(args, error))
}

fn with_progress<T>(args: &BakeArgs, bake: impl FnOnce(&(dyn Fn(Progress) + Sync)) -> Result<T>) -> Result<T> {
    let bar: ProgressBar = progress::bar("baking", 0);
    // Bars of several meshes would overwrite each other.
    if args.fleet.is_wanted() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    let baked = bake(&|progress: Progress| match progress {
        Progress::Total(steps) => bar.inc_length(steps),
        Progress::Done(steps) => bar.inc(steps),
    });
    bar.finish_and_clear();
    baked
}

fn part_report(
    args: &BakeArgs,
    BrickShard { index, count }: BrickShard,
    baked: &BakedFile,
    input: &MeshFacts,
    [read, bake]: [f64; 2],
    output: &Path,
) -> Report<serde_json::Value> {
    let (grid, info) = (&baked.grid, &baked.grid.info);
    let (lattice, bricks) = (&grid.lattice, grid.slots.len());
    let file = fs::metadata(output).map_or(0, |file| file.len());
    let rows = vec![
        ("mesh", mesh_row(args, input, &baked.mesh)),
        ("sign", info.sign_reason.clone()),
        ("grid", format!("{} nodes, spacing {}", counts(lattice.nodes()), number(lattice.spacing()))),
        (
            "part",
            format!(
                "{index}/{count}, {} in {}: join all parts by sdftool merge",
                counted(bricks, "brick"),
                grid.precision.name()
            ),
        ),
        ("time", format!("{} to read, {} to bake and write", seconds(read), seconds(bake))),
        ("file", format!("{}, {file} bytes", output.display())),
    ];
    let json = json!({
        "schema": "sdftool.part/1",
        "output": output.display().to_string(),
        "part": [index, count],
        "triangles": input.triangles,
        "sign_method": info.sign_method.name(),
        "sign_verdict": info.sign_reason,
        "precision": grid.precision.name(),
        "counts": lattice.nodes(),
        "origin": lattice.origin(),
        "spacing": lattice.spacing(),
        "band": info.band,
        "bricks": bricks,
        "file_bytes": file,
        "peak_memory_bytes": sdf_field::memory::peak_bytes(),
        "seconds": {"read": read, "bake": bake},
    });
    Report { rows, json }
}

fn failure(args: &BakeArgs, error: BakeFileError) -> anyhow::Error {
    match error {
        BakeFileError::Bake(error) => refusal(args, error),
        other => other.into(),
    }
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
    let shortage = |bytes, free| match args.memory {
        Some(_) => memory::shortage_of_budget(bytes, free),
        None => memory::shortage(bytes, free),
    };
    match error {
        BakeError::InvalidMesh(invalid) => anyhow!("{shown}: {invalid}"),
        BakeError::VoxelTooLarge { side } => {
            anyhow!("{size}: the whole mesh is {} long: use a smaller --voxel-size", number(side))
        }
        BakeError::ErrorBudget(ErrorBudgetError::SignJumps { .. }) => {
            let cure = match args.sign {
                Sign::PseudoNormal => "leave out --sign",
                Sign::Auto | Sign::Winding => "close the mesh by --weld or --close",
            };
            anyhow!("{shown}: {size}: {error}: use --res or --voxel-size, or {cure}")
        }
        BakeError::ErrorBudget(_) => anyhow!("{shown}: {size}: {error}: {smaller}"),
        BakeError::TooLarge { bricks: Some(bricks), bytes, triangle_bytes, free, .. } => {
            let grid = format!("{shown}: a grid of {bricks} bricks {}", shortage(bytes, free));
            if free.is_some_and(|free| triangle_bytes > free) {
                let more = if args.memory.is_some() { "a larger --memory, " } else { "" };
                let faces = memory::words(triangle_bytes);
                return anyhow!(
                    "{grid}; {faces} are for the mesh's faces, at any --res: use {more}a mesh of fewer faces or --layout dense"
                );
            }
            let smaller = "use a smaller --res, a larger --voxel-size, a smaller --band or --precision u8";
            anyhow!("{grid}: {smaller}")
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
            anyhow!("{size}: a grid of {nodes} nodes {}: {smaller}{or_sparse}", shortage(bytes, free))
        }
        other => anyhow!("{shown}: {other}"),
    }
}

/// The mesh's stem with .sdf.h5, in the current folder; of a part with its number.
fn default_output(args: &BakeArgs) -> PathBuf {
    let mut name = args.mesh.file_stem().unwrap_or_default().to_owned();
    match args.shard_of_bricks() {
        Some(BrickShard { index, count }) => name.push(format!(".part-{index}-of-{count}.h5")),
        None => name.push(".sdf.h5"),
    }
    name.into()
}
