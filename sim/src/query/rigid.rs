//! Which elements of a rigid surface are searched this frame? [`RigidMemory`] lists those near the field, and what is known of each.
//!
//! | step | question | when |
//! |---|---|---|
//! | 1 | Which faces are near, with their edges and vertices? Clusters, within a margin twice as wide as needed | the surface has moved by the other half |
//! | 2 | Which of these may have moved too far for what is known of them? By how far the whole surface has moved | every frame |
//! | 3 | Which have? By the ways of their own corners: a bowl that rocks moves far at its rim and hardly where it touches | those of step 2 |
//! | 4 | Where do they touch? The search gets the pose of the surface in the field's frame, and nothing else is moved | those of step 3 |
//!
//! All is kept in the frame in which the field stands still. What is known of an element, and for how long, is as in
//! [`Memory`](crate::Memory). A vertex that is an element of its own speaks for faces that touch with it.

use sdf_core::contact::{Contact, ElementKind, Feature};
use sdf_core::nalgebra::{Isometry3, Point3};
use sdf_core::placed::Rigid;
use sdf_field::{MeshInMotion, MeshView, QueryError};

use super::{Contacts, Elements, Pair, Query};
use crate::memory::{self, Asked};
use crate::{Body, V3};

/// Elements are listed within a margin wider than needed by this share of it.
const LISTED: f64 = 1.0;

/// Elements are searched within a margin wider than needed by this share of it: of those that are found there, a bound is known.
const SEARCHED: f64 = 0.25;

/// Knowledge of one rigid surface and one obstacle from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct RigidMemory {
    /// Pose of the surface in the field's frame when its elements were listed, and the margin within which all are. `None` before the
    /// first time.
    listed: Option<(Isometry3<f64>, f64)>,
    /// Kinds of elements that are listed.
    kinds: Option<Elements>,
    /// The pose in the last frame, and an upper bound of the way that any vertex has made until then.
    last: Option<Isometry3<f64>>,
    way: f64,
    faces: Near<3>,
    edges: Near<2>,
    vertices: Near<1>,
}

/// Listed elements of one kind.
#[derive(Clone, Debug, Default)]
struct Near<const N: usize> {
    /// In ascending order.
    ids: Vec<u32>,
    due: Vec<Due>,
    known: Vec<Known<N>>,
    /// In the order of their elements.
    contacts: Vec<Kept>,
}

/// An element at its last search.
#[derive(Clone, Copy, Debug)]
struct Known<const N: usize> {
    vertices: [u32; N],
    /// The corners in the surface's own frame, and where they were in the field's.
    rest: [V3; N],
    corners: [V3; N],
    /// Lower bound of φ on all of it, as the search found: see [`memory`](crate::memory).
    lower_bound: f64,
    has_contact: bool,
}

/// The way of the whole surface at which an element has to be looked at.
#[derive(Clone, Copy, Debug)]
struct Due {
    /// The way; where an element is known by its lower bound, the margin that is needed counts as one, too.
    way: f64,
    by_bound: bool,
}

/// A contact in the field's frame.
#[derive(Clone, Copy, Debug)]
struct Kept {
    contact: Contact<f64>,
    /// Radius of curvature of the field's surface at the contact; computed when it is first needed.
    radius: Option<f64>,
}

/// Needs of one frame.
#[derive(Clone, Copy)]
struct Needs {
    /// Elements within this matter.
    needed: f64,
    /// Elements are searched within this.
    margin: f64,
    hold: f64,
    slope_bound: f64,
    /// The way of the whole surface until now.
    way: f64,
}

impl<const N: usize> Near<N> {
    /// Lists other elements. What is known of those that are listed again stays.
    fn list(&mut self, ids: Vec<u32>, rest: &[[f64; 3]], vertices_of: impl Fn(u32) -> [u32; N]) {
        let Self { ids: old_ids, due: old_due, known: old_known, mut contacts } = std::mem::take(self);
        let (mut due, mut known) = (Vec::with_capacity(ids.len()), Vec::with_capacity(ids.len()));
        let mut next = 0;
        for id in &ids {
            while old_ids.get(next).is_some_and(|other| other < id) {
                next += 1;
            }
            let is_old = old_ids.get(next) == Some(id);
            due.push(if is_old { old_due[next] } else { Due { way: f64::NEG_INFINITY, by_bound: true } });
            known.push(if is_old {
                old_known[next]
            } else {
                let vertices = vertices_of(*id);
                Known {
                    vertices,
                    rest: vertices.map(|vertex| rest[vertex as usize].into()),
                    corners: [V3::zeros(); N],
                    lower_bound: f64::NEG_INFINITY,
                    has_contact: false,
                }
            });
        }
        contacts.retain(|kept| ids.binary_search(&kept.contact.element).is_ok());
        *self = Self { ids, due, known, contacts };
    }

