//! Enclosures of a field in a region: intervals of the value and of the gradient, and exact minima where they are known.
//!
//! The bounds are those of interval analysis (Moore 1966, "Interval Analysis"): an enclosure of φ over a hull holds every value there,
//! rounding included. Fields that know nothing better are bounded by their slope: φ(about) ± slope_bound · distance.

use nalgebra::{Matrix3, Vector3};

use crate::number::interval::Interval;
use crate::number::{Float, Real};
use crate::relaxation::{Relaxation, smallest, tangent_planes};
use crate::rounding::{FieldScale, rounding};
use crate::simplex::{max_distance, mean};
use crate::{Aabb, ErrorBound, NearParts, Sample, Sdf};

/// A field that bounds itself in regions. Every method has a default from [`Sdf::slope_bound`], so that
/// `impl EnclosedSdf for MyField {}` is enough; better bounds make culls and certified searches faster.
pub trait EnclosedSdf: Sdf {
    /// Is φ a convex function? Where its gradient is a choice, it must then be a limit of gradients nearby.
    const IS_CONVEX: bool = false;

    /// Bounds of φ in a box, without an evaluation.
    fn enclose_box(&self, _region: &Aabb) -> BoxEnclosure {
        BoxEnclosure { slope_bound: self.slope_bound(), ..BoxEnclosure::ANYTHING }
    }

    /// Does a cull of many save time if it asks [`lowest_in_box`](Self::lowest_in_box) for each? Else it asks that for several together.
    const SLOPES_TAKE_LONG: bool = false;

    /// Lower bound of φ in a box, at most that of [`enclose_box`](Self::enclose_box), in less time; −∞ where there is none.
    #[inline(always)]
    fn lowest_in_box(&self, _region: &Aabb) -> f64 {
        f64::NEG_INFINITY
    }

    /// Bounds of φ and ∇φ on the convex hull of one to four points, from one or two evaluations, the first at `about`, a point
    /// of the hull: the nearer that is to the minimum, the tighter.
    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        if Self::IS_CONVEX {
            Enclosure::from_tangent_planes(self, about, corners)
        } else {
            Enclosure::from_slope(self, about, corners)
        }
    }

    /// Affine bounds of φ on the convex hull of one to four points, with tangent planes at `about`, a point of the hull. Costs
    /// up to five evaluations. Combinations of fields are bounded by those of their parts.
    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        if Self::IS_CONVEX {
            Relaxation::from_convex(self, about, corners)
        } else {
            Relaxation::from_enclosure(self, self.enclosure(about, corners), about, corners)
        }
    }

    /// Is φ certainly a convex function on the convex hull of one to four points?
    fn is_convex_on<R: Float>(&self, _corners: &[Vector3<R>]) -> bool {
        Self::IS_CONVEX
    }

    /// For each of one to four corners: upper bound of the total rise of φ along any straight path to it from a point of the hull.
    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        if self.is_convex_on(corners) {
            max_rise_of_convex(self, corners)
        } else {
            self.enclosure(mean(corners), corners).gradients.max_rise_to_corners(corners)
        }
    }

    /// The minimum on a segment (`N` = 2) or triangle (`N` = 3), where the field knows it without a search.
    fn exact_minimum<R: Float, const N: usize>(
        &self,
        _corners: [Vector3<R>; N],
        _goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        None
    }

    /// Upper bound of φ(c) + ∇φ(c)·(x − c) − φ(x) for x in a box with centre c: how far the field can lie below its
    /// tangent plane. 0 where φ is convex; infinity where nothing is known.
    fn linearization_error(&self, _region: &Aabb) -> f64 {
        if Self::IS_CONVEX { 0.0 } else { f64::INFINITY }
    }

    /// How far the field can be, in a box, from the shape that it was made from. No error where the field is the shape.
    fn error_bound(&self, _region: &Aabb) -> ErrorBound {
        ErrorBound::EXACT
    }

    /// [`Sdf::evaluate`] at a point of an element, by the parts that can be the minimum there: the same bits.
    #[inline(always)]
    fn evaluate_near<R: Real>(&self, point: Vector3<R>, _near: &NearParts<R>) -> Sample<R> {
        self.evaluate(point)
    }

    /// [`evaluate_near`](Self::evaluate_near), where a union also learns from the values which parts cannot be the minimum. No two
    /// points of the element are farther apart than `radius`.
    #[inline(always)]
    fn narrow<R: Real>(&self, point: Vector3<R>, _radius: R, _near: &mut NearParts<R>) -> Sample<R> {
        self.evaluate(point)
    }

    /// Visits the fields whose minimum this field is: the parts of a union, else the field itself. So a search uses what each knows.
    #[inline(always)]
    fn visit_parts<V: PartVisitor>(&self, visitor: &mut V) {
        visitor.visit(&self);
    }
}

