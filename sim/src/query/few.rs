//! Few contacts of a rigid body with one obstacle, in place of many.

use sdf_core::Aabb;
use sdf_core::contact::{Contact, Reduction};

use super::{Contacts, Query};
use crate::motion::Motion;
use crate::{Body, V3};

impl Query {
    /// Keeps the contacts that hold a body best while it moves as far as `reach`, and comes free.
    pub(super) fn keep_few(&self, count: usize, reach: f64, found: &mut Vec<Contact<f64>>, contacts: &mut Contacts) {
        let depth = found.iter().map(|contact| self.thickness - contact.distance).fold(0.0, f64::max);
        let reduction = Reduction { count, movement: reach + depth, thickness: self.thickness };
        let mut scratch = vec![0.0; found.len()];
        // There is no reduction where nothing moves and nothing is deep: then all are kept.
        if let Some(reduced) = reduction.apply(found, &mut scratch) {
            found.truncate(reduced.count);
            contacts.shortfall = contacts.shortfall.max(reduced.shortfall);
        }
    }
}

/// How far a rigid body moves against an obstacle until contacts at these points are found again, as [`Reduction::movement`] has it: about
/// the box around them, which may lie beside the centers of both. `motion` is [toward](Motion::toward) the obstacle.
pub(super) fn reach(
    points: impl Iterator<Item = [f64; 3]>,
    body: &Body,
    obstacle_angular_speed: f64,
    motion: &Motion,
) -> f64 {
    let Some(bounds) = Aabb::from_points(points) else { return 0.0 };
    let center = (V3::from(bounds.min) + V3::from(bounds.max)) * 0.5;
    let radius = 0.5 * bounds.diagonal();
    let arm = (center - body.position).norm() + radius;
    // The obstacle's speed is that of its surface, where the contacts are: the box's center is within a radius of one.
    let of_obstacle = 2.0 * radius * obstacle_angular_speed;
    motion.reach(body.velocity.norm() + body.angular_velocity().norm() * arm + of_obstacle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_contact_moves_farther_than_the_reach_whichever_body_turns() {
        let spinning = |velocity: V3, spin: V3| {
            let mut body = Body { velocity, inv_mass: 1.0, inv_inertia: Body::fixed().inertia, ..Body::fixed() };
            body.set_angular_velocity(&spin);
            body
        };
        let mut sharpest = 0.0_f64;
        for index in 0..3000 {
            let random = |salt: u32| (f64::from(index) * 12.9898 + f64::from(salt) * 78.233).sin();
            let vector = |salt: u32| V3::new(random(salt), random(salt + 1), random(salt + 2));
            // The obstacle is a ball of radius 1 about the origin, and the body beside it: one of them moves, or both.
            let strengths = [[0.0, 1.0], [1.0, 0.0], [1.0, 0.3]][index as usize % 3];
            let mut body = spinning(vector(1) * strengths[0], vector(4) * strengths[0]);
            let obstacle = spinning(vector(7) * strengths[1] * 0.1, vector(10) * strengths[1]);
            body.position = vector(13) * 2.0;
            let points: Vec<[f64; 3]> = (0..1 + index % 4).map(|k| vector(16 + 3 * k).normalize().into()).collect();
            let spin = obstacle.angular_velocity();
            let motion =
                Motion { time: 0.1, fall: 0.0, max: f64::INFINITY }.toward(obstacle.velocity.norm() + spin.norm());
            let reach = reach(points.iter().copied(), &body, spin.norm(), &motion);
            // |v| + |ω| · L, as the reduction has it.
            let bounds = Aabb::from_points(points.iter().copied()).unwrap();
            let center = (V3::from(bounds.min) + V3::from(bounds.max)) * 0.5;
            let at_center = |body: &Body| body.velocity + body.angular_velocity().cross(&(center - body.position));
            let turn = (body.angular_velocity() - spin).norm();
            let movement = 0.1 * ((at_center(&body) - at_center(&obstacle)).norm() + turn * 0.5 * bounds.diagonal());
            assert!(movement <= reach + 1e-12, "{index}: {movement} of {reach}");
            sharpest = sharpest.max(movement / reach);
        }
        assert!(sharpest > 0.9, "{sharpest} at most: the cases are not sharp");
    }
}
