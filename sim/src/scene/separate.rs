//! Which way do rigid bodies part that start deep inside of each other?
//!
//! Each of their contacts pushes to the nearest side, some one way and some another, and together they hold what they should part. So a pair
//! that is that deep before the first frame gets one row in place of all its contacts: between the centers, along the direction n in which the
//! two have to move least, until no element is deep any more.
//!
//! ```text
//! way(n) = max over vertices of one of n · x − min over those of the other,    n: the direction where it is least
//! ```
//!
//! That is the way until a plane across n is between the two, exact for convex bodies, and an upper bound for others. It is sought on 200
//! directions and the axes of both, then downhill from the best. The row turns nothing, and parts the two at the recovery speed.

use std::collections::{BTreeMap, BTreeSet};

use sdf_core::contact::{Contact, Row, RowSide};
use sdf_field::{Field, Threads};

use crate::query::Contacts;
use crate::surface::{Carrier, Surface};
use crate::{Body, V3, World};

/// A pair is deep where an element to which no side is opposite, or a center, is inside by the thickness and this share of the smaller body's
/// radius.
const DEEP: f64 = 0.01;

/// Directions over the sphere.
const DIRECTIONS: u32 = 200;

/// Rounds downhill from the best of them, each with a step that is half of the last or no smaller.
const ROUNDS: u32 = 40;

/// Pairs that started deep inside of each other, by the numbers of their surfaces, the lower one first.
#[derive(Debug, Default)]
pub(super) struct Separations {
    /// The direction in which the first one parts, and one of the pair's contacts.
    pairs: BTreeMap<[usize; 2], (V3, Contact<f64>)>,
    /// Pairs that are deep in this frame.
    deep: BTreeSet<[usize; 2]>,
    has_started: bool,
    thickness: f64,
}

impl Separations {
    pub fn new(thickness: f64) -> Self {
        Self { thickness, ..Self::default() }
    }

    /// Looks at the contacts of surface `a` with the body `b` and its field, those from `first` on. Takes them away where the two part.
    pub fn take(
        &mut self,
        [a, b]: [usize; 2],
        surfaces: &[Surface],
        world: &World,
        field: &Field,
        contacts: &mut Contacts,
        first: usize,
    ) {
        let pair = [a.min(b), a.max(b)];
        let is_known = self.pairs.contains_key(&pair);
        let buried = contacts.buried.take().filter(|_| is_known || !self.has_started);
        if let (Some(contact), Some((_, body)), Some((_, other))) =
            (buried, body_of(&surfaces[a], world), body_of(&surfaces[b], world))
        {
            let center = other.local_point(&body.position);
            let depth = (-contact.distance).max(-field.sample(&[center.into()], Threads::ONE)[0].value);
            if depth > self.thickness + DEEP * surfaces[a].radius().min(surfaces[b].radius()) {
                self.deep.insert(pair);
                let direction = || shortest(pair.map(|index| &surfaces[index]), world);
                self.pairs.entry(pair).or_insert_with(|| (direction(), contact));
            }
        }
        if self.pairs.contains_key(&pair) {
            contacts.truncate(first);
        }
    }

    /// Adds the rows of a frame whose contacts have all been looked at.
    pub fn push(&mut self, surfaces: &[Surface], world: &World, contacts: &mut Contacts) {
        self.has_started = true;
        for (pair, (normal, contact)) in &self.pairs {
            let both = pair.map(|index| &surfaces[index]);
            let [Some((a, first)), Some((b, second))] = both.map(|surface| body_of(surface, world)) else { continue };
            let side = |body| RowSide::Body { body, arm: V3::zeros() };
            let contact =
                Contact { normal: *normal, point: first.position, surface_point: second.position, ..*contact };
            let row = Row {
                gap: -way(&both.map(|surface| surface.points(world)), normal) - self.thickness,
                normal: *normal,
                point: contact.point,
                surface_point: contact.surface_point,
                surface_velocity: V3::zeros(),
                thickness: self.thickness,
                friction: 0.0,
                element: side(a),
                field: side(b),
                key: contact.key(),
            };
            contacts.push(contact, row);
        }
        let deep = std::mem::take(&mut self.deep);
        self.pairs.retain(|pair, _| deep.contains(pair));
    }
}

fn body_of<'a>(surface: &Surface, world: &'a World) -> Option<(u32, &'a Body)> {
    match surface.carrier {
        Carrier::Body { id, .. } => Some((id, &world.bodies[id as usize])),
        _ => None,
    }
}

/// The way that the first points have to move along `direction` until they are beyond the second ones.
fn way([first, second]: &[Vec<[f64; 3]>; 2], direction: &V3) -> f64 {
    let along = |point: &[f64; 3]| direction.dot(&V3::from(*point));
    second.iter().map(along).fold(f64::NEG_INFINITY, f64::max) - first.iter().map(along).fold(f64::INFINITY, f64::min)
}

/// The direction in which the first surface has to move least until it is beyond the second.
fn shortest(surfaces: [&Surface; 2], world: &World) -> V3 {
    let points = surfaces.map(|surface| surface.points(world));
    let axes = surfaces.iter().filter_map(|surface| body_of(surface, world));
    let axes = axes.flat_map(|(_, body)| [V3::x(), V3::y(), V3::z()].map(|axis| body.rotation * axis));
    let mut best = (f64::INFINITY, V3::z());
    let mut look = |direction: V3| {
        let found = way(&points, &direction);
        let is_less = found < best.0;
        if is_less {
            best = (found, direction);
        }
        (is_less, best.1)
    };
    axes.flat_map(|axis| [axis, -axis]).chain((0..DIRECTIONS).map(on_sphere)).for_each(|direction| {
        look(direction);
    });
    let mut step = 0.1;
    for _ in 0..ROUNDS {
        let at = look(V3::z()).1;
        let tangents = [at.cross(&V3::x()), at.cross(&V3::y()), at.cross(&V3::z())];
        let sides = tangents.iter().flat_map(|tangent| [*tangent, -tangent]);
        let is_less =
            sides.map(|side| look((at + side * step).normalize()).0).fold(false, |any, is_less| any | is_less);
        step *= if is_less { 1.0 } else { 0.5 };
    }
    best.1
}

/// A direction of a spiral that covers the sphere evenly (Vogel 1979).
fn on_sphere(index: u32) -> V3 {
    let z = 1.0 - (2.0 * f64::from(index) + 1.0) / f64::from(DIRECTIONS);
    let (sin, cos) = (f64::from(index) * std::f64::consts::PI * (3.0 - 5_f64.sqrt())).sin_cos();
    let radius = (1.0 - z * z).sqrt();
    V3::new(radius * cos, radius * sin, z)
}
