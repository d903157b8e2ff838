use nalgebra::Vector3;

use crate::number::Float;

/// A cell's trilinear interpolant by its coefficients, in shares of the cell's sides.
#[derive(Clone, Copy)]
pub(super) struct Polynomial<R: Float> {
    pub constant: R,
    /// Of x, y and z.
    pub linear: Vector3<R>,
    pub xy: R,
    pub yz: R,
    pub zx: R,
    pub xyz: R,
}

/// The second derivatives of a [`Polynomial`] at a place. Those along one axis twice are zero.
#[derive(Clone, Copy)]
pub(super) struct MixedDerivatives<R> {
    pub xy: R,
    pub yz: R,
    pub zx: R,
}

impl<R: Float> Polynomial<R> {
    #[cfg_attr(feature = "std", inline(always))]
    pub fn new([c000, c100, c010, c110, c001, c101, c011, c111]: [R; 8]) -> Self {
        let (x, y, z) = (c100 - c000, c010 - c000, c001 - c000);
        let (xy, zx, yz) = (c110 - c100 - y, c101 - c100 - z, c011 - c010 - z);
        let xyz = (c111 - c011) - (c101 - c001) - xy;
        Self { constant: c000, linear: Vector3::new(x, y, z), xy, yz, zx, xyz }
    }

    #[inline(always)]
    pub fn bends(&self, at: Vector3<R>) -> MixedDerivatives<R> {
        MixedDerivatives { xy: self.xy + self.xyz * at.z, yz: self.yz + self.xyz * at.x, zx: self.zx + self.xyz * at.y }
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub fn gradient(&self, at: Vector3<R>, bends: &MixedDerivatives<R>) -> Vector3<R> {
        Vector3::new(
            self.linear.x + bends.xy * at.y + self.zx * at.z,
            self.linear.y + self.xy * at.x + bends.yz * at.z,
            self.linear.z + self.zx * at.x + bends.yz * at.y,
        )
    }

    #[inline(always)]
    pub fn value(&self, at: Vector3<R>) -> R {
        let twist = (self.xy + self.xyz * at.z) * at.x * at.y;
        self.constant + self.linear.dot(&at) + twist + self.yz * at.y * at.z + self.zx * at.z * at.x
    }
}

impl<R: Float> MixedDerivatives<R> {
    /// How the gradient changes over a way.
    #[inline(always)]
    pub fn times(&self, way: Vector3<R>) -> Vector3<R> {
        Vector3::new(
            self.xy * way.y + self.zx * way.z,
            self.xy * way.x + self.yz * way.z,
            self.zx * way.x + self.yz * way.y,
        )
    }
}
