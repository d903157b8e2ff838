//! A capsule: the points within a radius of a segment.

use nalgebra::Vector3;

use super::is_length;
use super::nearest::{minimum_at, nearest_to_axis};
use crate::number::{Float, Parameter, Real};
use crate::vector::{direction, from_parameters, largest_component};
use crate::{Aabb, EnclosedSdf, ExactMinimum, Goal, Sample, Sdf, Simplex};

/// All points within `radius` of the segment from `a` to `b`: φ = |x − a − t (b − a)| − r, t = clamp((x − a)·(b − a)
/// / |b − a|², 0, 1) (Ericson 2005, "Real-Time Collision Detection", §5.1.2). Exact.
///
/// Degenerate: the segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    a: [Parameter; 3],
    b: [Parameter; 3],
    radius: Parameter,
    /// (b − a) / |b − a|², or zero if the ends coincide: t is its product with x − a.
    axis: [Parameter; 3],
    /// Largest coordinate of the ends.
    largest_coordinate: Parameter,
    /// Gradient on the segment: a unit vector normal to it.
    normal: [Parameter; 3],
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
        let largest_coordinate = largest_component::<f64>(a.into()).max(largest_component(b.into()));
        let parameters = |vector: [f64; 3]| vector.map(Parameter::from);
        (is_valid && is_length(radius)).then(|| Self {
            a: parameters(a),
            b: parameters(b),
            radius: radius.into(),
            axis: parameters(axis),
            largest_coordinate: largest_coordinate.into(),
            normal: parameters(normal),
        })
    }

    /// One end of the segment.
    pub fn a(&self) -> [f64; 3] {
        self.a.map(|x| x.double)
    }

    /// The other end of the segment.
    pub fn b(&self) -> [f64; 3] {
        self.b.map(|x| x.double)
    }

    /// The radius.
    pub fn radius(&self) -> f64 {
        self.radius.double
    }
}

impl Sdf for Capsule {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let (a, b) = (from_parameters::<R>(self.a), from_parameters::<R>(self.b));
        let (offset, segment, axis) = (point - a, b - a, from_parameters::<R>(self.axis));
        let t = axis.dot(&offset);
        let from_segment = offset - segment * t.clamp(R::zero(), R::one());
        // Near the axis the offset is mere rounding, and may point along it.
        let is_beside = R::zero().le(t) & t.le(R::one());
        let along = R::select(is_beside, axis.dot(&from_segment), R::zero());
        let outward = direction(from_segment - segment * along);
        let gradient = outward
            .unit
            .zip_map(&from_parameters(self.normal), |unit, normal| R::select(outward.is_zero, normal, unit));
        Sample::with_degenerate(outward.length - R::from_parameter(self.radius), gradient, outward.is_zero)
    }

    fn bounds(&self, level: f64) -> Aabb {
        let ends = Aabb { min: self.a(), max: self.a() }.union(&Aabb { min: self.b(), max: self.b() });
        ends.inflate(self.radius() + level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }

    /// x − a, and the nearest point of the segment.
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        R::from_parameter(self.largest_coordinate)
    }
}

impl EnclosedSdf for Capsule {
    const IS_CONVEX: bool = true;

    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        _goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        let weights = nearest_to_axis(corners, [from_parameters(self.a), from_parameters(self.b)])?;
        minimum_at(self, R::from_parameter(self.radius), &Simplex { corners }, weights)
    }
}
