//! Lower bounds of f = max(φ_A, φ_B) in a box, from what the fields enclose there and one evaluation of both at its
//! centre.
//!
//! Three bounds, and the highest counts. With half extents h and centre c:
//! - without an evaluation: the higher of both lower bounds ([`EnclosedSdf::enclose_box`]);
//! - by slope: max over both fields of φ(c) − slope_bound · |h|;
//! - by tangents: f ≥ t a + (1 − t) b − |t g_A + (1 − t) g_B|·h for every t in \[0, 1\]. Here g are the gradients at c,
//!   and a, b the values there less the errors of both tangents ([`EnclosedSdf::linearization_error`]). Where the
//!   fields push against each other, its error is of second order in h.

use core::array::from_fn;

use nalgebra::Vector3;

use super::{OverlapPoint, Pair};
use crate::number::{Float, Real};
use crate::rounding::{FieldScale, rounding};
use crate::vector::{from_f64, norm};
use crate::{Aabb, BoxEnclosure, EnclosedSdf};

/// A pair queried in one number type.
pub(super) struct PairQuery<'p, R, A, B> {
    pub pair: &'p Pair<'p, A, B>,
    /// Bound of the rounding of a value or a bound of either field in the region.
    pub rounding: R,
    pub margin: R,
}

/// Bounds of a box, and both fields at its centre.
pub(super) struct BoxBound<R: Real> {
    /// Lower bound of f in the box.
    pub lower_bound: R,
    /// φ_A − φ_B is proven not to be zero in the box.
    pub excludes_middle: bool,
    /// `None` if the bounds without an evaluation were enough.
    pub center: Option<OverlapPoint<R>>,
    margin: R,
}

impl<R: Float> BoxBound<R> {
    /// False only if f is proven to be above the margin in the box.
    pub fn may_touch(&self) -> bool {
        let is_above = self.margin < self.lower_bound;
        !is_above
    }
}

impl<'p, R: Float, A: EnclosedSdf, B: EnclosedSdf> PairQuery<'p, R, A, B> {
    pub fn new(pair: &'p Pair<'p, A, B>) -> Self {
        Self::evaluating(pair, [true; 2])
    }

    /// A query that evaluates only the fields for which `may_evaluate` is true.
    pub fn evaluating(pair: &'p Pair<'p, A, B>, may_evaluate: [bool; 2]) -> Self {
        Self { pair, rounding: pair.rounding_at_corners(may_evaluate), margin: R::from_f64(pair.margin) }
    }

    /// False only if f is proven to be above the margin in a box: by the slope of the fields that may be evaluated, and
    /// by the box enclosure of both.
    pub fn may_touch_by_slope(&self, region: &Aabb, may_evaluate: [bool; 2]) -> bool {
        let center = center(region);
        let distance = R::from_f64(0.5 * region.diagonal());
        let by_slope = |enclosure: BoxEnclosure, value: R| value - distance * R::from_f64(enclosure.slope_bound);
        let (a, b) = (self.pair.a, self.pair.b);
        let [enclosure_a, enclosure_b] = [a.enclose_box(region), b.enclose_box(region)];
        let mut lower_bound = R::from_f64(enclosure_a.range.lower.max(enclosure_b.range.lower));
        if may_evaluate[0] {
            lower_bound = Real::max(lower_bound, by_slope(enclosure_a, a.value(center)));
        }
        if may_evaluate[1] {
            lower_bound = Real::max(lower_bound, by_slope(enclosure_b, b.value(center)));
        }
        let is_above = self.margin < lower_bound - self.rounding;
        !is_above
    }

    /// Both fields at a point, which is moved into the region if it lies outside.
    pub fn evaluate(&self, point: Vector3<R>) -> OverlapPoint<R> {
        let [min, max] = [self.pair.region.min, self.pair.region.max].map(from_f64::<R>);
        let point = point.zip_zip_map(&min, &max, Real::clamp);
        OverlapPoint::new(point, self.pair.a.evaluate(point), self.pair.b.evaluate(point))
    }

