//! How fast may a surface become within a frame? About as fast as the fastest of those that may strike it, directly or through others: nothing
//! rebounds, but what is struck beside its center turns, and its far end is faster.

use sdf_core::Aabb;

use crate::motion::Motion;
use crate::surface::Surface;
use crate::world::World;

/// A surface until the next search.
pub(super) struct Struck {
    /// Largest speed of its vertices now.
    pub speed: f64,
    /// Largest speed that it may have once it was struck.
    fastest: f64,
    bounds: Option<Aabb>,
    /// The box that it may reach.
    reached: Option<Aabb>,
}

impl Struck {
    /// All surfaces. Speeds go on from one to another as long as the boxes that they may reach meet.
    pub fn all(surfaces: &[Surface], world: &World, motion: &Motion, thickness: f64) -> Vec<Self> {
        let margin = |speed: f64| thickness + speed * motion.time + motion.fall;
        let still = |surface: &Surface| {
            let (speed, bounds) = (surface.max_speed(world), surface.bounds(world));
            Self { speed, fastest: speed, bounds, reached: bounds.map(|bounds| bounds.inflate(margin(speed))) }
        };
        let mut all: Vec<Self> = surfaces.iter().map(still).collect();
        // Each round gives some surface the speed of another: there is an end.
        let mut is_changed = true;
        while is_changed {
            is_changed = false;
            for striker in 0..all.len() {
                for index in 0..all.len() {
                    let fastest = all[striker].fastest;
                    if all[index].fastest < fastest && all[index].meets(&all[striker]) {
                        let struck = &mut all[index];
                        struck.fastest = fastest;
                        struck.reached = struck.bounds.map(|bounds| bounds.inflate(margin(fastest)));
                        is_changed = true;
                    }
                }
            }
        }
        all
    }

    /// Speed that strikes may add to its own.
    pub fn gain(&self) -> f64 {
        (self.fastest - self.speed).max(0.0)
    }

    /// May the two touch?
    pub fn meets(&self, other: &Self) -> bool {
        let (Some(a), Some(b)) = (&self.reached, &other.reached) else { return false };
        a.intersection(b).is_some()
    }
}
