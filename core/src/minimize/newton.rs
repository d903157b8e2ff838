//! Newton's method between cutting planes: few evaluations, expensive steps.
//!
//! | part | file |
//! |---|---|
//! | Cutting planes, the last four tangents, and the minimum of their maximum | `cuts` |
//! | A quadratic model, its Hessian from differences of gradients, and its minimum | `curvature` |
//! | Which of the two, or a step along the gradient, is next, and when it ends | this one |

use core::array::from_fn;

use super::curvature::Curvature;
use super::cuts::{Candidate, CutBundle, Tangent};
use super::descent_state::DescentState;
use super::{Minimizer, Minimum, reference_length};
use crate::number::{Mask, Real};
use crate::simplex::corner_weights;
use crate::{EnclosedSdf, Simplex};

/// Newton's method between cutting planes: a second-order bundle method (Kelley 1960, "The Cutting-Plane Method for
/// Solving Convex Programs"; Lukšan and Vlček 1998, "A bundle-Newton method for nonsmooth unconstrained minimization").
///
/// It has two models of φ, from the points x_p so far and the best of them, x:
/// - cutting planes c(y) = max_p φ(x_p) + ∇φ(x_p)·(y − x_p), which lie below a convex φ;
/// - a quadratic function q(y) = φ(x) + ∇φ(x)·(y − x) + ½ (y − x)·H (y − x).
///
/// A step goes to
/// 1. argmin q, if c ≤ q there and the last such step did not fail: superlinear where φ is smooth;
/// 2. else argmin c: exact where planes meet, as around the corner of a box;
/// 3. else, where planes that a nonconvex φ contradicts promise nothing, x + t (s − x) with the corner s of the lowest
///    slope. t is ½, and is halved after each such step that fails.
///
/// The first two end exactly on an edge if the minimum is there. The corners come first.
///
/// On triangles it misses the fewest minima of all local methods here, and its steps cost the most: as much as
/// several evaluations of a box or a dense grid. Use [`ProjectedGradient`](super::ProjectedGradient) for many triangles on
/// a cheap field. It is a local method: it can end in a higher one of several minima, though less often than
/// the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Newton {
    /// Largest number of steps, of one evaluation each.
    pub iterations: u32,
    /// Converged when φ(x) − min c, with no plane contradicted, is at most this fraction of slope bound · l, where l is the
    /// longest edge, or the size of the surface if that is shorter ([`Sdf::extent`](crate::Sdf::extent)). On a convex field that is
    /// a proof, to within rounding. On others nothing is proven: of converged ends one in a hundred had a lower value nearby, a
    /// thousandth of the path to some corner.
    pub tolerance: f64,
}

/// Planes that promise nothing, while the tangent at x does, mean a crease at x, or a field that is not convex. They
/// are believed once t is below this: after two gradient steps that failed, of ½ and ¼. Believed at once, twice as many
/// ends on nonconvex fields are not minima; with one step more, two thirds as many, for one more evaluation at every
/// crease.
const MAX_FRACTION_OF_BELIEF: f64 = 0.2;

impl Default for Newton {
    fn default() -> Self {
        Self { iterations: 32, tolerance: 1e-6 }
    }
}

impl<const N: usize> Minimizer<N> for Newton {
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        self.minimize_to_gap(field, simplex, R::from_f64(f64::NEG_INFINITY))
    }
}

impl Newton {
    /// [`minimize`](Minimizer::minimize) for who proves the minimum otherwise: it ends, too, after a step 1 that led lower, where another promises
    /// no more than the tolerance and the tangent at x is nowhere below φ(x) − gap. The last steps, which tighten the planes, are saved.
    pub(super) fn minimize_to_gap<R: Real, F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
        gap: R,
    ) -> Minimum<R, N> {
        let mut state = DescentState::new(field, simplex, corner_weights(0));
        let first = Tangent::new(simplex, &state.best);
        let mut corners = [first; N];
        for corner in 1..N {
            corners[corner] = Tangent::new(simplex, &state.evaluate_corner(corner));
        }
        let tolerance = reference_length(field, simplex.longest_edge())
            * (field.slope_bound_as::<R>() * R::from_f64(self.tolerance));
        let mut model = Model::new(&corners, first, gap);
        let (mut active, mut converged) = (!R::Mask::NONE, R::Mask::NONE);
        for _ in 0..self.iterations {
            let step = model.step(tolerance, active);
            converged = converged | active & step.is_converged;
            active = active & !step.is_converged & !step.is_exhausted;
            if !active.any() {
                break;
            }
            let tangent = Tangent::new(simplex, &state.evaluate(step.weights, active));
            model.update(tangent, step.kind);
        }
        state.finish(converged)
    }
}

