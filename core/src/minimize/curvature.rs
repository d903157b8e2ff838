use core::array::from_fn;

use super::cuts::{Candidate, Tangent, at, dot, on_face};
use crate::number::Real;
use crate::simplex::corner_weights;

/// An update is left out where the change of slopes that it explains is nearly across the step, less than this share of it
/// along: it would divide by what is nearly nothing. (Nocedal and Wright 2006, "Numerical Optimization", eq. 6.26.)
const MIN_SHARE_ALONG: f64 = 1e-2;

/// The second derivatives by the weights, as far as differences of slopes tell them.
pub(super) struct Curvature<R, const N: usize> {
    by_weights: [[R; N]; N],
}

impl<R: Real, const N: usize> Curvature<R, N> {
    /// From tangents at the corners, exact where the field is quadratic.
    pub fn new(corners: &[Tangent<R, N>; N]) -> Self {
        let half = R::from_f64(0.5);
        let change = |k: usize, corner: usize| corners[corner].slopes[k] - corners[0].slopes[k];
        Self { by_weights: from_fn(|i| from_fn(|k| (change(i, k) + change(k, i)) * half)) }
    }

    /// By the symmetric rank-one formula (Davidon 1959; Broyden 1967).
    pub fn update(&mut self, from: &Tangent<R, N>, to: &Tangent<R, N>) {
        let step = from_fn(|k| to.weights[k] - from.weights[k]);
        let missed: [R; N] = from_fn(|k| to.slopes[k] - from.slopes[k] - dot(self.by_weights[k], step));
        let along = dot(missed, step);
        let least = largest(missed) * largest(step) * R::from_f64(MIN_SHARE_ALONG);
        let is_valid = least.lt(along.abs());
        let divisor = R::select(is_valid, along, R::one());
        for (row, missed_here) in self.by_weights.iter_mut().zip(missed) {
            for (entry, other) in row.iter_mut().zip(missed) {
                *entry = R::select(is_valid, *entry + missed_here * (other / divisor), *entry);
            }
        }
    }

    /// Where the quadratic function of this curvature that touches the tangent is least on an edge or a face, off their
    /// ends. (Of more than three corners the inside is left out.)
    pub fn lowest(&self, tangent: &Tangent<R, N>) -> Candidate<R, N> {
        let mut lowest = Candidate::none();
        for i in 0..N {
            let at_corner = self.carry(tangent, corner_weights(i));
            for j in 0..i {
                self.consider_edge(&at_corner, [i, j], &mut lowest);
                for k in 0..j {
                    self.consider_face(&at_corner, [i, j, k], &mut lowest);
                }
            }
        }
        lowest
    }

    /// The tangent of the same quadratic function elsewhere.
    fn carry(&self, tangent: &Tangent<R, N>, weights: [R; N]) -> Tangent<R, N> {
        let step = from_fn(|k| weights[k] - tangent.weights[k]);
        let bend = self.by_weights.map(|row| dot(row, step));
        let value = tangent.value + dot(tangent.slopes, step) + dot(bend, step) * R::from_f64(0.5);
        Tangent { weights, value, slopes: from_fn(|k| tangent.slopes[k] + bend[k]) }
    }

    /// Between two edges that leave a corner.
    fn between(&self, corner: usize, a: usize, b: usize) -> R {
        let change = self.by_weights.map(|row| at(row, b) - at(row, corner));
        at(change, a) - at(change, corner)
    }

    fn consider_edge(&self, at_i: &Tangent<R, N>, [i, j]: [usize; 2], lowest: &mut Candidate<R, N>) {
        let (slope, curvature) = (at(at_i.slopes, j) - at(at_i.slopes, i), self.between(i, j, j));
        let share = -slope / curvature;
        let value = at_i.value + slope * share * R::from_f64(0.5);
        // Curved downwards, this is the greatest.
        let value = R::select(R::zero().lt(curvature), value, R::from_f64(f64::INFINITY));
        lowest.consider(on_face([(i, R::one() - share), (j, share)]), value);
    }

    fn consider_face(&self, at_i: &Tangent<R, N>, [i, j, k]: [usize; 3], lowest: &mut Candidate<R, N>) {
        let [slope_j, slope_k] = [j, k].map(|corner| at(at_i.slopes, corner) - at(at_i.slopes, i));
        let (jj, jk, kk) = (self.between(i, j, j), self.between(i, j, k), self.between(i, k, k));
        let determinant = jj * kk - jk * jk;
        let share_j = (slope_k * jk - slope_j * kk) / determinant;
        let share_k = (slope_j * jk - slope_k * jj) / determinant;
        let value = at_i.value + (slope_j * share_j + slope_k * share_k) * R::from_f64(0.5);
        let is_bowl = R::zero().lt(determinant) & R::zero().lt(jj);
        let value = R::select(is_bowl, value, R::from_f64(f64::INFINITY));
        lowest.consider(on_face([(i, R::one() - share_j - share_k), (j, share_j), (k, share_k)]), value);
    }
}

fn largest<R: Real, const N: usize>(of: [R; N]) -> R {
    of.into_iter().fold(R::zero(), |most, x| most.max(x.abs()))
}
