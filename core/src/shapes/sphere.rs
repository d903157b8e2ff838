use nalgebra::Vector3;

use super::is_length;
use super::nearest::{minimum_at, nearest_to_axis};
use crate::number::{Float, Parameter, Real};
use crate::vector::direction;
use crate::{Aabb, EnclosedSdf, ExactMinimum, Goal, Sample, Sdf, Simplex};

/// A ball around the origin: φ = |x| − r. Exact.
///
/// Degenerate: the centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    radius: Parameter,
}

impl Sphere {
    /// A positive radius.
    pub fn new(radius: f64) -> Option<Self> {
        is_length(radius).then_some(Self { radius: radius.into() })
    }

    /// The radius.
    pub fn radius(&self) -> f64 {
        self.radius.double
    }
}

impl Sdf for Sphere {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let outward = direction(point);
        Sample::with_degenerate(outward.length - R::from_parameter(self.radius), outward.unit, outward.is_zero)
    }

    fn bounds(&self, level: f64) -> Aabb {
        Aabb::centered([self.radius(); 3]).inflate(level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }

    /// |x| − r has terms of the size of x near the surface.
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        R::zero()
    }

    fn extent<R: Real>(&self) -> R {
        R::from_f64(2.0) * R::from_parameter(self.radius)
    }
}

impl EnclosedSdf for Sphere {
    const IS_CONVEX: bool = true;

    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        _goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        let weights = nearest_to_axis(corners, [Vector3::zeros(); 2])?;
        minimum_at(self, R::from_parameter(self.radius), &Simplex { corners }, weights)
    }
}
