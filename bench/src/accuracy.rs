//! Error of every minimizer against steps, evaluations and time, and the contacts that it misses in whole scenes: Fig. 12,
//! Fig. 13, table 1 and §8.3 of the paper, measured against proven minima.
//!
//! | step | file |
//! |---|---|
//! | 1. fields, and random elements posed on them | `fields`, `problems`, `random` |
//! | 2. proven minimum of each problem, by branch and bound | `reference` |
//! | 3. every method with every budget on every problem | `methods`, `curves` |
//! | 4. best method within a budget | `advice` |
//! | 5. scenes as large as the paper's: contacts found and missed | `scene_file`, `scene_report` |
//! | 6. report, tables, pictures | `pages`, `tables`, `csv`, `plots` |

mod advice;
mod csv;
mod curves;
mod fields;
mod methods;
mod pages;
mod plots;
mod problems;
mod random;
mod reference;
mod scene_file;
mod scene_report;
mod tables;

use std::time::Instant;

use anyhow::Result;
use rayon::prelude::*;
use sdf_core::AnyField;
use sdf_core::grid::owned::Layout;
use sdf_procedural::SpikedBall;
use serde::Serialize;

pub use pages::{Page, docs, folder};
pub use scene_file::{PaperTimes, SceneFile, read_scenes};

use advice::{Advice, Cost, advise};
use curves::{SetReport, measure};
use methods::{ElementMethod, Method};
use problems::{Domain, ProblemSet};
use reference::reference;
use scene_report::{SceneLimits, SceneReport};

/// Everything that was measured.
#[derive(Debug, Serialize)]
pub struct Study {
    pub schema: &'static str,
    pub short: bool,
    /// How often each time was taken.
    #[serde(skip)]
    pub rounds: u32,
    pub sets: Vec<SetReport>,
    /// A set whose references are known without a search: depths of cone apexes.
    pub apexes: SetReport,
    pub scenes: Vec<SceneReport>,
    pub advice: Vec<Advice>,
    pub parts: Vec<Part>,
    pub seconds: f64,
}

/// Duration of a part of the study.
#[derive(Debug, Serialize)]
pub struct Part {
    pub part: String,
    pub seconds: f64,
}

/// Number of parts of a study, for its progress bar: the sets of problems, and two for each scene.
pub fn part_count(scenes: &[SceneFile]) -> usize {
    8 + 2 * scenes.len()
}

/// Records when each part is done.
struct Progress<'a> {
    started: Instant,
    parts: Vec<Part>,
    on_part_done: &'a (dyn Fn() + Sync),
}

impl Progress<'_> {
    fn done(&mut self, part: impl Into<String>) {
        let before: f64 = self.parts.iter().map(|part| part.seconds).sum();
        self.parts.push(Part { part: part.into(), seconds: self.started.elapsed().as_secs_f64() - before });
        (self.on_part_done)();
    }
}

/// Extent of a study.
#[derive(Clone, Copy)]
struct Extent {
    problems: usize,
    /// How often each time is taken; the median counts.
    rounds: u32,
    /// Cells along the longest side of the body that random problems are posed on.
    cells: u32,
    scenes: SceneLimits,
}

/// As many problems as in the paper.
const FULL: Extent = Extent {
    problems: 1000,
    rounds: 3,
    cells: 128,
    scenes: SceneLimits { cells: u32::MAX, elements: usize::MAX, rounds: 3 },
};

const SHORT: Extent =
    Extent { problems: 24, rounds: 1, cells: 24, scenes: SceneLimits { cells: 48, elements: 400, rounds: 1 } };

