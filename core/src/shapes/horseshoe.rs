use nalgebra::Vector3;

use super::fold::unfold_axis;
use super::is_length;
use super::profile::{Profile, corner, extrude};
use crate::number::Real;
use crate::{Aabb, EnclosedSdf, Sample, Sdf};

/// A bar bent to an arc around the origin in the plane of x and y, open towards +y, its ends running on as straight
/// legs, as thick along z as from −`half_depth` to `half_depth`: the shape of the paper's Fig. 3, extruded. Exact.
///
/// The arc runs from its lowest point (0, −radius) by `bend` to either side; π/2 makes a U. The gradient is a choice
/// on sharp edges and, inside, where two walls are equally near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Horseshoe {
    radius: f64,
    thickness: f64,
    leg: f64,
    half_depth: f64,
    sin: f64,
    cos: f64,
}

impl Horseshoe {
    /// `radius` runs to the middle of the bar, `thickness` < 2·radius is the bar's own in the plane, `leg` ≥ 0 the
    /// length of a leg, `bend` in radians more than 0 and less than π. Legs may not cross the plane x = 0.
    pub fn new(radius: f64, thickness: f64, bend: f64, leg: f64, half_depth: f64) -> Option<Self> {
        let (sin, cos) = libm::sincos(bend);
        let sound = [radius, thickness, half_depth, bend].into_iter().all(is_length)
            && leg.is_finite()
            && leg >= 0.0
            && bend < core::f64::consts::PI
            && thickness < 2.0 * radius
            && (radius - 0.5 * thickness) * sin + leg * cos >= 0.0;
        sound.then_some(Self { radius, thickness, leg, half_depth, sin, cos })
    }

    /// In the half-plane x ≥ 0, seen from the end of the arc: `outward` from the center, `along` the leg.
    #[inline]
    fn figure<R: Real>(&self, x: R, y: R) -> Profile<R> {
        let (sin, cos, radius) = (R::from_f64(self.sin), R::from_f64(self.cos), R::from_f64(self.radius));
        let half_thickness = R::from_f64(0.5 * self.thickness);
        let side = x.abs();
        let outward = side * sin - y * cos;
        let along = side * cos + y * sin;
        let beside_leg = R::zero().le(along);

        let from_center = Profile::from_point([side, y]);
        let across = R::select(beside_leg, outward, from_center.value) - radius;
        // From within the arc the leg's end is seen only where it lies straight ahead.
        let sees_end = beside_leg | (radius - half_thickness).le(outward);
        let from_end = R::select(sees_end, along - R::from_f64(self.leg), R::from_f64(-R::MAX_COORDINATE));
        let corner = corner([across.abs() - half_thickness, from_end]);

        let (by_across, on_middle) = unfold_axis(corner.gradient[0], across);
        let by_end = corner.gradient[1];
        let outward_gradient =
            [R::select(beside_leg, sin, from_center.gradient[0]), R::select(beside_leg, -cos, from_center.gradient[1])];
        let (by_x, on_symmetry) = unfold_axis(by_across * outward_gradient[0] + by_end * cos, x);
        let at_center = !beside_leg & from_center.degenerate;
        Profile {
            value: corner.value,
            gradient: [by_x, by_across * outward_gradient[1] + by_end * sin],
            degenerate: corner.degenerate | on_middle | on_symmetry | at_center,
        }
    }
}

impl Sdf for Horseshoe {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        extrude(self.figure(point.x, point.y), point.z, R::from_f64(self.half_depth))
    }

    fn bounds(&self, level: f64) -> Aabb {
        let outer = self.radius + 0.5 * self.thickness;
        let leg_end = [-0.5, 0.5].map(|side| {
            let across = self.radius + side * self.thickness;
            [across * self.sin + self.leg * self.cos, -across * self.cos + self.leg * self.sin]
        });
        let reach_x = leg_end.iter().fold(outer, |reach, [x, _]| reach.max(*x));
        let reach_y = leg_end.iter().fold(outer, |reach, [_, y]| reach.max(*y));
        Aabb { min: [-reach_x, -outer, -self.half_depth], max: [reach_x, reach_y, self.half_depth] }
            .inflate(level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }
}

impl EnclosedSdf for Horseshoe {}
