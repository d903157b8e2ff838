//! Any invertible affine map: x = t + A p, with shear and mirror.
//!
//! With σ₁ ≥ σ₂ ≥ σ₃ the singular values of A, J = A⁻¹ and ‖J‖ = 1/σ₃. So s = σ₃ makes s ‖J‖ = 1: the largest factor that keeps
//! |φ_w| at or below the distance in the world. For A = diag(f) it is the smallest |f|, as of [`Stretch`](super::Stretch); for A = s R
//! it is s. ‖J‖ is the root of the largest eigenvalue of Jᵀ J, found by Jacobi's rotations.

use nalgebra::{Matrix3, Vector3};

use super::{LocalPoint, Placement, similarity::map_bounds};
use crate::Aabb;
use crate::number::Real;
use crate::rounding::{INVERSE_RESIDUAL, SPECTRAL_NORM};
use crate::vector::{from_f64, largest_component, times};

/// An affine map: x = t + A p. Sign and surface are exact; the magnitude is a lower bound of the distance, and of slope σ₃/σ₁ at
/// least where the field is a distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// A.
    world_from_local: Matrix3<f64>,
    /// J = A⁻¹.
    local_from_world: Matrix3<f64>,
    translation: [f64; 3],
    /// s: a lower bound of σ₃, off by rounding alone.
    scale: f64,
    /// An upper bound of ‖J⁻¹‖: σ₁, off by rounding and by the residual.
    largest_scale: f64,
    /// ‖J A − 1‖ in the maximum norm.
    residual: f64,
}

impl Affine {
    /// `linear` is A, by rows. `None` if anything is not finite, or A is so nearly singular that its computed inverse J has
    /// ‖J A − 1‖ > 1e-6.
    pub fn new(translation: [f64; 3], linear: [[f64; 3]; 3]) -> Option<Self> {
        let world_from_local = Matrix3::from_fn(|row, column| linear[row % 3][column % 3]);
        let local_from_world = inverse(&world_from_local)?;
        let residual = max_row_sum(&(local_from_world * world_from_local - Matrix3::identity()));
        let scale = 1.0 / spectral_norm(&local_from_world);
        let is_valid = translation.iter().all(|x| x.is_finite())
            && residual <= INVERSE_RESIDUAL
            && scale.is_finite()
            && scale > 0.0;
        // J⁻¹ = A (J A)⁻¹, and the Euclidean norm of a 3 × 3 matrix is at most √3 times its maximum norm.
        let largest_scale = spectral_norm(&world_from_local) / (1.0 - 2.0 * residual);
        is_valid.then_some(Self { world_from_local, local_from_world, translation, scale, largest_scale, residual })
    }

    /// World point of a local point.
    pub fn push(&self, local: Vector3<f64>) -> Vector3<f64> {
        self.world_from_local * local + Vector3::from(self.translation)
    }

    /// t.
    pub fn translation(&self) -> [f64; 3] {
        self.translation
    }

    /// A, by rows.
    pub fn linear(&self) -> [[f64; 3]; 3] {
        let a = &self.world_from_local;
        [[a.m11, a.m12, a.m13], [a.m21, a.m22, a.m23], [a.m31, a.m32, a.m33]]
    }
}

impl Placement for Affine {
    #[inline(always)]
    fn pull<R: Real>(&self, world_point: Vector3<R>) -> LocalPoint<R> {
        let jacobian = self.local_from_world.map(R::from_f64);
        let point = times(&jacobian, world_point - from_f64(self.translation));
        LocalPoint { point, jacobian, scale: R::from_f64(self.scale) }
    }

    /// The field is moved by J⁻¹ = A (J A)⁻¹, which differs from A by rounding: it takes p where A takes a point beside it.
    fn push_bounds(&self, local: Aabb) -> Aabb {
        let largest = local.min.iter().chain(&local.max).fold(0.0_f64, |largest, x| largest.max(x.abs()));
        // Without a residual, also of a box without end.
        let slack = if self.residual > 0.0 { largest * self.residual / (1.0 - self.residual) } else { 0.0 };
        let local = local.inflate(slack);
        let Aabb { min, max } = map_bounds(local, &self.world_from_local, |centre| self.world_from_local * centre);
        let shift = |corner: [f64; 3]| core::array::from_fn(|k| corner[k] + self.translation[k]);
        Aabb { min: shift(min), max: shift(max) }
    }