/// Runs on the threads of the current pool. Times are taken on one of them while the others rest. Calls `on_part_done`
/// after each part.
pub fn run(scenes: &[SceneFile], short: bool, on_part_done: &(dyn Fn() + Sync)) -> Result<Study> {
    let extent = if short { SHORT } else { FULL };
    let mut progress = Progress { started: Instant::now(), parts: vec![], on_part_done };
    let sets = measure_sets(extent, &mut progress)?;
    let (cones, depths) = problems::apexes(extent.problems);
    let apexes = measure(cones, &depths, extent.rounds);
    progress.done(apexes.set);
    let scenes = measure_scenes(scenes, extent.scenes, &mut progress)?;
    let advice = [Cost::Evaluations, Cost::Nanoseconds]
        .into_iter()
        .flat_map(|cost| sets.iter().chain([&apexes]).flat_map(move |set| advise(set, cost)))
        .collect();
    let Progress { started, parts, .. } = progress;
    let seconds = started.elapsed().as_secs_f64();
    let rounds = extent.rounds;
    Ok(Study { schema: "sdftool.study/1", short, rounds, sets, apexes, scenes, advice, parts, seconds })
}

fn measure_sets(extent: Extent, progress: &mut Progress) -> Result<Vec<SetReport>> {
    let body = SpikedBall { levels: 2, radius: 0.6 }.mesh();
    let bake = |layout| fields::bake(&body, extent.cells, layout);
    let (dense, sparse) = (bake(Layout::Dense)?, bake(Layout::Sparse)?);
    let horseshoe = SetOutline { name: "horseshoe", about: "a horseshoe in its plane", domain: Domain::Plane };
    let shapes = SetOutline { name: "shapes", about: "six shapes in closed form", domain: Domain::Space };
    let on_dense = SetOutline { name: "dense", about: "a ball with spikes, dense grid", domain: Domain::Space };
    let on_sparse =
        SetOutline { name: "sparse", about: "a ball with spikes, sparse grid of u16", domain: Domain::Space };
    let mut sets = vec![];
    let mut done = |set: SetReport| {
        progress.done(format!("{}, {}", set.set, set.elements));
        sets.push(set);
    };
    done(horseshoe.measure::<2>(vec![fields::horseshoe()?], extent));
    done(shapes.measure::<3>(fields::shapes()?, extent));
    done(shapes.measure::<2>(fields::shapes()?, extent));
    done(on_dense.measure::<3>(vec![dense.clone()], extent));
    done(on_dense.measure::<2>(vec![dense], extent));
    done(on_sparse.measure::<3>(vec![sparse.clone()], extent));
    done(on_sparse.measure::<2>(vec![sparse], extent));
    Ok(sets)
}

/// A set of random problems before its field and its elements are named.
struct SetOutline {
    name: &'static str,
    about: &'static str,
    domain: Domain,
}

impl SetOutline {
    fn measure<const N: usize>(&self, fields: Vec<AnyField>, extent: Extent) -> SetReport
    where
        Method: ElementMethod<N>,
    {
        let set = ProblemSet::<N>::random(self.name, self.about, fields, extent.problems, self.domain);
        let problems = set.problems.par_iter();
        let references: Vec<_> =
            problems.map(|problem| reference(&set.fields[problem.field], &problem.simplex)).collect();
        measure(set, &references, extent.rounds)
    }
}

/// Bakes each field once, even if several scenes share it.
fn measure_scenes(files: &[SceneFile], limits: SceneLimits, progress: &mut Progress) -> Result<Vec<SceneReport>> {
    let mut reports: Vec<Option<SceneReport>> = files.iter().map(|_| None).collect();
    for (index, file) in files.iter().enumerate() {
        if reports[index].is_some() {
            continue;
        }
        let field = file.field(limits.cells)?;
        progress.done(format!("{}, its field", file.scene.name));
        let sharing = files.iter().zip(&mut reports).skip(index).filter(|(other, _)| other.shares_field_with(file));
        for (other, report) in sharing {
            *report = Some(scene_report::measure(other, &field, limits)?);
            progress.done(&other.scene.name);
        }
    }
    Ok(reports.into_iter().flatten().collect())
}
