//! Which things touch in a frame, and how far have the normals turned where they press?

use std::collections::{BTreeMap, BTreeSet};

use sdf_core::contact::Contact;

use crate::V3;

/// Contacts of a frame beside those of the frame before.
#[derive(Default)]
pub(super) struct Touching {
    /// Largest distance of a contact that presses.
    reach: f64,
    /// Pairs that touch: numbers of two surfaces, or of a surface and, after all of those, an obstacle.
    pairs: BTreeSet<[usize; 2]>,
    /// Normals of the contacts that press, by surface, the other surface or obstacle, and key.
    normals: BTreeMap<(usize, usize, u64), V3>,
    /// Normals of the frame before.
    before: BTreeMap<(usize, usize, u64), V3>,
}

impl Touching {
    /// A contact presses up to the distance `reach`.
    pub fn new(reach: f64) -> Self {
        Self { reach, ..Self::default() }
    }

    /// Begins a frame.
    pub fn begin(&mut self) {
        self.pairs.clear();
        self.before = std::mem::take(&mut self.normals);
    }

    /// Adds all contacts of a surface with one other surface or obstacle.
    pub fn add(&mut self, surface: usize, other: usize, found: &[Contact<f64>]) {
        self.pairs.extend((!found.is_empty()).then_some([surface.min(other), surface.max(other)]));
        let pressing = found.iter().filter(|contact| contact.distance <= self.reach);
        self.normals.extend(pressing.map(|contact| ((surface, other, contact.key()), contact.normal)));
    }

    /// How many pairs touch.
    pub fn pair_count(&self) -> usize {
        self.pairs.len()
    }

    /// The largest turn of the normal of a contact that presses now and did in the frame before, in degrees.
    pub fn turned(&self) -> f64 {
        let turn = |(key, now): (&_, &V3)| self.before.get(key).map_or(0.0, |then| angle(then, now));
        self.normals.iter().map(turn).fold(0.0, f64::max)
    }
}

/// Degrees between two unit vectors.
fn angle(a: &V3, b: &V3) -> f64 {
    a.cross(b).norm().atan2(a.dot(b)).to_degrees()
}
