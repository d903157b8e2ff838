use core::array::from_fn;

use super::search::Visit;
use crate::Simplex;
use crate::number::Real;
use crate::simplex::corner_weights;

/// How many cuts are kept. With three it lost its way on convex fields now and then; with five or six it needed as many
/// steps as with four, and each costs more.
const MOST: usize = 4;

/// Where a model is least, and what it says there.
#[derive(Clone, Copy)]
pub(super) struct Candidate<R, const N: usize> {
    pub weights: [R; N],
    pub value: R,
}

impl<R: Real, const N: usize> Candidate<R, N> {
    /// Above every other.
    pub fn none() -> Self {
        Self { weights: corner_weights(0), value: R::from_f64(f64::INFINITY) }
    }

    /// Takes the other if it is lower and lies in the simplex. Weights that are no numbers do not.
    pub fn consider(&mut self, weights: [R; N], value: R) {
        let is_lower = weights.iter().fold(value.lt(self.value), |all, weight| all & R::zero().le(*weight));
        self.weights = from_fn(|k| R::select(is_lower, weights[k], self.weights[k]));
        self.value = R::select(is_lower, value, self.value);
    }
}

/// The linear function that meets the field at a point with its value and slopes.
#[derive(Clone, Copy)]
pub(super) struct Tangent<R, const N: usize> {
    pub weights: [R; N],
    pub value: R,
    /// By each weight, as [`Simplex::slopes`].
    pub slopes: [R; N],
}

impl<R: Real, const N: usize> Tangent<R, N> {
    pub fn new(simplex: &Simplex<R, N>, visit: &Visit<R, N>) -> Self {
        Self { weights: visit.weights, value: visit.sample.value, slopes: simplex.slopes(visit.sample.gradient) }
    }

    fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        Self {
            weights: from_fn(|k| R::select(mask, yes.weights[k], no.weights[k])),
            value: R::select(mask, yes.value, no.value),
            slopes: from_fn(|k| R::select(mask, yes.slopes[k], no.slopes[k])),
        }
    }

    /// At the corners: a linear function is a weighted mean of these.
    pub fn at_corners(&self) -> [R; N] {
        let at_first = self.value - dot(self.weights, self.slopes);
        self.slopes.map(|slope| at_first + slope)
    }
}

/// The best tangent and the last few others.
pub(super) struct CutBundle<R, const N: usize> {
    pub best: Tangent<R, N>,
    others: [Tangent<R, N>; MOST - 1],
}

impl<R: Real, const N: usize> CutBundle<R, N> {
    pub fn new(first: Tangent<R, N>) -> Self {
        Self { best: first, others: [first; MOST - 1] }
    }

    /// In place of the oldest.
    pub fn add(&mut self, tangent: Tangent<R, N>) {
        let is_better = tangent.value.lt(self.best.value);
        let mut newer = Tangent::select(is_better, self.best, tangent);
        self.best = Tangent::select(is_better, tangent, self.best);
        for other in self.others.iter_mut().rev() {
            core::mem::swap(other, &mut newer);
        }
    }

    /// Whether the field was asked there, but for rounding.
    pub fn holds(&self, weights: [R; N]) -> R::Mask {
        let rounding = R::from_f64(16.0 * R::EPSILON);
        let is_there = |tangent: &Tangent<R, N>| {
            (0..N).fold(R::zero(), |most, k| most.max((tangent.weights[k] - weights[k]).abs())).le(rounding)
        };
        self.others.iter().fold(is_there(&self.best), |any, other| any | is_there(other))
    }

    /// As cuts, which pass nowhere above the best point. Also how far the highest was above it: nothing, on a convex field.
    pub fn cuts(&self) -> (Cuts<R, N>, R) {
        let mut highest = R::zero();
        let mut planes = [self.best.at_corners(); MOST];
        for (plane, other) in planes.iter_mut().skip(1).zip(&self.others) {
            let at_corners = other.at_corners();
            let above = (dot(at_corners, self.best.weights) - self.best.value).max(R::zero());
            highest = highest.max(above);
            *plane = at_corners.map(|value| value - above);
        }
        (Cuts { planes }, highest)
    }
}

/// The largest of a few linear functions, each by its values at the corners.
pub(super) struct Cuts<R, const N: usize> {
    planes: [[R; N]; MOST],
}

impl<R: Real, const N: usize> Cuts<R, N> {
    pub fn at(&self, weights: [R; N]) -> R {
        let [first, others @ ..] = self.planes;
        others.iter().fold(dot(first, weights), |most, plane| most.max(dot(*plane, weights)))
    }

    /// The least in the simplex: at a corner, where two cross on an edge, or three on a face. (Of more than three corners
    /// the inside is left out.)
    pub fn lowest(&self) -> Candidate<R, N> {
        let mut lowest = Candidate::none();
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
        lowest.consider(weights, self.at(weights));
    }

    fn consider_edge(&self, [i, j]: [usize; 2], lowest: &mut Candidate<R, N>) {
        let ends = self.planes.map(|plane| (at(plane, i), at(plane, j) - at(plane, i)));
        let value_at = |share: R| {
            let (start, rise) = ends[0];
            ends.iter().skip(1).fold(start + rise * share, |most, (start, rise)| most.max(*start + *rise * share))
        };
        let (mut least, mut least_at) = (R::from_f64(f64::INFINITY), R::zero());
        for (p, (start, rise)) in ends.iter().enumerate() {
            for (other_start, other_rise) in ends.iter().take(p) {
                // No number where the two are parallel, and then not on the edge.
                let share = (*start - *other_start) / (*other_rise - *rise);
                let value = value_at(share);
                let is_lower = R::zero().le(share) & share.le(R::one()) & value.lt(least);
                least = R::select(is_lower, value, least);
                least_at = R::select(is_lower, share, least_at);
            }
        }
        lowest.consider(on_face([(i, R::one() - least_at), (j, least_at)]), least);
    }

    /// Weights at which two differences vanish are a multiple of their cross product.
    fn consider_face(&self, corners: [usize; 3], lowest: &mut Candidate<R, N>) {
        let planes = self.planes.map(|plane| corners.map(|corner| at(plane, corner)));
        for (p, first) in planes.iter().enumerate() {
            for (q, second) in planes.iter().enumerate().take(p) {
                for third in planes.iter().take(q) {
                    let (a, b): ([R; 3], [R; 3]) =
                        (from_fn(|k| first[k] - second[k]), from_fn(|k| first[k] - third[k]));
                    let normal = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
                    let sum = normal[0] + normal[1] + normal[2];
                    let [i, j, k] = corners;
                    let weights = [(i, normal[0] / sum), (j, normal[1] / sum), (k, normal[2] / sum)];
                    self.consider(on_face(weights), lowest);
                }
            }
        }
    }
}

/// The weights of a point on an edge or a face, of which some corners' are given.
pub(super) fn on_face<R: Real, const N: usize, const M: usize>(given: [(usize, R); M]) -> [R; N] {
    let mut weights = [R::zero(); N];
    for (corner, weight) in weights.iter_mut().enumerate() {
        for (at, of_corner) in given {
            *weight = if at == corner { of_corner } else { *weight };
        }
    }
    weights
}

/// No check of the index can panic: corners are always below `N`.
pub(super) fn at<R: Real, const N: usize>(values: [R; N], corner: usize) -> R {
    values.get(corner).copied().unwrap_or_else(R::zero)
}

pub(super) fn dot<R: Real, const N: usize>(a: [R; N], b: [R; N]) -> R {
    (0..N).fold(R::zero(), |sum, k| sum + a[k] * b[k])
}
