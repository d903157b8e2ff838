use nalgebra::Vector3;

use crate::number::Real;
use crate::{Aabb, EnclosedSdf, ErrorBound, NearParts, Sample, Sdf};

/// A field whose contacts have its own gradient as normal, which on a grid jumps at the faces of cells. The code of smooth normals,
/// 2 KiB on a Cortex-M4F, is then not linked, nor is that of bounds in boxes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlainNormals<F>(pub F);

impl<F: Sdf> Sdf for PlainNormals<F> {
    const IS_SMOOTH_AS_IT_IS: bool = true;

    #[inline(always)]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        self.0.evaluate(point)
    }
    #[inline(always)]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        self.0.value(point)
    }
    fn bounds(&self, level: f64) -> Aabb {
        self.0.bounds(level)
    }
    #[inline(always)]
    fn slope_bound(&self) -> f64 {
        self.0.slope_bound()
    }
    #[inline(always)]
    fn slope_bound_as<R: Real>(&self) -> R {
        self.0.slope_bound_as()
    }
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        self.0.magnitude()
    }
    #[inline(always)]
    fn extent<R: Real>(&self) -> R {
        self.0.extent()
    }
    #[inline(always)]
    fn lowest_about<R: Real>(&self, point: Vector3<R>) -> R {
        self.0.lowest_about(point)
    }
}

impl<F: EnclosedSdf> EnclosedSdf for PlainNormals<F> {
    fn error_bound(&self, region: &Aabb) -> ErrorBound {
        self.0.error_bound(region)
    }
    #[inline(always)]
    fn evaluate_near<R: Real>(&self, point: Vector3<R>, near: &NearParts<R>) -> Sample<R> {
        self.0.evaluate_near(point, near)
    }
    #[inline(always)]
    fn narrow<R: Real>(&self, point: Vector3<R>, radius: R, near: &mut NearParts<R>) -> Sample<R> {
        self.0.narrow(point, radius, near)
    }
}
