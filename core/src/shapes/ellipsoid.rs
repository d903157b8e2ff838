use nalgebra::Vector3;

use super::is_length;
use crate::number::Real;
use crate::vector::{direction, from_f64};
use crate::{Aabb, EnclosedSdf, Sample, Sdf};

/// An ellipsoid around the origin with its axes along x, y and z.
///
/// A bound, not a distance: φ = r·(|x/radii| − 1) with r the smallest radius. It has the sign and the surface of the
/// true distance, its magnitude is never larger, and its slope is nowhere above 1. Along the longest axis it is smaller
/// than the distance by as much as the radii differ. The gradient at the centre is a choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    radii: [f64; 3],
    smallest: f64,
}

impl Ellipsoid {
    pub fn new(radii: [f64; 3]) -> Option<Self> {
        let smallest = radii.into_iter().fold(f64::INFINITY, f64::min);
        radii.into_iter().all(is_length).then_some(Self { radii, smallest })
    }
}

impl Sdf for Ellipsoid {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        // 1 along the smallest axis, less along the others.
        let squeeze = from_f64(self.radii.map(|radius| self.smallest / radius));
        let squeezed = direction(point.component_mul(&squeeze));
        let gradient = squeezed.unit.component_mul(&squeeze);
        Sample::with_degenerate(squeezed.length - R::from_f64(self.smallest), gradient, squeezed.is_zero)
    }

    fn bounds(&self, level: f64) -> Aabb {
        let growth = 1.0 + level.max(0.0) / self.smallest;
        Aabb::centered(self.radii.map(|radius| radius * growth))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }
}

impl EnclosedSdf for Ellipsoid {
    const IS_CONVEX: bool = true;
}
