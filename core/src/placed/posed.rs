//! A field with a placement that may be absent at run time, [`Posed`]: one type for both cases, so that searches
//! compile once.

use nalgebra::Vector3;

use super::{Placed, Placement, Rigid};
use crate::number::{Float, Real};
use crate::rounding::FieldScale;
use crate::{
    Aabb, BoxEnclosure, EnclosedSdf, Enclosure, ErrorBound, ExactMinimum, Goal, NearParts, PartVisitor, Relaxation,
    Sample, Sdf,
};

/// A field that a placement, mostly a rigid motion, may move, known only at run time: the same bits as the field itself without
/// one, and as [`Placed`] with one. One type for both halves the code of what is compiled for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posed<F, P = Rigid> {
    /// The field in its own frame.
    pub field: F,
    /// Where it stands in the world; `None` where its frame is the world's.
    pub pose: Option<P>,
}

impl<F, P: Copy> Posed<F, P> {
    #[inline(always)]
    fn placed(&self) -> Option<Placed<&F, P>> {
        self.pose.map(|placement| Placed { field: &self.field, placement })
    }
}

impl<F, P: Placement> Posed<F, P> {
    /// A ball of the field's frame that holds all points of a ball in the world: its centre and its radius.
    #[inline(always)]
    pub fn pull_ball<R: Real>(&self, center: Vector3<R>, radius: R) -> (Vector3<R>, R) {
        match &self.pose {
            None => (center, radius),
            Some(pose) => (pose.pull(center).point, super::pull_radius(pose, center, radius)),
        }
    }
}

impl<F: Sdf, P: Placement + Copy> Sdf for Posed<F, P> {
    // The field's own code stands here once, between what is before and after it with a pose.
    #[inline(always)]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let pulled = self.pose.as_ref().map(|pose| pose.pull(point));
        let local = self.field.evaluate(pulled.map_or(point, |pulled| pulled.point));
        match pulled {
            None => local,
            Some(pulled) => pulled.push_sample(local),
        }
    }

    #[inline(always)]
    fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
        match self.placed() {
            None => self.field.evaluate_smooth(point),
            Some(placed) => placed.evaluate_smooth(point),
        }
    }

    #[inline(always)]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        let pulled = self.pose.as_ref().map(|pose| pose.pull(point));
        let local = self.field.value(pulled.map_or(point, |pulled| pulled.point));
        pulled.map_or(local, |pulled| local * pulled.scale)
    }

    fn bounds(&self, level: f64) -> Aabb {
        match self.placed() {
            None => self.field.bounds(level),
            Some(placed) => placed.bounds(level),
        }
    }

    fn slope_bound(&self) -> f64 {
        match self.placed() {
            None => self.field.slope_bound(),
            Some(placed) => placed.slope_bound(),
        }
    }

    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        match self.placed() {
            None => self.field.magnitude(),
            Some(placed) => placed.magnitude(),
        }
    }

    #[inline(always)]
    fn extent<R: Real>(&self) -> R {
        let extent = self.field.extent::<R>();
        self.pose.as_ref().map_or(extent, |pose| pose.extent(extent, || self.field.bounds(0.0)))
    }
}

impl<F: EnclosedSdf, P: Placement + Copy> EnclosedSdf for Posed<F, P> {
    const SLOPES_TAKE_LONG: bool = F::SLOPES_TAKE_LONG;

    #[inline(always)]
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        let local = self.pose.as_ref().map_or(*region, |pose| pose.pull_bounds(*region));
        let local = self.field.enclose_box(&local);
        match &self.pose {
            None => local,
            Some(pose) => BoxEnclosure {
                range: local.range.scale(pose.scale()),
                slope_bound: local.slope_bound * pose.slope_factor(),
            },
        }
    }

    #[inline(always)]
    fn evaluate_near<R: Real>(&self, point: Vector3<R>, near: &NearParts<R>) -> Sample<R> {
        let pulled = self.pose.as_ref().map(|pose| pose.pull(point));
        let local = self.field.evaluate_near(pulled.map_or(point, |pulled| pulled.point), near);
        pulled.map_or(local, |pulled| pulled.push_sample(local))
    }

    #[inline(always)]
    fn narrow<R: Real>(&self, point: Vector3<R>, radius: R, near: &mut NearParts<R>) -> Sample<R> {
        let pulled = self.pose.as_ref().map(|pose| pose.pull(point));
        let radius = self.pose.as_ref().map_or(radius, |pose| super::pull_radius(pose, point, radius));
        let local = self.field.narrow(pulled.map_or(point, |pulled| pulled.point), radius, near);
        pulled.map_or(local, |pulled| pulled.push_sample(local))
    }

    #[inline(always)]
    fn lowest_in_box(&self, region: &Aabb) -> f64 {
        let local = self.pose.as_ref().map_or(*region, |pose| pose.pull_bounds(*region));
        let lowest = self.field.lowest_in_box(&local);
        self.pose.as_ref().map_or(lowest, |pose| lowest * pose.scale())
    }

    fn error_bound(&self, region: &Aabb) -> ErrorBound {
        match self.placed() {
            None => self.field.error_bound(region),
            Some(placed) => placed.error_bound(region),
        }
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        match self.placed() {
            None => self.field.enclosure(about, corners),
            Some(placed) => placed.enclosure(about, corners),
        }
    }

    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        match self.placed() {
            None => self.field.relaxation(about, corners),
            Some(placed) => placed.relaxation(about, corners),
        }
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        match self.placed() {
            None => self.field.is_convex_on(corners),
            Some(placed) => placed.is_convex_on(corners),
        }
    }

    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        match self.placed() {
            None => self.field.max_rise_to_corners(corners),
            Some(placed) => placed.max_rise_to_corners(corners),
        }
    }

    #[inline(always)]
    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        let pulled = self.pose.as_ref().map_or(corners, |pose| corners.map(|corner| pose.pull(corner).point));
        let local_goal = self.pose.as_ref().map_or(goal, |pose| super::pull_goal(pose, goal));
        let found = self.field.exact_minimum(pulled, local_goal)?;
        Some(match &self.pose {
            None => found,
            Some(pose) => super::push_minimum(found, pose, FieldScale::new(self), corners),
        })
    }

    fn linearization_error(&self, region: &Aabb) -> f64 {
        match self.placed() {
            None => self.field.linearization_error(region),
            Some(placed) => placed.linearization_error(region),
        }
    }

    // Without a pose the parts are wrapped as well, so that a search is compiled once.
    #[inline(always)]
    fn visit_parts<V: PartVisitor>(&self, visitor: &mut V) {
        self.field.visit_parts(&mut WithPose { visitor, pose: self.pose });
    }
}

/// Visits the parts of a union, each moved as the whole is.
struct WithPose<'v, V, P> {
    visitor: &'v mut V,
    pose: Option<P>,
}

impl<V: PartVisitor, P: Placement + Copy> PartVisitor for WithPose<'_, V, P> {
    #[inline(always)]
    fn visit<F: EnclosedSdf>(&mut self, part: &F) {
        self.visitor.visit(&Posed { field: part, pose: self.pose });
    }
}
