//! When does a moving shape arrive? By conservative advancement (Mirtich 1996): no step passes the field, by no more than the search for the
//! lowest point misses. A step is the longer of two:
//!
//! | bound | step |
//! |---|---|
//! | no point of the surface gets nearer, in φ, than by slope bound · speed · time | φ over these |
//! | a plane before the field's box, its normal that of the nearest point, with all of the surface beyond | its distance over the speed towards it |
//!
//! The second lets a shape pass close by the flat side of another without a step for each gap of the way.

use parry3d::math::{Pose, Vector};
use parry3d::query::details::ShapeCastOptions;
use parry3d::query::{NonlinearRigidMotion, ShapeCastHit, ShapeCastStatus};
use parry3d::shape::Shape;
use sdf_core::Sdf;
use sdf_core::nalgebra::Vector3;

use crate::convert::{to_core, to_parry, to_rigid};
use crate::pair::Pair;
use crate::search::Search;
use crate::surface::Rounding;
use crate::touch::Touch;

/// A bound of a speed that grows with time.
struct Speed {
    at_first: f64,
    growth: f64,
}

impl Speed {
    /// Least time that this distance takes.
    fn time_of(&self, distance: f64) -> f64 {
        // at_first · t + growth · t²/2 = distance.
        2.0 * distance / (self.at_first + (self.at_first * self.at_first + 2.0 * self.growth * distance).sqrt())
    }
}

