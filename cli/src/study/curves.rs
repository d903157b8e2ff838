use std::hint::black_box;

use cpu_time::ThreadTime;
use rayon::prelude::*;
use serde::Serialize;

use super::methods::{Method, Search, Searches, methods};
use super::problems::{Problem, ProblemSet};
use super::reference::{Reference, Trust};
use super::statistics::{Spread, median};

/// What all methods make of one set of problems.
#[derive(Debug, Serialize)]
pub struct SetReport {
    pub set: &'static str,
    pub about: &'static str,
    pub elements: &'static str,
    pub problems: usize,
    /// So many random elements were drawn to have the problems, left out ones too: the least value of the others is at a corner.
    pub drawn: usize,
    pub reference: Trust,
    pub curves: Vec<Curve>,
}

/// One method with one budget after another.
#[derive(Debug, Serialize)]
pub struct Curve {
    pub method: &'static str,
    /// Of the method in the list of all.
    #[serde(skip)]
    pub number: usize,
    /// What a budget counts.
    pub unit: &'static str,
    pub usual: &'static [u32],
    pub points: Vec<Point>,
}

#[derive(Debug, Serialize)]
pub struct Point {
    pub budget: u32,
    /// Value found less the lower bound of the reference, in longest edges.
    pub errors: Spread,
    /// How many times the field was asked for one element, on average.
    pub evaluations: f64,
    /// The share of elements whose found value is more than [`SHALLOW`] edges above that of the reference.
    pub missed: f64,
    /// For one element: the time that one thread has run.
    pub nanoseconds: f64,
}

/// How deep below the margin an element reaches, in longest edges, of which it is asked whether a method sees it at all. Each
/// element has a margin of its own, so far above its least value, for at one margin for all nearly every touching element is
/// deep, and none is missed.
pub const SHALLOW: f64 = 1e-3;

const BUDGETS: [u32; 18] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 512, 1024];

/// No method is given more than this many times its usual budget.
const MAX_USUAL_BUDGETS: u32 = 8;

impl Method {
    fn budgets(&self) -> impl Iterator<Item = u32> {
        let usual = self.usual.iter().copied().max().unwrap_or(1);
        BUDGETS.into_iter().filter(move |budget| *budget <= usual.saturating_mul(MAX_USUAL_BUDGETS))
    }
}

/// One search with one budget.
struct Case<'a, const N: usize> {
    search: &'a Search<N>,
    budget: u32,
}

/// Errors on as many threads as there are, then times on one. `rounds` is how often each is timed. Problems without a
/// reference that converged are left out, and counted.
pub fn measure<const N: usize>(mut set: ProblemSet<N>, references: &[Reference], rounds: u32) -> SetReport
where
    Method: Searches<N>,
{
    let (trust, references) = keep_converged(&mut set, references);
    let methods = methods();
    let mut least_error = f64::INFINITY;
    let mut curves = vec![];
    let mut cases = vec![];
    for (number, method) in methods.iter().enumerate() {
        let Some(search) = method.search() else { continue };
        let points: Vec<Point> = method
            .budgets()
            .map(|budget| {
                cases.push(Case { search, budget });
                let (point, least) = point(&set, &references, &Case { search, budget });
                least_error = least_error.min(least);
                point
            })
            .collect();
        curves.push(Curve { method: method.name, number, unit: method.unit, usual: method.usual, points });
    }
    let points = curves.iter_mut().flat_map(|curve| &mut curve.points);
    points.zip(times(&set, &cases, rounds)).for_each(|(point, time)| point.nanoseconds = time);
    SetReport {
        set: set.name,
        about: set.about,
        elements: Method::ELEMENTS,
        problems: set.problems.len(),
        drawn: set.drawn,
        reference: Trust { least_error, ..trust },
        curves,
    }
}

/// The references of the problems that are kept.
fn keep_converged<const N: usize>(set: &mut ProblemSet<N>, references: &[Reference]) -> (Trust, Vec<Reference>) {
    let gap =
        |reference: &Reference, problem: &Problem<N>| (reference.value - reference.lower_bound) / problem.longest_edge;
    let all = set.problems.len();
    let (mut gaps, mut kept, mut largest_gap_left_out) = (vec![], vec![], 0.0_f64);
    let mut references = references.iter();
    set.problems.retain(|problem| {
        let Some(reference) = references.next() else { return false };
        if reference.converged {
            gaps.push(gap(reference, problem));
            kept.push(*reference);
        } else {
            largest_gap_left_out = largest_gap_left_out.max(gap(reference, problem));
        }
        reference.converged
    });
    let not_converged = all - kept.len();
    let trust = Trust { gap: Spread::of(gaps), not_converged, largest_gap_left_out, least_error: f64::NAN };
    (trust, kept)
}

/// Not yet timed; also the least error of all.
fn point<const N: usize>(set: &ProblemSet<N>, references: &[Reference], case: &Case<N>) -> (Point, f64) {
    let answer = |(problem, reference): (&Problem<N>, &Reference)| {
        let minimum = (case.search.minimize)(case.budget, &set.fields[problem.field], &problem.simplex);
        let found = minimum.sample.value;
        let error = (found - reference.lower_bound) / problem.longest_edge;
        (error, minimum.evaluations, found - reference.value > SHALLOW * problem.longest_edge)
    };
    let answers: Vec<(f64, f64, bool)> = set.problems.par_iter().zip(references).map(answer).collect();
    let count = answers.len() as f64;
    let errors: Vec<f64> = answers.iter().map(|(error, ..)| *error).collect();
    let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
    let point = Point {
        budget: case.budget,
        errors: Spread::of(errors),
        evaluations: answers.iter().map(|(_, evaluations, _)| evaluations).sum::<f64>() / count,
        missed: answers.iter().filter(|(.., missed)| *missed).count() as f64 / count,
        nanoseconds: 0.0,
    };
    (point, least)
}

/// Nanoseconds an element. All cases take turns, so that what slows the machine for a while slows all of them.
fn times<const N: usize>(set: &ProblemSet<N>, cases: &[Case<N>], rounds: u32) -> Vec<f64> {
    let mut times = vec![vec![]; cases.len()];
    for _ in 0..rounds {
        for (case, times) in cases.iter().zip(&mut times) {
            let started = ThreadTime::now();
            for problem in &set.problems {
                black_box((case.search.minimize)(case.budget, &set.fields[problem.field], &problem.simplex));
            }
            times.push(started.elapsed().as_nanos() as f64 / set.problems.len() as f64);
        }
    }
    times.into_iter().map(median).collect()
}
