//! A field on a rigid motion between two poses: constant velocity v and constant spin ω in the world.
//!
//! ```text
//! c(t) = c₀ + t v,  R(t) = exp(t ω) R₀           a body's point x moves at u(x, t) = v + ω × (x − c(t))
//! φ_w(x, t) = φ(R(t)ᵀ (x − c(t)), t)             ∂φ_w/∂t = ∂φ/∂t − ∇φ_w · u(x, t)
//! ```
//!
//! A point on a straight path has the velocity ẋ − u relative to the field. It is an affine function of time and of the point, so
//! that its length is greatest at a corner of the element and at an end of the time.

use nalgebra::{Quaternion, Vector3};

use super::{MovingSdf, position, product, swept_bounds};
use crate::number::Float;
use crate::placed::{Placed, Placement, Rigid};
use crate::vector::{from_f64, norm};
use crate::{Aabb, Sdf};

/// A rigid motion at constant velocity and spin between two poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidMotion {
    now: Rigid,
    later: Rigid,
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
}

impl RigidMotion {
    /// The motion from one pose to another, by the shorter way around.
    pub fn between(now: Rigid, later: Rigid) -> Self {
        let velocity = Vector3::from(later.translation()) - Vector3::from(now.translation());
        let turn = later.unit_quaternion() * now.unit_quaternion().conjugate();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let axis = turn.imag();
        let sine = norm(axis);
        let angle = 2.0 * libm::atan2(sine, turn.w);
        let spin = if sine > 0.0 { axis * (angle / sine) } else { Vector3::zeros() };
        Self { now, later, velocity, spin }
    }

    /// The motion from a pose by a velocity and a spin: a vector along the axis, its length the angle in radians from time 0 to
    /// time 1, which may be more than one turn. `None` if one is not finite.
    pub fn new(now: Rigid, velocity: [f64; 3], spin: [f64; 3]) -> Option<Self> {
        let (velocity, spin) = (Vector3::from(velocity), Vector3::from(spin));
        let later = pose(&now, &velocity, &spin, 1.0)?;
        Some(Self { now, later, velocity, spin })
    }

    /// Velocity of the pose's origin: its displacement from time 0 to 1.
    pub fn velocity(&self) -> [f64; 3] {
        self.velocity.into()
    }

    /// Angle from time 0 to 1, in radians, along the axis of the turn.
    pub fn spin(&self) -> [f64; 3] {
        self.spin.into()
    }

    /// The pose at a time; at 0 and 1 the given ones.
    pub fn pose(&self, time: f64) -> Rigid {
        match time {
            0.0 => self.now,
            1.0 => self.later,
            _ => pose(&self.now, &self.velocity, &self.spin, time).unwrap_or(self.now),
        }
    }

    /// u: the velocity of the body's point that is at `point`.
    pub fn velocity_at<R: Float>(&self, point: Vector3<R>, time: f64) -> Vector3<R> {
        let centre = Vector3::from(self.now.translation()) + self.velocity * time;
        let [velocity, spin] = [self.velocity, self.spin].map(|vector| from_f64::<R>(vector.into()));
        velocity + spin.cross(&(point - from_f64(centre.into())))
    }

    /// Upper bound of |u| in a box from one time to another.
    fn max_speed(&self, region: &Aabb, from: f64, until: f64) -> f64 {
        if self.spin == Vector3::zeros() {
            return norm(self.velocity);
        }
        let mut speed = 0.0_f64;
        for corner in 0..8_u32 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { region.min[axis] } else { region.max[axis] };
            let point = Vector3::new(pick(0), pick(1), pick(2));
            speed = [from, until]
                .into_iter()
                .fold(speed, |speed, time| fastest(speed, norm(self.velocity_at(point, time))));
        }
        speed
    }

    /// A box in the moving frame that holds all of `region` at all of the times: a point passes through that frame at |u|.
    fn pull_bounds(&self, region: &Aabb, from: f64, until: f64) -> Aabb {
        let reach = product(self.max_speed(region, from, until), until - from);
        self.pose(from).pull_bounds(*region).inflate(reach)
    }
}

