//! When does a moving shape arrive? By conservative advancement (Mirtich 1996): no point of the surface gets nearer, in φ, than slope
//! bound · speed · time, so that a step of φ over these never passes the field: by no more than the search for the lowest point misses.

use parry3d::math::{Pose, Vector};
use parry3d::query::details::ShapeCastOptions;
use parry3d::query::{NonlinearRigidMotion, ShapeCastHit, ShapeCastStatus};
use parry3d::shape::Shape;
use sdf_core::Sdf;

use crate::convert::{to_core, to_parry};
use crate::pair::Pair;
use crate::search::Search;
use crate::touch::Touch;

/// Two shapes in motion.
pub(crate) struct Cast<'a> {
    pub pair: &'a Pair,
    pub shapes: [&'a dyn Shape; 2],
    pub search: Search,
    /// Motions of the first and the second shape.
    pub motions: [&'a NonlinearRigidMotion; 2],
}

/// Steps of a cast. One that has not arrived by then is reported where it is, which is early.
const MAX_STEPS: u32 = 256;

/// The shapes have arrived within this fraction of the surface's size.
const AT_TARGET: f64 = 1e-4;

impl Cast<'_> {
    /// The first time at which the shapes are within the target distance; `None` if there is none until the last.
    pub fn run(&self, start: f32, options: ShapeCastOptions) -> Option<ShapeCastHit> {
        let end = f64::from(options.max_time_of_impact);
        let (target, within) = (f64::from(options.target_distance), AT_TARGET * self.pair.surface.radius());
        let rate = self.pair.field.slope_bound() * self.speed(start, end);
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
            time += left / rate;
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
        touch.map(|touch| (pose, touch))
    }

    /// Upper bound of the speed of any point of the surface, seen by the field. A point that a body turns about its centre c with ω has
    /// the speed |v + ω × (x − c)|; x − c is bounded at the start, and grows with the two velocities.
    fn speed(&self, start: f32, end: f64) -> f64 {
        let [first, second] = self.motions;
        let (field, moving) = if self.pair.flipped { (second, first) } else { (first, second) };
        let speed = |velocity: Vector| f64::from(velocity.length());
        let linear = speed(field.linvel) + speed(moving.linvel);
        let radius = self.pair.surface.radius_about(to_core(moving.local_center));
        let mut total = linear + speed(moving.angvel) * radius;
        if field.angvel != Vector::ZERO {
            let centre =
                |motion: &NonlinearRigidMotion| motion.position_at_time(start).transform_point(motion.local_center);
            let apart = speed(centre(field) - centre(moving)) + linear * (end - f64::from(start));
            total += speed(field.angvel) * (radius + apart);
        }
        total
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
