use nalgebra::Vector3;

use super::is_length;
use crate::number::Real;
use crate::vector::{direction, from_f64};
use crate::{Aabb, EnclosedSdf, Sample, Sdf};

/// All points within `radius` of the segment from `a` to `b`. Exact. The gradient on the segment is a choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    a: [f64; 3],
    b: [f64; 3],
    radius: f64,
    /// (b − a) / |b − a|², or zero where the ends coincide: a point's share of the way is its product with this.
    share: [f64; 3],
    /// The gradient on the segment, of unit length: across it.
    across: [f64; 3],
}

impl Capsule {
    pub fn new(a: [f64; 3], b: [f64; 3], radius: f64) -> Option<Self> {
        let along = Vector3::from(b) - Vector3::from(a);
        let length_sq = along.dot(&along);
        let share = if length_sq > 0.0 { along / length_sq } else { Vector3::zeros() };
        let side = along.cross(&Vector3::ith(along.iamin(), 1.0));
        let across = if length_sq > 0.0 { side / libm::sqrt(side.dot(&side)) } else { Vector3::x() };
        let (share, across) = (share.into(), across.into());
        let sound = [a, b, share, across, [length_sq; 3]].iter().flatten().all(|x: &f64| x.is_finite());
        (sound && is_length(radius)).then_some(Self { a, b, radius, share, across })
    }
}

impl Sdf for Capsule {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let (a, b) = (from_f64::<R>(self.a), from_f64::<R>(self.b));
        let from_a = point - a;
        let share = from_f64::<R>(self.share).dot(&from_a).clamp(R::zero(), R::one());
        let from_axis = direction(from_a - (b - a) * share);
        let outward =
            from_axis.unit.zip_map(&from_f64(self.across), |unit, across| R::select(from_axis.is_zero, across, unit));
        Sample::with_degenerate(from_axis.length - R::from_f64(self.radius), outward, from_axis.is_zero)
    }

    fn bounds(&self, level: f64) -> Aabb {
        let ends = Aabb { min: self.a, max: self.a }.union(&Aabb { min: self.b, max: self.b });
        ends.inflate(self.radius + level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }
}

impl EnclosedSdf for Capsule {
    const IS_CONVEX: bool = true;
}
