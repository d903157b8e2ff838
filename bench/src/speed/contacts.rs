//! Contact searches in memory: no file is counted.

use std::path::Path;

use anyhow::Result;
use sdf_core::grid::owned::Layout;
use sdf_field::{ContactOptions, Contacts, Field, MeshView, Method};
use sdf_formats::mesh;
use sdf_procedural::Mesh;

use super::limits::MachineLimits;
use super::round_robin::{RoundRobin, RunResult, Work, thread_counts, timed};
use super::row::Row;
use super::{Options, bodies};

use crate::bake::bake;
use crate::machine;

/// A mesh and a field that it may touch.
#[derive(Clone)]
pub struct ContactScene {
    pub name: String,
    pub mesh: Mesh,
    pub field: Field,
    pub resolution: u32,
    pub margin: f64,
    /// Without smooth normals and error bounds.
    lean: bool,
}

const METHODS: [Method; 7] = [
    Method::FrankWolfe,
    Method::Auto,
    Method::Newton,
    Method::ProjectedGradient,
    Method::Sampling(4),
    Method::Sampling(16),
    Method::Sampling(64),
];

pub fn against_methods(options: &Options, limits: Option<&MachineLimits>, turns: &mut RoundRobin) -> Result<()> {
    let scene = scene(options)?;
    let Some(method) = options.method else {
        let lean = ContactScene { lean: true, ..scene.clone() };
        let full = METHODS.iter().map(|method| scene.work("contacts", *method, 1, limits));
        return turns.measure(full.chain([lean.work("contacts", Method::FrankWolfe, 1, limits)]).collect());
    };
    turns.measure(vec![scene.work("contacts", method, 1, limits)])
}

pub fn against_threads(options: &Options, limits: Option<&MachineLimits>, turns: &mut RoundRobin) -> Result<()> {
    let scene = scene(options)?;
    for method in options.method.map_or(vec![Method::FrankWolfe, Method::Auto], |method| vec![method]) {
        let counts = thread_counts(machine::cores()).into_iter();
        turns.measure(counts.map(|threads| scene.work("threads", method, threads, limits)).collect())?;
    }
    Ok(())
}

/// The cloth on the spiked ball, in ever smaller faces.
pub fn against_elements(options: &Options, limits: Option<&MachineLimits>, turns: &mut RoundRobin) -> Result<()> {
    let counts: &[usize] =
        if options.quick { &[1_000, 10_000] } else { &[1_000, 10_000, 100_000, 1_000_000, 10_000_000] };
    let built_in = ContactScene::built_in(if options.quick { 48 } else { 256 })?;
    let scene = |count: &usize| ContactScene {
        name: built_in.name.clone(),
        mesh: bodies::cloth_with_faces(*count),
        field: built_in.field.clone(),
        ..built_in
    };
    let scenes: Vec<ContactScene> = counts.iter().map(scene).collect();
    for method in [Method::FrankWolfe, Method::Auto, Method::Sampling(64)] {
        let work = |scene| ContactScene::work(scene, "elements", method, 1, limits);
        let size = |scene: &ContactScene| scene.mesh.triangles.len() as f64;
        turns.measure(scenes.iter().map(|scene| Work { size: size(scene), ..work(scene) }).collect())?;
    }
    Ok(())
}

fn scene(options: &Options) -> Result<ContactScene> {
    let (Some(mesh_path), Some(field_path)) = (&options.mesh, &options.field) else {
        return ContactScene::built_in(if options.quick { 48 } else { 256 });
    };
    let stem = |path: &Path| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mesh = mesh::read(mesh_path)?;
    mesh.require_triangles(&mesh_path.display().to_string())?;
    Ok(ContactScene {
        name: format!("{} on {}", stem(mesh_path), stem(field_path)),
        mesh: Mesh { points: mesh.points, triangles: mesh.triangles, segments: vec![] },
        field: Field::open(field_path)?,
        resolution: 0,
        margin: options.margin,
        lean: false,
    })
}

impl ContactScene {
    /// A sheet over a ball with thin spikes, in a dense grid.
    pub fn built_in(resolution: u32) -> Result<Self> {
        let field = bake(&bodies::spiked_ball(), resolution, Layout::Dense)?;
        let name = "sheet on spiked ball".to_owned();
        Ok(Self { name, mesh: bodies::cloth(), field, resolution, margin: 0.01, lean: false })
    }

    fn work<'a>(
        &'a self,
        group: &'static str,
        method: Method,
        threads: usize,
        limits: Option<&'a MachineLimits>,
    ) -> Work<'a> {
        let row = Row {
            group,
            work: format!("contacts of {} by {}{method}", self.name, if self.lean { "lean " } else { "" }),
            triangles: self.mesh.triangles.len(),
            resolution: self.resolution,
            threads,
            units: self.mesh.triangles.len() as f64,
            unit: "faces",
            ..Row::default()
        };
        Work { row, size: 1.0 / threads as f64, run: Box::new(move || self.run(method, threads, limits)) }
    }

    fn run(&self, method: Method, threads: usize, limits: Option<&MachineLimits>) -> Result<RunResult> {
        let (found, seconds) = timed(threads, || self.find(method))?;
        let found = found?;
        // Separated faces do not report their evaluations: each is taken for an average contact.
        let evaluations: f64 = found.contacts.iter().map(|contact| f64::from(contact.evaluations)).sum();
        let mean = evaluations / found.contacts.len().max(1) as f64;
        let evaluations = found.element_count as f64 + mean * found.searched_count as f64;
        Ok(RunResult {
            contacts: Some(found.contacts.len()),
            floor_seconds: limits.map(|limits| limits.evaluation_seconds(evaluations) / threads as f64),
            ..RunResult::timed(seconds)
        })
    }

    /// Searches all faces, on the threads of the current pool.
    pub fn find(&self, method: Method) -> Result<Contacts> {
        let mesh = MeshView { points: &self.mesh.points, faces: &self.mesh.triangles };
        let options = ContactOptions { method, margin: self.margin, lean: self.lean, ..ContactOptions::default() };
        Ok(self.field.contacts(mesh, &options)?)
    }
}
