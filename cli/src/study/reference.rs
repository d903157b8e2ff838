use rayon::prelude::*;
use sdf_core::Simplex;
use sdf_core::minimize::{Certified, Minimizer};
use sdf_formats::field_file::Node;
use serde::Serialize;

use super::problems::{Problem, ProblemSet};
use super::statistics::Spread;

/// What is proven of the least value on an element, in the field's own unit.
#[derive(Clone, Copy, Debug)]
pub struct Reference {
    /// No point of the element is below.
    pub lower_bound: f64,
    /// The field's value at a point of the element.
    pub value: f64,
    pub converged: bool,
}

/// How near a reference is to come to the least value of an edge, as a share of its length · slope bound.
const TOLERANCE_ON_EDGES: f64 = 1e-7;

/// Of a face. Ten times nearer takes up to ten times as long: around a minimum a field is flat in two directions.
const TOLERANCE_ON_FACES: f64 = 1e-5;

/// At most, for an element or a part of one.
const EVALUATIONS: u32 = 100_000;

/// An element whose search runs out of evaluations is cut in parts that are searched one by one, so often, ...
const MAX_CUTS: u32 = 4;

/// ... and that only this many times less near.
const LESS_NEAR: f64 = 10.0;

/// By branch and bound, as far as it goes.
pub fn references<const N: usize>(set: &ProblemSet<N>) -> Vec<Reference> {
    let tolerance = if N == 2 { TOLERANCE_ON_EDGES } else { TOLERANCE_ON_FACES };
    let of_problem = |problem: &Problem<N>| {
        let (field, gap) = (&set.fields[problem.field], tolerance * problem.longest_edge);
        let near = certify(field, &problem.simplex, gap);
        if near.converged { near } else { certify_parts(field, &problem.simplex, LESS_NEAR * gap, MAX_CUTS) }
    };
    set.problems.par_iter().map(of_problem).collect()
}

/// `gap` is how near to come, as a length.
fn certify<const N: usize>(field: &Node, simplex: &Simplex<f64, N>, gap: f64) -> Reference
where
    Certified: Minimizer<N>,
{
    let tolerance = gap / simplex.longest_edge();
    let search = Certified { evaluations: EVALUATIONS, tolerance, ..Certified::default() };
    let minimum = search.minimize(field, simplex);
    Reference { lower_bound: minimum.lower_bound, value: minimum.sample.value, converged: minimum.converged }
}

fn certify_parts<const N: usize>(field: &Node, simplex: &Simplex<f64, N>, gap: f64, cuts: u32) -> Reference {
    let whole = certify(field, simplex, gap);
    if whole.converged || cuts == 0 {
        return whole;
    }
    let [a, b] = halves(simplex).map(|half| certify_parts(field, &half, gap, cuts - 1));
    Reference {
        lower_bound: a.lower_bound.min(b.lower_bound).max(whole.lower_bound),
        value: a.value.min(b.value).min(whole.value),
        converged: a.converged && b.converged,
    }
}

/// Cut at the middle of the longest edge.
fn halves<const N: usize>(simplex: &Simplex<f64, N>) -> [Simplex<f64, N>; 2] {
    let corners = &simplex.corners;
    let pairs = (0..N).flat_map(|a| (0..a).map(move |b| [a, b]));
    let length = |[a, b]: [usize; 2]| (corners[a] - corners[b]).norm_squared();
    let ends = pairs.max_by(|one, other| length(*one).total_cmp(&length(*other))).unwrap_or([0; 2]);
    let middle = (corners[ends[0]] + corners[ends[1]]) * 0.5;
    ends.map(|end| {
        let mut half = *simplex;
        half.corners[end] = middle;
        half
    })
}

/// How far the references of a set can be trusted.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Trust {
    /// Of value and lower bound, in edges.
    pub gap: Spread,
    /// Problems left out, for their reference did not converge.
    pub not_converged: usize,
    /// Of those left out, in edges.
    pub largest_gap_left_out: f64,
    /// The least error that any method was found to have with any budget, in edges: below zero by no more than rounding.
    pub least_error: f64,
}
