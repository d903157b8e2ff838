//! Scale by a factor of its own along each axis: x = diag(f) p.

use nalgebra::{Matrix3, Vector3};

use super::{LocalPoint, Placement};
use crate::Aabb;
use crate::number::Real;
use crate::vector::from_f64;

/// A scale by a factor of its own along each axis; a negative factor also mirrors.
///
/// With m the smallest |f|, φ_w = m φ(p). |p(x) − p(y)| ≤ |x − y| / m, so s ‖J‖ ≤ 1 and |φ_w| never exceeds the
/// distance to the stretched surface. Sign and surface are exact, the magnitude is a lower bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    factors: [f64; 3],
    inv_factors: [f64; 3],
    /// Smallest |f|.
    smallest: f64,
}

impl Stretch {
    /// `None` unless all factors and their reciprocals are finite.
    pub fn new(factors: [f64; 3]) -> Option<Self> {
        let inv_factors = factors.map(|factor| 1.0 / factor);
        let smallest = factors.iter().fold(f64::INFINITY, |smallest, factor| smallest.min(factor.abs()));
        let is_valid = factors.iter().chain(&inv_factors).all(|x| x.is_finite());
        is_valid.then_some(Self { factors, inv_factors, smallest })
    }

    /// The factor along each axis.
    pub fn factors(&self) -> [f64; 3] {
        self.factors
    }
}

/// The image of a box under diag(`factors`).
fn map(bounds: Aabb, factors: [f64; 3]) -> Aabb {
    let ends = |k: usize| [bounds.min[k] * factors[k], bounds.max[k] * factors[k]];
    Aabb {
        min: core::array::from_fn(|k| ends(k)[0].min(ends(k)[1])),
        max: core::array::from_fn(|k| ends(k)[0].max(ends(k)[1])),
    }
}

impl Placement for Stretch {
    #[inline]
    fn pull<R: Real>(&self, world_point: Vector3<R>) -> LocalPoint<R> {
        let inv_factors = from_f64(self.inv_factors);
        let point = world_point.component_mul(&inv_factors);
        LocalPoint { point, jacobian: Matrix3::from_diagonal(&inv_factors), scale: R::from_f64(self.smallest) }
    }

    fn push_bounds(&self, local: Aabb) -> Aabb {
        map(local, self.factors)
    }

    fn pull_bounds(&self, world: Aabb) -> Aabb {
        map(world, self.inv_factors)
    }

    fn slope_factor(&self) -> f64 {
        1.0
    }

    fn scale(&self) -> f64 {
        self.smallest
    }

    fn largest_scale(&self) -> f64 {
        self.factors.iter().fold(0.0, |largest, factor| largest.max(factor.abs()))
    }

    fn extent<R: Real>(&self, local: R, bounds: impl FnOnce() -> Aabb) -> R {
        let longest_side = self.push_bounds(bounds()).longest_side();
        R::from_f64(longest_side).min(local * R::from_f64(self.largest_scale()))
    }

    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        R::zero()
    }
}
