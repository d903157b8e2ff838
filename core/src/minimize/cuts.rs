//! Cutting planes (Kelley 1960, "The Cutting-Plane Method for Solving Convex Programs"): tangents of the field at a few
//! points, and the minimum on the simplex of their maximum c(w) = max_p φ(w_p) + s_p·(w − w_p).
//!
//! A convex field lies above c. On others a plane may pass above the best point, where it contradicts the value found:
//! it is shifted down to that value.

use core::array::from_fn;

use super::descent_state::WeightedSample;
use crate::Simplex;
use crate::number::Real;
use crate::rounding::SAME_WEIGHT;
use crate::simplex::corner_weights;

/// Cuts in the bundle. Three fail now and then on convex fields; five or six take as many steps as four, and each costs
/// more.
const MAX_CUTS: usize = 4;

/// The minimum of a model so far, and the model's value there.
#[derive(Clone, Copy)]
pub(super) struct Candidate<R, const N: usize> {
    pub weights: [R; N],
    pub value: R,
}

impl<R: Real, const N: usize> Candidate<R, N> {
    /// Above every other.
    pub fn infinite() -> Self {
        Self { weights: corner_weights(0), value: R::from_f64(f64::INFINITY) }
    }

    /// Becomes the other if that is lower and in the simplex. NaN weights are not.
    pub fn consider(&mut self, weights: [R; N], value: R) {
        let is_lower = weights.iter().fold(value.lt(self.value), |all, weight| all & R::zero().le(*weight));
        self.weights = from_fn(|k| R::select(is_lower, weights[k], self.weights[k]));
        self.value = R::select(is_lower, value, self.value);
    }
}

/// The tangent of the field at a point: φ(w) + s·(w′ − w).
#[derive(Clone, Copy)]
pub(super) struct Tangent<R, const N: usize> {
    pub weights: [R; N],
    pub value: R,
    /// ∂φ/∂w_k, as [`Simplex::slopes`].
    pub slopes: [R; N],
}

impl<R: Real, const N: usize> Tangent<R, N> {
    pub fn new(simplex: &Simplex<R, N>, point: &WeightedSample<R, N>) -> Self {
        Self { weights: point.weights, value: point.sample.value, slopes: simplex.slopes(point.sample.gradient) }
    }

    fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        Self {
            weights: from_fn(|k| R::select(mask, yes.weights[k], no.weights[k])),
            value: R::select(mask, yes.value, no.value),
            slopes: from_fn(|k| R::select(mask, yes.slopes[k], no.slopes[k])),
        }
    }

    /// Values at the corners, of which a linear function is the weighted mean.
    pub fn corner_values(&self) -> [R; N] {
        let at_zero_slope = self.value - dot(self.weights, self.slopes);
        self.slopes.map(|slope| at_zero_slope + slope)
    }
}

/// The best tangent and the last few others.
pub(super) struct CutBundle<R, const N: usize> {
    pub best: Tangent<R, N>,
    others: [Tangent<R, N>; MAX_CUTS - 1],
}

impl<R: Real, const N: usize> CutBundle<R, N> {
    pub fn new(first: Tangent<R, N>) -> Self {
        Self { best: first, others: [first; MAX_CUTS - 1] }
    }

    /// Adds a tangent in place of the oldest.
    pub fn add(&mut self, tangent: Tangent<R, N>) {
        let is_better = tangent.value.lt(self.best.value);
        let mut newer = Tangent::select(is_better, self.best, tangent);
        self.best = Tangent::select(is_better, tangent, self.best);
        for other in self.others.iter_mut().rev() {
            core::mem::swap(other, &mut newer);
        }
    }

    /// Was one of the tangents taken at this point, up to rounding?
    pub fn contains(&self, weights: [R; N]) -> R::Mask {
        let rounding = R::from_f64(SAME_WEIGHT * R::EPSILON);
        let is_equal = |tangent: &Tangent<R, N>| {
            (0..N).fold(R::zero(), |max, k| max.max((tangent.weights[k] - weights[k]).abs())).le(rounding)
        };
        self.others.iter().fold(is_equal(&self.best), |any, other| any | is_equal(other))
    }

