use nalgebra::Vector3;

use super::is_length;
use super::nearest::{minimum_at, nearest_to_axis};
use crate::number::{Float, Real};
use crate::vector::{direction, from_f64};
use crate::{Aabb, EnclosedSdf, ExactMinimum, Goal, Sample, Sdf, Simplex};

/// An ellipsoid around the origin with its axes along x, y and z.
///
/// A lower bound of the distance, not the distance: φ = r (|x / radii| − 1), with r the smallest radius and the
/// division by component. Sign and surface are exact. |x / radii| has a slope of at most 1 / r, so that |φ| never
/// exceeds the distance. Along the longest axis |φ| is smaller by the ratio of the radii.
///
/// Degenerate: the centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    radii: [f64; 3],
    /// r.
    smallest: f64,
}

impl Ellipsoid {
    /// Semi-axes along x, y and z.
    pub fn new(radii: [f64; 3]) -> Option<Self> {
        let smallest = radii.into_iter().fold(f64::INFINITY, f64::min);
        radii.into_iter().all(is_length).then_some(Self { radii, smallest })
    }

    /// Semi-axes along x, y and z.
    pub fn radii(&self) -> [f64; 3] {
        self.radii
    }

    /// Factors of the coordinates with which φ is |x| − r: 1 along the shortest axis, less along the others.
    #[inline(always)]
    fn squeeze<R: Real>(&self) -> Vector3<R> {
        from_f64(self.radii.map(|radius| self.smallest / radius))
    }
}

impl Sdf for Ellipsoid {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let squeeze = self.squeeze();
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

    /// Near the surface the squeezed length and the smallest radius are no larger than |x|.
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        R::zero()
    }
}

impl EnclosedSdf for Ellipsoid {
    const IS_CONVEX: bool = true;

    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        _goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        let squeezed = corners.map(|corner| corner.component_mul(&self.squeeze()));
        let weights = nearest_to_axis(squeezed, [Vector3::zeros(); 2])?;
        minimum_at(self, R::from_f64(self.smallest), &Simplex { corners }, weights)
    }
}
