//! Which arguments are meshes and which are fields? Told before any work, and with the command line that was meant.

use std::path::Path;

use anyhow::{Result, bail};
use sdf_formats::mesh::{MeshFormat, format_of};

use crate::args::Command;
use crate::failure::misuse;
use crate::field_input::is_field;
use crate::mesh_input::is_standard_input;

/// Refuses a mesh in the place of a field, and a field in the place of a mesh.
pub fn check(command: &Command) -> Result<()> {
    match command {
        // Two fields are a command of their own.
        Command::Contacts(args) => mesh_then_field("contacts", &args.mesh, &args.sdf),
        Command::Compare(args) => mesh_then_field("compare", &args.mesh, &args.sdf),
        Command::Verify(args) if is_standard_input(&args.sdf) && is_standard_input(&args.mesh) => {
            both_from_standard_input()
        }
        Command::View(args) if is_standard_input(&args.sdf) && args.mesh.as_deref().is_some_and(is_standard_input) => {
            both_from_standard_input()
        }
        Command::Verify(args) => match (format(&args.sdf), is_field(&args.mesh)) {
            (Some(format), true) => bail!(
                "verify takes a field, then its mesh, but {} is {format} and {} is a field: try `sdftool verify {} {}`",
                args.sdf.display(),
                args.mesh.display(),
                args.mesh.display(),
                args.sdf.display()
            ),
            _ => field("verify", &args.sdf),
        },
        // Of several meshes one that is a field fails alone.
        Command::Bake(args) if !args.fleet.is_wanted() && is_field(&args.mesh) => {
            bail!(
                "bake takes a mesh, but {} is a field already, HDF5 or TOML: give an OBJ, PLY, STL or OFF file",
                args.mesh.display()
            )
        }
        Command::Simulate(args) => match args.scene.as_deref().filter(|scene| scene.is_file()).and_then(format) {
            Some(given) => bail!(
                "simulate takes a scene in TOML, which names meshes, but the scene given is {given}: see docs/scenes.md"
            ),
            None => Ok(()),
        },
        Command::Eval(args) => field("eval", &args.sdf),
        Command::Info(args) => field("info", &args.sdf),
        Command::Slice(args) => field("slice", &args.sdf),
        Command::Surface(args) => field("surface", &args.sdf),
        Command::View(args) => field("view", &args.sdf),
        Command::Export(args) => field("export", &args.sdf),
        _ => Ok(()),
    }
}

fn both_from_standard_input() -> Result<()> {
    misuse!("the mesh and the field cannot both be standard input: name a file for one")
}

fn mesh_then_field(command: &str, mesh: &Path, sdf: &Path) -> Result<()> {
    if is_standard_input(mesh) && is_standard_input(sdf) {
        return both_from_standard_input();
    }
    let Some(given) = format(sdf) else {
        return match command {
            "compare" if is_field(mesh) => {
                bail!("compare takes a mesh, then a field, but {} is a field: give a mesh first", mesh.display())
            }
            _ => Ok(()),
        };
    };
    let (first, second) = (mesh.display(), sdf.display());
    if is_field(mesh) {
        bail!(
            "{command} takes a mesh, then a field, but {first} is a field and {second} is {given}: try \
             `sdftool {command} {second} {first}`"
        );
    }
    bail!(
        "{command} takes a mesh, then a field, but {second} is {given}: bake it first, with `sdftool bake {second} --res 128`"
    )
}

fn field(command: &str, sdf: &Path) -> Result<()> {
    let Some(given) = format(sdf) else { return Ok(()) };
    let shown = sdf.display();
    bail!(
        "{command} takes a field, a baked grid (.sdf.h5) or shapes in TOML (.sdf.toml), but {shown} is {given}: bake it first, \
         with `sdftool bake {shown} --res 128`"
    )
}

/// The kind of a mesh, in words; `None` for fields, and for files that are neither.
fn format(path: &Path) -> Option<String> {
    let is_mesh = !is_standard_input(path) && !is_field(path);
    let format = format_of(path).filter(|_| is_mesh)?;
    let article = if format == MeshFormat::Ply { "a" } else { "an" };
    Some(format!("{article} {format} mesh"))
}
