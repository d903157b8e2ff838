use nalgebra::Vector3;

use crate::number::{Float, Parameter, Real};
use crate::simplex::corner_weights;
use crate::vector::from_parameters;
use crate::{Aabb, EnclosedSdf, ExactMinimum, Goal, Sample, Sdf};

/// All points with n·x ≤ offset, |n| = 1: φ = n·x − offset. Exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// The normal as given: to normalize it again from the unit normal could change its last bit.
    given_normal: [f64; 3],
    normal: [Parameter; 3],
    offset: Parameter,
}

impl HalfSpace {
    /// `normal` points outward and is normalized; `None` if it is zero. `offset` is the distance of the surface from
    /// the origin along it.
    pub fn new(normal: [f64; 3], offset: f64) -> Option<Self> {
        let largest = normal.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let is_valid = normal.iter().all(|x| x.is_finite()) && largest > 0.0 && offset.is_finite();
        is_valid.then(|| {
            // Divided by the largest component first, so that no square underflows or overflows.
            let scaled = Vector3::from(normal) / largest;
            let unit: [f64; 3] = (scaled / libm::sqrt(scaled.dot(&scaled))).into();
            Self { given_normal: normal, normal: unit.map(Parameter::from), offset: offset.into() }
        })
    }

    /// The normal as it was given, of any length.
    pub fn given_normal(&self) -> [f64; 3] {
        self.given_normal
    }

    /// Distance of the surface from the origin along the unit normal.
    pub fn offset(&self) -> f64 {
        self.offset.double
    }
}

impl Sdf for HalfSpace {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let normal = from_parameters(self.normal);
        Sample::new(normal.dot(&point) - R::from_parameter(self.offset), normal)
    }

    fn bounds(&self, _level: f64) -> Aabb {
        Aabb::EVERYWHERE
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }

    /// n·x − offset has terms of the size of x near the surface.
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        R::zero()
    }
}

impl EnclosedSdf for HalfSpace {
    const IS_CONVEX: bool = true;

    /// The lowest corner.
    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        _goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        let (mut lowest, mut value) = (0, R::from_f64(f64::INFINITY));
        for (index, corner) in corners.iter().enumerate() {
            let here = self.value(*corner);
            (lowest, value) = if here < value { (index, here) } else { (lowest, value) };
        }
        let weights = corner_weights(lowest);
        value.is_finite().then_some(ExactMinimum { weights, value, lower_bound: value, evaluations: 1 })
    }
}
