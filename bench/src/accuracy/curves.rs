//! Errors, cost and missed contacts of every method with every budget, on one set of problems.

use std::hint::black_box;

use cpu_time::ThreadTime;
use rayon::prelude::*;
use serde::Serialize;

use super::methods::{Budgeted, ElementMethod, Method, methods};
use super::problems::{MISS_DEPTH, Problem, ProblemSet};
use super::reference::Reference;
use crate::statistics::{Quantiles, median};

/// Results of all methods on one set of problems.
#[derive(Debug, Serialize)]
pub struct SetReport {
    pub set: &'static str,
    pub about: &'static str,
    pub elements: &'static str,
    pub problems: usize,
    /// Number of random elements drawn, rejected ones included.
    pub drawn: usize,
    pub reference: ReferenceQuality,
    pub curves: Vec<MethodCurve>,
}

/// Quality of the references of a set, in longest edges.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ReferenceQuality {
    /// Gap between value and lower bound.
    pub gap: Quantiles,
    /// Number of problems left out because their reference did not converge.
    pub not_converged: usize,
    /// Largest gap among them.
    pub largest_gap_left_out: f64,
    /// Smallest error of any method with any budget: negative by no more than rounding.
    #[serde(rename = "least_error")]
    pub min_error: f64,
}

/// One method with ascending budgets.
#[derive(Debug, Serialize)]
pub struct MethodCurve {
    pub method: &'static str,
    /// Index in the list of all methods.
    #[serde(skip)]
    pub index: usize,
    /// Unit of a budget.
    pub unit: &'static str,
    #[serde(rename = "usual")]
    pub usual_budgets: &'static [u32],
    pub points: Vec<CurvePoint>,
}

/// One method with one budget.
#[derive(Debug, Serialize)]
pub struct CurvePoint {
    pub budget: u32,
    /// (value found − lower bound of the reference) / longest edge.
    pub errors: Quantiles,
    /// Mean number of evaluations of the field per element.
    pub evaluations: f64,
    /// Fraction of elements whose value found exceeds the reference's by more than [`MISS_DEPTH`] edges.
    pub missed: f64,
    /// Processor time per element.
    pub nanoseconds: f64,
}

const BUDGETS: [u32; 18] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 512, 1024];

/// Largest budget of a method, as a multiple of its largest usual budget.
const MAX_USUAL_BUDGETS: u32 = 8;

impl Method {
    fn budgets(&self) -> impl Iterator<Item = u32> {
        let usual = self.usual_budgets.iter().copied().max().unwrap_or(1);
        BUDGETS.into_iter().filter(move |budget| *budget <= usual.saturating_mul(MAX_USUAL_BUDGETS))
    }
}

/// A method with one budget.
struct Case<'a, const N: usize> {
    method: &'a Budgeted<N>,
    budget: u32,
}

/// Computes errors on all threads of the pool, then takes each time `rounds` times on one. Problems whose reference did not
/// converge are left out and counted.
pub fn measure<const N: usize>(mut set: ProblemSet<N>, references: &[Reference], rounds: u32) -> SetReport
where
    Method: ElementMethod<N>,
{
    let (quality, references) = keep_converged(&mut set, references);
    let methods = methods();
    let mut min_error = f64::INFINITY;
    let mut curves = vec![];
    let mut cases = vec![];
    for (index, method) in methods.iter().enumerate() {
        let Some(budgeted) = method.budgeted() else { continue };
        let points: Vec<CurvePoint> = method
            .budgets()
            .map(|budget| {
                cases.push(Case { method: budgeted, budget });
                let (point, min) = measure_errors(&set, &references, &Case { method: budgeted, budget });
                min_error = min_error.min(min);
                point
            })
            .collect();
        let &Method { name, unit, usual_budgets, .. } = method;
        curves.push(MethodCurve { method: name, index, unit, usual_budgets, points });
    }
    let points = curves.iter_mut().flat_map(|curve| &mut curve.points);
    points.zip(times(&set, &cases, rounds)).for_each(|(point, time)| point.nanoseconds = time);
    SetReport {
        set: set.name,
        about: set.about,
        elements: Method::ELEMENTS,
        problems: set.problems.len(),
        drawn: set.drawn,
        reference: ReferenceQuality { min_error, ..quality },
        curves,
    }
}

/// Removes the problems whose reference did not converge. Returns the references of the others.
fn keep_converged<const N: usize>(
    set: &mut ProblemSet<N>,
    references: &[Reference],
) -> (ReferenceQuality, Vec<Reference>) {
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
    let gap = Quantiles::new(gaps);
    (ReferenceQuality { gap, not_converged, largest_gap_left_out, min_error: f64::NAN }, kept)
}

/// A point without its time, and the smallest of its errors.
fn measure_errors<const N: usize>(set: &ProblemSet<N>, references: &[Reference], case: &Case<N>) -> (CurvePoint, f64) {
    let answer = |(problem, reference): (&Problem<N>, &Reference)| {
        let minimum = (case.method.minimize)(case.budget, &set.fields[problem.field], &problem.simplex);
        let found = minimum.sample.value;
        let error = (found - reference.lower_bound) / problem.longest_edge;
        (error, minimum.evaluations, found - reference.value > MISS_DEPTH * problem.longest_edge)
    };
    let answers: Vec<(f64, f64, bool)> = set.problems.par_iter().zip(references).map(answer).collect();
    let count = answers.len() as f64;
    let errors: Vec<f64> = answers.iter().map(|(error, ..)| *error).collect();
    let min = errors.iter().copied().fold(f64::INFINITY, f64::min);
    let point = CurvePoint {
        budget: case.budget,
        errors: Quantiles::new(errors),
        evaluations: answers.iter().map(|(_, evaluations, _)| evaluations).sum::<f64>() / count,
        missed: answers.iter().filter(|(.., missed)| *missed).count() as f64 / count,
        nanoseconds: 0.0,
    };
    (point, min)
}

/// Nanoseconds per element for each case. The cases take turns, so that a slow phase of the machine affects all of them.
fn times<const N: usize>(set: &ProblemSet<N>, cases: &[Case<N>], rounds: u32) -> Vec<f64> {
    let mut times = vec![vec![]; cases.len()];
    for _ in 0..rounds {
        for (case, times) in cases.iter().zip(&mut times) {
            let started = ThreadTime::now();
            for problem in &set.problems {
                black_box((case.method.minimize)(case.budget, &set.fields[problem.field], &problem.simplex));
            }
            times.push(started.elapsed().as_nanos() as f64 / set.problems.len() as f64);
        }
    }
    times.into_iter().map(median).collect()
}
