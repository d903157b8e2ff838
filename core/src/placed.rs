//! Fields placed into the world.
//!
//! A field φ lives in its own, local frame. A placement maps a world point x to the local point p(x) and has a factor
//! s from local to world lengths. The placed field is
//!
//! ```text
//! φ_w(x)  = s φ(p(x))
//! ∇φ_w(x) = s Jᵀ ∇φ(p(x)),    J = ∂p/∂x                       (chain rule)
//! |∇φ_w|  ≤ s ‖J‖ |∇φ|                                        `slope_factor` = s ‖J‖
//! ```
//!
//! | placement | p(x) | s | file |
//! |---|---|---|---|
//! | [`Rigid`] | Rᵀ(x − t) | 1 | `rigid` |
//! | [`Similarity`] | Rᵀ(x − t) / s | any s > 0 | `similarity` |
//! | [`Stretch`] | (x / f_x, y / f_y, z / f_z) | smallest \|f\| | `stretch` |
//! | [`Affine`] | A⁻¹(x − t) | smallest singular value of A | `affine` |
//!
//! s ‖J‖ ≤ 1 for each of them, so that a placed field is never steeper than the field. All are affine: they map a
//! hull to the hull of the mapped corners, and barycentric weights stay the same.

pub(crate) mod affine;
mod posed;
mod rigid;
mod similarity;
mod stretch;

use nalgebra::{Matrix3, Vector3};

pub use affine::Affine;
pub use posed::Posed;
pub use rigid::Rigid;
pub use similarity::Similarity;
pub use stretch::Stretch;

use crate::number::{Float, Real};
use crate::rounding::{FieldScale, rounding};
use crate::simplex::max_distance;
use crate::{
    Aabb, BoxEnclosure, EnclosedSdf, Enclosure, ErrorBound, ExactMinimum, Goal, Interval, NearParts, Relaxation,
    Sample, Sdf,
};

/// An affine map from the world into a field's local frame.
pub trait Placement {
    /// p(x), its derivative and the scale.
    fn pull<R: Real>(&self, world_point: Vector3<R>) -> LocalPoint<R>;

    /// A box in the world that holds the image of `local`, a box in the local frame.
    fn push_bounds(&self, local: Aabb) -> Aabb;

    /// A box in the local frame that holds the image of `world`, a box in the world.
    fn pull_bounds(&self, world: Aabb) -> Aabb;

    /// Upper bound of s ‖J‖: by how much a placed field can be steeper than the field.
    fn slope_factor(&self) -> f64;

    /// s: the least world length of a local length of 1.
    fn scale(&self) -> f64;

    /// The largest world length of a local length of 1: as `scale` where shapes are kept. It bounds how far φ_w can be from the
    /// distance to the placed shape.
    fn largest_scale(&self) -> f64;

    /// The [extent](Sdf::extent) of a placed surface, from that of the surface, or where lengths along some axes grow less than along others
    /// from the box around it, if that is shorter.
    #[inline(always)]
    fn extent<R: Real>(&self, local: R, bounds: impl FnOnce() -> Aabb) -> R {
        _ = bounds;
        local * R::from_f64(self.largest_scale())
    }

    /// Largest length that `pull` adds or subtracts, in the world: the largest component of the translation t.
    fn magnitude<R: Real>(&self) -> R;
}

/// A world point in a field's local frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalPoint<R: Real> {
    /// p(x).
    pub point: Vector3<R>,
    /// J = ∂p/∂x.
    pub jacobian: Matrix3<R>,
    /// s: the factor from local to world distances.
    pub scale: R,
}

/// A field placed into the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed<F, P> {
    /// The field, in its local frame.
    pub field: F,
    /// The map between the frames.
    pub placement: P,
}

impl<F: Sdf, P: Placement> Sdf for Placed<F, P> {
    #[inline(always)]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let pulled = self.placement.pull(point);
        pulled.push_sample(self.field.evaluate(pulled.point))
    }

    #[inline(always)]
    fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
        let pulled = self.placement.pull(point);
        pulled.push_sample(self.field.evaluate_smooth(pulled.point))
    }

    #[inline(always)]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        let pulled = self.placement.pull(point);
        self.field.value(pulled.point) * pulled.scale
    }

    fn bounds(&self, level: f64) -> Aabb {
        self.placement.push_bounds(self.field.bounds(level / self.placement.scale()))
    }

    fn slope_bound(&self) -> f64 {
        self.field.slope_bound() * self.placement.slope_factor()
    }

    /// m + s m_l / (s ‖J‖) for the lengths m of the map and m_l of the field: values round by slope bound · m_l in the local frame, and
    /// s times as much in the world, where the slope bound is s ‖J‖ times the local one.
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        self.placement.magnitude::<R>()
            + self.field.magnitude::<R>() * R::from_f64(self.placement.scale() / self.placement.slope_factor())
    }

    #[inline(always)]
    fn extent<R: Real>(&self) -> R {
        self.placement.extent(self.field.extent(), || self.field.bounds(0.0))
    }
}

