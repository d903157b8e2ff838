//! How far can a field be from the shape that it was made from?

use crate::number::{Float, Real};
use crate::{Aabb, EnclosedSdf, Interval, Sample};

/// Bounds of the difference between φ and d in a region, where d is the signed distance to the shape that the field was made from:
/// for a baked grid, the mesh. A closed form is its own shape, without error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBound {
    /// φ − d ≤ `near` at every point, but where φ and d are both below `levels` or both above.
    pub near: f64,
    /// d − φ ≤ `near_below` at these points.
    pub near_below: f64,
    /// Where [`near`](Self::near) and [`near_below`](Self::near_below) may not hold at points outside of a grid.
    pub fails_outside: [bool; 2],
    /// φ − d ≤ `above` at every point.
    pub above: f64,
    /// d − φ ≤ `below` at every point.
    pub below: f64,
    /// Interval from −B to B of a sparse grid with the band B; all numbers where nothing is coarse.
    pub levels: Interval<f64>,
}

impl ErrorBound {
    /// The bound of a field that is its own shape.
    pub const EXACT: Self = Self::everywhere(0.0);

    /// Nothing is known.
    pub const UNKNOWN: Self = Self::everywhere(f64::INFINITY);

    /// |φ − d| ≤ `error` at every point.
    pub const fn everywhere(error: f64) -> Self {
        let fails_outside = [false; 2];
        Self { near: error, near_below: error, fails_outside, above: error, below: error, levels: Interval::EVERYTHING }
    }

    /// Bound of either: of two regions together, and of the minimum of two fields.
    pub fn max(self, other: Self) -> Self {
        let Self { near, near_below, fails_outside, above, below, levels: Interval { lower, upper } } = other;
        Self {
            near: self.near.max(near),
            near_below: self.near_below.max(near_below),
            fails_outside: [0, 1].map(|side: usize| self.fails_outside[side] || fails_outside[side]),
            above: self.above.max(above),
            below: self.below.max(below),
            levels: Interval { lower: self.levels.lower.max(lower), upper: self.levels.upper.min(upper) },
        }
    }

    /// Bound of −φ against −d.
    pub fn negate(self) -> Self {
        let [near_fails, near_below_fails] = self.fails_outside;
        Self {
            near: self.near_below,
            near_below: self.near,
            fails_outside: [near_below_fails, near_fails],
            above: self.below,
            below: self.above,
            levels: self.levels.negate(),
        }
    }

    /// Bound of φ + `distance` against d + `distance`.
    pub fn shift(self, distance: f64) -> Self {
        Self { levels: self.levels.shift(distance), ..self }
    }

    /// Bound of s φ against s d.
    pub fn scale(self, scale: f64) -> Self {
        let Self { near, near_below, above, below, levels, .. } = self;
        Self {
            near: near * scale,
            near_below: near_below * scale,
            fails_outside: self.fails_outside,
            above: above * scale,
            below: below * scale,
            levels: levels.scale(scale),
        }
    }

    /// The same bound for all levels: what holds at every point.
    pub(crate) fn at_all_levels(self) -> Self {
        if self.levels == Interval::EVERYTHING {
            return self;
        }
        let fails_outside = [false; 2];
        Self { near: self.above, near_below: self.below, fails_outside, levels: Interval::EVERYTHING, ..self }
    }

    /// Upper bound of φ at all points where d ≤ `margin`: how far a search must look that is to leave out none of them.
    pub fn reach(&self, margin: f64) -> f64 {
        let Interval { lower, upper } = self.levels;
        let is_near = margin <= upper && !self.fails_outside[0];
        let near = if is_near { lower.max(margin + self.near) } else { f64::INFINITY };
        near.min(margin + self.above)
    }

    /// Lower bound of d at all points where φ is at least `value`: d is above every margin whose [`reach`](Self::reach) is below it.
    pub(crate) fn lowest_distance<R: Float>(&self, value: R) -> R {
        let everywhere = value - R::from_f64(self.above);
        let Interval { lower, upper } = self.levels;
        if self.fails_outside[0] || value.to_f64() <= lower {
            return everywhere;
        }
        Real::max(everywhere, Real::min(value - R::from_f64(self.near), R::from_f64(upper)))
    }

    /// Bound of s φ against the distance D to a shape stretched by at least s and at most s + e, where φ is in `range`.
    ///
    /// A linear map whose singular values are in [s, s + e] takes a segment of length l to one of length s l to (s + e) l, and the
    /// nearest point of the shape to one of the stretched shape. So D has the sign of d, and s |d| ≤ |D| ≤ (s + e) |d|. With
    /// a ≥ φ − d and b ≥ d − φ,
    ///
    /// ```text
    /// outside, d ≥ 0:   s φ − D ≤ s (φ − d)            ≤ s a
    ///                   D − s φ ≤ s (d − φ) + e d      ≤ s b + e (φ + b)
    /// inside,  d < 0:   s φ − D ≤ s (φ − d) + e (−d)   ≤ s a + e (a − φ)
    ///                   D − s φ ≤ s (d − φ)            ≤ s b
    /// ```
    ///
    /// The parts with e count only where φ + b or a − φ is positive: outside or inside is empty otherwise.
    ///
    /// `near` counts where φ or d is at least the lower level l, so that −d ≤ a − l too. φ and d below l ≤ 0 mean s φ and D below s l,
    /// and below (s + e) l for l > 0. So it is with `near_below` and the upper level.
    pub(crate) fn stretch(self, range: Interval<f64>, scale: f64, excess: f64) -> Self {
        let scaled = self.scale(scale);
        let deeper = |above: f64, lower: f64| excess * (above - lower).max(0.0);
        let farther = |below: f64, upper: f64| excess * (upper + below).max(0.0);
        let Interval { lower, upper } = self.levels;
        Self {
            near: scaled.near + deeper(self.near, range.lower.max(lower)),
            near_below: scaled.near_below + farther(self.near_below, range.upper.min(upper)),
            fails_outside: self.fails_outside,
            above: scaled.above + deeper(self.above, range.lower),
            below: scaled.below + farther(self.below, range.upper),
            levels: Interval {
                lower: scaled.levels.lower + excess * lower.max(0.0),
                upper: scaled.levels.upper + excess * upper.min(0.0),
            },
        }
    }