    fn pull_bounds(&self, world: Aabb) -> Aabb {
        map_bounds(world, &self.local_from_world, |centre| self.pull(centre).point)
    }

    fn slope_factor(&self) -> f64 {
        1.0
    }

    fn scale(&self) -> f64 {
        self.scale
    }

    fn largest_scale(&self) -> f64 {
        self.largest_scale
    }

    fn extent<R: Real>(&self, local: R, bounds: impl FnOnce() -> Aabb) -> R {
        let longest_side = self.push_bounds(bounds()).longest_side();
        R::from_f64(longest_side).min(local * R::from_f64(self.largest_scale()))
    }

    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        largest_component(from_f64(self.translation))
    }
}

/// A⁻¹ = adj(A) / det(A), improved, the rows of adj(A) being the cross products of the columns of A. `None` if that is not finite.
pub(crate) fn inverse(matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    // Divided by the largest entry first, so that no product underflows or overflows.
    let largest = matrix.amax();
    if !(largest > 0.0 && largest.is_finite()) {
        return None;
    }
    let scaled = matrix / largest;
    let [a, b, c] = [0, 1, 2].map(|column| scaled.column(column).into_owned());
    let adjugate = Matrix3::from_rows(&[b.cross(&c).transpose(), c.cross(&a).transpose(), a.cross(&b).transpose()]);
    let mut inverse = adjugate / a.dot(&b.cross(&c));
    // Each step of Newton's method squares the error of a determinant that lost digits (Schulz 1933). Not J ← J (2 − A J): that makes
    // A J − 1 small, and J A − 1, which a point of the surface is off by, larger by the condition of A.
    for _ in 0..2 {
        inverse = (Matrix3::from_diagonal_element(2.0) - inverse * scaled) * inverse;
    }
    inverse /= largest;
    inverse.iter().all(|x| x.is_finite()).then_some(inverse)
}

/// Upper bound of the largest singular value of a matrix, off by rounding alone: the root of the largest eigenvalue of MᵀM, by
/// cyclic Jacobi rotations (Golub and Van Loan 2013, "Matrix Computations", §8.5).
pub(crate) fn spectral_norm(matrix: &Matrix3<f64>) -> f64 {
    let largest = matrix.amax();
    if !(largest > 0.0 && largest.is_finite()) {
        return largest;
    }
    let scaled = matrix / largest;
    let mut gram = scaled.tr_mul(&scaled);
    // Convergence is quadratic: a 3 × 3 matrix is diagonal to rounding after five sweeps.
    for _ in 0..6 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off_diagonal = gram[(p, q)];
            let theta = (gram[(q, q)] - gram[(p, p)]) / (2.0 * off_diagonal);
            if off_diagonal == 0.0 || !theta.is_finite() {
                continue;
            }
            let tangent = theta.sign() / (theta.abs() + libm::sqrt(theta * theta + 1.0));
            let cosine = 1.0 / libm::sqrt(tangent * tangent + 1.0);
            let mut rotation = Matrix3::identity();
            rotation[(p, p)] = cosine;
            rotation[(q, q)] = cosine;
            rotation[(p, q)] = tangent * cosine;
            rotation[(q, p)] = -tangent * cosine;
            gram = rotation.tr_mul(&gram) * rotation;
        }
    }
    // Gershgorin: no eigenvalue exceeds the largest row sum of what is left.
    largest * libm::sqrt(max_row_sum(&gram)) * (1.0 + SPECTRAL_NORM * f64::EPSILON)
}

fn max_row_sum(matrix: &Matrix3<f64>) -> f64 {
    matrix.row_iter().fold(0.0_f64, |largest, row| largest.max(row.iter().map(|x| x.abs()).sum::<f64>()))
}
