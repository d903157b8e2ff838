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
//! That is the way until a plane across n is between the two, exact for convex bodies, and an upper bound for others. It is sought on 400
//! directions, the axes of both and those across an axis of each, which have the least way of two boxes (Gottschalk, Lin and Manocha 1996),
//! then downhill from the best few. The row turns nothing, and parts the two at the recovery speed.
//!
//! The two are taken in the order of their places, so that it does not matter which was named first.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use sdf_core::contact::{Contact, Row, RowSide};
use sdf_core::nalgebra::UnitQuaternion;
use sdf_field::{Field, Threads};

use crate::query::Contacts;
use crate::surface::{Carrier, Surface};
use crate::{Body, V3, World};

/// A pair is deep where an element to which no side is opposite, or a center, is inside by the thickness and this share of the smaller body's
/// radius.
const DEEP: f64 = 0.01;

/// Directions over the sphere, each with its opposite.
const DIRECTIONS: u32 = 200;

/// From so many of the best of them it goes downhill.
const STARTS: usize = 6;

/// Sine of the angle between two axes below which nothing is across both.
const LEAST_ANGLE: f64 = 1e-6;

/// Rounds downhill, each with a step that is half of the last or no smaller.
const ROUNDS: u32 = 40;

/// Pairs that started deep inside of each other, by the numbers of their surfaces, the lower one first.
#[derive(Debug, Default)]
pub(super) struct Separations {
    pairs: BTreeMap<[usize; 2], Parting>,
    /// Pairs that are deep in this frame.
    deep: BTreeSet<[usize; 2]>,
    /// The contacts of each pair in this frame: either body's with the other.
    looked_at: Vec<([usize; 2], Range<usize>)>,
    has_started: bool,
    thickness: f64,
}

/// How a pair parts.
#[derive(Debug)]
struct Parting {
    /// The surfaces in the order of their places.
    order: [usize; 2],
    /// The direction in which the first one parts.
    normal: V3,
    /// One of the pair's contacts.
    contact: Contact<f64>,
}

impl Separations {
    pub fn new(thickness: f64) -> Self {
        Self { thickness, ..Self::default() }
    }

    /// Looks at the contacts of surface `a` with the body `b` and its field, those from `first` on.
    pub fn look(
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
                self.pairs.entry(pair).or_insert_with(|| {
                    let order = if is_before(body, other) { [a, b] } else { [b, a] };
                    Parting { order, normal: shortest(order.map(|index| &surfaces[index]), world), contact }
                });
            }
        }
        self.looked_at.push((pair, first..contacts.contacts.len()));
    }

    /// One row for each pair that parts, in place of its contacts, once those of the frame have all been looked at.
    pub fn replace(&mut self, surfaces: &[Surface], world: &World, contacts: &mut Contacts) {
        self.has_started = true;
        let looked_at = std::mem::take(&mut self.looked_at);
        if !self.pairs.is_empty() {
            let of_pairs = looked_at.into_iter().filter(|(pair, _)| self.pairs.contains_key(pair));
            let replaced: BTreeSet<usize> = of_pairs.flat_map(|(_, range)| range).collect();
            let others: Vec<usize> = (0..contacts.contacts.len()).filter(|index| !replaced.contains(index)).collect();
            contacts.pick(&others);
        }
        for Parting { order, normal, contact } in self.pairs.values() {
            let both = order.map(|index| &surfaces[index]);
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

/// Does the first body come before the second by its place, or where that is the same by its turn? Of two at one place either may.
fn is_before(first: &Body, second: &Body) -> bool {
    let place = |body: &Body| {
        let turn = body.rotation.coords;
        [body.position.x, body.position.y, body.position.z, turn.x, turn.y, turn.z, turn.w]
    };
    place(first)
        .into_iter()
        .zip(place(second))
        .map(|(a, b)| a.total_cmp(&b))
        .find(|order| order.is_ne())
        .is_some_and(Ordering::is_lt)
}

/// The direction in which the first surface has to move least until it is beyond the second.
fn shortest(surfaces: [&Surface; 2], world: &World) -> V3 {
    let points = surfaces.map(|surface| surface.points(world));
    let axes = surfaces.map(|surface| {
        let turn = body_of(surface, world).map_or_else(UnitQuaternion::identity, |(_, body)| body.rotation);
        [V3::x(), V3::y(), V3::z()].map(|axis| turn * axis)
    });
    let across = axes[0].iter().flat_map(|a| axes[1].iter().filter_map(|b| a.cross(b).try_normalize(LEAST_ANGLE)));
    let all = axes.as_flattened().iter().copied().chain(across).chain((0..DIRECTIONS).map(on_sphere));
    let mut starts: Vec<(f64, V3)> =
        all.flat_map(|axis| [axis, -axis]).map(|axis| (way(&points, &axis), axis)).collect();
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let ends = starts.into_iter().take(STARTS).map(|start| downhill(&points, start));
    ends.reduce(|a, b| if b.0 < a.0 { b } else { a }).map_or_else(V3::z, |(_, direction)| direction)
}

fn downhill(points: &[Vec<[f64; 3]>; 2], mut best: (f64, V3)) -> (f64, V3) {
    let mut step = 0.1;
    for _ in 0..ROUNDS {
        let (before, at) = best;
        let tangents = [at.cross(&V3::x()), at.cross(&V3::y()), at.cross(&V3::z())];
        for side in tangents.iter().flat_map(|tangent| [*tangent, -tangent]) {
            let direction = (at + side * step).normalize();
            let found = way(points, &direction);
            best = if found < best.0 { (found, direction) } else { best };
        }
        step *= if best.0 < before { 1.0 } else { 0.5 };
    }
    best
}

/// A direction of a spiral that covers the sphere evenly (Vogel 1979).
fn on_sphere(index: u32) -> V3 {
    let z = 1.0 - (2.0 * f64::from(index) + 1.0) / f64::from(DIRECTIONS);
    let (sin, cos) = (f64::from(index) * std::f64::consts::PI * (3.0 - 5_f64.sqrt())).sin_cos();
    let radius = (1.0 - z * z).sqrt();
    V3::new(radius * cos, radius * sin, z)
}
