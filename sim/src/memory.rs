//! Which elements need no search this frame? [`Memory`](crate::Memory) keeps what the last search of a surface against an obstacle told.
//!
//! All of it is kept in the frame in which the obstacle's field stands still. Let w be the longest way of an element's corners since it
//! was searched.
//!
//! - **It had no contact.** Then φ was above the margin that the search was given: `auto` and `certified` prove that, unless their budget
//!   ends. Now φ is above that margin − slope bound · w.
//! - **It had one.** As long as w is at most [`Query::hold`](crate::Query::hold), the same point of the element and the same plane stay;
//!   the gap is measured anew. The element's true minimum is below that by no more than 2 · slope bound · hold.
//! - **It is searched anew.** The points where it touched before are evaluated again and stay contacts, three at most. A face that
//!   rests on two places would else be told of the deeper one, sink at the other, be told of that, and rock for ever.
//! - **Its plane stays** until its point has moved farther than [`Query::keep`](crate::Query::keep): a face that swings about the tip of
//!   a spine keeps point and normal there. A minimum found at that point takes its place if the plane tells over 2 · hold more, and one found
//!   elsewhere is added: so the guarantee above holds.
//!
//! So what is at rest keeps its contacts, bit for bit, and a solver comes to rest on them. A search anew finds another point of the
//! same flat minimum, and its push starts the next one.

use std::collections::BTreeMap;

use sdf_core::contact::{Contact, Feature};
use sdf_core::nalgebra::Isometry3;

use crate::V3;

/// Elements of one kind.
#[derive(Clone, Debug, Default)]
pub(crate) struct Known {
    /// Corners at the last search.
    corners: Vec<[V3; 3]>,
    /// Margin of the last search.
    margins: Vec<f64>,
    /// Each element's contacts: planes that were kept, the last minimum, other points.
    contacts: BTreeMap<u32, Vec<Contact<f64>>>,
}

/// Elements to search, and their margins.
#[derive(Default)]
pub(crate) struct Asked<const N: usize> {
    pub ids: Vec<u32>,
    pub elements: Vec<[u32; N]>,
    pub margins: Vec<f64>,
    /// Contacts of them from before.
    pub old: Vec<Contact<f64>>,
}

/// Contacts from before, evaluated again.
#[derive(Default)]
pub(crate) struct Again {
    /// Contacts whose plane is kept, and the gap that it tells now.
    planes: Vec<(Contact<f64>, f64)>,
    /// The others, as they are now.
    points: Vec<Contact<f64>>,
}

impl Again {
    /// Adds a contact from before, which was found as `now` at the same point of its element. Its plane is kept if the point moved no
    /// farther than `keep`.
    pub fn add(&mut self, before: &Contact<f64>, now: Contact<f64>, keep: f64) {
        let way = now.point - before.point;
        match way.norm() <= keep {
            true => self.planes.push((*before, before.distance + before.normal.dot(&way))),
            false => self.points.push(now),
        }
    }
}

/// Contacts of one element that are kept at most: a triangle rests on three points.
const MAX_CONTACTS: usize = 3;

/// Two points of an element are one if no weight differs by more than this.
const SAME_POINT: f64 = 0.1;

impl Known {
    /// The elements of which too little is known. `reach` tells how far from the field an element still matters, `points` are in the
    /// field's frame.
    pub fn ask<const N: usize>(
        &mut self,
        elements: &[[u32; N]],
        points: &[V3],
        reach: impl Fn(&[u32; N]) -> f64,
        hold: f64,
        slope_bound: f64,
    ) -> Asked<N> {
        if self.margins.len() != elements.len() {
            *self = Self {
                corners: vec![[V3::zeros(); 3]; elements.len()],
                margins: vec![f64::NEG_INFINITY; elements.len()],
                contacts: BTreeMap::new(),
            };
        }
        let mut asked = Asked::default();
        for (index, element) in elements.iter().enumerate() {
            let now = element.map(|vertex| points[vertex as usize]);
            let ways = now.iter().zip(&self.corners[index]).map(|(now, then)| (now - then).norm());
            let way = longest(ways);
            let (id, needed) = (index as u32, reach(element));
            let is_known = match self.contacts.contains_key(&id) {
                true => way <= hold,
                false => needed + slope_bound * way <= self.margins[index],
            };
            if !is_known {
                let margin = needed + 2.0 * slope_bound * hold;
                asked.old.extend(self.contacts.remove(&id).unwrap_or_default());
                self.corners[index][..N].copy_from_slice(&now);
                self.margins[index] = margin;
                asked.ids.push(id);
                asked.elements.push(*element);
                asked.margins.push(margin);
            }
        }
        asked
    }

