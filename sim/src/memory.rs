//! Which elements need no search this frame? [`Memory`] keeps what the last search of a surface against an obstacle told.
//!
//! All of it is kept in the frame in which the obstacle's field stands still. Let w be the longest way of an element's corners since it
//! was searched.
//!
//! - **It had no contact.** Then φ was above the margin it was asked with, and is above that margin − slope bound · w now.
//! - **It had one.** As long as w is at most [`Query::hold`](crate::Query::hold), the same point of the element and the same plane stay;
//!   the gap is measured anew. The element's true minimum is below that by no more than 2 · slope bound · hold.
//! - **It is searched anew.** The points where it touched before are evaluated again and stay contacts, three at most. A face that
//!   rests on two places would else be told of the deeper one, sink at the other, be told of that, and rock for ever.
//!
//! So what is at rest keeps its contacts, bit for bit, and a solver comes to rest on them. A search anew finds another point of the
//! same flat minimum, and its push starts the next one.

use std::collections::BTreeMap;

use sdf_core::contact::{Contact, Feature};
use sdf_core::nalgebra::Isometry3;

use crate::V3;

/// Knowledge of one surface and one obstacle from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    pub(crate) faces: Known,
    pub(crate) edges: Known,
    /// A rigid surface moves as one: its pose at the last search, the margin, and all contacts.
    pub(crate) rigid: Option<(Isometry3<f64>, f64, Vec<Contact<f64>>)>,
}

/// Elements of one kind.
#[derive(Clone, Debug, Default)]
pub(crate) struct Known {
    /// Corners at the last search.
    corners: Vec<[V3; 3]>,
    /// Margin of the last search.
    margins: Vec<f64>,
    /// Each element's contacts, the last minimum first.
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
            let way = ways.fold(0.0, |a, b| if b <= a { a } else { b });
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

    /// Keeps what a search of the elements asked found, its contacts numbered as they were asked.
    pub fn tell(&mut self, ids: &[u32], found: Vec<Contact<f64>>, frame: &Isometry3<f64>) {
        for contact in found {
            let Some(id) = ids.get(contact.element as usize) else { continue };
            let feature = if let Feature::Face(_) = contact.feature { Feature::Face(*id) } else { contact.feature };
            self.add(into_frame(frame, Contact { element: *id, feature, ..contact }));
        }
    }

    /// Adds a contact of an element behind its others, unless it is one of them, too far off, or one too many.
    pub fn add(&mut self, contact: Contact<f64>) {
        let others = self.contacts.entry(contact.element).or_default();
        let is_same = |other: &Contact<f64>| {
            let weights = other.weights.iter().zip(contact.weights);
            weights.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) <= SAME_POINT
        };
        let is_near = contact.distance <= self.margins[contact.element as usize];
        if is_near && others.len() < MAX_CONTACTS && !others.iter().any(is_same) {
            others.push(Contact { rank: others.len() as u32, ..contact });
        }
    }

    /// Forgets elements without a contact, so that their margin counts.
    pub fn settle(&mut self) {
        self.contacts.retain(|_, contacts| !contacts.is_empty());
    }

    /// All contacts, in the order of their elements.
    pub fn contacts(&self) -> impl Iterator<Item = &Contact<f64>> {
        self.contacts.values().flatten()
    }
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