    /// Places of the elements of which too little is known; their contacts are forgotten.
    fn ask(&mut self, pose: &Rigid, needs: &Needs) -> Vec<u32> {
        let Needs { needed, margin, hold, slope_bound, way: total } = *needs;
        let spent = total + needed / slope_bound;
        let mut asked = vec![];
        for (place, due) in (0..).zip(&mut self.due) {
            let reached = if due.by_bound { spent } else { total };
            // False of NaN.
            if reached < due.way {
                continue;
            }
            let known = &mut self.known[place as usize];
            let corners = known.rest.map(|corner| pose.push(corner));
            let ways = corners.iter().zip(&known.corners).map(|(now, then)| (now - then).norm());
            let way = memory::longest(ways);
            if known.has_contact && way <= hold {
                *due = Due { way: total + (hold - way), by_bound: false };
            } else if needed + slope_bound * way < known.lower_bound {
                *due = Due { way: total + known.lower_bound / slope_bound - way, by_bound: true };
            } else {
                *due = Due { way: total + margin / slope_bound, by_bound: true };
                *known = Known { corners, lower_bound: margin, has_contact: false, ..*known };
                asked.push(place);
            }
        }
        if !asked.is_empty() {
            let ids = &self.ids;
            let mut next = asked.iter().map(|place| ids[*place as usize]).peekable();
            // Both in ascending order.
            self.contacts.retain(|kept| {
                while next.next_if(|id| *id < kept.contact.element).is_some() {}
                next.peek() != Some(&kept.contact.element)
            });
        }
        asked
    }

    /// Records the contacts of the elements that were searched. `Contact::element` is an index into `asked`. Leaves out contacts at a
    /// vertex or an edge that is searched as an element of its own.
    fn tell(&mut self, asked: &[u32], found: &[Contact<f64>], needs: &Needs, others: Elements) {
        for contact in found {
            let place = asked[contact.element as usize] as usize;
            let known = &mut self.known[place];
            known.lower_bound = known.lower_bound.min(contact.lower_bound);
            known.has_contact = true;
            self.due[place] = Due { way: needs.way + needs.hold, by_bound: false };
            let is_told_elsewhere = match contact.feature {
                Feature::Vertex(_) => others.vertices && contact.kind != ElementKind::Vertex,
                Feature::Edge(_) => others.edges && contact.kind == ElementKind::Face,
                Feature::Face(_) => false,
            };
            if !is_told_elsewhere {
                let element = self.ids[place];
                let feature =
                    if let Feature::Face(_) = contact.feature { Feature::Face(element) } else { contact.feature };
                self.contacts.push(Kept { contact: Contact { element, feature, ..*contact }, radius: None });
            }
        }
        self.contacts.sort_by_key(|kept| (kept.contact.element, kept.contact.rank));
    }

    fn radius(&mut self, contact: &Contact<f64>, radius: impl FnOnce() -> f64) -> f64 {
        let key = |contact: &Contact<f64>| (contact.element, contact.rank);
        match self.contacts.binary_search_by_key(&key(contact), |kept| key(&kept.contact)) {
            Ok(index) => *self.contacts[index].radius.get_or_insert_with(radius),
            Err(_) => radius(),
        }
    }
}

impl RigidMemory {
    /// The radius of curvature at a contact that was found here: asked for once, and kept as long as the contact is.
    pub fn radius(&mut self, contact: &Contact<f64>, radius: impl FnOnce() -> f64) -> f64 {
        match contact.kind {
            ElementKind::Vertex => self.vertices.radius(contact, radius),
            ElementKind::Edge => self.edges.radius(contact, radius),
            ElementKind::Face => self.faces.radius(contact, radius),
        }
    }

    /// Is every element that may come within the margin listed, if the surface has this pose in the field's frame?
    fn is_complete(&self, relative: &Isometry3<f64>, radius: f64, margin: f64, slope_bound: f64) -> bool {
        self.listed.is_some_and(|(before, listed)| margin + slope_bound * way(&before, relative, radius) <= listed)
    }

