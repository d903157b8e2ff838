//! Rigid bodies: a pose, a velocity, and the angular momentum, which torque-free motion keeps to the last bit.
//!
//! With L kept, ω = I⁻¹L. A step turns by the ω at its middle (Lie midpoint rule), so that the energy L·I⁻¹L / 2 drifts by O(dt²)
//! and does not grow. Pushes change L by arm × push, and turn the body at once by I⁻¹(arm × push) · dt (Müller et al. 2020).

use sdf_core::Aabb;
use sdf_core::nalgebra::{Isometry3, Matrix3, Quaternion, UnitQuaternion};
use sdf_core::placed::Rigid;

use crate::V3;

/// A rigid body. Its frame's origin is the center of mass.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Center of mass, in the world.
    pub position: V3,
    /// World from body.
    pub rotation: UnitQuaternion<f64>,
    /// Velocity of the center of mass.
    pub velocity: V3,
    /// Angular momentum about the center of mass, in the world.
    pub momentum: V3,
    /// 1 / mass; 0 for a body that nothing moves.
    pub inv_mass: f64,
    /// About the center of mass, in the body's frame.
    pub inertia: Matrix3<f64>,
    /// The inverse of `inertia`; 0 for a body that nothing turns.
    pub inv_inertia: Matrix3<f64>,
}

impl Body {
    /// A body of a closed mesh, its faces counterclockwise from outside, and the mesh's points in the body's frame: moved so that the
    /// center of mass is at the origin. `None` if the volume is not positive, nor the inertia about every axis, or a face names a point that is
    /// not there.
    ///
    /// Signed tetrahedra from the middle of the mesh's box, so that a place far away costs no digits:
    /// ∫ x xᵀ dV = det/120 · ((a+b+c)(a+b+c)ᵀ + aaᵀ + bbᵀ + ccᵀ).
    pub fn of_mesh(points: &[[f64; 3]], faces: &[[u32; 3]], mass: f64) -> Option<(Self, Vec<[f64; 3]>)> {
        let Aabb { min, max } = Aabb::from_points(points.iter().copied())?;
        let middle = V3::from(min) * 0.5 + V3::from(max) * 0.5;
        let (mut volume, mut first, mut second) = (0.0, V3::zeros(), Matrix3::zeros());
        for face in faces {
            let corner = |vertex: u32| points.get(vertex as usize).map(|point| V3::from(*point) - middle);
            let [a, b, c] = face.map(corner);
            let (a, b, c) = (a?, b?, c?);
            let det = a.dot(&b.cross(&c));
            let sum = a + b + c;
            volume += det / 6.0;
            first += sum * (det / 24.0);
            second +=
                (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose()) * (det / 120.0);
        }
        let center = first / volume;
        let second = (second / volume - center * center.transpose()) * mass;
        let inertia = Matrix3::identity() * second.trace() - second;
        let inv_inertia = inertia.try_inverse().filter(|_| volume > 0.0 && inertia.cholesky().is_some())?;
        let center = middle + center;
        let points = points.iter().map(|point| (V3::from(*point) - center).into()).collect();
        Some((Self { position: center, inv_mass: 1.0 / mass, inertia, inv_inertia, ..Self::fixed() }, points))
    }

    /// A body at the origin that nothing moves.
    pub fn fixed() -> Self {
        Self {
            position: V3::zeros(),
            rotation: UnitQuaternion::identity(),
            velocity: V3::zeros(),
            momentum: V3::zeros(),
            inv_mass: 0.0,
            inertia: Matrix3::identity(),
            inv_inertia: Matrix3::zeros(),
        }
    }

    /// World from body, as the core has it.
    pub fn pose(&self) -> Option<Rigid> {
        let q = self.rotation.quaternion();
        Rigid::new(self.position.into(), [q.i, q.j, q.k, q.w])
    }

    /// World from body.
    pub fn isometry(&self) -> Isometry3<f64> {
        Isometry3::from_parts(self.position.into(), self.rotation)
    }

    /// World point of a point in the body's frame.
    pub fn world_point(&self, arm: &V3) -> V3 {
        self.position + self.rotation * arm
    }

    /// Point in the body's frame of a world point.
    pub fn local_point(&self, point: &V3) -> V3 {
        self.rotation.inverse() * (point - self.position)
    }

    /// ω, in the world.
    pub fn angular_velocity(&self) -> V3 {
        self.apply_inv_inertia(&self.momentum)
    }

    /// Sets ω, in the world.
    pub fn set_angular_velocity(&mut self, angular: &V3) {
        self.momentum = self.rotation * (self.inertia * (self.rotation.inverse() * angular));
    }

    /// Kinetic energy.
    pub fn kinetic_energy(&self) -> f64 {
        if self.inv_mass <= 0.0 {
            return 0.0;
        }
        0.5 * (self.velocity.norm_squared() / self.inv_mass + self.momentum.dot(&self.angular_velocity()))
    }

    fn apply_inv_inertia(&self, momentum: &V3) -> V3 {
        self.rotation * (self.inv_inertia * (self.rotation.inverse() * momentum))
    }

    /// Moves freely for a time.
    pub(crate) fn advance(&mut self, dt: f64) {
        self.position += self.velocity * dt;
        let start = self.rotation;
        // ω at the middle depends on the turn to the middle: three rounds of the fixed point.
        let mut angular = self.angular_velocity();
        for _ in 0..3 {
            self.rotation = turn(&(angular * (0.5 * dt))) * start;
            angular = self.angular_velocity();
        }
        self.rotation = turn(&(angular * dt)) * start;
    }

    /// Length that a push of one unit along `direction` at the arm, in the world, moves the point: 1/m + (r × n)·I⁻¹(r × n).
    pub(crate) fn inv_mass_at(&self, arm: &V3, direction: &V3) -> f64 {
        let lever = self.rotation.inverse() * arm.cross(direction);
        self.inv_mass + lever.dot(&(self.inv_inertia * lever))
    }

    /// Pushes at the arm, in the world, by mass · length, within a step of `dt`.
    pub(crate) fn push(&mut self, arm: &V3, push: &V3, dt: f64) {
        if self.inv_mass <= 0.0 {
            return;
        }
        self.position += push * self.inv_mass;
        self.velocity += push * (self.inv_mass / dt);
        self.twist(&arm.cross(push), dt);
    }

    /// Turns the body by a twist, mass · length², within a step of `dt`.
    pub(crate) fn twist(&mut self, twist: &V3, dt: f64) {
        self.rotation = turn(&self.apply_inv_inertia(twist)) * self.rotation;
        self.momentum += twist / dt;
    }

    /// Moves the body, and the pose that it had, as a push and its twist would, without a change of velocity.
    pub(crate) fn shift(&mut self, push: &V3, twist: &V3, position: &mut V3, rotation: &mut UnitQuaternion<f64>) {
        if self.inv_mass <= 0.0 {
            return;
        }
        let turned = turn(&self.apply_inv_inertia(twist));
        self.position += push * self.inv_mass;
        *position += push * self.inv_mass;
        self.rotation = turned * self.rotation;
        *rotation = turned * *rotation;
    }
}

/// The rotation by |v| about v: the quaternion (v/2 · sinc, cos), renormalized.
fn turn(v: &V3) -> UnitQuaternion<f64> {
    let half = 0.5 * v.norm();
    // sin h / h: the series is exact to rounding below 1e-3.
    let sinc = if half < 1e-3 { 1.0 - half * half / 6.0 } else { half.sin() / half };
    let w = v * (0.5 * sinc);
    UnitQuaternion::new_normalize(Quaternion::new(half.cos(), w.x, w.y, w.z))
}
