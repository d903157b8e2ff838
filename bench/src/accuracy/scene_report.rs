//! Contacts that each method finds and misses in whole scenes, and its time: the paper's table 1, Fig. 13 and §8.3.
//!
//! Branch and bound decides first, for each element, whether it is a contact ([`proofs`]). Each method is then compared
//! with that.

use std::hint::black_box;

use anyhow::Result;
use cpu_time::ThreadTime;
use rayon::prelude::*;
use sdf_core::AnyField;
use sdf_core::contact::{Element, Outcome, contact};
use sdf_core::grid::owned::Layout;
use sdf_core::minimize::{Certified, Minimizer, PointSampling};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Sdf, Simplex};
use sdf_procedural::Mesh;
use serde::Serialize;

use super::methods::{ElementMethod, Method, methods};
use super::scene_file::{Elements, PaperTimes, Scene, SceneFile};
use crate::statistics::median;

#[derive(Debug, Serialize)]
pub struct SceneReport {
    pub scene: String,
    pub about: String,
    #[serde(rename = "elements_are")]
    pub element_kind: Elements,
    /// Cells along the body's longest side, if it is a grid.
    pub resolution: Option<u32>,
    #[serde(serialize_with = "name")]
    pub layout: Option<Layout>,
    pub margin: f64,
    pub points: usize,
    pub elements: usize,
    pub passed_cull: usize,
    /// Number of elements proven to come within the margin.
    pub contacts: usize,
    /// Number of elements for which neither is proven. They count neither as contacts nor as missed.
    pub undecided: usize,
    pub methods: Vec<SceneMethod>,
    pub paper: Option<PaperTimes>,
}

impl SceneReport {
    pub fn missed_fraction(&self, missed: usize) -> f64 {
        missed as f64 / self.contacts.max(1) as f64
    }
}

/// One method in one scene.
#[derive(Debug, Serialize)]
pub struct SceneMethod {
    pub method: &'static str,
    /// Index in the list of all methods; [`VERTICES`] has that of sampling.
    #[serde(skip)]
    pub index: usize,
    pub budget: u32,
    pub unit: &'static str,
    /// Number of elements found within the margin; for [`VERTICES`], of vertices.
    pub contacts: usize,
    /// Number of the scene's contacts that it does not find.
    pub missed: usize,
    /// Evaluations of the field in all, one for each cull included, although some culls need none.
    pub evaluations: u64,
    /// Processor time for the whole scene, cull included.
    pub microseconds: f64,
}

/// The paper's simple approach: one evaluation at each vertex of the mesh.
pub const VERTICES: &str = "vertices alone";

/// Total time in microseconds after which a method is not timed again.
const ENOUGH_MICROSECONDS: f64 = 1e6;

/// Limits of a scene's size.
#[derive(Clone, Copy, Debug)]
pub struct SceneLimits {
    pub cells: u32,
    pub elements: usize,
    pub rounds: u32,
}

fn name<S: serde::Serializer>(layout: &Option<Layout>, to: S) -> Result<S::Ok, S::Error> {
    layout.map(Layout::name).serialize(to)
}

pub fn measure(file: &SceneFile, field: &AnyField, limits: SceneLimits) -> Result<SceneReport> {
    let mesh = file.mesh()?;
    let scene = PosedScene { scene: &file.scene, field, limits };
    Ok(match file.scene.elements {
        Elements::Faces => scene.report(&mesh, &mesh.triangles),
        Elements::Edges => scene.report(&mesh, &mesh.segments),
    })
}

/// A scene and its field.
struct PosedScene<'a> {
    scene: &'a Scene,
    field: &'a AnyField,
    limits: SceneLimits,
}

/// Result of branch and bound for an element.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Culled,
    Separated,
    Undecided,
    Contact,
}

/// Searches that decide about an element, tried in this order. After the last, an element is undecided if its minimum is
/// within 1e-4 edges of the margin, or if the search ran out of space.
fn proofs() -> [Certified; 3] {
    [(0, 1e-1), (256, 1e-2), (20_000, 1e-4)].map(|(evaluations, tolerance)| Certified {
        evaluations,
        tolerance,
        ..Certified::default()
    })
}