    /// Records the contacts that a search of the asked elements found, numbered as they were asked, and the earlier contacts that still
    /// hold.
    pub fn tell(&mut self, ids: &[u32], found: Vec<Contact<f64>>, again: Again, hold: f64, frame: &Isometry3<f64>) {
        let mut planes: BTreeMap<u32, Vec<(Contact<f64>, f64)>> = BTreeMap::new();
        for (contact, gap) in again.planes {
            planes.entry(contact.element).or_default().push((contact, gap));
        }
        for contact in found {
            let Some(id) = ids.get(contact.element as usize) else { continue };
            let feature = if let Feature::Face(_) = contact.feature { Feature::Face(*id) } else { contact.feature };
            let minimum = into_frame(frame, Contact { element: *id, feature, ..contact });
            let mut kept = planes.remove(id).unwrap_or_default();
            kept.retain(|(plane, gap)| !is_same(plane, &minimum) || *gap <= minimum.distance + 2.0 * hold);
            if !kept.iter().any(|(plane, _)| is_same(plane, &minimum)) {
                kept.truncate(MAX_CONTACTS - 1);
            }
            kept.into_iter().for_each(|(plane, _)| self.add(plane));
            self.add(minimum);
        }
        // Where nothing was found, a plane that is farther off now than was searched would hide what comes nearer.
        for (plane, gap) in planes.into_values().flatten() {
            if gap <= self.margins[plane.element as usize] {
                self.add(plane);
            }
        }
        again.points.into_iter().for_each(|contact| self.add(contact));
        self.contacts.retain(|_, contacts| !contacts.is_empty());
    }

    /// Adds a contact of an element behind its others, unless it is one of them, too far off, or one too many.
    fn add(&mut self, contact: Contact<f64>) {
        let others = self.contacts.entry(contact.element).or_default();
        let is_near = contact.distance <= self.margins[contact.element as usize];
        if is_near && others.len() < MAX_CONTACTS && !others.iter().any(|other| is_same(other, &contact)) {
            others.push(Contact { rank: others.len() as u32, ..contact });
        }
    }

    /// All contacts, in the order of their elements.
    pub fn contacts(&self) -> impl Iterator<Item = &Contact<f64>> {
        self.contacts.values().flatten()
    }
}

/// The longest of some ways; NaN if one is.
pub(crate) fn longest(ways: impl Iterator<Item = f64>) -> f64 {
    ways.fold(0.0, |longest, way| if longest < way || way.is_nan() { way } else { longest })
}

/// Are two points of an element one?
fn is_same(a: &Contact<f64>, b: &Contact<f64>) -> bool {
    a.weights.iter().zip(b.weights).all(|(a, b)| (a - b).abs() <= SAME_POINT)
}

/// The point of its element that a contact lies on, now.
pub(crate) fn point_on(contact: &Contact<f64>, points: &[[f64; 3]]) -> V3 {
    let corners = contact.corner_vertices().iter().zip(contact.corner_weights());
    corners.map(|(vertex, weight)| V3::from(points[*vertex as usize]) * *weight).sum()
}