    /// Bound of |φ − d| at one point.
    pub(crate) fn at_point<F: EnclosedSdf, R: Float>(field: &F, point: &Aabb, sample: &Sample<R>) -> R {
        let Self { near, near_below, above, below, levels, .. } = field.error_bound(point);
        let value = sample.value.to_f64();
        let is_near = !sample.status.beyond_band && !sample.status.outside_grid;
        // Of a combination another part may be beyond its band there.
        let is_near = is_near && levels.lower <= value && value <= levels.upper;
        R::from_f64(if is_near { near.max(near_below) } else { above.max(below) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: ErrorBound = ErrorBound {
        near: 0.5,
        near_below: 0.25,
        fails_outside: [false; 2],
        above: 4.0,
        below: 3.0,
        levels: Interval { lower: -2.0, upper: 2.0 },
    };

    #[test]
    fn a_distance_is_above_each_margin_whose_reach_is_below_the_value() {
        let outside = ErrorBound { fails_outside: [true, false], ..GRID };
        for bound in [GRID, GRID.shift(-1.5), outside, GRID.negate(), ErrorBound::EXACT, ErrorBound::everywhere(0.25)] {
            for step in -80..=80 {
                let (value, lowest) = (f64::from(step) * 0.125, bound.lowest_distance(f64::from(step) * 0.125));
                // Sixteenths are exact, and all numbers of the bounds are multiples of them.
                for margin in (-200..=200).map(|step| f64::from(step) * 0.0625) {
                    let is_below = bound.reach(margin) < value;
                    assert!(margin == lowest || is_below == (margin < lowest), "{bound:?} from {value} on: {margin}");
                }
            }
        }
        assert_eq!([-3.0, 1.0, 4.0, 9.0].map(|value| GRID.lowest_distance(value)), [-7.0, 0.5, 2.0, 5.0]);
    }

    #[test]
    fn beyond_its_levels_a_bound_reaches_as_far_as_its_larger_error() {
        assert_eq!(
            [-9.0, -4.0, -2.0, 0.0, 2.0, 3.0].map(|margin| GRID.reach(margin)),
            [-5.0, -2.0, -1.5, 0.5, 2.5, 7.0]
        );
        assert_eq!(ErrorBound::EXACT.reach(0.25), 0.25);
        let moved = GRID.shift(-1.5);
        assert_eq!([-4.0, 0.0, 0.5, 1.0].map(|margin| moved.reach(margin)), [-3.5, 0.5, 1.0, 5.0]);
        assert_eq!(GRID.max(moved).levels, Interval { lower: -2.0, upper: 0.5 });
        assert_eq!(GRID.at_all_levels().reach(0.0), 4.0);
        let outside = ErrorBound { fails_outside: [false, true], ..GRID };
        assert_eq!(
            [outside.reach(0.0), outside.negate().reach(0.0), outside.max(GRID).negate().reach(0.0)],
            [0.5, 3.0, 3.0]
        );
        assert_eq!(ErrorBound::everywhere(1.0).at_all_levels(), ErrorBound::everywhere(1.0));
    }

    fn holds(bound: &ErrorBound, value: f64, distance: f64) -> bool {
        let ErrorBound { near, near_below, above, below, levels, .. } = *bound;
        let is_beyond = value.max(distance) < levels.lower || value.min(distance) > levels.upper;
        let off = value - distance;
        off <= above && -off <= below && (is_beyond || off <= near && -off <= near_below)
    }

    #[test]
    fn bounds_hold_for_what_becomes_of_a_value_and_a_distance() {
        let numbers = || (-40..=40).map(|k| 0.25 * f64::from(k));
        let pairs = || numbers().flat_map(|value| numbers().map(move |distance| (value, distance)));
        for bound in [-3.0, -1.5, 0.0, 0.5, 3.0].map(|distance| GRID.shift(distance)) {
            for (value, distance) in pairs().filter(|(value, distance)| holds(&bound, *value, *distance)) {
                let context = (value, distance, bound);
                assert!(holds(&bound.negate(), -value, -distance), "{context:?}: negated");
                assert!(holds(&bound.max(GRID), value, distance), "{context:?}: with another");
                assert!(holds(&bound.at_all_levels(), value, distance), "{context:?}: at all levels");
                for margin in numbers().filter(|margin| distance <= *margin) {
                    assert!(value <= bound.reach(margin), "{context:?}: margin {margin}");
                }
                for (spread, factor) in [(0.0, 2.0), (0.0, 3.0), (1.0, 2.5)] {
                    let range = Interval { lower: value - spread, upper: value + spread };
                    let stretched = bound.stretch(range, 2.0, 1.0);
                    assert!(holds(&stretched, 2.0 * value, factor * distance), "{context:?}: {factor}, {stretched:?}");
                }
            }
        }
    }
}