/// Two shapes in motion.
pub(crate) struct Cast<'a> {
    pub pair: &'a Pair,
    pub shapes: [&'a dyn Shape; 2],
    pub search: Search,
    /// Motions of the first and the second shape.
    pub motions: [&'a NonlinearRigidMotion; 2],
}

/// Steps of a cast. One that has not arrived by then is reported where it is, which is early: one that passes over a rough field by a
/// 500th of the way.
const MAX_STEPS: u32 = 1024;

/// The shapes have arrived within this fraction of the surface's size.
const AT_TARGET: f64 = 1e-4;

impl Cast<'_> {
    /// The first time at which the shapes are within the target distance; `None` if there is none until the last.
    pub fn run(&self, start: f32, options: ShapeCastOptions) -> Option<ShapeCastHit> {
        let end = f64::from(options.max_time_of_impact);
        let (target, within) = (f64::from(options.target_distance), AT_TARGET * self.pair.surface.radius());
        let slope_bound = self.pair.field.slope_bound();
        let radius = self.radius();
        let mut time = f64::from(start);
        for step in 0..MAX_STEPS {
            // A field can be wholly inside of the other shape only at the start: on the way there it touches.
            let (pose, touch) = self.nearest(time, step == 0)?;
            let left = touch.value - target;
            if left <= within {
                let is_start = step == 0;
                if is_start && !options.stop_at_penetration && self.is_leaving(&touch) {
                    return None;
                }
                let converged = ShapeCastStatus::Converged;
                let status = if is_start { ShapeCastStatus::PenetratingOrWithinTargetDist } else { converged };
                return Some(self.hit(time, &pose, &touch, status));
            }
            if step + 1 == MAX_STEPS {
                return Some(self.hit(time, &pose, &touch, ShapeCastStatus::OutOfIterations));
            }
            let by_value = self.speed(time, radius, None).time_of(left / slope_bound);
            let beyond = self.beyond_plane(&pose, &touch) - target;
            let by_plane = if beyond > within { self.speed(time, radius, Some(&touch)).time_of(beyond) } else { 0.0 };
            time += by_value.max(by_plane);
            if time.is_nan() || time > end {
                return None;
            }
        }
        None
    }

    /// The surface's pose in the field's frame, and its lowest point there.
    fn nearest(&self, time: f64, may_be_swallowed: bool) -> Option<(Pose, Touch)> {
        let [first, second] = self.motions.map(|motion| motion.position_at_time(time as f32));
        let pose = self.pair.pose(&first.inv_mul(&second));
        let touch = if may_be_swallowed {
            self.pair.nearest_or_way_out(self.shapes, &pose, self.search).0
        } else {
            self.pair.nearest(&pose, self.search)
        };
        // A border around triangles is not wider for φ that is less than a distance.
        let is_beside = |touch: &Touch| touch.is_measured && touch.border > 0.0 && touch.gap > 0.0;
        let touch =
            touch.map(|touch| if is_beside(&touch) { self.pair.apart(self.shapes, &pose, touch) } else { touch });
        touch.map(|touch| (pose, touch))
    }

    /// Radius of the surface about the point that it turns about.
    fn radius(&self) -> f64 {
        let [first, second] = self.motions;
        let moving = if self.pair.flipped { first } else { second };
        self.pair.surface.radius_about(to_core(moving.local_center))
    }

    /// Upper bound of the speed of any point of the surface from a time on, seen by the field; of its part against a touch's normal, if one
    /// is given. A point that a body turns about its centre c with ω has the speed |v + ω × (x − c)|; x − c is bounded at that time, and
    /// grows with the two velocities.
    fn speed(&self, time: f64, radius: f64, towards: Option<&Touch>) -> Speed {
        let [first, second] = self.motions;
        let (field, moving) = if self.pair.flipped { (second, first) } else { (first, second) };
        let speed = |velocity: Vector| f64::from(velocity.length());
        let linear = speed(field.linvel) + speed(moving.linvel);
        let straight = match towards {
            None => linear,
            Some(touch) => {
                let frame = field.position_at_time(time as f32).rotation;
                let normal = to_core(frame * to_parry(touch.normal));
                (to_core(field.linvel) - to_core(moving.linvel)).dot(&normal).max(0.0)
            }
        };
        let mut speeds = Speed { at_first: straight + speed(moving.angvel) * radius, growth: 0.0 };
        if field.angvel != Vector::ZERO {
            let centre = |motion: &NonlinearRigidMotion| {
                motion.position_at_time(time as f32).transform_point(motion.local_center)
            };
            let apart = speed(centre(field) - centre(moving));
            speeds.at_first += speed(field.angvel) * (radius + apart);
            // In the frame of the field the plane's normal stands still, and the velocities turn.
            let turned = if towards.is_some() { linear } else { 0.0 };
            speeds.growth = speed(field.angvel) * (linear + turned);
        }
        speeds
    }

    /// How far all of the surface is beyond a plane at right angles to the touch's normal, and all of the field's box before it.
    fn beyond_plane(&self, pose: &Pose, touch: &Touch) -> f64 {
        let (bounds, normal) = (&self.pair.bounds, touch.normal);
        let farthest = |axis: usize| if normal[axis] > 0.0 { bounds.max[axis] } else { bounds.min[axis] };
        let plane = Vector3::from([0, 1, 2].map(farthest)).dot(&normal);
        let Some(pose) = to_rigid(pose) else { return f64::NEG_INFINITY };
        let lowest = |points: &mut dyn Iterator<Item = Vector3<f64>>, border: f64| {
            points.map(|point| pose.push(point).dot(&normal) - border).fold(f64::INFINITY, f64::min)
        };
        let parts = self.pair.surface.parts.iter().map(|part| match part.rounding {
            Rounding::Swept { segment, radius } => lowest(&mut segment.into_iter(), radius),
            _ => lowest(&mut part.points.iter().copied().map(Vector3::from), part.border()),
        });
        parts.fold(f64::INFINITY, f64::min) - plane
    }

    /// Do the linear velocities carry the shapes apart?
    fn is_leaving(&self, touch: &Touch) -> bool {
        let [first, second] = self.motions;
        let (field, moving) = if self.pair.flipped { (second, first) } else { (first, second) };
        (field.start.rotation * to_parry(touch.normal)).dot(moving.linvel - field.linvel) >= 0.0
    }

    fn hit(&self, time: f64, pose: &Pose, touch: &Touch, status: ShapeCastStatus) -> ShapeCastHit {
        let normal = to_parry(touch.normal);
        let hit = ShapeCastHit {
            time_of_impact: time as f32,
            witness1: to_parry(touch.field_point),
            witness2: pose.inverse_transform_point(to_parry(touch.point)),
            normal1: normal,
            normal2: pose.rotation.inverse() * -normal,
            status,
            subshape1: 0,
            subshape2: 0,
        };
        if self.pair.flipped { hit.swapped() } else { hit }
    }
}
