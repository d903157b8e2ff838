//! What methods make of whole scenes, as in the paper's table 1, Fig. 13 and §8.3.

use std::hint::black_box;

use anyhow::Result;
use cpu_time::ThreadTime;
use rayon::prelude::*;
use sdf_core::contact::{Element, Outcome, contact};
use sdf_core::minimize::{Certified, Minimizer, PointSampling};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Sdf, Simplex};
use sdf_formats::field_file::Node;
use sdf_procedural::Mesh;
use serde::Serialize;

use super::fields::Layout;
use super::methods::{Method, Searches, methods};
use super::scene::{Elements, Paper, Place, Scene};
use super::statistics::median;

#[derive(Debug, Serialize)]
pub struct SceneReport {
    pub scene: String,
    pub about: String,
    pub elements_are: Elements,
    /// Cells along the body's longest side, of a grid.
    pub resolution: Option<u32>,
    pub layout: Option<Layout>,
    pub margin: f64,
    pub points: usize,
    pub elements: usize,
    pub passed_cull: usize,
    /// Elements that are proven to come within the margin.
    pub contacts: usize,
    /// Elements of which it is not proven whether they do. They count neither as contacts nor as missed.
    pub undecided: usize,
    pub methods: Vec<SceneMethod>,
    pub paper: Option<Paper>,
}

impl SceneReport {
    /// Of its contacts.
    pub fn share(&self, missed: usize) -> f64 {
        missed as f64 / self.contacts.max(1) as f64
    }
}

#[derive(Debug, Serialize)]
pub struct SceneMethod {
    pub method: &'static str,
    /// Of the method in the list of all; of the vertices that of sampling.
    #[serde(skip)]
    pub number: usize,
    pub budget: u32,
    pub unit: &'static str,
    /// Elements that it finds within the margin; of the vertices, how many are.
    pub contacts: usize,
    /// Of the scene's contacts those that it does not see.
    pub missed: usize,
    /// How often the field is asked in all, at most: once for an element's cull, though some need none.
    pub evaluations: u64,
    /// For the whole scene, cull included: the time that one thread has run.
    pub microseconds: f64,
}

/// The paper's simple approach: all vertices of the mesh, each asked once.
pub const VERTICES: &str = "vertices alone";

/// A method that took longer than this for a scene is not timed again, in microseconds.
const LONG_ENOUGH: f64 = 1e6;

/// How much of a scene is taken.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    pub cells: u32,
    pub elements: usize,
    pub rounds: u32,
}

pub fn measure(place: &Place, field: &Node, limits: Limits) -> Result<SceneReport> {
    let mesh = place.mesh()?;
    let asked = Asked { scene: &place.scene, field, limits };
    Ok(match place.scene.elements {
        Elements::Faces => asked.report(&mesh, &mesh.triangles),
        Elements::Edges => asked.report(&mesh, &mesh.segments),
    })
}

/// A field that a scene's elements are held against.
struct Asked<'a> {
    scene: &'a Scene,
    field: &'a Node,
    limits: Limits,
}

/// What branch and bound proves of an element.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Truth {
    Culled,
    Separated,
    Undecided,
    Touches,
}

/// The searches that decide on an element, one after another: what the first finds needs no proof. The last leaves undecided
/// what lies within a 10,000th of an edge of the margin, or has no room in the search.
fn proofs() -> [Certified; 3] {
    [(0, 1e-1), (256, 1e-2), (20_000, 1e-4)].map(|(evaluations, tolerance)| Certified {
        evaluations,
        tolerance,
        ..Certified::default()
    })
}

