//! Contact searches in memory: no file is counted.

use std::path::Path;

use anyhow::Result;
use clap::ValueEnum;
use rayon::prelude::*;
use sdf_core::Simplex;
use sdf_core::contact::{Element, Outcome};
use sdf_core::minimize::{Certified, FrankWolfe, LineSearch, Minimizer, Newton, PointSampling, ProjectedGradient};
use sdf_core::nalgebra::Vector3;
use sdf_field::Search;
use sdf_formats::field_file::{self, Field, Node};
use sdf_formats::grid_file::OwnedGrid;
use sdf_formats::mesh;
use sdf_procedural::Mesh;

use super::limits::MachineLimits;
use super::round_robin::{RoundRobin, RunResult, Work, thread_counts, timed};
use super::row::Row;
use super::{MethodName, Options, bodies};
use crate::bake::{Layout, bake};
use crate::machine;

/// A mesh and a field that it may touch.
pub struct ContactScene {
    name: String,
    mesh: Mesh,
    field: ContactField,
    resolution: u32,
    margin: f64,
}

enum ContactField {
    Grid(OwnedGrid),
    ClosedForm(Node),
}

const METHODS: [MethodName; 7] = [
    MethodName::Fw,
    MethodName::Auto,
    MethodName::Newton,
    MethodName::Pgd,
    MethodName::Sample4,
    MethodName::Sample16,
    MethodName::Sample64,
];

pub fn against_methods(options: &Options, limits: Option<&MachineLimits>, turns: &mut RoundRobin) -> Result<()> {
    let scene = scene(options)?;
    let methods = options.method.map_or(METHODS.to_vec(), |method| vec![method]);
    turns.measure(methods.into_iter().map(|method| scene.work("contacts", method, 1, limits)).collect())
}

pub fn against_threads(options: &Options, limits: Option<&MachineLimits>, turns: &mut RoundRobin) -> Result<()> {
    let scene = scene(options)?;
    for method in options.method.map_or(vec![MethodName::Fw, MethodName::Auto], |method| vec![method]) {
        let counts = thread_counts(machine::cores()).into_iter();
        turns.measure(counts.map(|threads| scene.work("threads", method, threads, limits)).collect())?;
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
        field: match field_file::read(field_path)? {
            Field::Grid(stored) => ContactField::Grid(stored.grid),
            Field::Analytic(node) => ContactField::ClosedForm(node),
        },
        resolution: 0,
        margin: options.margin,
    })
}

impl ContactScene {
    /// A sheet over a ball with thin spikes, in a dense grid.
    pub fn built_in(resolution: u32) -> Result<Self> {
        let grid = bake(&bodies::spiked_ball(), resolution, Layout::Dense)?.into_grid()?;
        let name = "sheet on spiked ball".to_owned();
        Ok(Self { name, mesh: bodies::cloth(), field: ContactField::Grid(grid), resolution, margin: 0.01 })
    }

    fn work<'a>(
        &'a self,
        group: &'static str,
        method: MethodName,
        threads: usize,
        limits: Option<&'a MachineLimits>,
    ) -> Work<'a> {
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
        Work { row, size: 1.0 / threads as f64, run: Box::new(move || self.run(method, threads, limits)) }
    }

    fn run(&self, method: MethodName, threads: usize, limits: Option<&MachineLimits>) -> Result<RunResult> {
        let (found, seconds) = timed(threads, || self.find(method))?;
        // Separated faces do not report their evaluations: each is taken for an average contact.
        let mean = found.evaluations / found.contacts.max(1) as f64;
        let evaluations = self.mesh.triangles.len() as f64 + mean * found.passed_cull as f64;
        Ok(RunResult {
            contacts: Some(found.contacts),
            floor_seconds: limits.map(|limits| limits.evaluation_seconds(evaluations) / threads as f64),
            ..RunResult::timed(seconds)
        })
    }

    /// Searches all faces, on the threads of the current pool.
    pub fn find(&self, method: MethodName) -> ContactTotals {
        match &self.field {
            ContactField::Grid(grid) => self.find_by_name(grid, method),
            ContactField::ClosedForm(node) => self.find_by_name(node, method),
        }
    }

    fn find_by_name<F: Search>(&self, field: &F, method: MethodName) -> ContactTotals {
        let certified = |evaluations| Certified { evaluations, ..Certified::default() };
        match method {
            MethodName::Auto => self.find_by(field, &certified(256)),
            MethodName::Certified => self.find_by(field, &certified(1024)),
            MethodName::Fw => self.find_by(field, &FrankWolfe::default()),
            MethodName::Pgd => self.find_by(field, &ProjectedGradient::default()),
            MethodName::Ls => self.find_by(field, &LineSearch { iterations: 32, ..Default::default() }),
            MethodName::Newton => self.find_by(field, &Newton::default()),
            MethodName::Sample4 => self.find_by(field, &PointSampling { samples: 4 }),
            MethodName::Sample16 => self.find_by(field, &PointSampling { samples: 16 }),
            MethodName::Sample64 => self.find_by(field, &PointSampling { samples: 64 }),
        }
    }

    fn find_by<F: Search, M: Minimizer<3> + Sync>(&self, field: &F, minimizer: &M) -> ContactTotals {
        let chunks = self.mesh.triangles.par_chunks(CHUNK).enumerate();
        let totals = chunks.map(|(chunk, triangles)| {
            let faces = (chunk * CHUNK..).zip(triangles).map(|(id, vertices)| self.face(id, *vertices));
            let faces: Vec<_> = faces.collect();
            field.outcomes(minimizer, self.margin, &faces).iter().fold(ContactTotals::default(), ContactTotals::add)
        });
        totals.collect::<Vec<_>>().into_iter().fold(ContactTotals::default(), ContactTotals::merge)
    }

    fn face(&self, id: usize, vertices: [u32; 3]) -> Element<f64, 3> {
        let corners = vertices.map(|vertex| Vector3::from(self.mesh.points[vertex as usize]));
        Element { id: id as u32, vertices, simplex: Simplex { corners } }
    }
}

/// Faces searched together: enough to fill the vectors, few enough to distribute among threads.
const CHUNK: usize = 512;

/// Totals over all faces.
#[derive(Default)]
pub struct ContactTotals {
    contacts: usize,
    passed_cull: usize,
    /// Evaluations of the faces that are contacts.
    evaluations: f64,
}

impl ContactTotals {
    fn add(mut self, outcome: &Outcome<f64, 3>) -> Self {
        match outcome {
            Outcome::NotFinite | Outcome::Culled => {}
            Outcome::Separated(_) => self.passed_cull += 1,
            Outcome::Contact(contact) => {
                self.passed_cull += 1;
                self.contacts += 1;
                self.evaluations += f64::from(contact.evaluations);
            }
        }
        self
    }

    fn merge(self, other: Self) -> Self {
        Self {
            contacts: self.contacts + other.contacts,
            passed_cull: self.passed_cull + other.passed_cull,
            evaluations: self.evaluations + other.evaluations,
        }
    }
}

/// The word on the command line.
fn word(method: MethodName) -> String {
    method.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}
