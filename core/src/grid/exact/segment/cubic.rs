//! A cell's polynomial restricted to a line, and its minimum.
//!
//! ```text
//! φ(start + t d) = k₀ + k₁ t + k₂ t² + k₃ t³
//! k₀ = φ(start)    k₁ = ∇φ·d    k₂ = ½ dᵀH d = H_xy d_x d_y + H_yz d_y d_z + H_zx d_z d_x    k₃ = c_xyz d_x d_y d_z
//! ```

use nalgebra::Vector3;

use crate::grid::exact::polynomial::Polynomial;
use crate::number::{Float, Real};

/// The coefficients k₀ to k₃.
pub(in crate::grid::exact) struct Cubic<R>([R; 4]);

impl<R: Float> Cubic<R> {
    /// `start` counts from the cell's first corner.
    #[inline(always)]
    pub fn restrict(corners: [R; 8], start: Vector3<R>, direction: Vector3<R>) -> Self {
        let Polynomial { constant, linear, xy, yz, zx, xyz } = Polynomial::new(corners);
        let (x, y, z) = (linear.x, linear.y, linear.z);
        let (sx, sy, sz) = (start.x, start.y, start.z);
        let (dx, dy, dz) = (direction.x, direction.y, direction.z);
        let k0 = constant + x * sx + y * sy + z * sz + xy * sx * sy + yz * sy * sz + zx * sz * sx + xyz * sx * sy * sz;
        let k1 = (x + xy * sy + zx * sz + xyz * sy * sz) * dx
            + (y + xy * sx + yz * sz + xyz * sz * sx) * dy
            + (z + yz * sy + zx * sx + xyz * sx * sy) * dz;
        let k2 = (xy + xyz * sz) * dx * dy + (yz + xyz * sx) * dy * dz + (zx + xyz * sy) * dz * dx;
        Self([k0, k1, k2, xyz * dx * dy * dz])
    }

    #[inline(always)]
    fn value(&self, t: R) -> R {
        let [k0, k1, k2, k3] = self.0;
        k0 + t * (k1 + t * (k2 + t * k3))
    }

    /// The minimum over 0 ≤ t ≤ 1 as (t, value): at an end, or at the root of k₁ + 2k₂t + 3k₃t² with positive slope,
    ///
    /// t = (r − k₂) / (3k₃) = −k₁ / (k₂ + r),   r = √(k₂² − 3k₃k₁).
    ///
    /// The second form serves k₂ > 0, where the first would cancel (Higham 2002, §1.8). Without real roots r is NaN
    /// and every comparison below is false.
    #[inline(always)]
    pub fn minimum(&self) -> (R, R) {
        let [_, k1, k2, k3] = self.0;
        let (start, end) = (self.value(R::zero()), self.value(R::one()));
        let is_end = end < start;
        let (t, value) = (R::select(is_end, R::one(), R::zero()), R::select(is_end, end, start));
        let r = Real::sqrt(k2 * k2 - R::from_f64(3.0) * k3 * k1);
        let is_convex = R::zero() < k2;
        let numerator = R::select(is_convex, -k1, r - k2);
        let divisor = R::select(is_convex, k2 + r, R::from_f64(3.0) * k3);
        let root = numerator / divisor;
        let value_at_root = self.value(root);
        let is_lower = (R::zero() < numerator * divisor) & (numerator.abs() < divisor.abs()) & (value_at_root < value);
        (R::select(is_lower, root, t), R::select(is_lower, value_at_root, value))
    }
}
