//! A horseshoe: a bar bent to an arc with two straight legs (Quilez, "sdHorseshoe"), extruded.
//!
//! The shape is symmetric in x, so only x ≥ 0 is computed. The frame at the end of the arc has the axes `outward`
//! from the centre and `along` the leg:
//!
//! ```text
//! outward = x sin β − y cos β      along = x cos β + y sin β      β: bend
//! beside the leg (along ≥ 0):      across = outward − r
//! beside the arc:                  across = |(x, y)| − r
//! φ₂ = corner(|across| − thickness/2, along − leg),    φ = extrusion of φ₂
//! ```

use nalgebra::Vector3;

use super::is_length;
use super::mirror::reflect_derivative;
use super::profile::{Profile, corner, corner_bounds, extrude};
use crate::number::{Float, Real};
use crate::relaxation::AffineBounds;
use crate::{Aabb, EnclosedSdf, Enclosure, Relaxation, Sample, Sdf};

/// A bar bent to an arc around the origin in the plane of x and y, open toward +y, with straight legs, from
/// −`half_depth` to `half_depth` along z: the shape of Fig. 3 in Macklin et al. 2020, extruded. Exact.
///
/// The arc runs from its lowest point (0, −`radius`) by the angle `bend` to either side; π/2 makes a U.
///
/// Degenerate: sharp edges and, inside, where two walls are equally near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Horseshoe {
    radius: f64,
    thickness: f64,
    bend: f64,
    leg: f64,
    half_depth: f64,
    sin: f64,
    cos: f64,
}

impl Horseshoe {
    /// `radius` is that of the middle of the bar, `thickness` < 2 `radius` the bar's width in the plane, 0 < `bend` <
    /// π in radians, `leg` ≥ 0 the length of a leg. The legs must not cross the plane x = 0.
    pub fn new(radius: f64, thickness: f64, bend: f64, leg: f64, half_depth: f64) -> Option<Self> {
        let (sin, cos) = libm::sincos(bend);
        let is_valid = [radius, thickness, half_depth, bend].into_iter().all(is_length)
            && leg.is_finite()
            && leg >= 0.0
            && bend < core::f64::consts::PI
            && thickness < 2.0 * radius
            && (radius - 0.5 * thickness) * sin + leg * cos >= 0.0;
        is_valid.then_some(Self { radius, thickness, bend, leg, half_depth, sin, cos })
    }

    /// Radius of the middle of the bar.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// The bar's width in the plane.
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Angle of the arc to either side of its lowest point, in radians.
    pub fn bend(&self) -> f64 {
        self.bend
    }

    /// Length of a leg.
    pub fn leg(&self) -> f64 {
        self.leg
    }

    /// Half the extent along z.
    pub fn half_depth(&self) -> f64 {
        self.half_depth
    }

    /// φ₂.
    #[inline]
    fn profile<R: Real>(&self, x: R, y: R) -> Profile<R> {
        let (sin, cos, radius) = (R::from_f64(self.sin), R::from_f64(self.cos), R::from_f64(self.radius));
        let half_thickness = R::from_f64(0.5 * self.thickness);
        let side = x.abs();
        let outward = side * sin - y * cos;
        let along = side * cos + y * sin;
        let is_beside_leg = R::zero().le(along);

        let center = Profile::norm([side, y]);
        let across = R::select(is_beside_leg, outward, center.value) - radius;
        // Inside the arc the leg's end can be the nearest wall only where it lies straight ahead.
        let faces_end = is_beside_leg | (radius - half_thickness).le(outward);
        let end_distance = R::select(faces_end, along - R::from_f64(self.leg), R::from_f64(-R::MAX_COORDINATE));
        let corner = corner([across.abs() - half_thickness, end_distance]);

        let (by_across, is_middle) = reflect_derivative(corner.gradient[0], across);
        let by_end = corner.gradient[1];
        let outward_gradient =
            [R::select(is_beside_leg, sin, center.gradient[0]), R::select(is_beside_leg, -cos, center.gradient[1])];
        let (by_x, is_symmetry_plane) = reflect_derivative(by_across * outward_gradient[0] + by_end * cos, x);
        let is_center = !is_beside_leg & center.is_degenerate;
        Profile {
            value: corner.value,
            gradient: [by_x, by_across * outward_gradient[1] + by_end * sin],
            is_degenerate: corner.is_degenerate | is_middle | is_symmetry_plane | is_center,
        }
    }
}

impl Sdf for Horseshoe {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        extrude(self.profile(point.x, point.y), point.z, R::from_f64(self.half_depth))
    }

    fn bounds(&self, level: f64) -> Aabb {
        let outer = self.radius + 0.5 * self.thickness;
        let leg_end = [-0.5, 0.5].map(|side| {
            let across = self.radius + side * self.thickness;
            [across * self.sin + self.leg * self.cos, -across * self.cos + self.leg * self.sin]
        });
        let max_x = leg_end.iter().fold(outer, |max, [x, _]| max.max(*x));
        let max_y = leg_end.iter().fold(outer, |max, [_, y]| max.max(*y));
        Aabb { min: [-max_x, -outer, -self.half_depth], max: [max_x, max_y, self.half_depth] }.inflate(level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }

    /// |(x, y)| − r and the distance from the leg's end round at the size of r and of the leg, also near the centre of a thick bar.
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        R::from_f64(self.radius + self.leg)
    }
}

/// Bounds operation by operation (see `relaxation`). `across` is at least `outward` − r and at most |(x, y)| − r. Each is
/// attained on its side of the line `along` = 0. There both have the same value and gradient, so that a hull which meets it is
/// bounded by both with an error of second order.
impl EnclosedSdf for Horseshoe {
    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.relaxation(about, corners).enclosure
    }

    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        let [x, y, z] = AffineBounds::coordinates(about, corners);
        let figure = self.figure_bounds(x, y);
        let bar = corner_bounds([figure, z.abs().shift(R::from_f64(-self.half_depth))]);
        let size = self.radius + self.thickness + self.leg + self.half_depth;
        Relaxation::from_affine(self, bar, size, about, corners)
    }
}

impl Horseshoe {
    /// Bounds of φ₂.
    fn figure_bounds<R: Float>(&self, x: AffineBounds<R>, y: AffineBounds<R>) -> AffineBounds<R> {
        let (sin, cos, radius) = (R::from_f64(self.sin), R::from_f64(self.cos), R::from_f64(self.radius));
        let half_thickness = R::from_f64(0.5 * self.thickness);
        let side = x.abs();
        let outward = side.scale(sin).add(y.scale(-cos));
        let along = side.scale(cos).add(y.scale(sin));
        let center = AffineBounds::norm([x, y]);
        let is_beside_leg = R::zero() <= along.min_value();
        let across = match () {
            () if is_beside_leg => outward,
            () if along.max_value() < R::zero() => center,
            () => AffineBounds { upper: center.upper, ..outward },
        };
        let end = along.shift(R::from_f64(-self.leg));
        let may_face_end = R::zero() <= along.max_value() || radius - half_thickness <= outward.max_value();
        let faces_end = is_beside_leg || radius - half_thickness <= outward.min_value();
        let ignored = AffineBounds::constant(R::from_f64(-R::MAX_COORDINATE));
        let end = match () {
            () if faces_end => end,
            () if may_face_end => AffineBounds { upper: end.upper, ..ignored },
            () => ignored,
        };
        corner_bounds([across.shift(-radius).abs().shift(-half_thickness), end])
    }
}