impl<F: EnclosedSdf, P: Placement> EnclosedSdf for Placed<F, P> {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        let local = self.field.enclose_box(&self.placement.pull_bounds(*region));
        BoxEnclosure {
            range: local.range.scale(self.placement.scale()),
            slope_bound: local.slope_bound * self.placement.slope_factor(),
        }
    }

    fn error_bound(&self, region: &Aabb) -> ErrorBound {
        let local_region = self.placement.pull_bounds(*region);
        let error = self.field.error_bound(&local_region);
        let scale = self.placement.scale();
        let excess = self.placement.largest_scale() - scale;
        // A closed form is its own shape, also stretched.
        if excess <= 0.0 || error == ErrorBound::EXACT {
            return error.scale(scale);
        }
        error.stretch(range_in(&self.field, &local_region), scale, excess)
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        let pulled = self.pull_all(corners);
        let here = self.placement.pull(about);
        let local = self.field.enclosure(here.point, pulled.get(..corners.len()).unwrap_or(&pulled));
        let scaled = local.pull_back(&here.jacobian, here.scale);
        // World coordinates may be larger than local ones, and so is their rounding.
        scaled.widen(rounding(FieldScale::new(self), about, max_distance(about, corners), scaled.value))
    }

    #[inline(always)]
    fn evaluate_near<R: Real>(&self, point: Vector3<R>, near: &NearParts<R>) -> Sample<R> {
        let pulled = self.placement.pull(point);
        pulled.push_sample(self.field.evaluate_near(pulled.point, near))
    }

    #[inline(always)]
    fn narrow<R: Real>(&self, point: Vector3<R>, radius: R, near: &mut NearParts<R>) -> Sample<R> {
        let (pulled, radius) = (self.placement.pull(point), pull_radius(&self.placement, point, radius));
        pulled.push_sample(self.field.narrow(pulled.point, radius, near))
    }

    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        let pulled = self.pull_all(corners);
        let here = self.placement.pull(about);
        let local = self.field.relaxation(here.point, pulled.get(..corners.len()).unwrap_or(&pulled));
        let scaled = local.pull_back(&here.jacobian, here.scale);
        scaled.widen(rounding(FieldScale::new(self), about, max_distance(about, corners), scaled.enclosure.value))
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        let pulled = self.pull_all(corners);
        self.field.is_convex_on(pulled.get(..corners.len()).unwrap_or(&pulled))
    }

    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let pulled = self.pull_all(corners);
        let rises = self.field.max_rise_to_corners(pulled.get(..corners.len()).unwrap_or(&pulled));
        rises.map(|rise| rise * R::from_f64(self.placement.scale()))
    }

    /// p maps the centre of a box to the centre of the box around its image, so both have the same tangent plane.
    fn linearization_error(&self, region: &Aabb) -> f64 {
        self.field.linearization_error(&self.placement.pull_bounds(*region)) * self.placement.scale()
    }

    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        let pulled = corners.map(|corner| self.placement.pull(corner).point);
        let local = self.field.exact_minimum(pulled, pull_goal(&self.placement, goal))?;
        Some(push_minimum(local, &self.placement, FieldScale::new(self), corners))
    }
}

/// Bounds of φ in a box: those of its enclosure, and φ(c) ± L r with the middle c, the slope bound L and half of the diagonal r.
fn range_in<F: EnclosedSdf>(field: &F, region: &Aabb) -> Interval<f64> {
    let range = field.enclose_box(region).range;
    let middle = Vector3::from_fn(|k, _| 0.5 * (region.min[k] + region.max[k]));
    let (value, reach) = (field.value(middle), 0.5 * field.slope_bound() * region.diagonal());
    Interval { lower: range.lower.max(value - reach), upper: range.upper.min(value + reach) }
}

/// Upper bound of the distance of two points in the field's frame, computed of points at most `radius` apart of which one is `point`.
#[inline(always)]
fn pull_radius<R: Real, P: Placement>(placement: &P, point: Vector3<R>, radius: R) -> R {
    let world = FieldScale { slope_bound: R::one(), magnitude: placement.magnitude() };
    let rounding = rounding(world, point, radius, R::zero());
    (radius + rounding) * R::from_f64(placement.slope_factor() / placement.scale())
}

/// A goal of the world in the field's frame.
#[inline(always)]
fn pull_goal<R: Real, P: Placement>(placement: &P, goal: Goal<R>) -> Goal<R> {
    let scale = R::from_f64(placement.scale());
    Goal { level: goal.level / scale, gap: goal.gap / scale }
}

/// A minimum in the field's frame as one in the world, where the corners were rounded.
#[inline(always)]
fn push_minimum<R: Float, P: Placement, const N: usize>(
    local: ExactMinimum<R, N>,
    placement: &P,
    field_scale: FieldScale<R>,
    corners: [Vector3<R>; N],
) -> ExactMinimum<R, N> {
    let scale = R::from_f64(placement.scale());
    let (value, distance) = (local.value * scale, max_distance(corners[0], &corners));
    // World coordinates may be larger than local ones, and so is their rounding.
    let rounding = rounding(field_scale, corners[0], distance, value);
    ExactMinimum { value, lower_bound: local.lower_bound * scale - rounding, ..local }
}

impl<R: Real> LocalPoint<R> {
    /// A sample in the field's frame as one in the world, by the chain rule: scale · Jᵀ ∇φ.
    #[inline(always)]
    pub fn push_sample(&self, local: Sample<R>) -> Sample<R> {
        let gradient = self.jacobian.tr_mul(&local.gradient) * self.scale;
        Sample { value: local.value * self.scale, gradient, status: local.status }
    }
}

impl<F, P: Placement> Placed<F, P> {
    /// p of up to four points; the rest is zero.
    fn pull_all<R: Real>(&self, points: &[Vector3<R>]) -> [Vector3<R>; 4] {
        let mut pulled = [Vector3::zeros(); 4];
        for (pulled, point) in pulled.iter_mut().zip(points) {
            *pulled = self.placement.pull(*point).point;
        }
        pulled
    }
}
