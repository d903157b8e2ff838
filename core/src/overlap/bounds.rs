use nalgebra::Vector3;

use super::{OverlapPoint, Pair};
use crate::number::{Float, Real};
use crate::rounding::rounding;
use crate::vector::{from_f64, norm};
use crate::{Aabb, BoxEnclosure, EnclosedSdf};

/// A pair that is asked in one number type.
pub(super) struct Asked<'p, R, A, B> {
    pub pair: &'p Pair<'p, A, B>,
    /// More than a value or a bound of either field in the region is off by rounding.
    pub rounding: R,
    pub margin: R,
}

/// What is certain in a box, and what was seen at its middle.
pub(super) struct Look<R: Real> {
    /// max(φ_A, φ_B) is nowhere in the box below this.
    pub least: R,
    /// φ_A − φ_B is nowhere in the box zero.
    pub off_middle: bool,
    /// `None` where what the fields know of the box was enough.
    pub seen: Option<OverlapPoint<R>>,
    margin: R,
}

impl<R: Float> Look<R> {
    /// False only if it is certain that at every point of the box one of the fields is above the margin.
    pub fn may_touch(&self) -> bool {
        let is_above = self.margin < self.least;
        !is_above
    }
}

impl<'p, R: Float, A: EnclosedSdf, B: EnclosedSdf> Asked<'p, R, A, B> {
    pub fn of(pair: &'p Pair<'p, A, B>) -> Self {
        Self::of_some(pair, [true; 2])
    }

    /// For those of the fields that are asked.
    pub fn of_some(pair: &'p Pair<'p, A, B>, is_asked: [bool; 2]) -> Self {
        Self { pair, rounding: pair.rounding_at_corners(is_asked), margin: R::from_f64(pair.margin) }
    }

    /// By the slopes alone, of a field that is not asked by what it knows without.
    pub fn may_touch(&self, region: &Aabb, is_asked: [bool; 2]) -> bool {
        let middle = from_f64(core::array::from_fn(|axis| 0.5 * (region.min[axis] + region.max[axis])));
        let reach = R::from_f64(0.5 * region.diagonal());
        let by_slope = |local: BoxEnclosure, value: R| value - reach * R::from_f64(local.slope_bound);
        let (a, b) = (self.pair.a, self.pair.b);
        let [of_a, of_b] = [a.enclose_box(region), b.enclose_box(region)];
        let mut least = R::from_f64(of_a.range.lower.max(of_b.range.lower));
        if is_asked[0] {
            least = Real::max(least, by_slope(of_a, a.value(middle)));
        }
        if is_asked[1] {
            least = Real::max(least, by_slope(of_b, b.value(middle)));
        }
        let is_above = self.margin < least - self.rounding;
        !is_above
    }

    /// At a point of the region, or at the nearest one.
    pub fn see(&self, point: Vector3<R>) -> OverlapPoint<R> {
        let [min, max] = [self.pair.region.min, self.pair.region.max].map(from_f64::<R>);
        let point = point.zip_zip_map(&min, &max, Real::clamp);
        OverlapPoint::new(point, self.pair.a.evaluate(point), self.pair.b.evaluate(point))
    }

