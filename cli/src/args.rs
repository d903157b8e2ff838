//! The command line. Each command's arguments stand in a struct; `values` parses what clap does not.

mod bake;
mod contacts;
mod device;
mod exchange;
mod fields;
mod simulate;
mod values;

pub use bake::{BakeArgs, Certify, Sign};
pub use contacts::{CompareArgs, ContactsArgs, Elements};
pub use device::{Device, DeviceArgs};
pub use exchange::{ExportArgs, ImportArgs, ViewArgs};
pub use fields::{Axis, EvalArgs, InfoArgs, SliceArgs, SurfaceArgs, VerifyArgs};
pub use simulate::{MethodWord, SimulateArgs};

use std::path::PathBuf;

use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{Parser, Subcommand};
use sdf_core::grid::owned::Layout;
use sdf_field::Method;

/// Bake meshes into signed distance fields, and find the contacts of other meshes with them.
///
/// MESH is an OBJ, PLY, STL or OFF file. SDF is a baked grid (.sdf.h5) or shapes in closed form (.sdf.toml). Distances are
/// negative inside and in the mesh's own unit.
///
/// Exit status: 0 done, 1 the input or the disk is at fault, 2 wrong usage, 3 some of several meshes were baked,
/// 128 + N ended by the signal N, as by Ctrl-C (130).
#[derive(Debug, Parser)]
#[command(version, max_term_width = 110)]
pub struct Args {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    Bake(BakeArgs),
    Merge(MergeArgs),
    Contacts(ContactsArgs),
    Compare(CompareArgs),
    Eval(EvalArgs),
    Info(InfoArgs),
    Verify(VerifyArgs),
    Slice(SliceArgs),
    Surface(SurfaceArgs),
    Export(ExportArgs),
    Import(ImportArgs),
    View(ViewArgs),
    Simulate(SimulateArgs),
    Demo(DemoArgs),
    Completions(CompletionsArgs),
    Man(ManArgs),
}

impl Command {
    /// Refuses combinations of options that contradict each other.
    pub fn check(&self) -> Result<(), &'static str> {
        match self {
            Self::Bake(args) if args.mesh.as_os_str().is_empty() && args.fleet.list.is_none() => {
                Err("a mesh is needed, or --list with the names of some")
            }
            Self::Bake(args) if args.layout() == Layout::Dense && args.band.is_some() => {
                Err("a dense grid has no band: add --layout sparse, or remove --band")
            }
            Self::Bake(args) if args.layout() == Layout::Dense && args.certify == Certify::Tight => {
                Err("--certify tight is for the bricks of a sparse grid: add --layout sparse, or remove it")
            }
            Self::Bake(args) if args.max_error.is_some() && args.layout() == Layout::Dense => {
                Err("--max-error makes a sparse grid: remove --layout dense")
            }
            Self::Bake(args) if args.max_error.is_some() && args.precision.is_some() => {
                Err("--max-error chooses the precision: remove --precision")
            }
            Self::Bake(args) if args.shard_of_bricks().is_some() && args.max_error.is_some() => {
                Err("--shard of one mesh needs the size of cells: give --res or --voxel-size in place of --max-error")
            }
            Self::Bake(args) if args.shard_of_bricks().is_some() && args.layout() == Layout::Dense => {
                Err("--shard of one mesh is a part of its bricks: add --layout sparse")
            }
            Self::Bake(args)
                if args.fleet.shard.is_some() && args.fleet.has_one_mesh_alone() && args.fleet.is_wanted() =>
            {
                Err(
                    "--shard of one mesh bakes a part of its bricks, anew each time: remove --resume and --jobs; to share out whole meshes, give --out-dir",
                )
            }
            Self::Bake(args) if args.shard_of_bricks().is_some() && args.view.is_some() => {
                Err("--view shows a whole grid: merge the parts, then use `view`")
            }
            Self::Contacts(args) if args.all_minima && !matches!(args.method, Method::Auto | Method::Certified) => {
                Err("--all-minima needs a certified search: remove --method")
            }
            Self::Contacts(args)
                if args.tolerance.is_some() && !matches!(args.method, Method::Auto | Method::Certified) =>
            {
                Err("--tolerance is for auto and certified: remove it, or --method")
            }
            Self::Contacts(args) if args.method == Method::GoldenSection && args.elements != Elements::Edges => {
                Err("--method gss works on edges only: add --elements edges, or use another method")
            }
            Self::Simulate(args) if args.suite && args.frames.is_some() => {
                Err("--suite runs the frames that each scene asks for: remove --frames")
            }
            Self::Simulate(args) if !args.suite && args.methods.len() > 1 => {
                Err("several methods are for --suite: give one, or add --suite")
            }
            _ => Ok(()),
        }
    }
}

/// Make a spiky body and a cloth over it, bake, find contacts and draw them.
///
/// Writes, or replaces, body.obj, cloth.obj, body.sdf.h5, contacts.csv and contacts.png.
#[derive(Debug, Parser)]
pub struct DemoArgs {
    /// The folder to write into; it is made if missing.
    #[arg(short, long, value_name = "FOLDER", default_value = "sdftool-demo", value_parser = folder())]
    pub output: PathBuf,
    #[command(flatten)]
    pub json: Json,
}

/// Join the parts of a sparse bake, written by `bake --shard`, into one grid.
///
/// The file has the bytes that one bake would write, but for one thing: a grid of an open mesh that is joined from parts lacks
/// `error_regions`, which say where its error is large. Parts of other meshes, options or versions, and missing ones, are refused.
#[derive(Debug, Parser)]
pub struct MergeArgs {
    /// All parts of one bake, in any order.
    #[arg(value_name = "PART", required = true)]
    pub parts: Vec<PathBuf>,
    /// Where to write the grid.
    #[arg(short, long, value_name = "OUT.sdf.h5", value_parser = PathBufValueParser::new().try_map(values::merged_file))]
    pub output: PathBuf,
    #[command(flatten)]
    pub threads: Threads,
    #[command(flatten)]
    pub json: Json,
}

/// Print a completion script for a shell.
#[derive(Debug, Parser)]
pub struct CompletionsArgs {
    /// The shell; for bash: sdftool completions bash > ~/.local/share/bash-completion/completions/sdftool
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// Print the manual page, or write one for each command.
#[derive(Debug, Parser)]
pub struct ManArgs {
    /// The folder to write a page for each command into; it is made if missing [default: one page to standard output].
    #[arg(short, long, value_name = "FOLDER", value_parser = folder())]
    pub output: Option<PathBuf>,
}

fn folder() -> impl TypedValueParser<Value = PathBuf> {
    let why = "several files are written, and standard output takes one: give the name of a folder";
    PathBufValueParser::new().try_map(values::not_standard_output(why))
}

#[derive(Clone, Copy, Debug, Parser)]
pub struct Threads {
    /// Number of threads; the result does not depend on it [default: as many as the machine has].
    #[arg(long = "threads", value_name = "T", allow_negative_numbers = true)]
    #[arg(value_parser = clap::value_parser!(u16).range(1..=sdf_field::Threads::MOST as i64))]
    pub count: Option<u16>,
}

#[derive(Clone, Copy, Debug, Parser)]
pub struct Json {
    /// Print one JSON object, alone, on standard output.
    #[arg(long = "json")]
    pub wanted: bool,
}
