use core::array::from_fn;

use super::curvature::Curvature;
use super::cuts::{Candidate, CutBundle, Tangent};
use super::search::Search;
use super::{Minimizer, Minimum};
use crate::number::{Mask, Real};
use crate::simplex::corner_weights;
use crate::{EnclosedSdf, Simplex};

/// Newton's method between cutting planes: a second-order bundle method (Kelley 1960, "The Cutting-Plane Method for
/// Solving Convex Programs"; Lukšan and Vlček 1998, "A bundle-Newton method for nonsmooth unconstrained minimization").
///
/// The tangents at the best point and at the last three others are cuts, below which a convex field has no value. How
/// slopes change from corner to corner, and then from step to step, tells the curvature. A step goes
/// 1. to the least of the quadratic function through the best point, if no cut denies its value there and the last such
///    step did not fail: superlinear where the field is smooth;
/// 2. else to the least of the cuts: exact where planes meet, as around a box's corner;
/// 3. else, where cuts that a field which is not convex has broken leave nothing to gain, a share of the way to the corner
///    that the gradient points away from. The share is a half, and is halved after each such step that fails.
///
/// The first two end on an edge exactly when the minimum is there; the corners are asked before all.
///
/// Of all methods here it needs the fewest evaluations, by far, and its steps cost the most: on triangles as much as
/// several evaluations of a box or a dense grid. Take it for a field that is dear to ask, for a minimum of more than two or
/// three digits, or on segments, where its steps are cheap. Take [`FrankWolfe`](super::FrankWolfe) for a quick look at many
/// triangles on a cheap field. It is a local method: where there are several minima it can end in a higher one;
/// Frank-Wolfe does so more often.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Newton {
    /// How many steps at most, each of one evaluation.
    pub iterations: u32,
    /// Done when the cuts, if none was broken, leave no more to gain than this share of longest edge · slope bound: on a
    /// convex field that is proven, to within rounding. On others nothing is: of ends that call themselves converged one in
    /// a hundred had a lower value a thousandth of the way to some corner.
    pub tolerance: f64,
}

/// Cuts that leave nothing to gain, while the best point's own does, mean a crease there, or a field that is not convex.
/// They are believed once the share is below this: after a step of a half and one of a quarter by the gradient that failed.
/// Believed at once, twice as many ends are no minimum where a field is not convex; with one step more two thirds as many,
/// for an evaluation more at every crease.
const BELIEF: f64 = 0.2;

impl Default for Newton {
    fn default() -> Self {
        Self { iterations: 32, tolerance: 1e-6 }
    }
}

impl<const N: usize> Minimizer<N> for Newton {
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        let mut search = Search::from(field, simplex, corner_weights(0));
        let first = Tangent::new(simplex, &search.best());
        let mut corners = [first; N];
        for corner in 1..N {
            corners[corner] = Tangent::new(simplex, &search.visit(corner_weights(corner), !R::Mask::NONE));
        }
        let tolerance = simplex.longest_edge() * R::from_f64(field.slope_bound() * self.tolerance);
        let mut model = Model::new(&corners, first);
        let (mut active, mut converged) = (!R::Mask::NONE, R::Mask::NONE);
        for _ in 0..self.iterations {
            let step = model.step(tolerance, active);
            converged = converged | active & step.is_converged;
            active = active & !step.is_converged & !step.is_nowhere;
            if !active.any() {
                break;
            }
            let tangent = Tangent::new(simplex, &search.visit(step.weights, active));
            model.learn(tangent, step.kind);
        }
        search.finish(converged)
    }
}

/// What the field is taken for, by the points asked so far.
struct Model<R: Real, const N: usize> {
    bundle: CutBundle<R, N>,
    curvature: Curvature<R, N>,
    newton_failed: R::Mask,
    /// Of the way to a corner, for the next step by the gradient.
    share: R,
}

struct Step<R: Real, const N: usize> {
    weights: [R; N],
    kind: Kind<R::Mask>,
    is_converged: R::Mask,
    /// Nothing is left to try, though it has not converged.
    is_nowhere: R::Mask,
}

/// Neither is by the gradient.
#[derive(Clone, Copy)]
struct Kind<M> {
    by_curvature: M,
    by_cuts: M,
}

impl<R: Real, const N: usize> Model<R, N> {
    fn new(corners: &[Tangent<R, N>; N], first: Tangent<R, N>) -> Self {
        let mut bundle = CutBundle::new(first);
        corners.iter().skip(1).for_each(|corner| bundle.add(*corner));
        Self { bundle, curvature: Curvature::new(corners), newton_failed: R::Mask::NONE, share: R::from_f64(0.5) }
    }

    fn step(&self, tolerance: R, active: R::Mask) -> Step<R, N> {
        let best = &self.bundle.best;
        let falls_to = |value: R| tolerance.lt(best.value - value);
        let (corner, at_corner) = cheapest_corner(best);
        let is_flat = !falls_to(at_corner);

        let (cuts, contradiction) = self.bundle.cuts();
        let lowest = self.curvature.lowest(best);
        let is_allowed = cuts.at(lowest.weights).le(lowest.value) & !self.newton_failed;
        let by_curvature = falls_to(lowest.value) & is_allowed & !self.bundle.holds(lowest.weights);

        // What is allowed below the best point is below the least of the cuts too: that is not needed then.
        let wants_cuts = active & !is_flat & !by_curvature;
        let least = if wants_cuts.any() { cuts.lowest() } else { Candidate::none() };
        let by_cuts = !by_curvature & falls_to(least.value) & !self.bundle.holds(least.weights);
        let by_slope: [R; N] = from_fn(|k| best.weights[k] + (corner[k] - best.weights[k]) * self.share);
        let falls_by_slope = tolerance.lt((best.value - at_corner) * self.share);
        let is_believed = self.share.lt(R::from_f64(BELIEF)) | !falls_by_slope;
        let is_lowest = !falls_to(least.value) & contradiction.le(tolerance) & is_believed;
        Step {
            weights: from_fn(|k| {
                let without_curvature = R::select(by_cuts, least.weights[k], by_slope[k]);
                R::select(by_curvature, lowest.weights[k], without_curvature)
            }),
            kind: Kind { by_curvature, by_cuts },
            is_converged: is_flat | (wants_cuts & is_lowest),
            is_nowhere: !(by_curvature | by_cuts | falls_by_slope),
        }
    }

    /// In all lanes: one that is done is not asked what it has learned.
    fn learn(&mut self, tangent: Tangent<R, N>, kind: Kind<R::Mask>) {
        let best = self.bundle.best;
        let failed = !tangent.value.lt(best.value);
        self.newton_failed = kind.by_curvature & failed;
        let is_too_far = failed & !kind.by_curvature & !kind.by_cuts;
        self.share = R::select(is_too_far, self.share * R::from_f64(0.5), self.share);
        self.curvature.update(&best, &tangent);
        self.bundle.add(tangent);
    }
}

/// Where in the simplex a tangent is least, and its value there.
fn cheapest_corner<R: Real, const N: usize>(tangent: &Tangent<R, N>) -> ([R; N], R) {
    let at_corners = tangent.at_corners();
    let (mut cheapest, mut least) = (corner_weights(0), at_corners[0]);
    for corner in 1..N {
        let is_lower = at_corners[corner].lt(least);
        let here: [R; N] = corner_weights(corner);
        cheapest = from_fn(|k| R::select(is_lower, here[k], cheapest[k]));
        least = R::select(is_lower, at_corners[corner], least);
    }
    (cheapest, least)
}
