use nalgebra::Vector3;

use super::fold::unfold_axis;
use super::is_length;
use super::profile::{Profile, corner, revolve};
use crate::number::Real;
use crate::{Aabb, EnclosedSdf, Sample, Sdf};

/// A solid cylinder around z, from −`half_height` to `half_height`. Exact. The gradient is a choice on the rims and,
/// inside, on the axis and where side and end are equally near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    radius: f64,
    half_height: f64,
}

impl Cylinder {
    pub fn new(radius: f64, half_height: f64) -> Option<Self> {
        (is_length(radius) && is_length(half_height)).then_some(Self { radius, half_height })
    }
}

impl Sdf for Cylinder {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        revolve(point, |[from_axis, z]| {
            let corner = corner([from_axis - R::from_f64(self.radius), z.abs() - R::from_f64(self.half_height)]);
            let (axial, on_mid_plane) = unfold_axis(corner.gradient[1], z);
            Profile {
                value: corner.value,
                gradient: [corner.gradient[0], axial],
                degenerate: corner.degenerate | on_mid_plane,
            }
        })
    }

    fn bounds(&self, level: f64) -> Aabb {
        Aabb::centered([self.radius, self.radius, self.half_height]).inflate(level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }
}

impl EnclosedSdf for Cylinder {
    const IS_CONVEX: bool = true;
}
