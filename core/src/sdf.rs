use nalgebra::Vector3;

use crate::enclosure::{max_rise_of_convex, mean};
use crate::grid::{SegmentMinimum, TriangleMinimum};
use crate::number::kernel::LaneBundle;
use crate::number::{Float, Mask, Real};
use crate::vector::select;
use crate::{Aabb, Enclosure};

/// A field of signed distances: negative inside, zero on the surface, positive outside, in the unit of the points.
///
/// One method makes a field, [`evaluate`](Self::evaluate). It is generic over the number type, so one `impl` answers
/// scalars, lanes and dual numbers.
///
/// ```
/// use sdf_core::{Sdf, nalgebra::Vector3, shapes::Sphere};
/// let sphere = Sphere::new(0.5).unwrap();
/// let sample = sphere.sample(Vector3::new(0.0_f32, 2.0, 0.0));
/// assert_eq!(sample.value, 1.5);
/// assert_eq!(sample.gradient, Vector3::new(0.0, 1.0, 0.0));
/// ```
pub trait Sdf: Sized {
    /// φ is a convex function, and where its gradient is a choice that is a limit of gradients nearby. Bounds of such fields
    /// are tighter.
    const IS_CONVEX: bool = false;

    /// φ and ∇φ at a point whose coordinates are finite and within ±[`Real::MAX_COORDINATE`]. Any other point may give NaN;
    /// [`sample`](Self::sample) takes those too.
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R>;

    /// A box that holds every point with φ ≤ level.
    fn bounds(&self, level: f64) -> Aabb;

    /// The most that the value changes over a unit of distance: 1 for a true distance.
    fn slope_bound(&self) -> f64;

    /// What is certain of φ in a box. By default only that it changes no faster than anywhere.
    fn enclose_box(&self, _region: &Aabb) -> BoxEnclosure {
        BoxEnclosure { slope_bound: self.slope_bound(), ..BoxEnclosure::ANYTHING }
    }

    /// What is certain of φ on the convex hull of one to four points, by what it is and how it changes at a point `about`
    /// of the hull: the nearer that is to the least value, the tighter. By default by the slope, or by the tangent plane.
    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        if Self::IS_CONVEX {
            Enclosure::of_convex(self, about, corners)
        } else {
            Enclosure::by_slope(self, about, corners)
        }
    }

    /// Whether φ is certainly a convex function on the convex hull of one to four points.
    fn is_convex_on<R: Float>(&self, _corners: &[Vector3<R>]) -> bool {
        Self::IS_CONVEX
    }

    /// Of each of one to four corners the most that φ rises, all rises added, on a straight way to it from any point of
    /// their hull. By default by the gradients.
    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        if Self::IS_CONVEX {
            max_rise_of_convex(self, corners)
        } else {
            self.enclosure(mean(corners), corners).gradients.max_rise_to_corners(corners)
        }
    }

    /// Where on a segment φ is least, if that can be told without a search.
    fn minimum_on_segment<R: Float>(&self, _ends: [Vector3<R>; 2]) -> Option<SegmentMinimum<R>> {
        None
    }

    /// Where on a triangle φ is least, if that can be told without a search. It need not be the least once it is certain that
    /// no value is at most the first of `enough`, nor where none is lower by more than the second.
    fn minimum_on_triangle<R: Float>(&self, _corners: [Vector3<R>; 3], _enough: [R; 2]) -> Option<TriangleMinimum<R>> {
        None
    }

    /// The most by which φ in a box lies below φ(c) + ∇φ(c)·(x − c), its linear part at the middle c of the box: 0 where φ
    /// is a convex function. By default nothing is known, and the answer is infinity.
    fn linearization_error(&self, _region: &Aabb) -> f64 {
        if Self::IS_CONVEX { 0.0 } else { f64::INFINITY }
    }

    /// φ alone, the same bits as [`evaluate`](Self::evaluate) gives, under the same condition.
    #[inline(always)]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        self.evaluate(point).value
    }

    /// φ and ∇φ at any point. One that is not finite, or beyond [`Real::MAX_COORDINATE`], here or in a frame that the field is
    /// placed in, is answered with the status [`not_finite`](Status::not_finite), the value REACH and a zero gradient; so
    /// is one where stored samples are not finite.
    fn sample<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let [x, y, z] = [point.x, point.y, point.z].map(Real::is_representable);
        let in_reach = x & y & z;
        let sample = self.evaluate(point.map(|x| R::select(in_reach, x, R::zero())));
        let is_valid = sample.gradient.iter().fold(sample.value.is_finite(), |all, slope| all & slope.is_finite());
        let refusal = Sample {
            value: R::from_f64(R::MAX_COORDINATE),
            gradient: Vector3::zeros(),
            status: Status { not_finite: !R::Mask::NONE, ..Status::GOOD },
        };
        Sample::select(in_reach & is_valid, sample, refusal)
    }
}

impl<F: Sdf> Sdf for &F {
    const IS_CONVEX: bool = F::IS_CONVEX;
    #[inline(always)]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        (**self).evaluate(point)
    }
    fn bounds(&self, level: f64) -> Aabb {
        (**self).bounds(level)
    }
    fn slope_bound(&self) -> f64 {
        (**self).slope_bound()
    }
    #[inline(always)]
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        (**self).enclose_box(region)
    }
    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        (**self).enclosure(about, corners)
    }
    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        (**self).is_convex_on(corners)
    }
    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        (**self).max_rise_to_corners(corners)
    }
    fn minimum_on_segment<R: Float>(&self, ends: [Vector3<R>; 2]) -> Option<SegmentMinimum<R>> {
        (**self).minimum_on_segment(ends)
    }
    fn minimum_on_triangle<R: Float>(&self, corners: [Vector3<R>; 3], enough: [R; 2]) -> Option<TriangleMinimum<R>> {
        (**self).minimum_on_triangle(corners, enough)
    }
    fn linearization_error(&self, region: &Aabb) -> f64 {
        (**self).linearization_error(region)
    }
    #[inline(always)]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        (**self).value(point)
    }
}