impl PosedScene<'_> {
    fn report<const N: usize>(&self, mesh: &Mesh, all: &[[u32; N]]) -> SceneReport
    where
        Method: ElementMethod<N>,
        Certified: Minimizer<N>,
    {
        let scene = self.scene;
        let step = all.len().div_ceil(self.limits.elements).max(1);
        let chosen = all.iter().step_by(step).enumerate();
        let elements: Vec<Element<f64, N>> = chosen.map(|(id, vertices)| element(mesh, id, *vertices)).collect();
        let verdicts: Vec<Verdict> = elements.par_iter().map(|element| self.verdict(element)).collect();
        let count = |wanted: Verdict| verdicts.iter().filter(|verdict| **verdict == wanted).count();
        let grid = scene.grid;
        SceneReport {
            scene: scene.name.clone(),
            about: scene.about.clone(),
            element_kind: scene.elements,
            resolution: grid.map(|grid| grid.resolution.min(self.limits.cells)),
            layout: grid.map(|grid| grid.layout),
            margin: scene.margin,
            points: mesh.points.len(),
            elements: elements.len(),
            passed_cull: elements.len() - count(Verdict::Culled),
            contacts: count(Verdict::Contact),
            undecided: count(Verdict::Undecided),
            methods: self.methods(mesh, &elements, &verdicts),
            paper: scene.paper,
        }
    }

    fn verdict<const N: usize>(&self, element: &Element<f64, N>) -> Verdict
    where
        Certified: Minimizer<N>,
    {
        let margin = self.scene.margin;
        for search in proofs() {
            match contact(self.field, &search, margin, element) {
                Outcome::NotFinite | Outcome::Culled => return Verdict::Culled,
                Outcome::Contact(_) => return Verdict::Contact,
                Outcome::Separated(minimum) if margin < minimum.lower_bound => return Verdict::Separated,
                Outcome::Separated(_) => {}
            }
        }
        Verdict::Undecided
    }

    fn methods<const N: usize>(
        &self,
        mesh: &Mesh,
        elements: &[Element<f64, N>],
        verdicts: &[Verdict],
    ) -> Vec<SceneMethod>
    where
        Method: ElementMethod<N>,
    {
        let margin = self.scene.margin;
        let methods = methods();
        let points = vertices(mesh, elements);
        let mut found = vec![self.vertices_alone(mesh, elements, verdicts)];
        let mut runs: Vec<Box<dyn Fn()>> = vec![Box::new(|| self.search_points(&points))];
        for (index, method) in methods.iter().enumerate() {
            let Some(budgeted) = method.budgeted() else { continue };
            for budget in method.usual_budgets {
                let search = |element| (budgeted.contact)(*budget, self.field, margin, element);
                let results: Vec<(bool, u64)> = elements.par_iter().map(|element| summary(&search(element))).collect();
                found.push(SceneMethod {
                    method: method.name,
                    index,
                    budget: *budget,
                    unit: method.unit,
                    contacts: results.iter().filter(|(is_contact, _)| *is_contact).count(),
                    missed: missed_count(verdicts, results.iter().map(|(is_contact, _)| *is_contact)),
                    evaluations: results.iter().map(|(_, evaluations)| evaluations).sum(),
                    microseconds: 0.0,
                });
                runs.push(Box::new(move || {
                    for element in elements {
                        black_box(search(element));
                    }
                }));
            }
        }
        found.iter_mut().zip(self.times(&runs)).for_each(|(method, time)| method.microseconds = time);
        found
    }

    /// Microseconds of each run. The runs take turns, so that a slow phase of the machine affects all of them.
    fn times(&self, runs: &[Box<dyn Fn() + '_>]) -> Vec<f64> {
        let mut times = vec![vec![]; runs.len()];
        for _ in 0..self.limits.rounds {
            for (run, times) in runs.iter().zip(&mut times) {
                if times.iter().sum::<f64>() < ENOUGH_MICROSECONDS {
                    let started = ThreadTime::now();
                    run();
                    times.push(started.elapsed().as_secs_f64() * 1e6);
                }
            }
        }
        times.into_iter().map(median).collect()
    }

    fn search_points(&self, points: &[Element<f64, 1>]) {
        let once = PointSampling { samples: 1, corners: false };
        for point in points {
            black_box(contact(self.field, &once, self.scene.margin, point));
        }
    }

    /// [`VERTICES`] finds an element if one of its vertices is within the margin.
    fn vertices_alone<const N: usize>(
        &self,
        mesh: &Mesh,
        elements: &[Element<f64, N>],
        verdicts: &[Verdict],
    ) -> SceneMethod {
        let margin = self.scene.margin;
        let is_within: Vec<bool> =
            mesh.points.par_iter().map(|point| self.field.value(Vector3::from(*point)) <= margin).collect();
        let points = vertices(mesh, elements);
        let is_found = |element: &Element<f64, N>| element.vertices.iter().any(|vertex| is_within[*vertex as usize]);
        SceneMethod {
            method: VERTICES,
            index: 0,
            budget: 1,
            unit: "samples",
            contacts: points.iter().filter(|point| is_within[point.vertices[0] as usize]).count(),
            missed: missed_count(verdicts, elements.iter().map(is_found)),
            evaluations: points.len() as u64,
            microseconds: 0.0,
        }
    }
}

fn element<const N: usize>(mesh: &Mesh, id: usize, vertices: [u32; N]) -> Element<f64, N> {
    let corners = vertices.map(|vertex| Vector3::from(mesh.points[vertex as usize]));
    Element { id: id as u32, vertices, simplex: Simplex { corners } }
}

/// The vertices of the elements, each once.
fn vertices<const N: usize>(mesh: &Mesh, elements: &[Element<f64, N>]) -> Vec<Element<f64, 1>> {
    let mut vertices: Vec<u32> = elements.iter().flat_map(|element| element.vertices).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices.into_iter().map(|vertex| element(mesh, vertex as usize, [vertex])).collect()
}

/// Is it a contact, and how many evaluations did it take?
fn summary<const N: usize>(outcome: &Outcome<f64, N>) -> (bool, u64) {
    match outcome {
        Outcome::NotFinite | Outcome::Culled => (false, 1),
        Outcome::Separated(minimum) => (false, 1 + minimum.evaluations as u64),
        Outcome::Contact(contact) => (true, u64::from(contact.evaluations)),
    }
}

fn missed_count(verdicts: &[Verdict], found: impl Iterator<Item = bool>) -> usize {
    verdicts.iter().zip(found).filter(|(verdict, found)| **verdict == Verdict::Contact && !found).count()
}