    /// The cuts, shifted down to the best value where they pass above it, and the largest shift: zero on a convex
    /// field.
    pub fn cuts(&self) -> (Cuts<R, N>, R) {
        let mut max_shift = R::zero();
        let mut planes = [self.best.corner_values(); MAX_CUTS];
        for (plane, other) in planes.iter_mut().skip(1).zip(&self.others) {
            let corner_values = other.corner_values();
            let shift = (dot(corner_values, self.best.weights) - self.best.value).max(R::zero());
            max_shift = max_shift.max(shift);
            *plane = corner_values.map(|value| value - shift);
        }
        (Cuts { planes }, max_shift)
    }
}

/// The maximum of a few linear functions, each given by its values at the corners.
pub(super) struct Cuts<R, const N: usize> {
    planes: [[R; N]; MAX_CUTS],
}

impl<R: Real, const N: usize> Cuts<R, N> {
    pub fn value(&self, weights: [R; N]) -> R {
        let [first, others @ ..] = self.planes;
        others.iter().fold(dot(first, weights), |max, plane| max.max(dot(*plane, weights)))
    }

    /// The minimum on the simplex: at a corner, where two planes meet on an edge, or three on a face. (With more than
    /// three corners the interior is left out.)
    pub fn minimum(&self) -> Candidate<R, N> {
        let mut lowest = Candidate::infinite();
        for i in 0..N {
            self.consider(corner_weights(i), &mut lowest);
            for j in 0..i {
                self.consider_edge([i, j], &mut lowest);
                for k in 0..j {
                    self.consider_face([i, j, k], &mut lowest);
                }
            }
        }
        lowest
    }

    fn consider(&self, weights: [R; N], lowest: &mut Candidate<R, N>) {
        lowest.consider(weights, self.value(weights));
    }

    /// Two lines a + b t and a′ + b′ t meet at t = (a − a′)/(b′ − b).
    fn consider_edge(&self, [i, j]: [usize; 2], lowest: &mut Candidate<R, N>) {
        let lines = self.planes.map(|plane| (get(plane, i), get(plane, j) - get(plane, i)));
        let value_at = |t: R| {
            let (start, slope) = lines[0];
            lines.iter().skip(1).fold(start + slope * t, |max, (start, slope)| max.max(*start + *slope * t))
        };
        let (mut min_value, mut min_t) = (R::from_f64(f64::INFINITY), R::zero());
        for (p, (start, slope)) in lines.iter().enumerate() {
            for (other_start, other_slope) in lines.iter().take(p) {
                // NaN where the two are parallel, and so not on the edge.
                let t = (*start - *other_start) / (*other_slope - *slope);
                let value = value_at(t);
                let is_lower = R::zero().le(t) & t.le(R::one()) & value.lt(min_value);
                min_value = R::select(is_lower, value, min_value);
                min_t = R::select(is_lower, t, min_t);
            }
        }
        lowest.consider(face_weights([(i, R::one() - min_t), (j, min_t)]), min_value);
    }

    /// The weights at which the differences a and b of three planes vanish are a multiple of a × b.
    fn consider_face(&self, corners: [usize; 3], lowest: &mut Candidate<R, N>) {
        let planes = self.planes.map(|plane| corners.map(|corner| get(plane, corner)));
        for (p, first) in planes.iter().enumerate() {
            for (q, second) in planes.iter().enumerate().take(p) {
                for third in planes.iter().take(q) {
                    let (a, b): ([R; 3], [R; 3]) =
                        (from_fn(|k| first[k] - second[k]), from_fn(|k| first[k] - third[k]));
                    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
                    let sum = cross[0] + cross[1] + cross[2];
                    let [i, j, k] = corners;
                    let weights = [(i, cross[0] / sum), (j, cross[1] / sum), (k, cross[2] / sum)];
                    self.consider(face_weights(weights), lowest);
                }
            }
        }
    }
}

/// Weights of a point on an edge or a face from those of its corners; the others are zero.
pub(super) fn face_weights<R: Real, const N: usize, const M: usize>(corners: [(usize, R); M]) -> [R; N] {
    let mut weights = [R::zero(); N];
    for (corner, weight) in weights.iter_mut().enumerate() {
        for (index, given) in corners {
            *weight = if index == corner { given } else { *weight };
        }
    }
    weights
}

/// The value at a corner, which is below `N`. Zero instead of a panic otherwise.
pub(super) fn get<R: Real, const N: usize>(values: [R; N], corner: usize) -> R {
    values.get(corner).copied().unwrap_or_else(R::zero)
}

pub(super) fn dot<R: Real, const N: usize>(a: [R; N], b: [R; N]) -> R {
    (0..N).fold(R::zero(), |sum, k| sum + a[k] * b[k])
}
