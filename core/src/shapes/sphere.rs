use nalgebra::Vector3;

use super::is_length;
use crate::number::Real;
use crate::vector::direction;
use crate::{Aabb, EnclosedSdf, Sample, Sdf};

/// A ball around the origin. Exact. The gradient at the centre is a choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    radius: f64,
}

impl Sphere {
    pub fn new(radius: f64) -> Option<Self> {
        is_length(radius).then_some(Self { radius })
    }
}

impl Sdf for Sphere {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let from_center = direction(point);
        Sample::with_degenerate(from_center.length - R::from_f64(self.radius), from_center.unit, from_center.is_zero)
    }

    fn bounds(&self, level: f64) -> Aabb {
        Aabb::centered([self.radius; 3]).inflate(level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }
}

impl EnclosedSdf for Sphere {
    const IS_CONVEX: bool = true;
}
