//! Minima that the field knows without a search ([`EnclosedSdf::exact_minimum`]), made into answers.
//!
//! An exact minimum is a value in exact arithmetic at rounded weights. The answer is the field's own sample at the
//! point of those weights, so φ ≥ min(exact lower bound, sample) − rounding.
//!
//! An exact minimum and the sample there count as one evaluation, however many cells of a grid the element meets. The
//! grid bounds their number by itself: 256 cells of a segment, 512 blocks of a triangle's box.

use core::array::from_fn;

use nalgebra::Vector3;

use super::Slack;
use crate::minimize::Minimum;
use crate::number::{Float, Real};
use crate::rounding::{FieldScale, rounding};
use crate::simplex::corner_weights;
use crate::{EnclosedSdf, Goal, Sample, Simplex};

/// An exact minimum and the field's sample there.
#[derive(Clone, Copy)]
pub(super) struct SampledMinimum<R: Real, const N: usize> {
    pub weights: [R; N],
    pub point: Vector3<R>,
    pub sample: Sample<R>,
    /// Lower bound of φ up to rounding.
    pub lower_bound: R,
}

impl<R: Float, const N: usize> SampledMinimum<R, N> {
    pub fn with_bound(&self, Slack { gap, rounding }: Slack<R>) -> Minimum<R, N> {
        let lower_bound = self.lower_bound - rounding;
        Minimum {
            weights: self.weights,
            point: self.point,
            sample: self.sample,
            lower_bound,
            evaluations: R::one(),
            converged: self.sample.value - gap <= lower_bound,
        }
    }
}

/// `None` if the field does not know the minimum, or the simplex is not a triangle.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn minimum_on_triangle<R: Float, F: EnclosedSdf, const N: usize>(
    field: &F,
    simplex: &Simplex<R, N>,
    goal: Goal<R>,
) -> Option<SampledMinimum<R, N>> {
    let &[a, b, c] = simplex.corners.as_slice() else { return None };
    let exact = field.exact_minimum([a, b, c], goal)?;
    let mut weights = [R::zero(); N];
    weights.iter_mut().zip(exact.weights).for_each(|(weight, exact)| *weight = exact);
    let point = simplex.point(weights);
    let sample = field.evaluate(point);
    let lower_bound = Real::min(exact.lower_bound, sample.value);
    Some(SampledMinimum { weights, point, sample, lower_bound })
}

/// The minimum on the three edges of a triangle.
#[derive(Clone, Copy)]
pub(super) struct EdgeMinimum<R, const N: usize> {
    pub weights: [R; N],
    pub value: R,
}

/// Evaluations of [`minimum_on_edges`]: one for each edge.
pub(super) const EDGE_EVALUATIONS: u32 = 3;

/// `None` if the field does not know the minimum of an edge, or the simplex is not a triangle.
pub(super) fn minimum_on_edges<R: Float, F: EnclosedSdf, const N: usize>(
    field: &F,
    simplex: &Simplex<R, N>,
) -> Option<EdgeMinimum<R, N>> {
    let &[a, b, c] = simplex.corners.as_slice() else { return None };
    let mut lowest = EdgeMinimum { weights: corner_weights(0), value: R::from_f64(f64::INFINITY) };
    for (ends, from, to) in [([a, b], 0, 1), ([b, c], 1, 2), ([c, a], 2, 0)] {
        let edge = field.exact_minimum(ends, Goal::exact())?;
        if edge.value < lowest.value {
            let (from, to): ([R; N], [R; N]) = (corner_weights(from), corner_weights(to));
            lowest.weights = from_fn(|k| from[k] * edge.weights[0] + to[k] * edge.weights[1]);
            lowest.value = edge.value;
        }
    }
    Some(lowest)
}

/// `None` if the field does not know the minimum, or the simplex is not a segment.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn minimum_on_segment<R: Float, F: EnclosedSdf, const N: usize>(
    field: &F,
    simplex: &Simplex<R, N>,
) -> Option<Minimum<R, N>> {
    let &[a, b] = simplex.corners.as_slice() else { return None };
    let exact = field.exact_minimum([a, b], Goal::exact())?;
    let mut weights = [R::zero(); N];
    weights.iter_mut().zip(exact.weights).for_each(|(weight, exact)| *weight = exact);
    let point = simplex.point(weights);
    let sample = field.evaluate(point);
    let rounding = rounding(FieldScale::new(field), point, simplex.longest_edge(), sample.value);
    Some(Minimum {
        weights,
        point,
        sample,
        lower_bound: Real::min(exact.value, sample.value) - rounding,
        evaluations: R::one(),
        converged: true,
    })
}
