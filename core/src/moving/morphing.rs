//! A field that becomes another one: φ(x, t) = (1 − t) φ_now(x) + t φ_later(x).
//!
//! It is each of the two at its time, and ∂φ/∂t = φ_later − φ_now. All bounds of a mean are the mean of the bounds. In between, the
//! zero set of two distances is off the closed form with mean parameters by second order in their difference: a torus whose radius R
//! grows by δ by up to δ²/(8 r). A program that animates a shape makes one [`Morphing`] for each frame.

use nalgebra::Vector3;

use super::{Animated, MovingSdf, product};
use crate::number::{Float, Real};
use crate::rounding::{FieldScale, rounding};
use crate::simplex::max_distance;
use crate::{Aabb, BoxEnclosure, EnclosedSdf, Enclosure, ErrorBound, GradientBox, Interval, Relaxation, Sample, Sdf};

/// A field that becomes another one between the times 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Morphing<A, B = A> {
    now: A,
    later: B,
    /// Upper bound of |φ_later − φ_now|.
    max_difference: f64,
}

impl<A: EnclosedSdf, B: EnclosedSdf> Morphing<A, B> {
    /// Any two fields. How fast φ falls in a box is bounded by what they know there.
    pub fn new(now: A, later: B) -> Self {
        Self { now, later, max_difference: f64::INFINITY }
    }

    /// The field at time 0.
    pub fn now(&self) -> &A {
        &self.now
    }

    /// The field at time 1.
    pub fn later(&self) -> &B {
        &self.later
    }
}

impl<A: Animated> Morphing<A> {
    /// A closed form with other parameters at time 1.
    pub fn animated(now: A, later: A) -> Self {
        Self { max_difference: now.max_difference(&later), now, later }
    }
}

impl<A: EnclosedSdf, B: EnclosedSdf> MovingSdf for Morphing<A, B> {
    type Moment<'a>
        = Blend<&'a A, &'a B>
    where
        Self: 'a;

    fn at(&self, time: f64) -> Self::Moment<'_> {
        Blend::new(&self.now, &self.later, time)
    }

    fn time_derivative<R: Float>(&self, point: Vector3<R>, _time: f64) -> R {
        self.later.value(point) - self.now.value(point)
    }

    /// A mean of the two is no steeper than the steeper one.
    fn slope_bound_in(&self, region: &Aabb, from: f64, until: f64) -> f64 {
        self.now.slope_bound_in(region, from, until).max(self.later.slope_bound_in(region, from, until))
    }

    /// The smallest of three bounds of φ_now − φ_later: that of the parameters; by the ranges in the box; and by the difference at
    /// the box's centre c, d(c) + (L_now + L_later) · half of the diagonal.
    fn fall_bound(&self, region: &Aabb, _from: f64, _until: f64) -> f64 {
        let (now, later) = (self.now.enclose_box(region), self.later.enclose_box(region));
        let by_ranges = now.range.upper - later.range.lower;
        let centre = (Vector3::from(region.min) + Vector3::from(region.max)) * 0.5;
        let radius = 0.5 * region.diagonal();
        let by_centre = match centre.iter().all(|x| x.is_representable()) && radius.is_representable() {
            false => f64::INFINITY,
            true => {
                let difference = self.now.value(centre) - self.later.value(centre);
                let [of_now, of_later] = [FieldScale::new(&self.now), FieldScale::new(&self.later)];
                let slope_bound = of_now.slope_bound + of_later.slope_bound;
                let scale = FieldScale { slope_bound, ..of_now.max(of_later) };
                let slack = rounding(scale, centre, radius, difference);
                difference + product(now.slope_bound + later.slope_bound, radius) + slack
            }
        };
        // `min` passes over NaN.
        self.max_difference.min(by_ranges).min(by_centre).max(0.0)
    }
}

/// The mean (1 − t) a + t b of two fields.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend<A, B> {
    first: A,
    second: B,
    time: f64,
}

impl<A, B> Blend<A, B> {
    /// `time` is t, clamped to 0 ≤ t ≤ 1; NaN counts as 0.
    pub fn new(first: A, second: B, time: f64) -> Self {
        Self { first, second, time: if time > 0.0 { time.min(1.0) } else { 0.0 } }
    }

    #[inline(always)]
    fn mean<R: Real>(&self, first: R, second: R) -> R {
        first * R::from_f64(1.0 - self.time) + second * R::from_f64(self.time)
    }

    #[inline(always)]
    fn mean_sample<R: Real>(&self, first: Sample<R>, second: Sample<R>) -> Sample<R> {
        Sample {
            value: self.mean(first.value, second.value),
            gradient: first.gradient.zip_map(&second.gradient, |a, b| self.mean(a, b)),
            status: first.status.merge(second.status),
        }
    }

