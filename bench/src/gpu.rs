//! Contacts on a GPU: are they those of the CPU, bit for bit, and how long do they take?
//!
//! For every scene and method, the contacts of `sdf_gpu` are compared with `contact::<f32, …>` on this machine. Then the card's own
//! clock measures each stage with warm buffers, and the processor's searches of the same scene, in f64 as programs call them, are
//! measured beside it. Times are medians, in microseconds.

mod export;

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use rayon::prelude::*;
use sdf_core::AnyField;
use sdf_core::Simplex;
use sdf_core::contact::{Contact, Element, Feature, Outcome, contact, contact_at, cull, lean_contact};
use sdf_core::grid::PlainNormals;
use sdf_core::minimize::{Certified, FrankWolfe, GoldenSection, Minimizer, Newton, PointSampling, ProjectedGradient};
use sdf_core::nalgebra::Vector3;
use sdf_field::{ContactOptions, Field, MeshView, Threads};
use sdf_gpu::{Elements, Gpu, GpuError, GpuField, GpuMesh, GpuQuery, Method, QueryOptions, Stages, Unsettled};
use sdf_procedural::Mesh;

use crate::accuracy::{PaperTimes, SceneFile, read_scenes};
use crate::statistics::median;
use crate::table::Table;

/// Command-line options.
#[derive(Clone, Debug, clap::Args)]
pub struct GpuOptions {
    /// PTX or machine code of the kernels, made by .ci/gpu.sh.
    #[arg(value_name = "KERNELS", required_unless_present = "export")]
    pub kernels: Option<PathBuf>,
    /// Use no card: write points, elements, samples and the CPU's contacts of each scene with a grid into DIR/NAME, for
    /// tests/peers/gpu.py.
    #[arg(long, value_name = "DIR", conflicts_with = "kernels")]
    pub export: Option<PathBuf>,
    /// Further scenes, as bench/scenes has them.
    #[arg(long, value_name = "SCENE.toml")]
    pub scene: Vec<PathBuf>,
    /// Only the scenes of these names.
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Only queries of these forms.
    #[arg(long, value_name = "FORM", value_parser = ["separate", "fused", "lean", "leanseparate", "certified"])]
    pub form: Vec<String>,
    /// How often each time is taken.
    #[arg(long, default_value_t = 100)]
    pub repetitions: usize,
    /// Largest number of cells along a grid's longest side.
    #[arg(long, default_value_t = u32::MAX)]
    pub cells: u32,
    /// Leave out the times of the processor.
    #[arg(long)]
    pub card_only: bool,
}

/// Steps of every method but one, as in the paper's table 1.
const ITERATIONS: u32 = 32;

/// Steps of projected gradient descent, which is nearer after these than Frank-Wolfe after 32 (docs/methods.md).
const GRADIENT_ITERATIONS: u32 = 8;

/// Evaluations of the second search of each element, as of `auto`.
const EVALUATIONS: u32 = 256;

/// Forms of a query. The last certifies what Frank-Wolfe does not settle.
const FORMS: [(Stages, Unsettled); 5] = [
    (Stages::Separate, Unsettled::Keep),
    (Stages::Fused, Unsettled::Keep),
    (Stages::Lean, Unsettled::Keep),
    (Stages::LeanSeparate, Unsettled::Keep),
    (Stages::Separate, Unsettled::Certify { evaluations: EVALUATIONS }),
];

const METHODS: [(&str, Method); 5] = [
    ("points", Method::PointSampling),
    ("FW", Method::FrankWolfe),
    ("PGD", Method::ProjectedGradient),
    ("GS", Method::GoldenSection),
    ("Newton", Method::Newton),
];