    /// Lists faces, and their edges and vertices; all of these without faces.
    fn list(&mut self, faces: Vec<u32>, pair: &Pair, rest: &[[f64; 3]], elements: Elements) {
        let (all_faces, all_edges) = (&pair.surface.faces, &pair.surface.edges);
        let mut is_near = vec![!elements.faces; pair.surface.vertex_count()];
        faces.iter().flat_map(|face| all_faces[*face as usize]).for_each(|vertex| is_near[vertex as usize] = true);
        if elements.edges {
            let near = (0..).zip(all_edges.iter()).filter(|(_, ends)| ends.iter().all(|end| is_near[*end as usize]));
            self.edges.list(near.map(|(id, _)| id).collect(), rest, |id| all_edges[id as usize]);
        }
        if elements.vertices {
            let near = (0..).zip(&is_near).filter(|(_, is_near)| **is_near);
            self.vertices.list(near.map(|(id, _)| id).collect(), rest, |id| [id]);
        }
        self.faces.list(faces, rest, |id| all_faces[id as usize]);
    }
}

/// Upper bound of the way of any point of a surface from one pose to another.
fn way(from: &Isometry3<f64>, to: &Isometry3<f64>, radius: f64) -> f64 {
    let turn = from.rotation.rotation_to(&to.rotation).angle();
    (to.translation.vector - from.translation.vector).norm() + turn * radius
}

impl Query {
    /// Contacts of a rigid surface that may come within `reach` and the thickness until the next search.
    pub(super) fn find_rigid(
        &self,
        pair: &Pair,
        (body, rest): (&Body, &[[f64; 3]]),
        reach: f64,
        memory: &mut RigidMemory,
        contacts: &mut Contacts,
    ) -> Result<Vec<Contact<f64>>, QueryError> {
        let Pair { surface, frame, slope_bound, still, .. } = pair;
        // A field that stands still is searched in its own frame.
        let obstacle = still.map_or(pair.obstacle, |field| field);
        let relative = frame.inv_mul(&body.isometry());
        let q = relative.rotation.quaternion();
        let Some(pose) = Rigid::new(relative.translation.vector.into(), [q.i, q.j, q.k, q.w]) else {
            return Ok(vec![]);
        };
        let needed = self.thickness + reach;
        let margin = needed + SEARCHED * needed.abs() + 2.0 * slope_bound * self.hold;
        contacts.element_count += surface.faces.len();
        if memory.kinds != Some(self.elements) {
            *memory = RigidMemory { kinds: Some(self.elements), ..RigidMemory::default() };
        }
        memory.way += memory.last.map_or(0.0, |last| way(&last, &relative, surface.radius()));
        memory.last = Some(relative);
        if !memory.is_complete(&relative, surface.radius(), margin, *slope_bound) {
            // Who asks once needs no more than that.
            let listed = margin + if memory.listed.is_some() { LISTED * needed.abs() } else { 0.0 };
            let faces = match (still, surface.at_rest()) {
                _ if !self.elements.faces => vec![],
                (Some(field), Some((_, clusters))) => {
                    let mut near = vec![];
                    let visit = |faces: &[u32]| near.extend_from_slice(faces);
                    clusters.as_core().visit_near(field.as_any(), listed, Some(&pose), visit);
                    near.sort_unstable();
                    near
                }
                _ => (0..surface.faces.len() as u32).collect(),
            };
            memory.list(faces, pair, rest, self.elements);
            memory.listed = Some((relative, listed));
        }
        let needs = Needs { needed, margin, hold: self.hold, slope_bound: *slope_bound, way: memory.way };
        let position = |vertex: u32| pose.push(rest[vertex as usize].into());
        let RigidMemory { faces, edges, vertices, .. } = memory;
        let asked = faces.ask(&pose, &needs);
        if !asked.is_empty() {
            let elements: Vec<_> = asked.iter().map(|place| faces.known[*place as usize].vertices).collect();
            let mesh = MeshView { points: rest, faces: &elements };
            let mesh = MeshInMotion { pose: Some(pose), ..MeshInMotion::new(mesh) };
            let found = obstacle.contacts_in_motion(&mesh, &self.options(sdf_field::Elements::Faces, margin))?;
            contacts.searched_count += found.searched_count;
            faces.tell(&asked, &found.contacts, &needs, self.elements);
        }
        let asked = edges.ask(&pose, &needs);
        if !asked.is_empty() {
            let ends: Vec<u32> = asked.iter().flat_map(|place| edges.known[*place as usize].vertices).collect();
            let points: Vec<[f64; 3]> = ends.iter().map(|vertex| position(*vertex).into()).collect();
            let elements = (0..asked.len() as u32).map(|index| [2 * index, 2 * index + 1]).collect();
            let asked_edges = Asked { margins: vec![margin; asked.len()], ids: vec![], elements, old: vec![] };
            let mut found = self.search_edges(obstacle, &points, &asked_edges, contacts)?;
            found.iter_mut().for_each(|contact| rename(contact, &ends));
            edges.tell(&asked, &found, &needs, self.elements);
        }
        let asked = vertices.ask(&pose, &needs);
        if !asked.is_empty() {
            let ids: Vec<u32> = asked.iter().map(|place| vertices.ids[*place as usize]).collect();
            let points: Vec<[f64; 3]> = ids.iter().map(|vertex| position(*vertex).into()).collect();
            let mut found = self.search_vertices(obstacle, &points, margin, contacts)?;
            found.iter_mut().for_each(|contact| rename(contact, &ids));
            vertices.tell(&asked, &found, &needs, self.elements);
        }
        let kept = faces.contacts.iter().chain(&edges.contacts).chain(&vertices.contacts);
        let found = kept.filter_map(|Kept { contact: kept, .. }| {
            let at = memory::point_on(kept, rest);
            let distance = kept.distance + kept.normal.dot(&(pose.push(at) - kept.point));
            (distance <= needed).then(|| Contact {
                distance,
                point: body.world_point(&at),
                surface_point: (frame * Point3::from(kept.surface_point)).coords,
                normal: frame * kept.normal,
                ..*kept
            })
        });
        Ok(found.collect())
    }
}

