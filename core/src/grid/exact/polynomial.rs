//! A cell's trilinear interpolant as a polynomial, and its derivatives.
//!
//! ```text
//! φ(x, y, z) = constant + linear·(x, y, z) + c_xy xy + c_yz yz + c_zx zx + c_xyz xyz,   0 ≤ x, y, z ≤ 1
//!
//!     ⎡ 0     H_xy  H_zx ⎤      H_xy = c_xy + c_xyz z
//! H = ⎢ H_xy  0     H_yz ⎥      H_yz = c_yz + c_xyz x
//!     ⎣ H_zx  H_yz  0    ⎦      H_zx = c_zx + c_xyz y
//! ```

use nalgebra::Vector3;

use crate::number::Float;

/// The coefficients. Positions count from the cell's first corner.
#[derive(Clone, Copy)]
pub(super) struct Polynomial<R: Float> {
    pub constant: R,
    /// Coefficients of x, y and z.
    pub linear: Vector3<R>,
    pub xy: R,
    pub yz: R,
    pub zx: R,
    pub xyz: R,
}

/// The Hessian H at a position: its three entries off the diagonal.
#[derive(Clone, Copy)]
pub(super) struct MixedDerivatives<R> {
    pub xy: R,
    pub yz: R,
    pub zx: R,
}

impl<R: Float> Polynomial<R> {
    /// From the corner values, in the order of [`Storage::corners`](crate::grid::Storage::corners).
    #[cfg_attr(feature = "std", inline(always))]
    pub fn new([c000, c100, c010, c110, c001, c101, c011, c111]: [R; 8]) -> Self {
        let (x, y, z) = (c100 - c000, c010 - c000, c001 - c000);
        let (xy, zx, yz) = (c110 - c100 - y, c101 - c100 - z, c011 - c010 - z);
        let xyz = (c111 - c011) - (c101 - c001) - xy;
        Self { constant: c000, linear: Vector3::new(x, y, z), xy, yz, zx, xyz }
    }

    #[inline(always)]
    pub fn mixed_derivatives(&self, x: Vector3<R>) -> MixedDerivatives<R> {
        MixedDerivatives { xy: self.xy + self.xyz * x.z, yz: self.yz + self.xyz * x.x, zx: self.zx + self.xyz * x.y }
    }

    /// ∇φ at `x`, with `mixed` the derivatives there.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn gradient(&self, x: Vector3<R>, mixed: &MixedDerivatives<R>) -> Vector3<R> {
        Vector3::new(
            self.linear.x + mixed.xy * x.y + self.zx * x.z,
            self.linear.y + self.xy * x.x + mixed.yz * x.z,
            self.linear.z + self.zx * x.x + mixed.yz * x.y,
        )
    }

    #[inline(always)]
    pub fn value(&self, x: Vector3<R>) -> R {
        let xy_terms = (self.xy + self.xyz * x.z) * x.x * x.y;
        self.constant + self.linear.dot(&x) + xy_terms + self.yz * x.y * x.z + self.zx * x.z * x.x
    }
}

impl<R: Float> MixedDerivatives<R> {
    /// H · `direction`.
    #[inline(always)]
    pub fn times(&self, direction: Vector3<R>) -> Vector3<R> {
        Vector3::new(
            self.xy * direction.y + self.zx * direction.z,
            self.xy * direction.x + self.yz * direction.z,
            self.zx * direction.x + self.yz * direction.y,
        )
    }
}