/// Both models of the field, c and q.
struct Model<R: Real, const N: usize> {
    bundle: CutBundle<R, N>,
    curvature: Curvature<R, N>,
    newton_failed: R::Mask,
    newton_led_lower: R::Mask,
    /// t of the next gradient step.
    fraction: R,
    /// See [`Newton::minimize_to_gap`].
    gap: R,
}

struct Step<R: Real, const N: usize> {
    weights: [R; N],
    kind: StepKind<R::Mask>,
    is_converged: R::Mask,
    /// No step is left, though it has not converged.
    is_exhausted: R::Mask,
}

/// Step 1 or 2 of [`Newton`]; step 3 where neither holds.
#[derive(Clone, Copy)]
struct StepKind<M> {
    is_newton: M,
    is_cut: M,
}

impl<R: Real, const N: usize> Model<R, N> {
    fn new(corners: &[Tangent<R, N>; N], first: Tangent<R, N>, gap: R) -> Self {
        let mut bundle = CutBundle::new(first);
        corners.iter().skip(1).for_each(|corner| bundle.add(*corner));
        let (newton_failed, newton_led_lower) = (R::Mask::NONE, R::Mask::NONE);
        let curvature = Curvature::new(corners);
        Self { bundle, curvature, newton_failed, newton_led_lower, fraction: R::from_f64(0.5), gap }
    }

    fn step(&self, tolerance: R, active: R::Mask) -> Step<R, N> {
        let best = &self.bundle.best;
        let descends_to = |value: R| tolerance.lt(best.value - value);
        let (corner, corner_value) = lowest_corner(best);
        let is_flat = !descends_to(corner_value);
        if !(active & !is_flat).any() {
            let kind = StepKind { is_newton: R::Mask::NONE, is_cut: R::Mask::NONE };
            return Step { weights: best.weights, kind, is_converged: is_flat, is_exhausted: R::Mask::NONE };
        }

        let (cuts, contradiction) = self.bundle.cuts();
        let newton = self.curvature.minimum(best);
        let is_allowed = cuts.value(newton.weights).le(newton.value) & !self.newton_failed;
        let is_newton = descends_to(newton.value) & is_allowed & !self.bundle.contains(newton.weights);

        // A Newton step that the cuts allow needs no minimum of the cuts.
        let is_smooth_end =
            self.newton_led_lower & !descends_to(newton.value) & (best.value - corner_value).le(self.gap);
        let is_end = is_flat | is_smooth_end;
        let needs_cuts = active & !is_end & !is_newton;
        let cut = if needs_cuts.any() { cuts.minimum() } else { Candidate::infinite() };
        let is_cut = !is_newton & descends_to(cut.value) & !self.bundle.contains(cut.weights);
        let gradient_step: [R; N] = from_fn(|k| best.weights[k] + (corner[k] - best.weights[k]) * self.fraction);
        let gradient_descends = tolerance.lt((best.value - corner_value) * self.fraction);
        let is_believed = self.fraction.lt(R::from_f64(MAX_FRACTION_OF_BELIEF)) | !gradient_descends;
        let is_minimum = !descends_to(cut.value) & contradiction.le(tolerance) & is_believed;
        Step {
            weights: from_fn(|k| {
                let other = R::select(is_cut, cut.weights[k], gradient_step[k]);
                R::select(is_newton, newton.weights[k], other)
            }),
            kind: StepKind { is_newton, is_cut },
            is_converged: is_end | (needs_cuts & is_minimum),
            is_exhausted: !(is_newton | is_cut | gradient_descends),
        }
    }

    /// Updates all lanes: the model of one that has ended is not used again.
    fn update(&mut self, tangent: Tangent<R, N>, kind: StepKind<R::Mask>) {
        let best = self.bundle.best;
        let failed = !tangent.value.lt(best.value);
        self.newton_failed = kind.is_newton & failed;
        self.newton_led_lower = kind.is_newton & !failed;
        let is_too_far = failed & !kind.is_newton & !kind.is_cut;
        self.fraction = R::select(is_too_far, self.fraction * R::from_f64(0.5), self.fraction);
        self.curvature.update(&best, &tangent);
        self.bundle.add(tangent);
    }
}

/// Weights of the corner where a tangent is lowest, and its value there.
fn lowest_corner<R: Real, const N: usize>(tangent: &Tangent<R, N>) -> ([R; N], R) {
    let values = tangent.corner_values();
    let (mut lowest, mut lowest_value) = (corner_weights(0), values[0]);
    for corner in 1..N {
        let is_lower = values[corner].lt(lowest_value);
        let here: [R; N] = corner_weights(corner);
        lowest = from_fn(|k| R::select(is_lower, here[k], lowest[k]));
        lowest_value = R::select(is_lower, values[corner], lowest_value);
    }
    (lowest, lowest_value)
}