/// The pose moved by `time` of a velocity and a spin.
fn pose(now: &Rigid, velocity: &Vector3<f64>, spin: &Vector3<f64>, time: f64) -> Option<Rigid> {
    let translation = Vector3::from(now.translation()) + velocity * time;
    let angle = norm(*spin);
    let half = 0.5 * angle * time;
    let axis = if angle > 0.0 { spin / angle } else { Vector3::zeros() };
    let turn = Quaternion::from_parts(libm::cos(half), axis * libm::sin(half));
    let turned = turn * now.unit_quaternion();
    Rigid::new(translation.into(), [turned.i, turned.j, turned.k, turned.w])
}

/// A field on a rigid motion. The field itself may change, too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travelling<M> {
    /// The field, in its own frame.
    pub field: M,
    /// The frame's motion.
    pub motion: RigidMotion,
}

impl<M: MovingSdf> MovingSdf for Travelling<M> {
    type Moment<'a>
        = Placed<M::Moment<'a>, Rigid>
    where
        Self: 'a;

    fn at(&self, time: f64) -> Self::Moment<'_> {
        Placed { field: self.field.at(time), placement: self.motion.pose(time) }
    }

    fn time_derivative<R: Float>(&self, point: Vector3<R>, time: f64) -> R {
        let pulled = self.motion.pose(time).pull(point);
        let own = self.field.time_derivative(pulled.point, time);
        own - self.at(time).evaluate(point).gradient.dot(&self.motion.velocity_at(point, time))
    }

    fn fall_bound(&self, region: &Aabb, from: f64, until: f64) -> f64 {
        let speed = self.motion.max_speed(region, from, until);
        let carried = product(self.slope_bound_in(region, from, until), speed);
        carried + self.field.fall_bound(&self.motion.pull_bounds(region, from, until), from, until)
    }

    fn slope_bound_in(&self, region: &Aabb, from: f64, until: f64) -> f64 {
        self.field.slope_bound_in(&self.motion.pull_bounds(region, from, until), from, until)
    }

    fn approach_bound(&self, path: &[[Vector3<f64>; 2]], from: f64, until: f64) -> f64 {
        let relative_speed = path.iter().fold(0.0_f64, |speed, corner| {
            let at = |time: f64| norm(corner[1] - corner[0] - self.motion.velocity_at(position(corner, time), time));
            [at(from), at(until)].into_iter().fold(speed, fastest)
        });
        let region = self.motion.pull_bounds(&swept_bounds(path, from, until), from, until);
        let slope_bound = self.field.slope_bound_in(&region, from, until);
        product(slope_bound, relative_speed) + self.field.fall_bound(&region, from, until)
    }

    /// In the body's frame, where it does not turn: the element moves linearly there, too.
    fn free_until(&self, path: &[[Vector3<f64>; 2]], from: f64, until: f64, level: f64) -> f64 {
        let mut local = [[Vector3::zeros(); 2]; 4];
        let Some(local) = local.get_mut(..path.len()).filter(|_| self.motion.spin == Vector3::zeros()) else {
            return from;
        };
        for (local, corner) in local.iter_mut().zip(path) {
            *local = [0.0, 1.0].map(|time| self.motion.pose(time).pull(position(corner, time)).point);
        }
        self.field.free_until(local, from, until, level)
    }

    /// u, and beside it the velocity of the field's own surface.
    fn surface_velocity<R: Float>(&self, point: Vector3<R>, time: f64) -> Vector3<R> {
        let pulled = self.motion.pose(time).pull(point);
        let own = self.field.surface_velocity(pulled.point, time);
        self.motion.velocity_at(point, time) + pulled.jacobian.tr_mul(&own)
    }
}

/// The larger of two speeds; infinite if the second is NaN.
fn fastest(speed: f64, other: f64) -> f64 {
    if other.is_nan() { f64::INFINITY } else { speed.max(other) }
}
