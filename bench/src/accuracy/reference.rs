//! Proven minimum of a field on an element, by branch and bound with many evaluations.

use sdf_core::AnyField;
use sdf_core::Simplex;
use sdf_core::minimize::{Certified, Minimizer};

/// Bounds of the minimum on an element, in the field's unit.
#[derive(Clone, Copy, Debug)]
pub struct Reference {
    /// Lower bound of the field on the whole element.
    pub lower_bound: f64,
    /// The field's value at a point of the element: an upper bound of the minimum.
    pub value: f64,
    pub converged: bool,
}

/// Largest gap between value and lower bound on an edge, in edge lengths times the slope bound.
const TOLERANCE_ON_EDGES: f64 = 1e-7;

/// Largest gap on a face. A tenth of it takes up to ten times as long: near a minimum a field is flat in two directions.
const TOLERANCE_ON_FACES: f64 = 1e-5;

/// Largest number of evaluations for an element or a part of one.
const EVALUATIONS: u32 = 100_000;

/// How often an element is bisected whose search has spent its evaluations.
const MAX_BISECTIONS: u32 = 4;

/// Factor of the tolerance for bisected elements.
const BISECTED_TOLERANCE: f64 = 10.0;

pub fn reference<const N: usize>(field: &AnyField, simplex: &Simplex<f64, N>) -> Reference {
    let tolerance = if N == 2 { TOLERANCE_ON_EDGES } else { TOLERANCE_ON_FACES };
    let gap = tolerance * simplex.longest_edge();
    let whole = certify(field, simplex, gap);
    if whole.converged { whole } else { certify_parts(field, simplex, BISECTED_TOLERANCE * gap, MAX_BISECTIONS) }
}

/// `gap` is the largest gap allowed, as a length.
fn certify<const N: usize>(field: &AnyField, simplex: &Simplex<f64, N>, gap: f64) -> Reference
where
    Certified: Minimizer<N>,
{
    let tolerance = gap / simplex.longest_edge();
    let search = Certified { evaluations: EVALUATIONS, tolerance, ..Certified::default() };
    let minimum = search.minimize(field, simplex);
    Reference { lower_bound: minimum.lower_bound, value: minimum.sample.value, converged: minimum.converged }
}

fn certify_parts<const N: usize>(field: &AnyField, simplex: &Simplex<f64, N>, gap: f64, bisections: u32) -> Reference {
    let whole = certify(field, simplex, gap);
    if whole.converged || bisections == 0 {
        return whole;
    }
    let [a, b] = halves(simplex).map(|half| certify_parts(field, &half, gap, bisections - 1));
    Reference {
        lower_bound: a.lower_bound.min(b.lower_bound).max(whole.lower_bound),
        value: a.value.min(b.value).min(whole.value),
        converged: a.converged && b.converged,
    }
}

/// The simplex, bisected at the middle of its longest edge.
fn halves<const N: usize>(simplex: &Simplex<f64, N>) -> [Simplex<f64, N>; 2] {
    let corners = &simplex.corners;
    let pairs = (0..N).flat_map(|a| (0..a).map(move |b| [a, b]));
    let length_sq = |[a, b]: [usize; 2]| (corners[a] - corners[b]).norm_squared();
    let ends = pairs.max_by(|one, other| length_sq(*one).total_cmp(&length_sq(*other))).unwrap_or([0; 2]);
    let middle = (corners[ends[0]] + corners[ends[1]]) * 0.5;
    ends.map(|end| {
        let mut half = *simplex;
        half.corners[end] = middle;
        half
    })
}
