//! `contacts` without reading and writing files.

use anyhow::{Context, Result};
use clap::{Parser, ValueEnum};
use sdf_formats::field_file::{self, Field};
use sdf_formats::mesh::Mesh;

use super::bodies;
use super::limits::Limits;
use super::machine;
use super::processes::Folder;
use super::row::Row;
use super::turns::{Done, Turns, Work, thread_counts, timed};
use crate::args::{BakeArgs, BenchArgs, ContactsArgs, Method};
use crate::commands::{bake, contacts};
use crate::mesh_input;

/// A mesh, and the field that it may touch.
pub struct Scene {
    name: String,
    mesh: Mesh,
    field: Field,
    resolution: u32,
    margin: f64,
}

const METHODS: [Method; 7] =
    [Method::Fw, Method::Auto, Method::Newton, Method::Pgd, Method::Sample4, Method::Sample16, Method::Sample64];

pub fn by_method(args: &BenchArgs, limits: Option<&Limits>, turns: &mut Turns) -> Result<()> {
    let scene = scene(args)?;
    let methods = args.method.map_or(METHODS.to_vec(), |method| vec![method]);
    turns.take(methods.into_iter().map(|method| scene.work("contacts", method, 1, limits)).collect())
}

pub fn against_threads(args: &BenchArgs, limits: Option<&Limits>, turns: &mut Turns) -> Result<()> {
    let scene = scene(args)?;
    for method in args.method.map_or(vec![Method::Fw, Method::Auto], |method| vec![method]) {
        let counts = thread_counts(machine::cores()).into_iter();
        turns.take(counts.map(|threads| scene.work("threads", method, threads, limits)).collect())?;
    }
    Ok(())
}

fn scene(args: &BenchArgs) -> Result<Scene> {
    let (Some(mesh), Some(field)) = (&args.mesh, &args.field) else {
        return Scene::own(if args.quick { 48 } else { 256 });
    };
    let stem = |path: &std::path::Path| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Scene {
        name: format!("{} on {}", stem(mesh), stem(field)),
        mesh: mesh_input::read(mesh)?.mesh,
        field: field_file::read(field)?,
        resolution: 0,
        margin: args.margin,
    })
}

impl Scene {
    /// A sheet over a ball with thin spikes, in a dense grid.
    pub fn own(resolution: u32) -> Result<Self> {
        let input = bodies::spiked_ball();
        let args = BakeArgs::try_parse_from(["bake", "mesh", "--res", &resolution.to_string()])?;
        let baked = bake::bake(&args, input)?;
        let folder = Folder::new()?;
        let file = folder.file("body.sdf.h5");
        baked.grid.write(&file, &baked.lattice, baked.band, &bake::about(&args, &baked))?;
        let field = field_file::read(&file)?;
        let name = "sheet on spiked ball".to_owned();
        Ok(Self { name, mesh: bodies::cloth(), field, resolution, margin: 0.01 })
    }

    fn work<'a>(&'a self, group: &'static str, method: Method, threads: usize, limits: Option<&'a Limits>) -> Work<'a> {
        let row = Row {
            group,
            work: format!("contacts of {} by {}", self.name, word(method)),
            triangles: self.mesh.triangles.len(),
            resolution: self.resolution,
            threads,
            units: self.mesh.triangles.len() as f64,
            unit: "faces",
            ..Row::default()
        };
        Work { row, size: 1.0 / threads as f64, run: Box::new(move || self.find(method, threads, limits)) }
    }

    pub fn find(&self, method: Method, threads: usize, limits: Option<&Limits>) -> Result<Done> {
        let margin = format!("--margin={}", self.margin);
        let args = ContactsArgs::try_parse_from(["contacts", "mesh", "field", "--method", &word(method), &margin])?;
        let (found, seconds) = timed(threads, || contacts::find(&args, &self.mesh, &self.field))?;
        let found = found.context("a method that searches faces")?;
        let evaluations: f64 = found.contacts.iter().map(|contact| f64::from(contact.evaluations)).sum();
        // Of faces that come out apart it is not told how often the field was asked: taken for as often as of contacts.
        let of_one = evaluations / found.contacts.len().max(1) as f64;
        let asked = found.elements as f64 + of_one * found.passed_cull as f64;
        Ok(Done {
            found: Some(found.contacts.len()),
            floor: limits.map(|limits| limits.of_values(asked) / threads as f64),
            ..Done::in_seconds(seconds)
        })
    }
}

/// As on the command line.
fn word(method: Method) -> String {
    method.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}
