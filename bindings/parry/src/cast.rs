//! When does a moving shape arrive? By conservative advancement (Mirtich 1996): no step passes the field, by no more than the search for the
//! lowest point misses. A step is the longer of two:
//!
//! | bound | step |
//! |---|---|
//! | no point of the surface gets nearer, in φ, than by slope bound · speed · time | φ over these |
//! | a plane before the field's box, its normal that of the nearest point, with all of the surface beyond | its distance over the speed towards it |
//!
//! The second lets a shape pass close by the flat side of another without a step for each gap of the way. Where neither gets on, because
//! shapes slide along each other, in touch or nearly so, a step leads to where the next of the points that approach arrives at its
//! present speed, or over a tenth of the smaller shape. What it passes over by then is looked for between its two ends.

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
    /// With those triangles that are in reach.
    pair: Pair,
    shapes: [&'a dyn Shape; 2],
    search: Search,
    /// Motions of the first and the second shape.
    motions: [&'a NonlinearRigidMotion; 2],
    start: f64,
    options: ShapeCastOptions,
    /// The smaller size of the two shapes.
    size: f64,
}

/// Steps of a cast. One that has not arrived by then is reported where it is, which is early: a shape that slides over some 96 of its sizes.
const MAX_STEPS: u32 = 1024;

/// The shapes have arrived within this fraction of the smaller one's size, and this many units in the last place of their distance.
const AT_TARGET: f64 = 1e-4;
const AT_TARGET_ULPS: f64 = 4.0;

/// After so many steps, and where shapes are in touch and may go on, points that do not approach each other no longer keep a step short.
const CERTIFIED_STEPS: u32 = 64;

/// Such a step is no longer than this, as a fraction of the smaller one's size.
const STEP_BESIDE: f64 = 0.1;

/// Speed of approach, as a fraction of all speeds, that is more than the rounding of normals and poses.
const APPROACHING: f64 = 1e-5;

/// Bisections that find where in such a step a touch began.
const HALVINGS: u32 = 24;

/// The shapes at a time.
#[derive(Clone, Copy)]
struct At {
    time: f64,
    /// Pose of the surface in the field's frame.
    pose: Pose,
    /// The lowest touch.
    touch: Touch,
}

impl<'a> Cast<'a> {
    /// `None` if neither shape is a field, or its partner has no triangles.
    pub fn new(
        shapes: [&'a dyn Shape; 2],
        search: Search,
        motions: [&'a NonlinearRigidMotion; 2],
        start: f32,
        options: ShapeCastOptions,
    ) -> Option<Self> {
        let pair = Pair::near(shapes, motions, start, &options)?;
        let size = pair.surface.radius().min(pair.bounds.diagonal() / 2.0);
        Some(Self { pair, shapes, search, motions, start: start.into(), options, size })
    }

    /// The first time at which the shapes are within the target distance; `None` if there is none until the last. If they are so at the
    /// start and may go on, the first at which they come nearer than they have been.
    pub fn run(&self) -> Option<ShapeCastHit> {
        let end = f64::from(self.options.max_time_of_impact);
        let target = f64::from(self.options.target_distance);
        let slope_bound = self.pair.field.slope_bound();
        let radius = self.radius();
        // A field can be wholly inside of the other shape only at the start: on the way there it touches.
        let (mut at, is_swallowed) = self.at_start()?;
        let within = self.within(&at.pose);
        let is_in_touch = at.touch.value - target <= within;
        let goes_on = is_in_touch && !self.options.stop_at_penetration;
        if is_in_touch && (is_swallowed || !goes_on) {
            let is_hit = !goes_on || self.approach(self.start, &at.touch).is_some();
            return is_hit.then(|| self.hit(&at, ShapeCastStatus::PenetratingOrWithinTargetDist));
        }
        // Not nearer than this they have been without a touch: it is of what they part from or slide along.
        let mut known = if goes_on { at.touch.value } else { target + 2.0 * within };
        for step in 1..MAX_STEPS {
            let (left, within) = (at.touch.value - target, self.within(&at.pose));
            known = known.max(at.touch.value.min(target + 2.0 * within));
            let speed = self.speed(at.time, radius, None);
            let mut way = 0.0_f64;
            if left > within {
                way = way.max(speed.time_of(left / slope_bound));
                let beyond = self.beyond_plane(&at.pose, &at.touch) - target;
                if beyond > within {
                    way = way.max(self.speed(at.time, radius, Some(&at.touch)).time_of(beyond));
                }
            }
            let is_relaxed = goes_on || step >= CERTIFIED_STEPS;
            if is_relaxed {
                let [shortest, longest] = [within, self.size * STEP_BESIDE].map(|way| speed.time_of(way));
                let beside = self.time_beside(&at, within).min(longest).max(shortest);
                // The last step may pass over something, too.
                way = way.max(beside).min((end - at.time).max(f64::MIN_POSITIVE));
            }
            let time = at.time + way;
            if time.is_nan() || time > end || (is_relaxed && at.time >= end) {
                return None;
            }
            let next = self.at(time)?;
            if next.touch.value <= known - within {
                let hit = if is_relaxed { self.first_between(&at, next, known) } else { next };
                return Some(self.hit(&hit, ShapeCastStatus::Converged));
            }
            at = next;
        }
        Some(self.hit(&at, ShapeCastStatus::OutOfIterations))
    }

    /// How near to the target distance shapes have arrived.
    fn within(&self, pose: &Pose) -> f64 {
        AT_TARGET * self.size + AT_TARGET_ULPS * f64::from(f32::EPSILON * pose.translation.length())
    }

    /// When the first of the touches that approach, and are not at the target distance yet, arrives if it goes on as it does.
    fn time_beside(&self, at: &At, within: f64) -> f64 {
        let target = f64::from(self.options.target_distance);
        let margin = target + within + self.pair.field.slope_bound() * self.size * STEP_BESIDE;
        let touches = self.pair.touches_by_value(&at.pose, margin, self.search).into_iter();
        let touches = touches.map(|touch| self.measured(&at.pose, touch)).filter(|touch| touch.value > target + within);
        let times = touches.filter_map(|touch| Some((touch.value - target) / self.approach(at.time, &touch)?));
        times.fold(f64::INFINITY, f64::min)
    }

    /// Where the shapes are as near as in the second of two moments, but were not in the first; at the start, if they come nearer from
    /// there on.
    fn first_between(&self, clear: &At, near: At, known: f64) -> At {
        let (first, mut clear, mut near) = (clear.time, clear.time, near);
        for _ in 0..HALVINGS {
            let Some(middle) = self.at(f64::midpoint(clear, near.time)) else { break };
            let is_near = middle.touch.value <= known - self.within(&middle.pose);
            if is_near { near = middle } else { clear = middle.time }
        }
        let halfway = if first == self.start { self.at(f64::midpoint(first, near.time)) } else { None };
        let is_from_start = halfway.is_some_and(|at| at.touch.value <= known - 0.25 * self.within(&at.pose));
        if is_from_start { At { time: first, ..near } } else { near }
    }

    /// The surface's pose in the field's frame.
    fn pose(&self, time: f64) -> Pose {
        let [first, second] = self.motions.map(|motion| motion.position_at_time(time as f32));
        self.pair.pose(&first.inv_mul(&second))
    }

    fn at(&self, time: f64) -> Option<At> {
        let pose = self.pose(time);
        let touch = self.pair.nearest(&pose, self.search)?;
        Some(At { time, pose, touch: self.measured(&pose, touch) })
    }

    /// The shapes at the start, and whether one is wholly around a part of the field: then the touch is the way out.
    fn at_start(&self) -> Option<(At, bool)> {
        let (time, pose) = (self.start, self.pose(self.start));
        if self.pair.swallowed(self.shapes, &pose).is_none() {
            return self.at(time).map(|at| (at, false));
        }
        // The way out is to any triangle, in reach or not.
        let whole = Pair::new(self.shapes[0], self.shapes[1])?;
        let (touch, intersects) = whole.nearest_or_way_out(self.shapes, &pose, self.search);
        touch.map(|touch| (At { time, pose, touch }, intersects && !touch.is_of_triangles()))
    }

    /// The touch; by the nearest points of both shapes where φ is less than a distance, as a border around triangles is not wider for that.
    fn measured(&self, pose: &Pose, touch: Touch) -> Touch {
        let is_beside = touch.is_measured && touch.border > 0.0 && touch.gap > 0.0;
        if is_beside { self.pair.apart(self.shapes, pose, touch) } else { touch }
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

    /// The speed at which the two points of a touch come nearer to each other; `None` if they do not.
    fn approach(&self, time: f64, touch: &Touch) -> Option<f64> {
        let [first, second] = self.motions;
        let (field, moving) = if self.pair.flipped { (second, first) } else { (first, second) };
        let place = field.position_at_time(time as f32);
        let velocity = |motion: &NonlinearRigidMotion, point: Vector3<f64>| {
            let centre = motion.position_at_time(time as f32).transform_point(motion.local_center);
            let arm = place.transform_point(to_parry(point)) - centre;
            to_core(motion.linvel) + to_core(motion.angvel).cross(&to_core(arm))
        };
        let (of_field, of_moving) = (velocity(field, touch.field_point), velocity(moving, touch.point));
        let speed = of_field.norm() + of_moving.norm();
        let normal = to_core(place.rotation * to_parry(touch.normal));
        Some((of_field - of_moving).dot(&normal)).filter(|approach| *approach > APPROACHING * speed)
    }

    fn hit(&self, At { time, pose, touch }: &At, status: ShapeCastStatus) -> ShapeCastHit {
        let normal = to_parry(touch.normal);
        let hit = ShapeCastHit {
            time_of_impact: *time as f32,
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