    fn mean_enclosure<R: Float>(&self, first: Enclosure<R>, second: Enclosure<R>) -> Enclosure<R> {
        let mean = |a: Vector3<R>, b: Vector3<R>| a.zip_map(&b, |a, b| self.mean(a, b));
        Enclosure {
            value: self.mean(first.value, second.value),
            range: Interval {
                lower: self.mean(first.range.lower, second.range.lower),
                upper: self.mean(first.range.upper, second.range.upper),
            },
            gradients: GradientBox {
                lower: mean(first.gradients.lower, second.gradients.lower),
                upper: mean(first.gradients.upper, second.gradients.upper),
            },
        }
    }

    /// The mean of two bounds in f64, where 0 · ∞ = 0.
    fn mean_bound(&self, first: f64, second: f64) -> f64 {
        match self.time {
            0.0 => first,
            1.0 => second,
            _ => self.mean(first, second),
        }
    }
}

impl<A: Sdf, B: Sdf> Sdf for Blend<A, B> {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        self.mean_sample(self.first.evaluate(point), self.second.evaluate(point))
    }

    #[inline]
    fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
        self.mean_sample(self.first.evaluate_smooth(point), self.second.evaluate_smooth(point))
    }

    #[inline]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        self.mean(self.first.value(point), self.second.value(point))
    }

    /// The union of both: where a mean is at most the level, one of the two is.
    fn bounds(&self, level: f64) -> Aabb {
        self.first.bounds(level).union(&self.second.bounds(level))
    }

    fn slope_bound(&self) -> f64 {
        self.mean_bound(self.first.slope_bound(), self.second.slope_bound())
    }

    #[inline]
    fn magnitude<R: Real>(&self) -> R {
        self.first.magnitude::<R>().max(self.second.magnitude())
    }

    fn extent<R: Real>(&self) -> R {
        self.first.extent::<R>().max(self.second.extent())
    }
}

impl<A: EnclosedSdf, B: EnclosedSdf> EnclosedSdf for Blend<A, B> {
    const IS_CONVEX: bool = A::IS_CONVEX && B::IS_CONVEX;

    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        let (first, second) = (self.first.enclose_box(region), self.second.enclose_box(region));
        BoxEnclosure {
            range: Interval {
                lower: self.mean_bound(first.range.lower, second.range.lower),
                upper: self.mean_bound(first.range.upper, second.range.upper),
            },
            slope_bound: self.mean_bound(first.slope_bound, second.slope_bound),
        }
    }

    /// The error against the mean of the two shapes' distances.
    fn error_bound(&self, region: &Aabb) -> ErrorBound {
        let [first, second] =
            [self.first.error_bound(region), self.second.error_bound(region)].map(ErrorBound::at_all_levels);
        ErrorBound {
            near: self.mean_bound(first.near, second.near),
            near_below: self.mean_bound(first.near_below, second.near_below),
            fails_outside: [false; 2],
            above: self.mean_bound(first.above, second.above),
            below: self.mean_bound(first.below, second.below),
            levels: Interval::EVERYTHING,
        }
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        let (first, second) = (self.first.enclosure(about, corners), self.second.enclosure(about, corners));
        let larger = Real::max(first.value.abs(), second.value.abs());
        let rounding = rounding(FieldScale::new(self), about, max_distance(about, corners), larger);
        self.mean_enclosure(first, second).widen(rounding)
    }

    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        let (first, second) = (self.first.relaxation(about, corners), self.second.relaxation(about, corners));
        let larger = Real::max(first.enclosure.value.abs(), second.enclosure.value.abs());
        let rounding = rounding(FieldScale::new(self), about, max_distance(about, corners), larger);
        let mean = |a: [R; 4], b: [R; 4]| core::array::from_fn(|k| self.mean(a[k], b[k]));
        Relaxation {
            enclosure: self.mean_enclosure(first.enclosure, second.enclosure),
            lower: mean(first.lower, second.lower),
            upper: mean(first.upper, second.upper),
        }
        .tighten()
        .widen(rounding)
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        self.first.is_convex_on(corners) && self.second.is_convex_on(corners)
    }

    /// Rises of a sum are at most the sum of the rises.
    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let (first, second) = (self.first.max_rise_to_corners(corners), self.second.max_rise_to_corners(corners));
        core::array::from_fn(|k| self.mean(first[k], second[k]))
    }

    fn linearization_error(&self, region: &Aabb) -> f64 {
        self.mean_bound(self.first.linearization_error(region), self.second.linearization_error(region))
    }
}