/// Compares and measures all scenes, and prints a table. Fails if one contact differs. With `export` writes files in place of that.
pub fn measure(options: &GpuOptions) -> Result<()> {
    let scenes = read_scenes(&options.scene)?;
    let wanted = |file: &&SceneFile| options.only.is_empty() || options.only.contains(&file.scene.name);
    if let Some(folder) = &options.export {
        for file in scenes.iter().filter(wanted) {
            let name = &file.scene.name;
            let is_written = export::write(&folder.join(name), file, options.cells).with_context(|| name.clone())?;
            println!("{name}: {}", if is_written { "written" } else { "skipped, has no grid of a mesh" });
        }
        return Ok(());
    }
    let gpu = Gpu::new(options.kernels.as_deref().context("needs KERNELS")?)?;
    println!("{}", gpu.name()?);
    let head = vec![
        "scene",
        "elements",
        "method",
        "stages",
        "contacts",
        "equal",
        "kernels µs",
        "launched µs",
        "graph µs",
        "paper µs",
        "CPU 1 thread µs",
        "CPU all µs",
    ];
    let mut table = Table { head, rows: vec![] };
    for file in scenes.iter().filter(wanted) {
        let scene = Scene::new(file, options.cells)?;
        let field = GpuField::new(&gpu, &scene.field).with_context(|| scene.name.clone())?;
        for (label, method) in METHODS {
            if let Some(elements) = scene.elements(method) {
                let paper = scene.paper(method).map_or("-".to_owned(), |time| format!("{time:.0}"));
                let [expected, lean] = [false, true].map(|is_lean| scene.on_processor(elements, method, is_lean));
                let processor = [1, 0].map(|threads| match options.card_only {
                    true => Ok("-".to_owned()),
                    false => scene.processor_time(elements, method, threads),
                });
                let [one, all] = [&processor[0], &processor[1]].map(|time| time.as_deref().unwrap_or("failed"));
                let is_gradient = method == Method::ProjectedGradient;
                let iterations = if is_gradient { GRADIENT_ITERATIONS } else { ITERATIONS };
                let margin = scene.margin;
                for (stages, unsettled) in FORMS {
                    if !options.form.is_empty() && !options.form.contains(&name_of(stages, unsettled)) {
                        continue;
                    }
                    let query =
                        QueryOptions { method, margin, iterations, stages, unsettled, ..QueryOptions::default() };
                    let twice;
                    let expected = match (unsettled, elements) {
                        (Unsettled::Keep, _) if matches!(stages, Stages::Lean | Stages::LeanSeparate) => &lean,
                        (Unsettled::Keep, _) => &expected,
                        (_, Elements::Faces(faces)) if method == Method::FrankWolfe => {
                            twice = scene.search_twice(faces);
                            &twice
                        }
                        (_, Elements::Edges(edges)) if method == Method::FrankWolfe => {
                            twice = scene.search_twice(edges);
                            &twice
                        }
                        _ => continue,
                    };
                    let Some(mut row) = on_card(&gpu, &field, &scene, elements, &query, expected, options)? else {
                        continue;
                    };
                    row.splice(
                        0..0,
                        [scene.name.clone(), count(elements, scene.points.len()).to_string(), label.to_owned()],
                    );
                    row.extend([paper.clone(), one.to_owned(), all.to_owned()]);
                    eprintln!("{}", row.join(" | "));
                    table.rows.push(row);
                }
            }
        }
    }
    println!("{}", table.markdown());
    let different = table.rows.iter().filter(|row| row[5] != "all").count();
    ensure!(different == 0, "{different} queries have other contacts than the CPU");
    Ok(())
}

/// The cells of a table from "stages" to "graph"; `None` if there is no such kernel.
fn on_card(
    gpu: &Gpu,
    field: &GpuField,
    scene: &Scene,
    elements: Elements,
    query: &QueryOptions,
    expected: &[Contact<f32>],
    options: &GpuOptions,
) -> Result<Option<Vec<String>>> {
    let mesh = GpuMesh::new(gpu, &scene.points, elements)?;
    let mut on_card = match GpuQuery::new(gpu, field, mesh, query) {
        Err(GpuError::Unsupported(_)) => return Ok(None),
        query => query?,
    };
    let found = on_card.contacts()?.contacts;
    let differs = |(a, b): &(&Contact<f32>, &Contact<f32>)| bits(a) != bits(b);
    let pairs = found.iter().zip(expected);
    let equal = match pairs.clone().find(differs) {
        None if found.len() == expected.len() => "all".to_owned(),
        first => {
            eprintln!("{}: the first that differs: {first:#?}", scene.name);
            format!("{} of {}", pairs.filter(|pair| !differs(pair)).count(), expected.len())
        }
    };
    let times = on_card.time(options.repetitions)?;
    let text = |times: &Vec<f32>| format!("{:.1}", median(times.iter().map(|time| f64::from(*time)).collect()));
    let kernels: Vec<_> = times.kernels.iter().map(text).collect();
    let stages = name_of(query.stages, query.unsettled);
    let [launched, graph] = [text(&times.launched), text(&times.graph)];
    Ok(Some(vec![stages, found.len().to_string(), equal, kernels.join(" + "), launched, graph]))
}

