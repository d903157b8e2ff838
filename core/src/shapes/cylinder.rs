use nalgebra::Vector3;

use super::is_length;
use super::mirror::reflect_derivative;
use super::profile::{Profile, corner, revolve};
use crate::number::{Parameter, Real};
use crate::{Aabb, EnclosedSdf, Sample, Sdf};

/// A solid cylinder around z, from −`half_height` to `half_height`: corner(ρ − r, |z| − h). Exact.
///
/// Degenerate: the rims and, inside, the axis and where side and end are equally near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    radius: Parameter,
    half_height: Parameter,
}

impl Cylinder {
    /// Radius, and half the distance between the ends.
    pub fn new(radius: f64, half_height: f64) -> Option<Self> {
        (is_length(radius) && is_length(half_height))
            .then(|| Self { radius: radius.into(), half_height: half_height.into() })
    }

    /// The radius.
    pub fn radius(&self) -> f64 {
        self.radius.double
    }

    /// Half the distance between the ends.
    pub fn half_height(&self) -> f64 {
        self.half_height.double
    }
}

impl Sdf for Cylinder {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        revolve(point, |[rho, z]| {
            let corner = corner([rho - R::from_parameter(self.radius), z.abs() - R::from_parameter(self.half_height)]);
            let (axial, is_mid_plane) = reflect_derivative(corner.gradient[1], z);
            Profile {
                value: corner.value,
                gradient: [corner.gradient[0], axial],
                is_degenerate: corner.is_degenerate | is_mid_plane,
            }
        })
    }

    fn bounds(&self, level: f64) -> Aabb {
        Aabb::centered([self.radius(), self.radius(), self.half_height()]).inflate(level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }

    /// Near the surface an axis whose |x| is far from the size there is not the one that counts.
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        R::zero()
    }
}

impl EnclosedSdf for Cylinder {
    const IS_CONVEX: bool = true;
}
