//! How far do things get until the next search? Contacts are searched within that of what they touch.

use crate::World;

/// How far things get until the next search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Time until the next search.
    pub time: f64,
    /// Distance beside that of their own speed by which things get nearer to each other in it: what falls gains ½ g t².
    pub fall: f64,
    /// The margin is never larger, thickness not counted.
    pub max: f64,
}

impl Motion {
    /// Motion of everything in the world for a time.
    pub fn of(world: &World, time: f64) -> Self {
        let still = Self { time, fall: 0.0, max: f64::INFINITY };
        Self { fall: still.fall_from_rest(world), ..still }
    }

    /// How far things fall from rest until the next search, ½ g t².
    pub(crate) fn fall_from_rest(&self, world: &World) -> f64 {
        0.5 * world.gravity.norm() * self.time * self.time
    }

    /// Nothing moves: contacts are found where things touch already.
    pub const NONE: Self = Self { time: 0.0, fall: 0.0, max: 0.0 };

    /// The same against an obstacle whose surface moves at most at this speed: [`Surface::max_speed`](crate::Surface::max_speed) of a body's.
    #[must_use]
    pub fn toward(&self, speed: f64) -> Self {
        Self { fall: self.fall + speed * self.time, ..*self }
    }

    pub(crate) fn reach(&self, speed: f64) -> f64 {
        (speed * self.time + self.fall).min(self.max)
    }
}