/// Name of a form in the table.
fn name_of(stages: Stages, unsettled: Unsettled) -> String {
    match unsettled {
        Unsettled::Certify { .. } => "certified".to_owned(),
        _ => format!("{stages:?}").to_lowercase(),
    }
}

struct Scene {
    name: String,
    field: AnyField,
    mesh: Mesh,
    /// The mesh's points as the card has them.
    points: Vec<[f32; 3]>,
    margin: f32,
    paper: Option<PaperTimes>,
}

impl Scene {
    fn new(file: &SceneFile, cells: u32) -> Result<Self> {
        let mesh = file.mesh()?;
        let points: Vec<_> = mesh.points.iter().map(|point| point.map(|x| x as f32)).collect();
        let scene = &file.scene;
        Ok(Self {
            name: scene.name.clone(),
            field: file.field(cells)?,
            points,
            mesh,
            margin: scene.margin as f32,
            paper: scene.paper,
        })
    }

    /// The elements that a method searches; `None` if it does not know their kind.
    fn elements(&self, method: Method) -> Option<Elements<'_>> {
        match (method, self.mesh.triangles.is_empty()) {
            (Method::PointSampling, _) => Some(Elements::Vertices),
            (Method::GoldenSection, false) | (Method::Newton, true) => None,
            (_, true) => Some(Elements::Edges(&self.mesh.segments)),
            (_, false) => Some(Elements::Faces(&self.mesh.triangles)),
        }
    }

    /// Microseconds of the paper's table 1.
    fn paper(&self, method: Method) -> Option<f64> {
        let paper = self.paper?;
        match method {
            Method::PointSampling => Some(paper.simple),
            Method::FrankWolfe => Some(paper.frank_wolfe),
            Method::ProjectedGradient => Some(paper.projected_gradient),
            Method::GoldenSection => paper.golden_section,
            Method::Newton | Method::Certified => None,
        }
    }

    /// The contacts by `contact::<f32, …>`, or by `lean_contact` with plain normals.
    fn on_processor(&self, elements: Elements, method: Method, is_lean: bool) -> Vec<Contact<f32>> {
        let gradient = ProjectedGradient { iterations: GRADIENT_ITERATIONS, ..ProjectedGradient::default() };
        let (fw, golden) = (FrankWolfe::default(), GoldenSection::default());
        match (elements, method) {
            (Elements::Vertices, _) => {
                let vertices: Vec<_> = (0..self.points.len() as u32).map(|vertex| [vertex]).collect();
                self.search(&vertices, &PointSampling { samples: ITERATIONS, corners: false }, is_lean)
            }
            (Elements::Edges(edges), Method::GoldenSection) => self.search(edges, &golden, is_lean),
            (Elements::Edges(edges), Method::ProjectedGradient) => self.search(edges, &gradient, is_lean),
            (Elements::Edges(edges), _) => self.search(edges, &fw, is_lean),
            (Elements::Faces(faces), Method::ProjectedGradient) => self.search(faces, &gradient, is_lean),
            (Elements::Faces(faces), Method::Newton) => self.search(faces, &Newton::default(), is_lean),
            (Elements::Faces(faces), _) => self.search(faces, &fw, is_lean),
            (Elements::LentFaces(_), _) => unreachable!("the scenes lend nothing"),
        }
    }

    fn search<M: Minimizer<N> + Sync, const N: usize>(
        &self,
        elements: &[[u32; N]],
        method: &M,
        is_lean: bool,
    ) -> Vec<Contact<f32>> {
        self.search_each(elements, |element| {
            let outcome = match is_lean {
                true => lean_contact(&PlainNormals(&self.field), method, self.margin, element),
                false => contact(&self.field, method, self.margin, element),
            };
            if let Outcome::Contact(contact) = outcome { Some(contact) } else { None }
        })
    }

    /// The contacts by Frank-Wolfe where that settles an element, else by the certified search.
    fn search_twice<const N: usize>(&self, elements: &[[u32; N]]) -> Vec<Contact<f32>> {
        let (field, margin) = (&self.field, self.margin);
        let certified = Certified { evaluations: EVALUATIONS, ..Certified::default() };
        self.search_each(elements, |element| {
            let lower_bound = cull(field, margin, element).ok()?;
            let first = FrankWolfe::default().minimize_below(field, &element.simplex, margin);
            let is_settled = first.converged && first.sample.value <= margin;
            let last = if is_settled { first } else { certified.minimize_below(field, &element.simplex, margin) };
            if last.sample.value <= margin { contact_at(field, element, &last, lower_bound) } else { None }
        })
    }

    fn search_each<const N: usize>(
        &self,
        elements: &[[u32; N]],
        search: impl Fn(&Element<f32, N>) -> Option<Contact<f32>> + Sync,
    ) -> Vec<Contact<f32>> {
        let found = elements.par_iter().zip(0_u32..elements.len() as u32).filter_map(|(vertices, id)| {
            let corners = vertices.map(|vertex| Vector3::from(self.points[vertex as usize]));
            search(&Element { id, vertices: *vertices, simplex: Simplex { corners } })
        });
        found.collect()
    }

    /// Time of the processor's search in f64, with so many threads; 0 stands for all.
    fn processor_time(&self, elements: Elements, method: Method, threads: usize) -> Result<String> {
        let method = match method {
            Method::FrankWolfe => sdf_field::Method::FrankWolfe,
            Method::ProjectedGradient => sdf_field::Method::ProjectedGradient,
            Method::Newton => sdf_field::Method::Newton,
            Method::GoldenSection => sdf_field::Method::GoldenSection,
            Method::PointSampling | Method::Certified => return Ok("-".to_owned()),
        };
        let field = Field::new(self.field.clone());
        let threads = if threads == 1 { Threads::ONE } else { Threads::ALL };
        let budget = (method == sdf_field::Method::ProjectedGradient).then_some(GRADIENT_ITERATIONS);
        let margin = f64::from(self.margin);
        let options = ContactOptions { method, margin, threads, budget, ..ContactOptions::default() };
        let run = || match elements {
            Elements::Edges(edges) => field.contacts_of_edges(&self.mesh.points, edges, &options),
            _ => field.contacts(MeshView { points: &self.mesh.points, faces: &self.mesh.triangles }, &options),
        };
        let mut times = vec![];
        for _ in 0..7 {
            let start = Instant::now();
            run()?;
            times.push(1e6 * start.elapsed().as_secs_f64());
        }
        Ok(format!("{:.0}", median(times)))
    }
}

fn count(elements: Elements, points: usize) -> usize {
    match elements {
        Elements::Vertices => points,
        Elements::Edges(edges) => edges.len(),
        Elements::Faces(faces) => faces.len(),
        Elements::LentFaces(faces) => faces.count(),
    }
}

/// Every number of a contact.
fn bits(contact: &Contact<f32>) -> Vec<u32> {
    let feature = match contact.feature {
        Feature::Vertex(vertex) => [0, vertex, 0],
        Feature::Edge([a, b]) => [1, a, b],
        Feature::Face(face) => [2, face, 0],
    };
    let mut bits = vec![contact.kind as u32, contact.element, contact.rank, contact.evaluations, contact.status as u32];
    bits.extend(contact.vertices.iter().chain(&feature));
    let vectors = [contact.point, contact.surface_point, contact.normal];
    let numbers =
        [contact.slope, contact.distance, contact.lower_bound, contact.error_bound, contact.shape_lower_bound];
    let all = contact.weights.iter().chain(vectors.iter().flatten()).chain(&numbers);
    bits.extend(all.map(|number| number.to_bits()));
    bits
}