    pub fn look(&self, region: &Aabb) -> Look<R> {
        let (a, b) = (self.pair.a, self.pair.b);
        let [of_a, of_b] = [a.enclose_box(region), b.enclose_box(region)];
        let unasked = R::from_f64(of_a.range.lower.max(of_b.range.lower)) - self.rounding;
        let nothing = Look { least: unasked, off_middle: false, seen: None, margin: self.margin };
        if !nothing.may_touch() {
            return nothing;
        }
        let seen = self.see(from_f64(core::array::from_fn(|axis| 0.5 * (region.min[axis] + region.max[axis]))));
        if !seen.is_known() {
            return Look { least: R::from_f64(f64::NEG_INFINITY), seen: Some(seen), ..nothing };
        }
        let half: Vector3<R> = from_f64(region.extents().map(|extent| 0.5 * extent));
        let reach = norm(half);
        let steepest = |local: &BoxEnclosure| reach * R::from_f64(local.slope_bound);
        let by_slope = Real::max(seen.a.value - steepest(&of_a), seen.b.value - steepest(&of_b)) - self.rounding;
        let least = Real::max(unasked, by_slope);
        let apart = (seen.a.value - seen.b.value).abs();
        let off_middle = of_a.range.lower > of_b.range.upper
            || of_b.range.lower > of_a.range.upper
            || steepest(&of_a) + steepest(&of_b) + self.rounding * R::from_f64(2.0) < apart;
        let look = Look { least, off_middle, seen: Some(seen), margin: self.margin };
        if look.may_touch() {
            Look { least: Real::max(least, self.linear_least(region, half, &seen)), ..look }
        } else {
            look
        }
    }

    /// max(φ_A, φ_B) ≥ t φ_A + (1 − t) φ_B for any 0 ≤ t ≤ 1, and of linear parts the mean has a least value that is a
    /// concave function of t with its greatest where one component of the mean gradient is zero, or at the ends. So where
    /// the fields push against each other the bound is off by how they bend, and not by how steep they are.
    fn linear_least(&self, region: &Aabb, half: Vector3<R>, seen: &OverlapPoint<R>) -> R {
        let errors = [self.pair.a.linearization_error(region), self.pair.b.linearization_error(region)];
        let [a, b] = [seen.a.value - R::from_f64(errors[0]), seen.b.value - R::from_f64(errors[1])];
        let [slope_a, slope_b] = [seen.a.gradient, seen.b.gradient];
        let least = |a: R, slope: Vector3<R>| a - slope.map(R::abs).dot(&half);
        let mut best = Real::max(least(a, slope_a), least(b, slope_b));
        if !errors.iter().all(|error| error.is_finite()) {
            return best - self.rounding;
        }
        for (along_a, along_b) in slope_a.iter().copied().zip(slope_b.iter().copied()) {
            if along_a * along_b < R::zero() {
                let (share_a, share_b) = (along_b / (along_b - along_a), along_a / (along_a - along_b));
                best = Real::max(best, least(a * share_a + b * share_b, slope_a * share_a + slope_b * share_b));
            }
        }
        best - self.rounding
    }
}

impl<A: EnclosedSdf, B: EnclosedSdf> Pair<'_, A, B> {
    /// Of a value of this size at a point of the region.
    fn rounding<R: Float>(&self, value: R) -> R {
        let steepest = self.a.slope_bound().max(self.b.slope_bound());
        let diagonal = R::from_f64(self.region.diagonal());
        [self.region.min, self.region.max]
            .map(|corner| rounding(steepest, from_f64(corner), diagonal, value))
            .into_iter()
            .fold(R::zero(), Real::max)
    }

    /// With that of the frames that the fields are placed in, as they tell of the region's corners.
    fn rounding_at_corners<R: Float>(&self, is_asked: [bool; 2]) -> R {
        let Aabb { min, max } = self.region;
        let mut most = self.rounding(R::zero());
        for corner in 0..8_u32 {
            let at =
                core::array::from_fn(
                    |axis| if corner.wrapping_shr(axis as u32) & 1 == 0 { min[axis] } else { max[axis] },
                );
            let a = is_asked[0].then(|| self.a.enclosure::<R>(from_f64(at), &[from_f64(at)]));
            let b = is_asked[1].then(|| self.b.enclosure(from_f64(at), &[from_f64(at)]));
            for of_point in a.into_iter().chain(b) {
                let spread = (of_point.value - of_point.range.lower) + self.rounding(of_point.value);
                // NaN is not taken.
                most = if spread.is_finite() { Real::max(most, spread) } else { most };
            }
        }
        most * R::from_f64(2.0)
    }
}
