//! The union of a list of fields, [`Compound`]: φ = min_i φ_i, with bounds from the parts that can be the minimum.

#[cfg(feature = "alloc")]
use alloc::vec::Vec;
use core::ops::Deref;

use nalgebra::Vector3;

use super::boolean::{lower, lower_value};
use crate::enclosure::PartVisitor;
use crate::near_parts::{NearParts, PartSet, spread};
use crate::number::{Float, Mask, Parameter, Real};
use crate::rounding::FieldScale;
use crate::simplex::mean;
use crate::{Aabb, BoxEnclosure, EnclosedSdf, Enclosure, ErrorBound, ExactMinimum, Goal, Relaxation, Sample, Sdf};

/// The union of any number of fields of one type: min over all parts. `S` holds or lends the slice of them: `&[F]`, `Vec<F>`.
///
/// Parts of several types go in as `&dyn` [`DynSdf`](crate::DynSdf). A certified search treats each part by what that part
/// knows ([`EnclosedSdf::visit_parts`]), and leaves out those whose bounds lie above the minimum so far.
///
/// ```
/// use sdf_core::{DynSdf, Sdf, combine::Compound, nalgebra::Vector3, shapes::{HalfSpace, Sphere}};
/// let (ball, ground) = (Sphere::new(0.5).unwrap(), HalfSpace::new([0.0, 0.0, 1.0], -1.0).unwrap());
/// let scene: [&dyn DynSdf; 2] = [&ball, &ground];
/// let scene = Compound::new(&scene[..]).unwrap();
/// assert_eq!(scene.value(Vector3::new(3.0, 0.0, -0.75)), 0.25);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compound<S> {
    parts: S,
    /// The largest slope bound and magnitude of a part.
    scale: FieldScale<Parameter>,
    /// The longest of a part.
    extent: Parameter,
}

impl<F: Sdf, S: Deref<Target = [F]>> Compound<S> {
    /// `None` without a part.
    pub fn new(parts: S) -> Option<Self> {
        let slope_bound = parts.iter().map(Sdf::slope_bound).reduce(f64::max)?;
        let double = parts.iter().map(Sdf::magnitude::<f64>).fold(0.0, f64::max);
        let single = parts.iter().map(Sdf::magnitude::<f32>).fold(0.0, f32::max);
        let scale = FieldScale { slope_bound: slope_bound.into(), magnitude: Parameter { double, single } };
        let extent = parts.iter().map(Sdf::extent::<f64>).fold(0.0, f64::max).into();
        Some(Self { parts, scale, extent })
    }

    /// The parts, at least one.
    pub fn parts(&self) -> &[F] {
        &self.parts
    }

    /// Combines what `get` returns for each part. There is at least one, so that `none` is never returned.
    #[inline(always)]
    fn combine<T>(&self, none: T, mut get: impl FnMut(&F) -> T, combine: impl FnMut(T, T) -> T) -> T {
        self.combine_among(PartSet::ALL, none, |_, part, _| Some(get(part)), combine)
    }

    /// The same of the parts in a set. `get` also hears what is combined so far, if anything is, and may pass a part over.
    #[inline(always)]
    fn combine_among<T>(
        &self,
        parts: PartSet,
        none: T,
        mut get: impl FnMut(usize, &F, Option<&T>) -> Option<T>,
        mut combine: impl FnMut(T, T) -> T,
    ) -> T {
        let (mut combined, mut is_first) = (none, true);
        let mut index = parts.next_from(0);
        // Not by `reduce`, where what `get` does would stand twice.
        while let Some(part) = self.parts().get(index) {
            if let Some(next) = get(index, part, (!is_first).then_some(&combined)) {
                combined = if is_first { next } else { combine(combined, next) };
                is_first = false;
            }
            index = parts.next_from(index.wrapping_add(1));
        }
        combined
    }

    /// A bound of a part's value at a point that is above `lowest` in all lanes, if the part knows one without an evaluation: its value
    /// there is neither the lowest nor equal to it.
    #[inline(always)]
    fn bound_above<R: Real>(&self, part: &F, point: Vector3<R>, lowest: R) -> Option<R> {
        let bound = part.lowest_about(point);
        // The first comparison is false of −∞, so that nothing is left of both where a part knows none.
        let is_above = lowest.lt(bound) & lowest.lt(bound - spread(FieldScale::new(self), point, R::zero(), bound));
        (!(!is_above).any()).then_some(bound)
    }

    #[inline(always)]
    fn evaluate_among<R: Real>(&self, parts: PartSet, point: Vector3<R>) -> Sample<R> {
        let get = |_, part: &F, lowest: Option<&Sample<R>>| match lowest {
            Some(lowest) if self.bound_above(part, point, lowest.value).is_some() => None,
            _ => Some(part.evaluate(point)),
        };
        self.combine_among(parts, Sample::new(R::zero(), Vector3::zeros()), get, lower)
    }
}

#[cfg(feature = "alloc")]
impl<F: Sdf, S: Deref<Target = [F]>> Compound<S> {
    /// The same union of references.
    pub fn by_reference(&self) -> Compound<Vec<&F>> {
        self.with_parts(self.parts().iter().collect())
    }

    /// A union of some of the parts. Slope bound, magnitude and extent are those of all, so that bounds and tolerances keep their bits.
    fn with_parts<T>(&self, parts: Vec<T>) -> Compound<Vec<T>> {
        Compound { parts, scale: self.scale, extent: self.extent }
    }
}

