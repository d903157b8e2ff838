use nalgebra::Vector3;

use super::is_length;
use super::profile::{Profile, revolve};
use crate::number::{Mask, Real};
use crate::{Aabb, EnclosedSdf, Sample, Sdf};

/// A solid cone with its apex at the origin and its base at z = −`height`. Exact. The gradient is a choice at the apex,
/// on the rim and, inside, on the axis and where side and base are equally near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    sin: f64,
    cos: f64,
    height: f64,
    base_radius: f64,
    slant: f64,
}

impl Cone {
    /// `half_angle` in radians between the axis and the side, more than 0 and less than π/2.
    pub fn new(half_angle: f64, height: f64) -> Option<Self> {
        let (sin, cos) = libm::sincos(half_angle);
        let (base_radius, slant) = (height * sin / cos, height / cos);
        let sound = half_angle > 0.0 && half_angle < core::f64::consts::FRAC_PI_2;
        (sound && [sin, cos, height, base_radius, slant].into_iter().all(is_length)).then_some(Self {
            sin,
            cos,
            height,
            base_radius,
            slant,
        })
    }
}

impl Sdf for Cone {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let (sin, cos) = (R::from_f64(self.sin), R::from_f64(self.cos));
        let (height, base_radius) = (R::from_f64(self.height), R::from_f64(self.base_radius));
        revolve(point, |[from_axis, z]| {
            let side = Profile { value: from_axis * cos + z * sin, gradient: [cos, sin], degenerate: R::Mask::NONE };
            let base = Profile { value: -height - z, gradient: [R::zero(), -R::one()], degenerate: R::Mask::NONE };
            let apex = Profile::from_point([from_axis, z]);
            let rim = Profile::from_point([from_axis - base_radius, z + height]);

            let mut nearest_wall = Profile::select(side.value.lt(base.value), base, side);
            nearest_wall.degenerate = side.value.le(base.value) & base.value.le(side.value);
            let down_the_side = from_axis * sin - z * cos;
            let past_side = R::zero().lt(side.value);
            let past_base = R::zero().lt(base.value);
            let at_apex = past_side & down_the_side.le(R::zero());
            let at_rim = (past_side & R::from_f64(self.slant).lt(down_the_side) & base_radius.lt(from_axis))
                | (past_base & base_radius.lt(from_axis));
            Profile::select(at_apex, apex, Profile::select(at_rim, rim, nearest_wall))
        })
    }

    fn bounds(&self, level: f64) -> Aabb {
        let radius = self.base_radius;
        Aabb { min: [-radius, -radius, -self.height], max: [radius, radius, 0.0] }.inflate(level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }
}

impl EnclosedSdf for Cone {
    const IS_CONVEX: bool = true;
}
