use nalgebra::Vector3;

use super::is_length;
use crate::real::{Float, Real};
use crate::survey::rises_of_convex;
use crate::vector::direction;
use crate::{Aabb, Sample, Sdf, Survey};

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
        Sample::with_degenerate(from_center.length - R::lift(self.radius), from_center.unit, from_center.is_zero)
    }

    fn bounds(&self, level: f64) -> Aabb {
        Aabb::centered([self.radius; 3]).inflate(level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }

    fn survey<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Survey<R> {
        Survey::of_convex(self, about, corners)
    }

    fn is_convex_on<R: Float>(&self, _corners: &[Vector3<R>]) -> bool {
        true
    }

    fn rises<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        rises_of_convex(self, corners)
    }

    fn linearization_error(&self, _region: &Aabb) -> f64 {
        0.0
    }
}
