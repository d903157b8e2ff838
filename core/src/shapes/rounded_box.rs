use nalgebra::Vector3;

use super::Cuboid;
use crate::combine::Offset;
use crate::number::Real;
use crate::{Aabb, EnclosedSdf, Sample, Sdf};

/// A box with rounded edges and corners: that of [`Cuboid`] minus `radius`. Exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundedBox {
    inflated: Offset<Cuboid>,
}

impl RoundedBox {
    /// `half_extents` are those of the inner box, without `radius`, which may be zero.
    pub fn new(half_extents: [f64; 3], radius: f64) -> Option<Self> {
        let sharp = Cuboid::new(half_extents)?;
        (radius >= 0.0).then_some(Self { inflated: Offset::new(sharp, radius)? })
    }

    /// Half extents of the inner box, without the radius.
    pub fn half_extents(&self) -> [f64; 3] {
        self.inflated.field().half_extents()
    }

    /// Radius of the edges and corners.
    pub fn radius(&self) -> f64 {
        self.inflated.distance()
    }
}

impl Sdf for RoundedBox {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        self.inflated.evaluate(point)
    }

    fn bounds(&self, level: f64) -> Aabb {
        self.inflated.bounds(level)
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }

    /// Near the surface an axis with |x_i| far from h_i is not the one that counts.
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        R::zero()
    }
}

impl EnclosedSdf for RoundedBox {
    const IS_CONVEX: bool = true;
}