/// A callback that takes fields of any type: see [`EnclosedSdf::visit_parts`].
pub trait PartVisitor {
    /// Called with the field of a part.
    fn visit<F: EnclosedSdf>(&mut self, part: &F);
}

/// When a search may stop early.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal<R> {
    /// May stop once every value is proven above this.
    pub level: R,
    /// May stop once no value is lower than the one found by more than this.
    pub gap: R,
}

impl<R: Real> Goal<R> {
    /// No early stop.
    pub fn exact() -> Self {
        Self { level: R::from_f64(f64::INFINITY), gap: R::zero() }
    }
}

/// A minimum that a field knows without a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactMinimum<R, const N: usize> {
    /// Barycentric.
    pub weights: [R; N],
    /// φ there, up to rounding.
    pub value: R,
    /// Lower bound of φ on the segment or triangle, up to rounding.
    pub lower_bound: R,
    /// Points evaluated and cells searched. Cells that were only bounded do not count.
    pub evaluations: u32,
}

/// Bounds of a field in a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxEnclosure {
    /// Holds every value in the box.
    pub range: Interval<f64>,
    /// Lipschitz constant of φ between points of the box.
    pub slope_bound: f64,
}

impl BoxEnclosure {
    /// Nothing is known.
    pub const ANYTHING: Self = Self { range: Interval::EVERYTHING, slope_bound: f64::INFINITY };

    /// Bounds of −φ.
    pub fn negate(self) -> Self {
        Self { range: self.range.negate(), ..self }
    }

    /// Bounds of the minimum of two fields.
    pub fn min(self, other: Self) -> Self {
        Self { range: self.range.min(other.range), slope_bound: self.slope_bound.max(other.slope_bound) }
    }

    /// Bounds of φ + `distance`.
    pub fn shift(self, distance: f64) -> Self {
        Self { range: self.range.shift(distance), ..self }
    }
}

/// Bounds of a field on the convex hull of one to four points, from one evaluation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Enclosure<R: Real> {
    /// φ at the point that was evaluated.
    pub value: R,
    /// Holds every value on the hull.
    pub range: Interval<R>,
    /// Holds every gradient on the hull, those of both sides at a kink.
    pub gradients: GradientBox<R>,
}

/// An interval vector: a box that holds every gradient of a field in a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GradientBox<R: Real> {
    /// Lower bounds of ∂φ/∂x, ∂φ/∂y and ∂φ/∂z.
    pub lower: Vector3<R>,
    /// Upper bounds of ∂φ/∂x, ∂φ/∂y and ∂φ/∂z.
    pub upper: Vector3<R>,
}

impl<R: Float> GradientBox<R> {
    /// All gradients no longer than a slope bound.
    pub fn from_slope(slope_bound: f64) -> Self {
        let upper = Vector3::repeat(R::from_f64(slope_bound));
        Self { lower: -upper, upper }
    }

    /// The smallest box around both.
    pub fn hull(self, other: Self) -> Self {
        Self { lower: self.lower.zip_map(&other.lower, Real::min), upper: self.upper.zip_map(&other.upper, Real::max) }
    }

    /// Gradients of −φ.
    pub fn negate(self) -> Self {
        Self { lower: -self.upper, upper: -self.lower }
    }

    /// Gradients of φ(`jacobian` · x) · `scale`: the chain rule, axis by axis.
    pub fn pull_back(self, jacobian: &Matrix3<R>, scale: R) -> Self {
        let axis = |k: usize| self.change_along(jacobian.column(k).into_owned()).scale(scale);
        let [x, y, z] = [axis(0), axis(1), axis(2)];
        Self { lower: Vector3::new(x.lower, y.lower, z.lower), upper: Vector3::new(x.upper, y.upper, z.upper) }
    }

    /// [`EnclosedSdf::max_rise_to_corners`] of a field with these gradients on the hull.
    pub fn max_rise_to_corners(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let mut rises = [R::zero(); 4];
        for (rise, to) in rises.iter_mut().zip(corners) {
            // A path from inside the hull is a mean of those from its corners.
            *rise = corners.iter().fold(R::zero(), |rise, from| Real::max(rise, self.change_along(to - from).upper));
        }
        rises
    }

    /// The change of φ over `offset`, a straight path inside the region: the interval product
    /// Σ_i \[lower_i, upper_i\] · offset_i.
    #[inline]
    pub fn change_along(&self, offset: Vector3<R>) -> Interval<R> {
        let mut range = Interval { lower: R::zero(), upper: R::zero() };
        for ((lower, upper), offset) in self.lower.iter().zip(&self.upper).zip(&offset) {
            let (a, b) = (*lower * *offset, *upper * *offset);
            range = Interval { lower: range.lower + Real::min(a, b), upper: range.upper + Real::max(a, b) };
        }
        range
    }
}

