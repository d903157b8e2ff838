//! A solid cone, by the Voronoi regions of its profile.
//!
//! In the half-plane (ρ, z), with half angle α, height h and base radius R:
//!
//! ```text
//! side   s = ρ cos α + z sin α         beyond the side (s > 0) and above the apex:   φ = |(ρ, z)|
//! base   b = −h − z                    beyond the rim:                               φ = |(ρ − R, z + h)|
//!                                      else:                                         φ = max(s, b)
//! ```

use nalgebra::Vector3;

use super::is_length;
use super::profile::{Profile, revolve};
use crate::number::{Mask, Parameter, Real};
use crate::{Aabb, EnclosedSdf, Sample, Sdf};

/// A solid cone with its apex at the origin and its base at z = −`height`. Exact.
///
/// Degenerate: the apex, the rim and, inside, the axis and where side and base are equally near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    half_angle: f64,
    sin: Parameter,
    cos: Parameter,
    height: Parameter,
    base_radius: Parameter,
    slant: Parameter,
}

impl Cone {
    /// `half_angle` is the angle between axis and side in radians, 0 < `half_angle` < π/2.
    pub fn new(half_angle: f64, height: f64) -> Option<Self> {
        let (sin, cos) = libm::sincos(half_angle);
        let (base_radius, slant) = (height * sin / cos, height / cos);
        let is_valid = half_angle > 0.0 && half_angle < core::f64::consts::FRAC_PI_2;
        (is_valid && [sin, cos, height, base_radius, slant].into_iter().all(is_length)).then_some(Self {
            half_angle,
            sin: sin.into(),
            cos: cos.into(),
            height: height.into(),
            base_radius: base_radius.into(),
            slant: slant.into(),
        })
    }

    /// Angle between axis and side, in radians.
    pub fn half_angle(&self) -> f64 {
        self.half_angle
    }

    /// Distance from the apex to the base.
    pub fn height(&self) -> f64 {
        self.height.double
    }
}

impl Sdf for Cone {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let (sin, cos) = (R::from_parameter(self.sin), R::from_parameter(self.cos));
        let (height, base_radius) = (R::from_parameter(self.height), R::from_parameter(self.base_radius));
        revolve(point, |[rho, z]| {
            let side = Profile { value: rho * cos + z * sin, gradient: [cos, sin], is_degenerate: R::Mask::NONE };
            let base = Profile { value: -height - z, gradient: [R::zero(), -R::one()], is_degenerate: R::Mask::NONE };
            let mut nearest_wall = Profile::select(side.value.lt(base.value), base, side);
            nearest_wall.is_degenerate = side.value.le(base.value) & base.value.le(side.value);
            // Distance from the apex along the side.
            let along_side = rho * sin - z * cos;
            let is_past_side = R::zero().lt(side.value);
            let is_past_base = R::zero().lt(base.value);
            let is_apex_nearest = is_past_side & along_side.le(R::zero());
            let is_rim_nearest = (is_past_side & R::from_parameter(self.slant).lt(along_side) & base_radius.lt(rho))
                | (is_past_base & base_radius.lt(rho));
            // A root and divisions for the one that counts.
            let from_apex_or_rim = Profile::norm([
                R::select(is_apex_nearest, rho, rho - base_radius),
                R::select(is_apex_nearest, z, z + height),
            ]);
            Profile::select(is_apex_nearest | is_rim_nearest, from_apex_or_rim, nearest_wall)
        })
    }

    fn bounds(&self, level: f64) -> Aabb {
        let radius = self.base_radius.double;
        Aabb { min: [-radius, -radius, -self.height()], max: [radius, radius, 0.0] }.inflate(level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }

    /// The apex is at the origin: near the surface every sum has terms of the size of x.
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        R::zero()
    }
}

impl EnclosedSdf for Cone {
    const IS_CONVEX: bool = true;
}
