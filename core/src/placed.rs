//! Fields put into the world. A placement says where a world point lies in the field's own frame; the chain rule that
//! turns the answer back stands here once.

mod posed;
mod rigid;
mod similarity;
mod stretch;

use nalgebra::{Matrix3, Vector3};

pub use posed::Posed;
pub use rigid::Rigid;
pub use similarity::Similarity;
pub use stretch::Stretch;

use crate::number::{Float, Real};
use crate::rounding::rounding;
use crate::simplex::max_distance;
use crate::{Aabb, BoxEnclosure, EnclosedSdf, Enclosure, ExactMinimum, Goal, Sample, Sdf};

/// A map from the world into a field's own frame.
pub trait Placement {
    fn pull<R: Real>(&self, world_point: Vector3<R>) -> Pulled<R>;

    /// A box in the world around all that is in `local`, a box in the field's frame.
    fn push_bounds(&self, local: Aabb) -> Aabb;

    /// A box in the field's frame around all that is in `world`, a box in the world.
    fn pull_bounds(&self, world: Aabb) -> Aabb;

    /// The most that `scale · |jacobian|` can be: 1 for a rigid motion or a similarity.
    fn slope_factor(&self) -> f64;

    /// World lengths for one length of the field's own frame, the `scale` of [`Pulled`].
    fn scale(&self) -> f64;
}

/// A world point in a field's own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulled<R: Real> {
    pub point: Vector3<R>,
    /// The derivative of `point` by the world point.
    pub jacobian: Matrix3<R>,
    /// What a distance of the field's own frame is multiplied by in the world.
    pub scale: R,
}

/// A field put into the world by a placement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed<F, P> {
    pub field: F,
    pub placement: P,
}

impl<F: Sdf, P: Placement> Sdf for Placed<F, P> {
    #[inline(always)]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let pulled = self.placement.pull(point);
        pulled.push_sample(self.field.evaluate(pulled.point))
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
}

/// For placements that are affine maps: they take a hull to the hull of its corners, and barycentric weights stay the same.
impl<F: EnclosedSdf, P: Placement> EnclosedSdf for Placed<F, P> {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        let local = self.field.enclose_box(&self.placement.pull_bounds(*region));
        BoxEnclosure {
            range: local.range.scale(self.placement.scale()),
            slope_bound: local.slope_bound * self.placement.slope_factor(),
        }
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        let pulled = self.pull_all(corners);
        let here = self.placement.pull(about);
        let local = self.field.enclosure(here.point, pulled.get(..corners.len()).unwrap_or(&pulled));
        let scaled = local.pull_back(&here.jacobian, here.scale);
        // The corners were rounded where they stood in the world.
        scaled.widen(rounding(self.slope_bound(), about, max_distance(about, corners), scaled.value))
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

    /// The centre of a box becomes the centre of the box around its image.
    fn linearization_error(&self, region: &Aabb) -> f64 {
        self.field.linearization_error(&self.placement.pull_bounds(*region)) * self.placement.scale()
    }

    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        let pulled = corners.map(|corner| self.placement.pull(corner).point);
        let scale = R::from_f64(self.placement.scale());
        let local = self.field.exact_minimum(pulled, Goal { level: goal.level / scale, gap: goal.gap / scale })?;
        Some(push_minimum(local, &self.placement, self.slope_bound(), corners))
    }
}

/// A minimum in the field's frame as one in the world, where the corners were rounded.
#[inline(always)]
fn push_minimum<R: Float, P: Placement, const N: usize>(
    local: ExactMinimum<R, N>,
    placement: &P,
    slope_bound: f64,
    corners: [Vector3<R>; N],
) -> ExactMinimum<R, N> {
    let scale = R::from_f64(placement.scale());
    let (value, distance) = (local.value * scale, max_distance(corners[0], &corners));
    let rounding = rounding(slope_bound, corners[0], distance, value);
    ExactMinimum { value, lower_bound: local.lower_bound * scale - rounding, ..local }
}

impl<R: Real> Pulled<R> {
    /// A sample in the field's frame as one in the world, by the chain rule: scale · Jᵀ ∇φ.
    #[inline(always)]
    pub fn push_sample(&self, local: Sample<R>) -> Sample<R> {
        let gradient = self.jacobian.tr_mul(&local.gradient) * self.scale;
        Sample { value: local.value * self.scale, gradient, status: local.status }
    }
}

impl<F, P: Placement> Placed<F, P> {
    /// Up to four points.
    fn pull_all<R: Real>(&self, points: &[Vector3<R>]) -> [Vector3<R>; 4] {
        let mut pulled = [Vector3::zeros(); 4];
        for (pulled, point) in pulled.iter_mut().zip(points) {
            *pulled = self.placement.pull(*point).point;
        }
        pulled
    }
}
