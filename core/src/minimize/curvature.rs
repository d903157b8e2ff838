//! The quadratic model of [`Newton`](super::Newton): a Hessian H by the barycentric weights, from differences of slopes
//! s_k = ∂φ/∂w_k, and the minimum of q(w + d) = φ(w) + s·d + ½ d·H d.

use core::array::from_fn;

use super::cuts::{Candidate, Tangent, dot, face_weights, get};
use crate::number::Real;
use crate::simplex::corner_weights;

/// An update is skipped where |r·d| is below this times |r| |d|: it would divide by nearly zero. (Nocedal and Wright
/// 2006, "Numerical Optimization", eq. 6.26.)
const MIN_DENOMINATOR: f64 = 1e-2;

pub(super) struct Curvature<R, const N: usize> {
    hessian: [[R; N]; N],
}

impl<R: Real, const N: usize> Curvature<R, N> {
    /// H_ik = ½ (s_k(e_i) − s_k(e_0) + s_i(e_k) − s_i(e_0)) from the tangents at the corners e; exact for a quadratic
    /// φ.
    pub fn new(corners: &[Tangent<R, N>; N]) -> Self {
        let half = R::from_f64(0.5);
        let change = |k: usize, corner: usize| corners[corner].slopes[k] - corners[0].slopes[k];
        Self { hessian: from_fn(|i| from_fn(|k| (change(i, k) + change(k, i)) * half)) }
    }

    /// The symmetric rank-one update (Davidon 1959; Broyden 1967): with the step d and the residual r = Δs − H d, H ← H
    /// + r rᵀ / (r·d).
    pub fn update(&mut self, from: &Tangent<R, N>, to: &Tangent<R, N>) {
        let step = from_fn(|k| to.weights[k] - from.weights[k]);
        let residual: [R; N] = from_fn(|k| to.slopes[k] - from.slopes[k] - dot(self.hessian[k], step));
        let denominator = dot(residual, step);
        let limit = max_norm(residual) * max_norm(step) * R::from_f64(MIN_DENOMINATOR);
        let is_valid = limit.lt(denominator.abs());
        let denominator = R::select(is_valid, denominator, R::one());
        for (row, residual_of_row) in self.hessian.iter_mut().zip(residual) {
            for (entry, other) in row.iter_mut().zip(residual) {
                *entry = R::select(is_valid, *entry + residual_of_row * (other / denominator), *entry);
            }
        }
    }

    /// The lowest stationary minimum of q inside an edge or a face, with q tangent to the field at the given point.
    /// (With more than three corners the interior is left out.)
    pub fn minimum(&self, tangent: &Tangent<R, N>) -> Candidate<R, N> {
        let mut lowest = Candidate::infinite();
        for i in 0..N {
            let corner = self.tangent(tangent, corner_weights(i));
            for j in 0..i {
                self.consider_edge(&corner, [i, j], &mut lowest);
                for k in 0..j {
                    self.consider_face(&corner, [i, j, k], &mut lowest);
                }
            }
        }
        lowest
    }

    /// The tangent of q at other weights.
    fn tangent(&self, tangent: &Tangent<R, N>, weights: [R; N]) -> Tangent<R, N> {
        let step = from_fn(|k| weights[k] - tangent.weights[k]);
        let change = self.hessian.map(|row| dot(row, step));
        let value = tangent.value + dot(tangent.slopes, step) + dot(change, step) * R::from_f64(0.5);
        Tangent { weights, value, slopes: from_fn(|k| tangent.slopes[k] + change[k]) }
    }

    /// The second derivative along two edges from a corner c: (e_a − e_c)·H (e_b − e_c).
    fn second_derivative(&self, corner: usize, a: usize, b: usize) -> R {
        let change = self.hessian.map(|row| get(row, b) - get(row, corner));
        get(change, a) - get(change, corner)
    }

    /// On the edge from i to j with slope s and curvature c > 0: minimum at t = −s/c, s t/2 below the corner.
    fn consider_edge(&self, at_i: &Tangent<R, N>, [i, j]: [usize; 2], lowest: &mut Candidate<R, N>) {
        let (slope, curvature) = (get(at_i.slopes, j) - get(at_i.slopes, i), self.second_derivative(i, j, j));
        let t = -slope / curvature;
        let value = at_i.value + slope * t * R::from_f64(0.5);
        let value = R::select(R::zero().lt(curvature), value, R::from_f64(f64::INFINITY));
        lowest.consider(face_weights([(i, R::one() - t), (j, t)]), value);
    }

    /// On the face at corner i: minimum at t = −H⁻¹ s of the 2 × 2 system by Cramer's rule, if H is positive definite.
    fn consider_face(&self, at_i: &Tangent<R, N>, [i, j, k]: [usize; 3], lowest: &mut Candidate<R, N>) {
        let [slope_j, slope_k] = [j, k].map(|corner| get(at_i.slopes, corner) - get(at_i.slopes, i));
        let (jj, jk, kk) =
            (self.second_derivative(i, j, j), self.second_derivative(i, j, k), self.second_derivative(i, k, k));
        let determinant = jj * kk - jk * jk;
        let t_j = (slope_k * jk - slope_j * kk) / determinant;
        let t_k = (slope_j * jk - slope_k * jj) / determinant;
        let value = at_i.value + (slope_j * t_j + slope_k * t_k) * R::from_f64(0.5);
        let is_positive_definite = R::zero().lt(determinant) & R::zero().lt(jj);
        let value = R::select(is_positive_definite, value, R::from_f64(f64::INFINITY));
        lowest.consider(face_weights([(i, R::one() - t_j - t_k), (j, t_j), (k, t_k)]), value);
    }
}

fn max_norm<R: Real, const N: usize>(vector: [R; N]) -> R {
    vector.into_iter().fold(R::zero(), |max, x| max.max(x.abs()))
}
