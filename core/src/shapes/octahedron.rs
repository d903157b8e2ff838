use nalgebra::Vector3;

use super::is_length;
use super::mirror::reflect_sample;
use crate::number::Real;
use crate::simplex::excess;
use crate::vector::direction;
use crate::{Aabb, EnclosedSdf, Sample, Sdf};

const SQRT_3: f64 = 1.732_050_807_568_877_2;

/// All points with |x| + |y| + |z| ≤ size. Exact.
///
/// In the octant of non-negative coordinates, p = |x|, the surface is the triangle p_x + p_y + p_z = size. The
/// nearest point of it is max(p − τ, 0), the projection onto a scaled simplex, with Σ max(p_i − τ, 0) = size
/// (`excess`). So
///
/// φ = |min(p, τ)| if τ > 0 (outside), else √3 τ.
///
/// Degenerate: the corners and, on the surface and inside, the coordinate planes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Octahedron {
    size: f64,
}

impl Octahedron {
    /// Distance of the corners from the origin.
    pub fn new(size: f64) -> Option<Self> {
        is_length(size).then_some(Self { size })
    }

    /// Distance of the corners from the origin.
    pub fn size(&self) -> f64 {
        self.size
    }
}

impl Sdf for Octahedron {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let folded = point.map(R::abs);
        let threshold = excess(folded.into(), R::from_f64(self.size));
        let outward = direction(folded.map(|x| x.min(threshold)));
        let is_inside = threshold.le(R::zero()) | outward.is_zero;
        let inside = Sample::new(threshold * R::from_f64(SQRT_3), Vector3::repeat(R::from_f64(1.0 / SQRT_3)));
        reflect_sample(Sample::select(is_inside, inside, Sample::new(outward.length, outward.unit)), point)
    }

    fn bounds(&self, level: f64) -> Aabb {
        Aabb::centered([self.size; 3]).inflate(level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }

    /// |x| + |y| + |z| − s has terms of the size of x near the surface.
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        R::zero()
    }
}

impl EnclosedSdf for Octahedron {
    const IS_CONVEX: bool = true;
}
