//! Bakes many meshes, some at a time: each into a file of its own in one folder, each with a line of its own on standard output.
//!
//! A mesh that fails does not stop the others. Writes are atomic and a file states its mesh's SHA-256 and its options, so that a run
//! that was killed is resumed by running it again with --resume, on this machine or another.

use std::collections::BTreeMap;
#[cfg(unix)]
use std::ffi::OsStr;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use sdf_field::Source;
use sdf_formats::{clear_leftovers, grid_file};
use serde_json::{Value, json};

use crate::args::BakeArgs;
use crate::commands::bake::{TOOL, bake_read};
use crate::commands::export::named_after;
use crate::failure::{FleetFailure, misuse, sentence};
use crate::report::{complain, print_json};
use crate::standard_output::{Prints, to_stdout};
use crate::{mesh_input, progress};

/// Fate of a mesh.
enum Fate {
    Done(Value),
    /// The file is there, whole, of this mesh and with these options.
    Kept,
    Failed(String),
}

pub fn run(args: &BakeArgs) -> Result<()> {
    let folder = args.fleet.out_dir.clone().unwrap_or_else(|| PathBuf::from("."));
    let meshes = meshes(args)?;
    let outputs = outputs(&meshes, &folder)?;
    if args.output.is_some() || args.view.is_some() {
        match args.fleet.more.is_empty() && args.fleet.list.is_none() {
            true => misuse!(
                "--resume, --jobs and --out-dir do not go with -o or --view: give --out-dir, a folder, in their place"
            ),
            false => misuse!("-o and --view are for one mesh: give --out-dir, a folder for the grids of all"),
        }
    }
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let (shard, shards) = args.fleet.shard.map_or((0, 1), |shard| (shard.index, shard.count));
    let work: Vec<(&PathBuf, &PathBuf)> =
        meshes.iter().zip(&outputs).skip(shard as usize).step_by(shards as usize).collect();
    let of_machine = || std::thread::available_parallelism().map_or(1, usize::from);
    let threads = args.threads.count.map_or_else(of_machine, usize::from);
    let jobs = usize::from(args.fleet.jobs).min(work.len()).min(threads).max(1);
    let next = AtomicUsize::new(0);
    // Counts of baked, kept and failed; and the prints.
    let output_state = Mutex::new(([0_usize; 3], Prints::default()));
    std::thread::scope(|scope| {
        let worker = || -> Result<()> {
            let pool = progress::pool((threads / jobs).max(1))?;
            while let Some((mesh, output)) = work.get(next.fetch_add(1, Ordering::Relaxed)) {
                let fate = pool.install(|| fate_of(args, mesh, output));
                let index = match &fate {
                    Fate::Done(_) => 0,
                    Fate::Kept => 1,
                    Fate::Failed(_) => 2,
                };
                // Held while the line is printed, so that lines do not mix.
                let mut state = output_state.lock().map_err(|_| anyhow!("a worker panicked"))?;
                let (counts, prints) = &mut *state;
                counts[index] += 1;
                match fate {
                    Fate::Failed(error) if !args.json.wanted => complain(&error),
                    fate => prints.print(|| print(args, mesh, output, fate)),
                }
            }
            Ok(())
        };
        let workers: Vec<_> = (0..jobs).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().try_for_each(|worker| worker.join().map_err(|_| anyhow!("a worker panicked"))?)
    })?;
    let ([done, kept, failed], mut prints) = output_state.into_inner().map_err(|_| anyhow!("a worker panicked"))?;
    if !args.json.wanted {
        prints.print(|| to_stdout(|out| writeln!(out, "{done} baked, {kept} kept, {failed} failed")));
    }
    if failed > 0 { Err(FleetFailure { failed, all: done + kept + failed }.into()) } else { prints.end() }
}

