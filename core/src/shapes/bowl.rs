use nalgebra::Vector3;

use super::is_length;
use super::profile::{Profile, revolve};
use crate::number::Real;
use crate::{Aabb, EnclosedSdf, Sample, Sdf};

/// A hollow sphere around the origin, cut open above z = `cut_height`, with a wall that is rounded at the rim. Exact
/// outside, and inside as long as the wall does not fill the hollow; else a bound there.
/// The gradient is a choice in the middle of the wall, at the centre and, above the cut, on the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bowl {
    radius: f64,
    cut_height: f64,
    thickness: f64,
    rim_radius: f64,
}

impl Bowl {
    /// `radius` runs to the middle of the wall, `thickness` is the wall's own; −radius < `cut_height` < radius.
    pub fn new(radius: f64, cut_height: f64, thickness: f64) -> Option<Self> {
        let rim_radius = libm::sqrt(radius * radius - cut_height * cut_height);
        let sound = [radius, thickness, rim_radius].into_iter().all(is_length) && cut_height.is_finite();
        sound.then_some(Self { radius, cut_height, thickness, rim_radius })
    }
}

impl Sdf for Bowl {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let (rim_radius, cut_height) = (R::from_f64(self.rim_radius), R::from_f64(self.cut_height));
        revolve(point, |[from_axis, z]| {
            let away = Profile::from_point([from_axis, z]);
            // At the centre the wall's lowest point is as near as any, whatever the cut.
            let down = Profile { gradient: [R::zero(), -R::one()], ..away };
            let from_center = Profile::select(away.degenerate, down, away);
            let from_wall = from_center.value - R::from_f64(self.radius);
            let wall = Profile {
                value: from_wall.abs(),
                gradient: from_center.gradient.map(|derivative| derivative * from_wall.sign()),
                degenerate: from_center.degenerate | from_wall.is_zero(),
            };
            let rim = Profile::from_point([from_axis - rim_radius, z - cut_height]);
            let above_cut = (cut_height * from_axis).lt(rim_radius * z);
            let middle = Profile::select(above_cut, rim, wall);
            Profile { value: middle.value - R::from_f64(0.5 * self.thickness), ..middle }
        })
    }

    fn bounds(&self, level: f64) -> Aabb {
        let widest = if self.cut_height < 0.0 { self.rim_radius } else { self.radius };
        Aabb { min: [-widest, -widest, -self.radius], max: [widest, widest, self.cut_height] }
            .inflate(0.5 * self.thickness + level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }
}

impl EnclosedSdf for Bowl {}