/// [`EnclosedSdf::max_rise_to_corners`] of a convex φ, which rises fastest where a path ends: ∇φ(to)·(to − from).
pub(crate) fn max_rise_of_convex<R: Float, F: Sdf + ?Sized>(field: &F, corners: &[Vector3<R>]) -> [R; 4] {
    let mut gradients = [Vector3::zeros(); 4];
    gradients.iter_mut().zip(corners).for_each(|(gradient, corner)| *gradient = field.evaluate(*corner).gradient);
    let mut rises = [R::zero(); 4];
    for ((rise, gradient), to) in rises.iter_mut().zip(gradients).zip(corners) {
        *rise = corners.iter().fold(R::zero(), |rise, from| Real::max(rise, gradient.dot(&(to - from))));
    }
    rises
}

pub(crate) fn sum<R: Float>(a: [R; 4], b: [R; 4]) -> [R; 4] {
    core::array::from_fn(|k| a[k] + b[k])
}

impl<R: Float> Enclosure<R> {
    /// From the slope bound in the box around the points: φ(about) ± slope_bound · max |corner − about|.
    pub fn from_slope<F: EnclosedSdf + ?Sized>(field: &F, about: Vector3<R>, corners: &[Vector3<R>]) -> Self {
        let value = field.value(about);
        let distance = max_distance(about, corners);
        let local = field.enclose_box(&Aabb::from_corners(corners));
        let spread = distance * R::from_f64(local.slope_bound);
        let unrounded = Self {
            value,
            range: Interval {
                lower: Real::max(value - spread, R::from_f64(local.range.lower)),
                upper: Real::min(value + spread, R::from_f64(local.range.upper)),
            },
            gradients: GradientBox::from_slope(local.slope_bound),
        };
        unrounded.widen(rounding(FieldScale::new(field), about, distance, value))
    }

    /// Enclosure of a convex φ, which lies above its tangent planes: φ(x) ≥ φ(p) + ∇φ(p)·(x − p) for p = `about` and for one corner.
    pub fn from_tangent_planes<F: Sdf + ?Sized>(field: &F, about: Vector3<R>, corners: &[Vector3<R>]) -> Self {
        let (value, plane) = tangent_planes(field, about, corners);
        let distance = max_distance(about, corners);
        let unrounded = Self {
            value,
            range: Interval {
                lower: Real::min(value, smallest(plane)),
                upper: value + distance * R::from_f64(field.slope_bound()),
            },
            gradients: GradientBox::from_slope(field.slope_bound()),
        };
        unrounded.widen(rounding(FieldScale::new(field), about, distance, value))
    }

    /// Bounds of −φ.
    pub fn negate(self) -> Self {
        Self { value: -self.value, range: self.range.negate(), gradients: self.gradients.negate() }
    }

    /// Bounds of the minimum of two fields.
    pub fn min(self, other: Self) -> Self {
        let gradients = match () {
            () if self.range.upper < other.range.lower => self.gradients,
            () if other.range.upper < self.range.lower => other.gradients,
            () => self.gradients.hull(other.gradients),
        };
        Self { value: Real::min(self.value, other.value), range: self.range.min(other.range), gradients }
    }

    /// [`EnclosedSdf::max_rise_to_corners`] of the minimum of two fields with these enclosures; each field's own is
    /// computed only where it matters.
    pub fn min_max_rise(
        self,
        other: Self,
        own_rises: impl FnOnce() -> [R; 4],
        other_rises: impl FnOnce() -> [R; 4],
    ) -> [R; 4] {
        match () {
            () if self.range.upper < other.range.lower => own_rises(),
            () if other.range.upper < self.range.lower => other_rises(),
            // A path runs partly along the one and partly along the other.
            () => sum(own_rises(), other_rises()),
        }
    }

    /// Bounds of φ + `distance`.
    pub fn shift(self, distance: R) -> Self {
        Self { value: self.value + distance, range: self.range.shift(distance), gradients: self.gradients }
    }

    /// Bounds of φ(`jacobian` · x) · `scale`.
    pub fn pull_back(self, jacobian: &Matrix3<R>, scale: R) -> Self {
        Self {
            value: self.value * scale,
            range: self.range.scale(scale),
            gradients: self.gradients.pull_back(jacobian, scale),
        }
    }

    /// The same with values that may be off by `rounding`.
    pub fn widen(self, rounding: R) -> Self {
        Self { range: self.range.widen(rounding), ..self }
    }
}