#[cfg(feature = "alloc")]
impl<F: Sdf + Copy> Compound<Vec<F>> {
    /// The union of the parts that can be the minimum within `radius` of a point, or equal to it. There is at least one, and within the
    /// radius all values have the same bits.
    ///
    /// All parts where the value of one is not finite at the point.
    pub fn near<R: Float>(&self, point: Vector3<R>, radius: R) -> Self {
        let scale = FieldScale::new(self);
        let (mut upper, mut is_finite) = (R::from_f64(f64::INFINITY), true);
        let bound = |part: &F| {
            let value = part.value(point);
            let spread = spread(FieldScale { slope_bound: part.slope_bound_as(), ..scale }, point, radius, value);
            is_finite &= value.is_finite();
            upper = Real::min(upper, value + spread);
            (*part, value - spread)
        };
        let bounds: Vec<_> = self.parts.iter().map(bound).collect();
        let is_near = |lower| !(is_finite && upper < lower);
        self.with_parts(bounds.into_iter().filter(|(_, lower)| is_near(*lower)).map(|(part, _)| part).collect())
    }
}

impl<F: Sdf, S: Deref<Target = [F]>> Sdf for Compound<S> {
    const IS_SMOOTH_AS_IT_IS: bool = F::IS_SMOOTH_AS_IT_IS;

    // All parts: by boxes, certified searches of edges spill 300 bytes more on a GPU.
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        self.combine(Sample::new(R::zero(), Vector3::zeros()), |part| part.evaluate(point), lower)
    }

    #[inline]
    fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
        self.combine(Sample::new(R::zero(), Vector3::zeros()), |part| part.evaluate_smooth(point), lower)
    }

    #[inline]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        let get = |_, part: &F, lowest: Option<&R>| match lowest {
            Some(lowest) if self.bound_above(part, point, *lowest).is_some() => None,
            _ => Some(part.value(point)),
        };
        self.combine_among(PartSet::ALL, R::zero(), get, lower_value)
    }

    fn bounds(&self, level: f64) -> Aabb {
        self.combine(Aabb::EVERYWHERE, |part| part.bounds(level), |a, b| a.union(&b))
    }

    fn slope_bound(&self) -> f64 {
        self.scale.slope_bound.double
    }

    #[inline(always)]
    fn slope_bound_as<R: Real>(&self) -> R {
        R::from_parameter(self.scale.slope_bound)
    }

    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        R::from_parameter(self.scale.magnitude)
    }

    fn extent<R: Real>(&self) -> R {
        R::from_parameter(self.extent)
    }
}

impl<F: EnclosedSdf, S: Deref<Target = [F]>> EnclosedSdf for Compound<S> {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        self.combine(BoxEnclosure::ANYTHING, |part| part.enclose_box(region), BoxEnclosure::min)
    }

    fn error_bound(&self, region: &Aabb) -> ErrorBound {
        self.combine(ErrorBound::UNKNOWN, |part| part.error_bound(region), ErrorBound::max)
    }

    #[inline(always)]
    fn evaluate_near<R: Real>(&self, point: Vector3<R>, near: &NearParts<R>) -> Sample<R> {
        self.evaluate_among(near.parts, point)
    }

    #[inline(always)]
    fn narrow<R: Real>(&self, point: Vector3<R>, radius: R, near: &mut NearParts<R>) -> Sample<R> {
        let (scale, none) = (FieldScale::new(self), Sample::new(R::zero(), Vector3::zeros()));
        let (mut left, mut is_finite) = (near.emptied(), !R::Mask::NONE);
        let get = |index, part: &F, lowest: Option<&Sample<R>>| {
            if let Some(bound) = lowest.and_then(|lowest| self.bound_above(part, point, lowest.value)) {
                left.add_above(index, bound - spread(scale, point, radius, bound));
                return None;
            }
            let sample = part.evaluate(point);
            is_finite = is_finite & sample.value.is_finite();
            left.add(index, sample.value, spread(scale, point, radius, sample.value));
            Some(sample)
        };
        let lowest = self.combine_among(near.parts, none, get, lower);
        // Whether a NaN is the answer depends on all parts. None is left of a field that is steeper than its slope bound.
        if !(!is_finite).any() && !left.is_empty() {
            *near = left;
        }
        lowest
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        let parts = self.parts().iter().map(|part| part.enclosure(about, corners));
        parts.reduce(Enclosure::min).unwrap_or_else(|| Enclosure::from_slope(self, about, corners))
    }

    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        let parts = self.parts().iter().map(|part| part.relaxation(about, corners));
        parts.reduce(Relaxation::min).unwrap_or_else(|| {
            Relaxation::from_enclosure(self, Enclosure::from_slope(self, about, corners), about, corners)
        })
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        matches!(self.only_part_on(corners), Some(part) if part.is_convex_on(corners))
    }

    /// A path may run along each part in turn, so that rises add up over all parts that can be the minimum.
    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let middle = mean(corners);
        let upper = self.enclosure(middle, corners).range.upper;
        let mut rises = [R::zero(); 4];
        for part in self.parts() {
            if part.enclosure(middle, corners).range.lower <= upper {
                rises = crate::enclosure::sum(rises, part.max_rise_to_corners(corners));
            }
        }
        rises
    }

    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        match self.parts() {
            [part] => part.exact_minimum(corners, goal),
            _ => None,
        }
    }

    fn visit_parts<V: PartVisitor>(&self, visitor: &mut V) {
        for part in self.parts() {
            part.visit_parts(visitor);
        }
    }
}

impl<F: EnclosedSdf, S: Deref<Target = [F]>> Compound<S> {
    /// The part that is the minimum on all of the hull, if one certainly is.
    fn only_part_on<R: Float>(&self, corners: &[Vector3<R>]) -> Option<&F> {
        let middle = mean(corners);
        let upper = self.enclosure(middle, corners).range.upper;
        let mut candidates = self.parts().iter().filter(|part| part.enclosure(middle, corners).range.lower <= upper);
        let only = candidates.next();
        if candidates.next().is_some() { None } else { only }
    }
}
