//! A capsule: the points within a radius of a segment.

use nalgebra::Vector3;

use super::is_length;
use crate::number::Real;
use crate::vector::{direction, from_f64, largest_component};
use crate::{Aabb, EnclosedSdf, Sample, Sdf};

/// All points within `radius` of the segment from `a` to `b`: φ = |x − a − t (b − a)| − r, t = clamp((x − a)·(b − a)
/// / |b − a|², 0, 1) (Ericson 2005, "Real-Time Collision Detection", §5.1.2). Exact.
///
/// Degenerate: the segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    a: [f64; 3],
    b: [f64; 3],
    radius: f64,
    /// (b − a) / |b − a|², or zero if the ends coincide: t is its product with x − a.
    axis: [f64; 3],
    /// Largest coordinate of the ends.
    largest_coordinate: f64,
    /// Gradient on the segment: a unit vector normal to it.
    normal: [f64; 3],
}

impl Capsule {
    /// The ends may coincide.
    pub fn new(a: [f64; 3], b: [f64; 3], radius: f64) -> Option<Self> {
        let along = Vector3::from(b) - Vector3::from(a);
        let length_sq = along.dot(&along);
        let axis = if length_sq > 0.0 { along / length_sq } else { Vector3::zeros() };
        let side = along.cross(&Vector3::ith(along.iamin(), 1.0));
        let normal = if length_sq > 0.0 { side / libm::sqrt(side.dot(&side)) } else { Vector3::x() };
        let (axis, normal) = (axis.into(), normal.into());
        let is_valid = [a, b, axis, normal, [length_sq; 3]].iter().flatten().all(|x: &f64| x.is_finite());
        let largest_coordinate = largest_component::<f64>(a).max(largest_component(b));
        (is_valid && is_length(radius)).then_some(Self { a, b, radius, axis, largest_coordinate, normal })
    }

    /// One end of the segment.
    pub fn a(&self) -> [f64; 3] {
        self.a
    }

    /// The other end of the segment.
    pub fn b(&self) -> [f64; 3] {
        self.b
    }

    /// The radius.
    pub fn radius(&self) -> f64 {
        self.radius
    }
}

impl Sdf for Capsule {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let (a, b) = (from_f64::<R>(self.a), from_f64::<R>(self.b));
        let offset = point - a;
        let t = from_f64::<R>(self.axis).dot(&offset).clamp(R::zero(), R::one());
        let outward = direction(offset - (b - a) * t);
        let gradient =
            outward.unit.zip_map(&from_f64(self.normal), |unit, normal| R::select(outward.is_zero, normal, unit));
        Sample::with_degenerate(outward.length - R::from_f64(self.radius), gradient, outward.is_zero)
    }

    fn bounds(&self, level: f64) -> Aabb {
        let ends = Aabb { min: self.a, max: self.a }.union(&Aabb { min: self.b, max: self.b });
        ends.inflate(self.radius + level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }

    /// x − a, and the nearest point of the segment.
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        R::from_f64(self.largest_coordinate)
    }
}

impl EnclosedSdf for Capsule {
    const IS_CONVEX: bool = true;
}