/// Gives a contact, whose vertices are places in a list, the vertices that are listed.
fn rename(contact: &mut Contact<f64>, vertices: &[u32]) {
    let name = |place: u32| vertices.get(place as usize).copied().unwrap_or(place);
    contact.vertices = contact.vertices.map(name);
    contact.feature = match contact.feature {
        Feature::Vertex(vertex) => Feature::Vertex(name(vertex)),
        Feature::Edge([a, b]) => Feature::Edge([name(a).min(name(b)), name(a).max(name(b))]),
        Feature::Face(face) => Feature::Face(face),
    };
}

#[cfg(test)]
mod tests {
    use sdf_core::nalgebra::UnitQuaternion;

    use super::*;

    #[test]
    fn no_point_moves_farther_than_the_way_of_its_surface() {
        let radius = 1.5;
        for index in 1..1000 {
            let angles = [0.7, 1.1, 1.9, 2.3, 3.1, 4.3].map(|factor| (factor * f64::from(index)).sin());
            let turn = 10_f64.powi(-(index % 8));
            let axis = V3::new(angles[0], angles[1], angles[2]);
            let start = UnitQuaternion::from_scaled_axis(V3::new(angles[3], angles[4], angles[5]));
            let from = Isometry3::from_parts(V3::new(angles[4], 0.0, angles[2]).into(), start);
            let arm = from.rotation.inverse() * axis.cross(&V3::x()).normalize() * radius;
            // Across the axis and straight on: the point goes as far as it can.
            let swing = (from.rotation * arm).cross(&axis).normalize();
            let turned = UnitQuaternion::from_scaled_axis(-axis.normalize() * turn) * from.rotation;
            let to = Isometry3::from_parts((from.translation.vector + swing * turn).into(), turned);
            let bound = way(&from, &to, radius);
            let made = (to * Point3::from(arm) - from * Point3::from(arm)).norm();
            assert!(made <= bound + 1e-12, "{made} of {bound}");
            assert!(turn > 0.02 || made > 0.99 * bound, "{made} of {bound}: the case is not sharp");
        }
    }

    #[test]
    fn a_list_is_complete_until_margin_and_way_exceed_its_margin() {
        let (before, radius, slope_bound) = (Isometry3::translation(1.0, 2.0, 3.0), 1.5, 1.25);
        let memory = RigidMemory { listed: Some((before, 0.5)), ..RigidMemory::default() };
        let moved = Isometry3::translation(1.1, 2.0, 3.0);
        let turned = before * UnitQuaternion::from_scaled_axis(V3::z() * (0.1 / radius));
        for pose in [moved, turned] {
            // 0.5 = 0.375 + 1.25 · 0.1.
            assert!(memory.is_complete(&pose, radius, 0.375 - 1e-9, slope_bound));
            assert!(!memory.is_complete(&pose, radius, 0.375 + 1e-9, slope_bound));
        }
        assert!(!RigidMemory::default().is_complete(&before, radius, -1.0, slope_bound));
    }
}