/// The contact in a frame.
pub(crate) fn into_frame(frame: &Isometry3<f64>, contact: Contact<f64>) -> Contact<f64> {
    Contact {
        point: frame.inverse_transform_point(&contact.point.into()).coords,
        surface_point: frame.inverse_transform_point(&contact.surface_point.into()).coords,
        normal: frame.inverse_transform_vector(&contact.normal),
        ..contact
    }
}

/// A contact that a frame kept, in the world, where the same point of its element is now. Its distance changes by the way along the
/// normal.
pub(crate) fn in_world(frame: &Isometry3<f64>, kept: &Contact<f64>, points: &[[f64; 3]]) -> Contact<f64> {
    let point = point_on(kept, points);
    let (normal, before) = (frame * kept.normal, (frame * sdf_core::nalgebra::Point3::from(kept.point)).coords);
    Contact {
        distance: kept.distance + normal.dot(&(point - before)),
        surface_point: (frame * sdf_core::nalgebra::Point3::from(kept.surface_point)).coords,
        point,
        normal,
        ..*kept
    }
}

#[cfg(test)]
mod tests {
    use sdf_core::minimize::FrankWolfe;
    use sdf_core::shapes::HalfSpace;
    use sdf_core::{Simplex, contact};

    use super::*;

    const HOLD: f64 = 0.01;
    const KEEP: f64 = 0.1;

    fn found() -> Contact<f64> {
        let floor = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
        let corners = [V3::new(0.0, 0.0, 0.1), V3::new(1.0, 0.0, 0.2), V3::new(0.0, 1.0, 0.2)];
        let element = contact::Element { id: 0, vertices: [0, 1, 2], simplex: Simplex { corners } };
        let contact::Outcome::Contact(contact) = contact::contact(&floor, &FrankWolfe::default(), 1.0, &element) else {
            panic!()
        };
        contact
    }

    /// Contacts of a face after a search that found `minimum`, where `now` is at the point that was touched before.
    fn after(now: Contact<f64>, minimum: Contact<f64>) -> Vec<Contact<f64>> {
        let mut known = Known { margins: vec![1.0], ..Known::default() };
        let mut again = Again::default();
        again.add(&found(), now, KEEP);
        known.tell(&[0], vec![minimum], again, HOLD, &Isometry3::identity());
        known.contacts().copied().collect()
    }

    #[test]
    fn a_plane_is_kept_unless_its_point_is_far_or_the_minimum_is_lower() {
        let before = found();
        let now = |way: f64| Contact { point: before.point + V3::x() * way, normal: V3::new(0.6, 0.0, 0.8), ..before };
        let minimum = |lower: f64| Contact { distance: before.distance - lower, ..now(0.0) };
        let is_kept = |way, lower| {
            let contacts = after(now(way), minimum(lower));
            assert_eq!(contacts.len(), 1);
            contacts[0].normal == before.normal
        };
        assert!(is_kept(0.9 * KEEP, 0.0) && is_kept(0.0, 1.9 * HOLD));
        assert!(!is_kept(1.1 * KEEP, 0.0) && !is_kept(0.9 * KEEP, 2.1 * HOLD));
        // A minimum elsewhere in the face is added.
        let elsewhere = Contact { weights: [0.5, 0.5, 0.0], ..minimum(0.05) };
        let told: Vec<_> = after(now(0.0), elsewhere).iter().map(|contact| contact.weights).collect();
        assert_eq!(told, [before.weights, elsewhere.weights]);
    }

    #[test]
    fn a_minimum_has_room_beside_three_planes() {
        let weights = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut known = Known { margins: vec![1.0], ..Known::default() };
        let mut again = Again::default();
        for weights in weights {
            let contact = Contact { weights, ..found() };
            again.add(&contact, contact, KEEP);
        }
        let minimum = Contact { weights: [0.4, 0.3, 0.3], ..found() };
        known.tell(&[0], vec![minimum], again, HOLD, &Isometry3::identity());
        let told: Vec<_> = known.contacts().map(|contact| (contact.rank, contact.weights)).collect();
        assert_eq!(told, [(0, weights[0]), (1, weights[1]), (2, minimum.weights)]);
    }
}
