use nalgebra::Vector3;

use super::is_length;
use super::mirror::reflect_sample;
use super::profile::corner;
use crate::number::{Parameter, Real};
use crate::vector::from_parameters;
use crate::{Aabb, EnclosedSdf, Sample, Sdf};

/// A box around the origin with its sides along the axes: corner(|x| − h). Exact.
///
/// Degenerate: inside, where two walls are equally near, up to the edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    half_extents: [Parameter; 3],
}

impl Cuboid {
    /// Half the side lengths.
    pub fn new(half_extents: [f64; 3]) -> Option<Self> {
        half_extents.into_iter().all(is_length).then(|| Self { half_extents: half_extents.map(Parameter::from) })
    }

    /// Half the side lengths.
    pub fn half_extents(&self) -> [f64; 3] {
        self.half_extents.map(|extent| extent.double)
    }
}

impl Sdf for Cuboid {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let corner = corner((point.map(R::abs) - from_parameters(self.half_extents)).into());
        reflect_sample(Sample::with_degenerate(corner.value, corner.gradient.into(), corner.is_degenerate), point)
    }

    fn bounds(&self, level: f64) -> Aabb {
        Aabb::centered(self.half_extents()).inflate(level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }

    /// Near the surface an axis with |x_i| far from h_i is not the one that counts.
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        R::zero()
    }

    fn extent<R: Real>(&self) -> R {
        let [x, y, z] = self.half_extents.map(R::from_parameter);
        R::from_f64(2.0) * x.max(y).max(z)
    }
}

impl EnclosedSdf for Cuboid {
    const IS_CONVEX: bool = true;
}