impl Asked<'_> {
    fn report<const N: usize>(&self, mesh: &Mesh, all: &[[u32; N]]) -> SceneReport
    where
        Method: Searches<N>,
        Certified: Minimizer<N>,
    {
        let scene = self.scene;
        let step = all.len().div_ceil(self.limits.elements).max(1);
        let chosen = all.iter().step_by(step).enumerate();
        let elements: Vec<Element<f64, N>> = chosen.map(|(id, vertices)| element(mesh, id, *vertices)).collect();
        let truth: Vec<Truth> = elements.par_iter().map(|element| self.truth(element)).collect();
        let count = |wanted: Truth| truth.iter().filter(|truth| **truth == wanted).count();
        let grid = scene.grid;
        SceneReport {
            scene: scene.name.clone(),
            about: scene.about.clone(),
            elements_are: scene.elements,
            resolution: grid.map(|grid| grid.resolution.min(self.limits.cells)),
            layout: grid.map(|grid| grid.layout),
            margin: scene.margin,
            points: mesh.points.len(),
            elements: elements.len(),
            passed_cull: elements.len() - count(Truth::Culled),
            contacts: count(Truth::Touches),
            undecided: count(Truth::Undecided),
            methods: self.methods(mesh, &elements, &truth),
            paper: scene.paper,
        }
    }

    fn truth<const N: usize>(&self, element: &Element<f64, N>) -> Truth
    where
        Certified: Minimizer<N>,
    {
        let margin = self.scene.margin;
        for search in proofs() {
            match contact(self.field, &search, margin, element) {
                Outcome::NotFinite | Outcome::Culled => return Truth::Culled,
                Outcome::Contact(_) => return Truth::Touches,
                Outcome::Separated(minimum) if margin < minimum.lower_bound => return Truth::Separated,
                Outcome::Separated(_) => {}
            }
        }
        Truth::Undecided
    }

    fn methods<const N: usize>(&self, mesh: &Mesh, elements: &[Element<f64, N>], truth: &[Truth]) -> Vec<SceneMethod>
    where
        Method: Searches<N>,
    {
        let margin = self.scene.margin;
        let methods = methods();
        let points = points(mesh, elements);
        let mut found = vec![self.vertices(mesh, elements, truth)];
        let mut asks: Vec<Box<dyn Fn()>> = vec![Box::new(|| self.ask_points(&points))];
        for (number, method) in methods.iter().enumerate() {
            let Some(search) = method.search() else { continue };
            for budget in method.usual {
                let ask = |element| (search.contact)(*budget, self.field, margin, element);
                let seen: Vec<(bool, u64)> = elements.par_iter().map(|element| seen(&ask(element))).collect();
                found.push(SceneMethod {
                    method: method.name,
                    number,
                    budget: *budget,
                    unit: method.unit,
                    contacts: seen.iter().filter(|(touches, _)| *touches).count(),
                    missed: missed(truth, seen.iter().map(|(touches, _)| *touches)),
                    evaluations: seen.iter().map(|(_, evaluations)| evaluations).sum(),
                    microseconds: 0.0,
                });
                asks.push(Box::new(move || {
                    for element in elements {
                        black_box(ask(element));
                    }
                }));
            }
        }
        found.iter_mut().zip(self.times(&asks)).for_each(|(method, time)| method.microseconds = time);
        found
    }

    /// In microseconds. All take turns, so that what slows the machine for a while slows all of them.
    fn times(&self, asks: &[Box<dyn Fn() + '_>]) -> Vec<f64> {
        let mut times = vec![vec![]; asks.len()];
        for _ in 0..self.limits.rounds {
            for (ask, times) in asks.iter().zip(&mut times) {
                if times.iter().sum::<f64>() < LONG_ENOUGH {
                    let started = ThreadTime::now();
                    ask();
                    times.push(started.elapsed().as_secs_f64() * 1e6);
                }
            }
        }
        times.into_iter().map(median).collect()
    }

    fn ask_points(&self, points: &[Element<f64, 1>]) {
        let once = PointSampling { samples: 1 };
        for point in points {
            black_box(contact(self.field, &once, self.scene.margin, point));
        }
    }

    /// An element counts as seen where one of its vertices is within the margin.
    fn vertices<const N: usize>(&self, mesh: &Mesh, elements: &[Element<f64, N>], truth: &[Truth]) -> SceneMethod {
        let margin = self.scene.margin;
        let is_within: Vec<bool> =
            mesh.points.par_iter().map(|point| self.field.value(Vector3::from(*point)) <= margin).collect();
        let points = points(mesh, elements);
        let touches = |element: &Element<f64, N>| element.vertices.iter().any(|vertex| is_within[*vertex as usize]);
        SceneMethod {
            method: VERTICES,
            number: 0,
            budget: 1,
            unit: "samples",
            contacts: points.iter().filter(|point| is_within[point.vertices[0] as usize]).count(),
            missed: missed(truth, elements.iter().map(touches)),
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
fn points<const N: usize>(mesh: &Mesh, elements: &[Element<f64, N>]) -> Vec<Element<f64, 1>> {
    let mut vertices: Vec<u32> = elements.iter().flat_map(|element| element.vertices).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices.into_iter().map(|vertex| element(mesh, vertex as usize, [vertex])).collect()
}

/// Whether it is a contact, and how often the field was asked.
fn seen<const N: usize>(outcome: &Outcome<f64, N>) -> (bool, u64) {
    match outcome {
        Outcome::NotFinite | Outcome::Culled => (false, 1),
        Outcome::Separated(minimum) => (false, 1 + minimum.evaluations as u64),
        Outcome::Contact(contact) => (true, u64::from(contact.evaluations)),
    }
}

fn missed(truth: &[Truth], seen: impl Iterator<Item = bool>) -> usize {
    truth.iter().zip(seen).filter(|(truth, seen)| **truth == Truth::Touches && !seen).count()
}
