//! Errors of every minimizer against steps, evaluations and time, and what they make of whole scenes: Fig. 12, Fig. 13,
//! table 1 and §8.3 of the paper, with a reference that is proven.

mod advice;
mod contacts;
mod csv;
mod curves;
mod fields;
mod methods;
mod pages;
pub mod plots;
mod problems;
mod random;
mod reference;
mod scene;
pub mod statistics;
pub mod table;
mod tables;

use std::time::Instant;

use anyhow::Result;
use sdf_formats::field_file::Node;
use sdf_procedural::SpikedBall;
use serde::Serialize;

pub use pages::{Page, docs, folder};
pub use scene::{Place, all as read_scenes};

use advice::{Advice, Cost, advise};
use contacts::{Limits, SceneReport};
use curves::{SetReport, measure};
use fields::Layout;
use methods::{Method, Searches};
use problems::{ProblemSet, Where};
use reference::references;

/// All that was measured.
#[derive(Debug, Serialize)]
pub struct Study {
    pub schema: &'static str,
    pub short: bool,
    pub sets: Vec<SetReport>,
    /// Like a set, with the apex's known depth as reference.
    pub apexes: SetReport,
    pub scenes: Vec<SceneReport>,
    pub advice: Vec<Advice>,
    pub parts: Vec<Part>,
    pub seconds: f64,
}

/// What a part of the study took.
#[derive(Debug, Serialize)]
pub struct Part {
    pub part: String,
    pub seconds: f64,
}

/// Notes when each part is done.
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

/// Problems in a set, as in the paper.
const PROBLEMS: usize = 1000;
const PROBLEMS_SHORT: usize = 24;

/// Every time is the median of so many.
const ROUNDS: u32 = 3;

/// Along the longest side of the body that random problems are posed on.
const CELLS: u32 = 128;
const CELLS_SHORT: u32 = 24;

const SCENES: Limits = Limits { cells: u32::MAX, elements: usize::MAX, rounds: 3 };
const SCENES_SHORT: Limits = Limits { cells: 48, elements: 400, rounds: 1 };

/// Runs on the threads of the current pool; times are taken on one of them while the others rest. `on_part_done` is called
/// after each part.
pub fn run(places: &[Place], short: bool, on_part_done: &(dyn Fn() + Sync)) -> Result<Study> {
    let mut progress = Progress { started: Instant::now(), parts: vec![], on_part_done };
    let sets = sets(short, &mut progress)?;
    let (cones, depths) = problems::apexes(problems_in_a_set(short));
    let apexes = measure(cones, &depths, rounds(short));
    progress.done(apexes.set);
    let scenes = measured_scenes(places, if short { SCENES_SHORT } else { SCENES }, &mut progress)?;
    let advice = [Cost::Evaluations, Cost::Nanoseconds]
        .into_iter()
        .flat_map(|cost| sets.iter().chain([&apexes]).flat_map(move |set| advise(set, cost)))
        .collect();
    let Progress { started, parts, .. } = progress;
    let seconds = started.elapsed().as_secs_f64();
    Ok(Study { schema: "sdftool.study/1", short, sets, apexes, scenes, advice, parts, seconds })
}

fn problems_in_a_set(short: bool) -> usize {
    if short { PROBLEMS_SHORT } else { PROBLEMS }
}

fn rounds(short: bool) -> u32 {
    if short { 1 } else { ROUNDS }
}

fn sets(short: bool, progress: &mut Progress) -> Result<Vec<SetReport>> {
    let body = SpikedBall { levels: 2, radius: 0.6 }.mesh();
    let cells = if short { CELLS_SHORT } else { CELLS };
    let bake = |layout| fields::bake(&body, cells, layout);
    let (dense, sparse) = (bake(Layout::Dense)?, bake(Layout::Sparse)?);
    let horseshoe = Posed { name: "horseshoe", about: "a horseshoe in its plane", place: Where::Plane };
    let shapes = Posed { name: "shapes", about: "six shapes in closed form", place: Where::Space };
    let on_dense = Posed { name: "dense", about: "a ball with spikes, dense grid", place: Where::Space };
    let on_sparse = Posed { name: "sparse", about: "a ball with spikes, sparse grid of u16", place: Where::Space };
    let mut sets = vec![];
    let mut done = |set: SetReport| {
        progress.done(format!("{}, {}", set.set, set.elements));
        sets.push(set);
    };
    done(horseshoe.report::<2>(vec![fields::horseshoe()?], short));
    done(shapes.report::<3>(fields::shapes()?, short));
    done(shapes.report::<2>(fields::shapes()?, short));
    done(on_dense.report::<3>(vec![dense.clone()], short));
    done(on_dense.report::<2>(vec![dense], short));
    done(on_sparse.report::<3>(vec![sparse.clone()], short));
    done(on_sparse.report::<2>(vec![sparse], short));
    Ok(sets)
}

/// A set of random problems before its field is named.
struct Posed {
    name: &'static str,
    about: &'static str,
    place: Where,
}

impl Posed {
    fn report<const N: usize>(&self, fields: Vec<Node>, short: bool) -> SetReport
    where
        Method: Searches<N>,
    {
        let set = ProblemSet::<N>::random(self.name, self.about, fields, problems_in_a_set(short), self.place);
        let references = references(&set);
        measure(set, &references, rounds(short))
    }
}

fn measured_scenes(places: &[Place], limits: Limits, progress: &mut Progress) -> Result<Vec<SceneReport>> {
    let mut reports: Vec<Option<SceneReport>> = places.iter().map(|_| None).collect();
    for (number, place) in places.iter().enumerate() {
        if reports[number].is_some() {
            continue;
        }
        let field = place.field(limits.cells)?;
        progress.done(format!("{}, its field", place.scene.name));
        for (same, report) in
            places.iter().zip(&mut reports).skip(number).filter(|(same, _)| same.shares_field_with(place))
        {
            *report = Some(contacts::measure(same, &field, limits)?);
            progress.done(&same.scene.name);
        }
    }
    Ok(reports.into_iter().flatten().collect())
}