/// The meshes of the command line, then those of the list.
fn meshes(args: &BakeArgs) -> Result<Vec<PathBuf>> {
    let mut meshes: Vec<PathBuf> = [&args.mesh].into_iter().chain(&args.fleet.more).cloned().collect();
    meshes.retain(|mesh| !mesh.as_os_str().is_empty());
    if let Some(list) = &args.fleet.list {
        let shown = mesh_input::shown(list);
        let text = mesh_input::bytes(list)?;
        let text = text.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&text);
        let lines = text.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
        let names = lines.filter(|line| !line.is_empty() && !line.starts_with(b"#"));
        meshes.extend(names.map(path_from_bytes));
        if meshes.is_empty() {
            bail!("{shown}: no meshes: write the name of one on each line");
        }
    }
    match meshes.iter().any(|mesh| mesh_input::is_standard_input(mesh)) {
        true => misuse!("a mesh from standard input cannot be one of several: name its file"),
        false => Ok(meshes),
    }
}

/// The path of any bytes, as Unix has them.
#[cfg(unix)]
fn path_from_bytes(name: &[u8]) -> PathBuf {
    <OsStr as std::os::unix::ffi::OsStrExt>::from_bytes(name).into()
}

/// The path of a name; of one that is not UTF-8, where no file has it, a path that is not found.
#[cfg(not(unix))]
fn path_from_bytes(name: &[u8]) -> PathBuf {
    String::from_utf8_lossy(name).into_owned().into()
}

/// For each mesh its grid, in the order of the meshes; two must not be the same.
fn outputs(meshes: &[PathBuf], folder: &Path) -> Result<Vec<PathBuf>> {
    let mut of = BTreeMap::new();
    let mut outputs = Vec::new();
    for mesh in meshes {
        let output = folder.join(named_after(mesh, "sdf.h5"));
        if let Some(other) = of.insert(output.clone(), mesh) {
            let [other, mesh, output] = [other, mesh, &output].map(|path| path.display());
            bail!("{other} and {mesh} would both be written to {output}: bake them into two folders");
        }
        outputs.push(output);
    }
    Ok(outputs)
}

fn fate_of(args: &BakeArgs, mesh: &Path, output: &Path) -> Fate {
    let args = BakeArgs { mesh: mesh.to_owned(), ..args.clone() };
    let bake = || -> Result<Fate> {
        let started = Instant::now();
        let input = mesh_input::read(mesh)?;
        let options = args.options(Source::default())?;
        if args.fleet.resume && is_there(output, input.facts.sha256, &options.words()) {
            // A worker may have been killed between the last two steps of a write.
            clear_leftovers(output);
            return Ok(Fate::Kept);
        }
        crate::output::ensure_writable(output, &[mesh])?;
        Ok(Fate::Done(bake_read(&args, input, output, started)?.json))
    };
    match catch_unwind(AssertUnwindSafe(bake)) {
        Ok(Ok(fate)) => fate,
        Ok(Err(error)) => Fate::Failed(sentence(&error)),
        Err(_) => Fate::Failed(format!("{}: the bake panicked: please report this", mesh.display())),
    }
}

/// Is the grid there, whole, of a mesh with this hash, by these options and this version?
fn is_there(output: &Path, sha256: [u8; 32], options: &str) -> bool {
    grid_file::open(output).is_ok_and(|reader| {
        let about = reader.about();
        let is_it = about.source.sha256 == sha256 && about.options == options && about.tool == TOOL;
        is_it && reader.check().is_ok()
    })
}

/// Prints the fate of a mesh; of one that failed as JSON only.
fn print(args: &BakeArgs, mesh: &Path, output: &Path, fate: Fate) -> Result<()> {
    let (shown, output) = (mesh.display().to_string(), output.display().to_string());
    if args.json.wanted {
        return print_json(&match fate {
            Fate::Done(mut document) => {
                document["mesh"] = shown.into();
                document["status"] = "baked".into();
                document
            }
            Fate::Kept => json!({"schema": "sdftool.bake/1", "mesh": shown, "status": "kept", "output": output}),
            Fate::Failed(error) => {
                json!({"schema": "sdftool.error/1", "mesh": shown, "status": "failed", "error": error})
            }
        });
    }
    match fate {
        Fate::Done(document) => {
            let warning = document["warning"].as_str().map_or(String::new(), |warning| format!("; {warning}"));
            to_stdout(|out| writeln!(out, "{output}: {} bytes{warning}", document["file_bytes"]))
        }
        Fate::Kept => to_stdout(|out| writeln!(out, "{output}: kept")),
        Fate::Failed(_) => Ok(()),
    }
}