    pub fn bound(&self, region: &Aabb) -> BoxBound<R> {
        let (a, b) = (self.pair.a, self.pair.b);
        let [enclosure_a, enclosure_b] = [a.enclose_box(region), b.enclose_box(region)];
        let by_enclosure = R::from_f64(enclosure_a.range.lower.max(enclosure_b.range.lower)) - self.rounding;
        let bound = BoxBound { lower_bound: by_enclosure, excludes_middle: false, center: None, margin: self.margin };
        if !bound.may_touch() {
            return bound;
        }
        let center = self.evaluate(center(region));
        if !center.is_finite() {
            return BoxBound { lower_bound: R::from_f64(f64::NEG_INFINITY), center: Some(center), ..bound };
        }
        let half: Vector3<R> = from_f64(region.extents().map(|extent| 0.5 * extent));
        let distance = norm(half);
        let max_change = |enclosure: &BoxEnclosure| distance * R::from_f64(enclosure.slope_bound);
        let [lower_a, lower_b] = [center.a.value - max_change(&enclosure_a), center.b.value - max_change(&enclosure_b)];
        let by_slope = Real::max(lower_a, lower_b) - self.rounding;
        let lower_bound = Real::max(by_enclosure, by_slope);
        let difference = (center.a.value - center.b.value).abs();
        let excludes_middle = enclosure_a.range.lower > enclosure_b.range.upper
            || enclosure_b.range.lower > enclosure_a.range.upper
            || max_change(&enclosure_a) + max_change(&enclosure_b) + self.rounding * R::from_f64(2.0) < difference;
        let bound = BoxBound { lower_bound, excludes_middle, center: Some(center), margin: self.margin };
        if bound.may_touch() {
            BoxBound { lower_bound: Real::max(lower_bound, self.bound_by_tangents(region, half, &center)), ..bound }
        } else {
            bound
        }
    }

    /// The third bound of the module's header. It is concave in t, and linear but for those t at which a component of t
    /// g_A + (1 − t) g_B is zero. So its maximum is at one of these or at an end.
    fn bound_by_tangents(&self, region: &Aabb, half: Vector3<R>, center: &OverlapPoint<R>) -> R {
        let errors = [self.pair.a.linearization_error(region), self.pair.b.linearization_error(region)];
        let [a, b] = [center.a.value - R::from_f64(errors[0]), center.b.value - R::from_f64(errors[1])];
        let [gradient_a, gradient_b] = [center.a.gradient, center.b.gradient];
        let bound = |value: R, gradient: Vector3<R>| value - gradient.map(R::abs).dot(&half);
        let mut best = Real::max(bound(a, gradient_a), bound(b, gradient_b));
        if !errors.iter().all(|error| error.is_finite()) {
            return best - self.rounding;
        }
        for (slope_a, slope_b) in gradient_a.iter().copied().zip(gradient_b.iter().copied()) {
            if slope_a * slope_b < R::zero() {
                let (t_a, t_b) = (slope_b / (slope_b - slope_a), slope_a / (slope_a - slope_b));
                best = Real::max(best, bound(a * t_a + b * t_b, gradient_a * t_a + gradient_b * t_b));
            }
        }
        best - self.rounding
    }
}

fn center<R: Real>(region: &Aabb) -> Vector3<R> {
    from_f64(from_fn(|axis| 0.5 * (region.min[axis] + region.max[axis])))
}

impl<A: EnclosedSdf, B: EnclosedSdf> Pair<'_, A, B> {
    /// Rounding of a value of this size at any point of the region.
    fn rounding<R: Float>(&self, value: R) -> R {
        let scale = FieldScale::new(self.a).max(FieldScale::new(self.b));
        let diagonal = R::from_f64(self.region.diagonal());
        [self.region.min, self.region.max]
            .map(|corner| rounding(scale, from_f64(corner), diagonal, value))
            .into_iter()
            .fold(R::zero(), Real::max)
    }

    /// [`Self::rounding`], and that of the frames that the fields are placed in: twice the largest width of the
    /// enclosure of a single point, over the corners of the region.
    fn rounding_at_corners<R: Float>(&self, may_evaluate: [bool; 2]) -> R {
        let Aabb { min, max } = self.region;
        let mut largest = self.rounding(R::zero());
        for corner in 0..8_u32 {
            let point = from_fn(|axis| if corner.wrapping_shr(axis as u32) & 1 == 0 { min[axis] } else { max[axis] });
            let a = may_evaluate[0].then(|| self.a.enclosure::<R>(from_f64(point), &[from_f64(point)]));
            let b = may_evaluate[1].then(|| self.b.enclosure(from_f64(point), &[from_f64(point)]));
            for enclosure in a.into_iter().chain(b) {
                let width = (enclosure.value - enclosure.range.lower) + self.rounding(enclosure.value);
                // Skips NaN.
                largest = if width.is_finite() { Real::max(largest, width) } else { largest };
            }
        }
        largest * R::from_f64(2.0)
    }
}