/// What is certain of a field in a box, before it is asked at any point of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxEnclosure {
    /// No value in the box is below this.
    pub least: f64,
    /// No value in the box is above this.
    pub greatest: f64,
    /// The most that the value changes over a unit of distance between points of the box.
    pub slope_bound: f64,
}

impl BoxEnclosure {
    /// Nothing is certain.
    pub const ANYTHING: Self = Self { least: f64::NEG_INFINITY, greatest: f64::INFINITY, slope_bound: f64::INFINITY };

    /// Those of −φ.
    pub fn negate(self) -> Self {
        Self { least: -self.greatest, greatest: -self.least, ..self }
    }

    /// Those of the lower of two fields.
    pub fn lower(self, other: Self) -> Self {
        Self {
            least: self.least.min(other.least),
            greatest: self.greatest.min(other.greatest),
            slope_bound: self.slope_bound.max(other.slope_bound),
        }
    }

    /// Those of φ + `distance`.
    pub fn raise(self, distance: f64) -> Self {
        Self { least: self.least + distance, greatest: self.greatest + distance, ..self }
    }
}

/// What a field answers at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<R: Real> {
    /// Signed distance: negative inside, zero on the surface, positive outside.
    pub value: R,
    /// The derivative of the value along x, y and z. It points outward and is not normalized.
    pub gradient: Vector3<R>,
    pub status: Status<R::Mask>,
}

impl<R: Real> Sample<R> {
    #[inline(always)]
    pub fn new(value: R, gradient: Vector3<R>) -> Self {
        Self { value, gradient, status: Status::GOOD }
    }

    /// With a gradient that is a choice where `degenerate` holds.
    #[inline]
    pub fn with_degenerate(value: R, gradient: Vector3<R>, degenerate: R::Mask) -> Self {
        Self { value, gradient, status: Status { degenerate_gradient: degenerate, ..Status::GOOD } }
    }

    #[inline(always)]
    pub fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        Self {
            value: R::select(mask, yes.value, no.value),
            gradient: select(mask, yes.gradient, no.gradient),
            status: Status::select(mask, yes.status, no.status),
        }
    }

    /// The sample of −φ.
    #[inline]
    pub fn negate(self) -> Self {
        Self { value: -self.value, gradient: -self.gradient, ..self }
    }
}

impl<R: Real> LaneBundle<R> for Sample<R> {
    type Lane = Sample<R::Lane>;
    #[inline(always)]
    fn zero() -> Self {
        Self { value: R::zero(), gradient: LaneBundle::zero(), status: Status::GOOD }
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> Self::Lane {
        let Status { degenerate_gradient, outside_grid, not_finite } = self.status;
        let status = Status {
            degenerate_gradient: degenerate_gradient.lane(lane),
            outside_grid: outside_grid.lane(lane),
            not_finite: not_finite.lane(lane),
        };
        Sample { value: self.value.lane(lane), gradient: self.gradient.lane(lane), status }
    }
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, one: Self::Lane) {
        self.value.set_lane(lane, one.value);
        self.gradient.set_lane(lane, one.gradient);
        let Status { degenerate_gradient, outside_grid, not_finite } = one.status;
        self.status.degenerate_gradient.set_lane(lane, degenerate_gradient);
        self.status.outside_grid.set_lane(lane, outside_grid);
        self.status.not_finite.set_lane(lane, not_finite);
    }
}

/// What to know of a sample before trusting it. All false for an ordinary one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Status<M> {
    /// φ has no derivative here (a centre, an axis, an edge, a medial surface): the gradient is one of its one-sided
    /// limits.
    pub degenerate_gradient: M,
    /// The point lies outside the grid: the value is a lower bound of the distance, not the distance.
    pub outside_grid: M,
    /// The point was not finite, or beyond [`Real::MAX_COORDINATE`], or the answer was: value and gradient say nothing.
    pub not_finite: M,
}

impl<M: Mask> Status<M> {
    pub const GOOD: Self = Self { degenerate_gradient: M::NONE, outside_grid: M::NONE, not_finite: M::NONE };

    #[inline(always)]
    pub(crate) fn select(mask: M, yes: Self, no: Self) -> Self {
        let pick = |yes: M, no: M| (mask & yes) | (!mask & no);
        Self {
            degenerate_gradient: pick(yes.degenerate_gradient, no.degenerate_gradient),
            outside_grid: pick(yes.outside_grid, no.outside_grid),
            not_finite: pick(yes.not_finite, no.not_finite),
        }
    }

    /// Nothing to know, in any lane.
    #[inline(always)]
    pub(crate) fn is_good(self) -> bool {
        !(self.degenerate_gradient | self.outside_grid | self.not_finite).any()
    }

    /// Every doubt of either.
    #[inline(always)]
    pub fn merge(self, other: Self) -> Self {
        Self {
            degenerate_gradient: self.degenerate_gradient | other.degenerate_gradient,
            outside_grid: self.outside_grid | other.outside_grid,
            not_finite: self.not_finite | other.not_finite,
        }
    }
}
