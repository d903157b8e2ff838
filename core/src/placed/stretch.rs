use nalgebra::{Matrix3, Vector3};

use super::{Placement, Pulled};
use crate::Aabb;
use crate::number::Real;
use crate::vector::from_f64;

/// A scale along each axis by its own factor, mirrored where that is negative.
///
/// A distance is multiplied by the smallest factor. The stretched field has the sign and the surface of the stretched
/// solid's distance and nowhere a larger magnitude, and is no steeper than it was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    factors: [f64; 3],
    inv_factor: [f64; 3],
    smallest: f64,
}

impl Stretch {
    /// `None` unless all factors and their reciprocals are finite.
    pub fn new(factors: [f64; 3]) -> Option<Self> {
        let inv_factor = factors.map(|factor| 1.0 / factor);
        let smallest = factors.iter().fold(f64::INFINITY, |least, factor| least.min(factor.abs()));
        let is_valid = factors.iter().chain(&inv_factor).all(|x| x.is_finite());
        is_valid.then_some(Self { factors, inv_factor, smallest })
    }
}

fn map(bounds: Aabb, factors: [f64; 3]) -> Aabb {
    let ends = |k: usize| [bounds.min[k] * factors[k], bounds.max[k] * factors[k]];
    Aabb {
        min: core::array::from_fn(|k| ends(k)[0].min(ends(k)[1])),
        max: core::array::from_fn(|k| ends(k)[0].max(ends(k)[1])),
    }
}

impl Placement for Stretch {
    #[inline]
    fn pull<R: Real>(&self, world_point: Vector3<R>) -> Pulled<R> {
        let inv_factor = from_f64(self.inv_factor);
        let point = world_point.component_mul(&inv_factor);
        Pulled { point, jacobian: Matrix3::from_diagonal(&inv_factor), scale: R::from_f64(self.smallest) }
    }

    fn push_bounds(&self, local: Aabb) -> Aabb {
        map(local, self.factors)
    }

    fn pull_bounds(&self, world: Aabb) -> Aabb {
        map(world, self.inv_factor)
    }

    fn slope_factor(&self) -> f64 {
        1.0
    }

    fn scale(&self) -> f64 {
        self.smallest
    }
}
