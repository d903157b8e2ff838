use nalgebra::Vector3;

use super::fold::unfold;
use super::is_length;
use crate::number::Real;
use crate::simplex::excess;
use crate::vector::direction;
use crate::{Aabb, EnclosedSdf, Sample, Sdf};

const SQRT_3: f64 = 1.732_050_807_568_877_2;

/// All points with |x| + |y| + |z| ≤ size. Exact. The gradient is a choice at the corners and, on the surface and
/// inside, in the coordinate planes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Octahedron {
    size: f64,
}

impl Octahedron {
    pub fn new(size: f64) -> Option<Self> {
        is_length(size).then_some(Self { size })
    }
}

impl Sdf for Octahedron {
    /// In the octant of positive coordinates the surface is a triangle, and its nearest point is the point less the
    /// excess, where that leaves anything: the projection onto a simplex.
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let folded = point.map(R::abs);
        let excess = excess(folded.into(), R::from_f64(self.size));
        let from_surface = direction(folded.map(|x| x.min(excess)));
        let is_inside = excess.le(R::zero()) | from_surface.is_zero;
        let inside = Sample::new(excess * R::from_f64(SQRT_3), Vector3::repeat(R::from_f64(1.0 / SQRT_3)));
        unfold(Sample::select(is_inside, inside, Sample::new(from_surface.length, from_surface.unit)), point)
    }

    fn bounds(&self, level: f64) -> Aabb {
        Aabb::centered([self.size; 3]).inflate(level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }
}

impl EnclosedSdf for Octahedron {
    const IS_CONVEX: bool = true;
}
